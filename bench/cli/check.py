"""`rockbench check`: the loop check of the bench, with a verdict as exit code."""

from cyclopts import App

from bench.cli.run import CHECK

SUMMARY = "Check the loop of the configured bench at low level, line by line: passed or failed, and what to do."


def register_check(app: App) -> None:
    """`rockbench check`, loaded when it is used."""
    app.command(f"bench.cli.run:{CHECK}", name=CHECK, help=SUMMARY)
