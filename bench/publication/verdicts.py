"""The paper's statements as tables: a verdict on each, and the claims behind it."""

from collections.abc import Sequence

from bench.prediction.verdicts import Statement
from bench.report.page.document import Column, Table

Named = tuple[str, Statement]
"""A statement and how it is numbered."""


def verdicts_table(named: Sequence[Named]) -> Table:
    """One row per statement."""
    columns = [Column("statement", words=True), Column("of what", words=True), Column("verdict", words=True)]
    rows = [[number, each.title, str(each.verdict)] for number, each in named]
    caption = "Verdicts. As expected: it is known and documented that the model does not do what the paper says"
    return Table(caption, columns, rows)


def statement_table(named: Sequence[Named]) -> Table:
    """Every claim with what was found."""
    columns = [
        Column("statement", words=True),
        Column("claim", words=True),
        Column("found", words=True),
        Column("verdict", words=True),
    ]
    rows = [[number, check.claim, check.found, str(check.verdict)] for number, each in named for check in each.checks]
    return Table("The claims behind the verdicts, and what the model gives", columns, rows)
