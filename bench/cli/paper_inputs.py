"""The records that a reproduction of the paper is asked for: files, references, or folders of files."""

import sys
from collections.abc import Sequence
from pathlib import Path

from sim.errors import InvalidInput


def named_records(named: Sequence[str]) -> list[str]:
    """References to records, with every file of a folder in its place that is a record by itself.

    Other files of a folder are told of on standard error. Raises InvalidInput for a folder without records.
    """
    from bench.accelerograms.reference import RecordReference

    found: list[str] = []
    for text in named:
        folder = Path(text)
        if not folder.is_dir():
            found.append(text)
            continue
        good: list[str] = []
        for path in sorted(file for file in folder.iterdir() if file.is_file() and not file.name.startswith(".")):
            try:
                RecordReference.parse(str(path)).read()
            except InvalidInput as refused:
                print(f"rockbench: left out: {refused}", file=sys.stderr)
            else:
                good.append(str(path))
        if not good:
            raise InvalidInput("--records", text, "no file of this folder can be read as a record by itself")
        found += good
    return found
