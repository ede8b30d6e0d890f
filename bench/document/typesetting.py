"""Pages of a report, typeset by Typst from the template `report.typ` in a folder."""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

from bench.document.page_layout import Arrangement, Extent, filled_pages

Part = dict[str, Any]


class Typesetter:
    """Typesets the content of a report, as `bench.document.document.template_content` returns it. The `drawing` of a
    figure is a dictionary with `width` and `height` [pt] and its `page` in the file figures.pdf in the folder; None is
    an empty box.
    """

    def __init__(self, folder: Path, content: dict[str, Any]) -> None:
        import matplotlib
        import typst

        self._folder, self._content = folder, content
        self._sections: list[list[Part]] = [content["summary"], *(each["parts"] for each in content["sections"])]
        self._parts = [part for section in self._sections for part in section]
        for number, part in enumerate(self._parts):
            part["number"] = number
        template = folder / "report.typ"
        template.write_bytes(files("bench.document").joinpath(template.name).read_bytes())
        self._arrange(self._natural)
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        self._compiler = typst.Compiler(template, font_paths=[fonts], ignore_system_fonts=True)

    def fill_pages(self, highest: float) -> None:
        """Arrange the parts so that pages are filled. Changes heights of figures, up to `highest` [pt]."""
        self._arrange(filled_pages(self._natural, highest, self._trial))

    def pdf(self) -> bytes:
        """The PDF of the content as it is."""
        self._write()
        pdf = self._compiler.compile()
        # a list only for formats with a file for each page, nothing only for an output file
        assert isinstance(pdf, bytes)
        return pdf

    @property
    def _natural(self) -> Arrangement:
        figures = [part for part in self._parts if part["kind"] == "picture"]
        return Arrangement(
            sections=tuple(tuple(part["number"] for part in section) for section in self._sections),
            heights={part["number"]: part["drawing"]["height"] for part in figures},
        )

    def _arrange(self, arrangement: Arrangement) -> None:
        for section, numbers in zip(self._sections, arrangement.sections, strict=True):
            section[:] = [self._parts[number] for number in numbers]
        for number, part in enumerate(self._parts):
            part.update(split=number in arrangement.split, space=arrangement.spaces.get(number, 0.0))
        for number, height in arrangement.heights.items():
            self._parts[number]["drawing"]["height"] = height
        self._write()

    def _write(self) -> None:
        (self._folder / "report.json").write_text(json.dumps(self._content), encoding="utf-8")

    def _trial(self, arrangement: Arrangement) -> dict[int, Extent]:
        """Pages and filled shares of the parts in this arrangement."""
        self._arrange(arrangement)
        marks: dict[int, list[dict[str, Any]]] = {part["number"]: [] for part in self._parts}
        for mark in json.loads(self._compiler.query("<mark>", field="value")):
            marks[mark["part"]].append(mark)
        return {
            number: Extent(
                first=own[0]["page"],
                last=own[-1]["page"],
                filled=own[-1]["share"],
                rows=tuple(mark["page"] for mark in own if mark["row"]),
            )
            for number, own in marks.items()
            if own
        }
