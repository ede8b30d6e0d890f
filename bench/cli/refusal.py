"""Errors as the command line says them."""

import sys

from bench.cli.words import one_line


def tell(message: object) -> None:
    """One line on standard error, whatever the message holds."""
    print(f"rockbench: error: {one_line(str(message))}", file=sys.stderr)
