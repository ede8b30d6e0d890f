"""What the program offers, read from its own help, configuration file, reports and exports.

    python -m tests.first_edition.inventory

prints it as JSON: in an environment with the first edition it is `inventory.json`, but for its `events`, the fields of
the events in that edition's module, and its `files`, what the commands of `commands.txt` left in their folders.
"""

import json
import lzma
import os
import re
import sys
import tempfile
from html import unescape
from pathlib import Path
from typing import Any

import h5py

from tests.first_edition.command import DATA, command

FORMATS = ("mat", "csv", "uff", "parquet")

_LIMITS = r"(?:each )?(?:above|below|at least|at most) .*"
_WORDS = r"[\w-]+(?:, [\w-]+)+"


def _option(cell: str) -> tuple[str, dict[str, Any]]:
    """A row of a panel of the help: its names or place, and what is said of it."""
    required = cell.startswith(" *")
    names, _, text = re.sub(r"^ \*?\s*", "", cell).partition("  ")
    text = text.strip()
    flags = [word for word in names.split() if word.startswith("-")]
    found: dict[str, Any] = {"names": flags, "value": " ".join(w for w in names.split() if not w.startswith("-"))}
    text = text.removesuffix(" [required]")
    for key in ("default", "choices"):
        if match := re.search(rf" \[{key}: (.*?)\](?= \[|$)", text):
            found[key], text = match[1], text[: match.start()] + text[match.end() :]
    text = text.rstrip(".")
    if match := re.search(rf" \(({_LIMITS}|{_WORDS})\)$", text):
        found["allowed"], text = match[1], text[: match.start()]
    if match := re.search(r" \[([^\[\]]+)\]$", text):
        found["unit"], text = match[1], text[: match.start()]
    return (flags or [names])[0], {**found, "required": required, "text": text}


def commands(path: tuple[str, ...] = ()) -> dict[str, Any]:
    """Every command below `path`, its options by their first names, from `--help`, recursively."""
    done = command(*path, "--help")
    assert done.code == 0, (path, done.err)
    group, options, below = "", {}, []
    for line in done.out.splitlines():
        if line.startswith("╭"):
            group = line.strip("╭─╮ ")
        elif line.startswith("│") and group == "Commands":
            (word, *_) = line.strip("│ ").split()
            if word.startswith("-"):
                options[word] = {"group": group, **_option(line.strip("│").rstrip())[1]}
            else:
                below.append(word)
        elif line.startswith("│"):
            name, option = _option(line.strip("│").rstrip())
            options[name] = {"group": group, **option}
    found: dict[str, Any] = {" ".join(path): {"options": options, "commands": sorted(below)}}
    for name in below:
        found |= commands((*path, name))
    return found


def configuration() -> dict[str, Any]:
    """Every key of a configuration, by its path, from the file that `config init` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.toml"
        assert command("config", "init", path).code == 0
        lines = path.read_text(encoding="utf-8").splitlines()
    table, found = "", {}
    for above, line in zip(["", *lines], lines, strict=False):
        if match := re.match(r"\[([\w.]+)\]$", line):
            table = match[1] + "."
            continue
        if match := re.match(r"(#?)([\w.]+) = (.*)$", line):
            described, default = above.removeprefix("# "), match[3]
        elif match := re.match(
            r"(#) ([\w.]+), (?:which a run writes|written by a run|not to be (?:given|set) here): (.*)$", line
        ):
            described, default = match[3], "# example"
        else:
            continue
        text, _, allowed = described.rpartition("; ")
        unit = re.search(r" \[([^\[\]]+)\]$", text)
        found[table + match[2]] = {
            "absent": bool(match[1]),
            # what stands there is an example: there is no default
            "default": None if default.endswith("# example") else default,
            "unit": unit[1] if unit else "",
            "allowed": allowed,
        }
    return found


def tables(path: Path) -> dict[str, Any]:
    """Every dataset of a data file: its type, and the attributes of a column."""
    found: dict[str, Any] = {}

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            kind = "text" if item.dtype.kind in "SO" else item.dtype.name
            kept = {key: item.attrs[key] for key in ("units", "kind", "optional") if key in item.attrs}
            found[name] = {"type": kind, **{k: v if isinstance(v, str) else v.item() for k, v in kept.items()}}

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


def report(path: Path, folder: Path) -> dict[str, list[str]]:
    """The sections of a report, and the captions of its tables and figures without their numbers."""
    page = folder / "report.html"
    assert command("report", path, "--html", page).code == 0
    text = page.read_text(encoding="utf-8")
    page.unlink()

    def every(tag: str) -> list[str]:
        inner = re.findall(rf"<{tag}\b[^>]*>(.*?)</{tag}>", text, re.DOTALL)
        return [unescape(re.sub(r"<b>.*?</b>|<[^>]+>", "", item)).strip() for item in inner]

    return {"sections": every("h2"), "tables": every("caption"), "figures": every("figcaption")}


def exported(path: Path, to: str, folder: Path) -> list[str]:
    """The files of an export."""
    out = folder / f"{path.stem}-{to}"
    assert command("export", path, "--to", to, "--out", out).code == 0
    return sorted(item.name for item in out.iterdir())


def settings(path: Path) -> dict[str, str]:
    """What a re-analysis can change of a file, and its unit."""
    done = command("analyse", path, "--list")
    assert done.code == 0, done.err
    heading, _, *lines = done.out.splitlines()
    unit, text = heading.index("unit"), heading.index("meaning")
    # a line that begins with a space goes on with the meaning above
    return {line.split()[0]: line[unit:text].strip() for line in lines if not line.startswith(" ")}


def shared(found: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """What all files have in common, under "every file", and by file what it has besides."""
    first, *others = (each.items() for each in found.values())
    common = {key: value for key, value in first if all((key, value) in other for other in others)}
    besides = {name: {k: v for k, v in each.items() if k not in common} for name, each in found.items()}
    return {"every file": common, **besides}


def _main() -> None:
    found: dict[str, Any] = {"commands": commands(), "configuration": configuration()}
    found |= {part: {} for part in ("tables", "reports", "exports", "settings")}
    with tempfile.TemporaryDirectory() as folder:
        for packed in sorted(DATA.glob("*.h5.xz")):
            path = Path(folder) / packed.name.removesuffix(".xz")
            path.write_bytes(lzma.decompress(packed.read_bytes()))
            found["tables"][path.stem] = tables(path)
            found["reports"][path.stem] = report(path, Path(folder))
            found["exports"][path.stem] = {to: exported(path, to, Path(folder)) for to in FORMATS}
            found["settings"][path.stem] = settings(path)
    found["tables"], found["settings"] = shared(found["tables"]), shared(found["settings"])
    json.dump(found, sys.stdout, indent=1, sort_keys=True, ensure_ascii=False)
    print()


if __name__ == "__main__":
    os.environ["COLUMNS"] = "1000"
    _main()
