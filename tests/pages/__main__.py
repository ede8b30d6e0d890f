"""Makes every block, quoted result and picture of the pages again: `python -m tests.pages [PAGE ...] [--write]`.

Without arguments all pages, about twenty minutes. What differs from its page is printed, and the exit code is then 1;
with `--write` pictures are replaced by the ones that were made.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.pages.blocks import ROOT, blocks, pages
from tests.pages.claims import CLAIMS
from tests.pages.execute import collection, failures, furnish, specimen_text
from tests.pages.pictures import PICTURES


def main(arguments: Sequence[str] | None = None) -> int:
    """Check the pages, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.pages", description=__doc__)
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="such as README.md or docs/predict.md; default: all")
    parser.add_argument("--write", action="store_true", help="replace the pictures of the pages by those made now")
    given = parser.parse_args(arguments)
    chosen = [ROOT / name for name in given.pages] or pages()
    found = 0
    for page in chosen:
        begun, name = time.monotonic(), page.relative_to(ROOT).as_posix()
        wrong = [*_page(page), *_claims(page), *_pictures(page, write=given.write)]
        print(f"{name}: {len(wrong) or 'no'} differences, {time.monotonic() - begun:.0f} s")
        print("".join(f"  {text}\n" for text in wrong), end="", flush=True)
        found += len(wrong)
    return 1 if found else 0


def _page(page: Path) -> Iterator[str]:
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        furnish(folder, specimen_text())
        for block in blocks(page):
            if block.directive == "parse" or (block.directive == "records" and collection() is None):
                continue
            yield from map(str, failures(block, folder))


def _claims(page: Path) -> Iterator[str]:
    for claim in CLAIMS:
        if ROOT / claim.page == page and (collection() is not None or not claim.records):
            for line in claim.missing():
                yield f"{claim.name} is now: {line}"


def _pictures(page: Path, *, write: bool) -> Iterator[str]:
    for picture in PICTURES:
        if ROOT / picture.page == page and (difference := picture.difference(write=write)) is not None:
            yield difference


if __name__ == "__main__":
    sys.exit(main())
