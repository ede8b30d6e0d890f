"""The command line for tests: a stand-in for sessions, and every command of the tree."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

from cyclopts import App
from rich.console import Console

from bench.app.cli.console import draw
from bench.app.cli.main import main
from bench.app.run_display import RunDisplay
from bench.app.session import SessionResult
from bench.engine.interface import Operator, Requests
from bench.events import StepStarted, Subscriber
from bench.protocol import Prepared, Protocol
from protocols.harmonic.protocol import HarmonicParameters


@dataclass
class FakeSession:
    """Takes the place of `run_session`: remembers what it was asked for, does `during`, ends with `status`."""

    status: str = "completed"
    during: Callable[[Requests], None] = field(default=lambda _requests: None)
    calls: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def __call__(
        self,
        protocol: Protocol[Any],  # noqa: ARG002 - the surface of `run_session`
        prepared: Prepared[Any],
        *,
        out: Path,
        operator: Operator,
        subscribers: Sequence[Subscriber],
        requests: Requests,
        realtime: bool,
        **_: Any,
    ) -> SessionResult:
        self.calls.append(
            {
                "parameters": prepared.parameters,
                "configuration": prepared.configuration,
                "out": out,
                "operator": operator,
                "realtime": realtime,
            }
        )
        for subscriber in subscribers:
            subscriber(StepStarted("a step", time=0.0))
        self.during(requests)
        return SessionResult(self.status, "why it ended", {"points": [1]}, "the table", requests.strongest is not None)

    @property
    def parameters(self) -> HarmonicParameters:
        return self.calls[0]["parameters"]


def main_with(session: Callable[..., SessionResult], arguments: Sequence[str]) -> int:
    """The exit code of a command line whose sessions `session` carries out."""
    with patch("bench.app.session.run_session", session):
        return main(arguments)


def rendered(scene: RunDisplay, width: int = 110, height: int = 40) -> list[str]:
    """The lines of the run display on a terminal of this size."""
    console = Console(record=True, width=width, file=StringIO())
    console.print(draw(scene, width, height))
    return console.export_text().splitlines()


def commands(app: App, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], App]]:
    """Every command below `app`, and `app` itself, with the words that name it; loads all of them."""
    yield path, app
    for name in app:
        if not name.startswith("-"):
            yield from commands(app[name], (*path, name))
