"""The pages as far as it is quick: links, languages, command lines, files, blocks that need no run."""

from pathlib import Path

import pytest

from tests.pages import reference
from tests.pages.blocks import LANGUAGES, ROOT, Block, anchors, blocks, links, pages
from tests.pages.claims import CLAIMS, Claim
from tests.pages.execute import agrees, collection, failures, furnish, specimen_text

BLOCKS = [block for page in pages() for block in blocks(page)]


def _quick(block: Block) -> bool:
    return block.directive == "run" or (block.directive == "records" and not block.reason and collection() is not None)


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.name)
def test_every_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    for line, target in links(page):
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f"{page.name}:{line} links to {target}"
        assert not anchor or anchor in anchors(file), f"{page.name}:{line}: {file.name} has no heading #{anchor}"


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.where)
def test_every_block_has_a_language_and_a_reason_where_it_is_not_executed(block: Block) -> None:
    assert block.language in LANGUAGES, f"{block.where}: language {block.language!r}"
    assert block.reason or block.directive != "parse", f"{block.where}: say why the block is not executed"


@pytest.mark.parametrize("block", [each for each in BLOCKS if _quick(each)], ids=lambda block: block.where)
def test_quick_blocks_do_what_the_page_says(block: Block, tmp_path: Path) -> None:
    furnish(tmp_path, specimen_text())
    found = list(failures(block, tmp_path, here=True))
    assert not found, "\n".join(map(str, found))


@pytest.mark.parametrize("claim", [each for each in CLAIMS if not each.slow], ids=lambda claim: claim.name)
def test_quoted_results_are_those_of_today(claim: Claim) -> None:
    if claim.records and collection() is None:
        pytest.skip("no recorded motions: set ROCKBENCH_RECORDS to their folder")
    assert claim.missing() == []


def test_the_generated_reference_agrees_with_the_program() -> None:
    assert reference.stale() == [], f"renew these pages of docs/reference: {reference.COMMAND}"


def test_a_stale_output_is_found() -> None:
    shown = ("  omega  alpha_2", "...", "     20   1.3462")
    assert agrees(shown, "  omega  alpha_2\n-----\n     20   1.3462\n")
    assert not agrees(shown, "  omega  alpha_2\n-----\n     20   1.3461\n")
    assert not agrees(("a", "b"), "a\n")
    assert not agrees(("a",), "a\nb\n")


def test_pages_are_found() -> None:
    assert ROOT / "README.md" in pages()
    assert len(BLOCKS) > 20
