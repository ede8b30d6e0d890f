"""Filled pages of a report: order of the parts within a section, and heights of its figures.

A figure that does not fit on the rest of a page begins the next one and leaves the rest blank. Trial layouts by the
typesetter, with empty boxes as figures, find such pages, first to last, and fill each with the first of these remedies
that suffices, otherwise with the most effective one: draw the figures of the page slightly lower, move the next text
or table before the figure, draw the figures lower, split a table, draw the figures higher, or, for a page that is
filled poorly, draw them still lower or move the figure before the texts of the page. Figures stay in their section and
in order, and so do texts and tables; the width of a figure and the size of its letters do not change.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

ENOUGH = 0.75
"""Filled share of the height of the text from which a page is left as it is."""

POOR = 0.6
"""Filled share below which figures may be drawn as low as `LOWEST`."""

SLIGHTLY, LOWER, LOWEST, HIGHER = 0.85, 0.7, 0.6, 1.3
"""Limits of the height of a figure, relative to its own height."""

GAIN = 0.02
"""Least increase of the filled share that justifies a change."""

STEPS = 5
"""Number of bisections of a height."""

ROW = 18.0
"""Additional space above a table [pt] that moves one more of its rows to the next page."""

PUSHES = 4
"""Maximum number of rows moved to the next page to give a single row company."""


@dataclass(frozen=True)
class Arrangement:
    """Numbers of the parts of each section in order; heights of the figures [pt]; tables that are split over pages;
    additional space above tables [pt].
    """

    sections: tuple[tuple[int, ...], ...]
    heights: Mapping[int, float]
    split: frozenset[int] = frozenset()
    spaces: Mapping[int, float] = field(default_factory=dict[int, float])


@dataclass(frozen=True)
class Extent:
    """Pages of the beginning and end of a part and of the rows at both ends of a table; filled share at its end."""

    first: int
    last: int
    filled: float
    rows: tuple[int, ...] = ()

    @property
    def single(self) -> bool:
        """Whether the first or the last row of a table is alone on its page."""
        return len(self.rows) > 2 and (self.rows[0] != self.rows[1] or self.rows[-2] != self.rows[-1])


Extents = Mapping[int, Extent]
"""Extents of the parts by number, without empty ones."""

Trial = Callable[[Arrangement], Extents]


def filled_pages(natural: Arrangement, highest: float, trial: Trial) -> Arrangement:
    """The arrangement with filled pages; `natural` has the order and the heights of the document, `highest` is the
    largest height of a figure [pt], and `trial` lays out an arrangement.
    """
    return _Pages(natural, highest, trial).filled()


class _Pages:
    def __init__(self, natural: Arrangement, highest: float, trial: Trial) -> None:
        self._natural, self._highest, self._trial = natural, highest, trial

    def filled(self) -> Arrangement:
        """The arrangement, changed page by page."""
        found, page = self._natural, 1
        while page < _count(extents := self._trial(found)):
            if (better := self._better(found, extents, page)) is not None:
                found = better
                continue
            found, page = self._without_single_rows(found, extents, page), page + 1
        return found

    def _better(self, now: Arrangement, extents: Extents, page: int) -> Arrangement | None:
        """An arrangement that fills `page` better, or None."""
        share = _filled(extents, page)
        if share >= ENOUGH:
            return None
        best, most = None, share + GAIN
        for candidate in self._remedies(now, extents, page, share):
            reached = _filled(self._trial(candidate), page)
            if reached >= most:
                best, most = candidate, reached
            if reached >= ENOUGH:
                break
        return best

    def _remedies(self, now: Arrangement, extents: Extents, page: int, share: float) -> Iterator[Arrangement]:
        """Changed arrangements, the least conspicuous one first."""
        parts = (part for section in now.sections for part in section)
        following = next(part for part in parts if part in extents and extents[part].first > page)
        figure = following in now.heights
        if figure:
            yield from self._lower(now, extents, page, following, SLIGHTLY)
            yield from _text_first(now, following)
            yield from self._lower(now, extents, page, following, LOWER)
        else:
            yield replace(now, split=now.split | {following})
        yield from self._higher(now, extents, page)
        if figure and share < POOR:
            yield from self._lower(now, extents, page, following, LOWEST)
            for moved in _figure_first(now, extents, page, following):
                yield moved
                yield from self._lower(moved, extents, page, following, LOWER)

    def _lower(
        self, now: Arrangement, extents: Extents, page: int, following: int, limit: float
    ) -> Iterator[Arrangement]:
        """The figures of `page` and the following one as high as fits on the page, if this is within the limit."""
        figures = [*_figures(now, extents, page), following]

        def drawn(factor: float) -> Arrangement:
            heights = {
                each: min(now.heights[each], max(limit * self._natural.heights[each], factor * now.heights[each]))
                for each in figures
            }
            return replace(now, heights={**now.heights, **heights})

        def fits(factor: float) -> bool:
            return self._trial(drawn(factor))[following].last <= page

        if fits(limit):
            yield drawn(_largest(fits, limit, 1.0))

    def _higher(self, now: Arrangement, extents: Extents, page: int) -> Iterator[Arrangement]:
        """The figures of `page` as high as fits on the page, within the limit."""
        figures = _figures(now, extents, page)

        def drawn(factor: float) -> Arrangement:
            heights = {
                each: max(
                    now.heights[each],
                    min(self._highest, HIGHER * self._natural.heights[each], factor * now.heights[each]),
                )
                for each in figures
            }
            return replace(now, heights={**now.heights, **heights})

        def fits(factor: float) -> bool:
            after = self._trial(drawn(factor))
            return all(after[part].last <= page for part, extent in extents.items() if extent.last <= page)

        if figures:
            yield drawn(_largest(fits, 1.0, HIGHER / LOWEST))

    def _without_single_rows(self, now: Arrangement, extents: Extents, page: int) -> Arrangement:
        """The arrangement with more space above a table whose first or last row is alone on its page."""
        for table, extent in extents.items():
            if not extent.single or extent.first > page or extent.last <= page:
                continue
            for rows in range(1, PUSHES + 1):
                pushed = replace(now, spaces={**now.spaces, table: rows * ROW})
                if not self._trial(pushed)[table].single:
                    return pushed
        return now


def _text_first(now: Arrangement, figure: int) -> Iterator[Arrangement]:
    """The next text or table of the section moved before the figure."""
    section = next(each for each in now.sections if figure in each)
    place = section.index(figure)
    text = next((part for part in section[place:] if part not in now.heights), None)
    if text is not None:
        yield _moved(now, text, place)


def _figure_first(now: Arrangement, extents: Extents, page: int, figure: int) -> Iterator[Arrangement]:
    """The figure moved before texts and tables of its section that begin on `page`, one more of them each time."""
    section = next(each for each in now.sections if figure in each)
    for place in reversed(range(section.index(figure))):
        before = section[place]
        if before in now.heights or before not in extents or extents[before].first != page:
            return
        yield _moved(now, figure, place)


def _moved(now: Arrangement, part: int, place: int) -> Arrangement:
    """The arrangement with `part` at this place of its section."""

    def ordered(section: tuple[int, ...]) -> tuple[int, ...]:
        rest = [each for each in section if each != part]
        return (*rest[:place], part, *rest[place:]) if part in section else section

    return replace(now, sections=tuple(ordered(section) for section in now.sections))


def _largest(fits: Callable[[float], bool], low: float, high: float) -> float:
    """The largest factor between `low`, which fits, and `high`."""
    for _ in range(STEPS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _figures(now: Arrangement, extents: Extents, page: int) -> list[int]:
    return [figure for figure in now.heights if extents[figure].first == page]


def _count(extents: Extents) -> int:
    return max((extent.last for extent in extents.values()), default=1)


def _filled(extents: Extents, page: int) -> float:
    """Filled share of a page: 1 if a part continues on the next page."""
    if page >= _count(extents) or any(extent.first <= page < extent.last for extent in extents.values()):
        return 1.0
    return max((extent.filled for extent in extents.values() if extent.last == page), default=0.0)
