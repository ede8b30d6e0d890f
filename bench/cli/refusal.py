"""Errors as the command line says them."""

import sys

from bench.cli.words import one_line


def warn(message: object) -> None:
    """One line on standard error about what was done although something is wrong."""
    print(f"rockbench: warning: {one_line(str(message))}", file=sys.stderr)


def tell(message: object) -> None:
    """One line on standard error, whatever the message holds."""
    print(f"rockbench: error: {one_line(str(message))}", file=sys.stderr)
