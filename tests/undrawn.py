"""Runs without figures, for tests that look at none: to draw them takes longer than many a simulated run."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

from bench.protocol import Protocol


@contextmanager
def undrawn() -> Iterator[None]:
    """Commands and `bench.run` write all files of a run but its figures."""
    import bench.app.run  # noqa: F401 - has the function under its own name
    from bench.app.session import SessionResult, run_session

    def without_figures(protocol: Protocol[Any], *arguments: Any, **options: Any) -> SessionResult:
        return run_session(replace(protocol, figures=()), *arguments, **options)

    with patch("bench.app.session.run_session", without_figures), patch("bench.app.run.run_session", without_figures):
        yield
