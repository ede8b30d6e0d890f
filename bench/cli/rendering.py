"""Draws a scene for a terminal. Every colour has its word: nothing is told by colour alone."""

from rich import box
from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from bench.cli.scene import NOTICES, Notice, Scene
from bench.cli.words import ABSENT, clock
from bench.events import State

_STATE_STYLES = {
    State.IDLE: "reverse",
    State.ARMED: "bold black on yellow",
    State.RUNNING: "bold white on green4",
    State.WAITING: "bold black on yellow",
    State.STOPPING: "bold white on blue",
    State.ABORTING: "bold white on red3",
    State.HALTED: "bold white on red3",
    State.CLOSED: "reverse",
}
_WORD_STYLES = {
    "steady": "green",
    "yes": "green",
    "NO": "bold red",
    "overturned": "bold red",
    "modulated": "yellow",
    "resting": "cyan",
    "measuring": "bold",
}
_WIDE = 100
_NUMBERS = ("omega\n[rad/s]", "beta", "alpha_2\n(k = 2)", "predicted", "off by")
_WORDS = ("agrees", "status", "measured over")
_AROUND_TABLE = 11 + NOTICES
"""Lines that everything but the rows of the table takes."""


def draw(scene: Scene, width: int, height: int) -> RenderableType:
    """The scene for a terminal of `width` columns and `height` lines; the oldest points give way first."""
    hint = Text("Ctrl-C ramps the output to zero and ends the run; a second Ctrl-C cuts it at once.", style="dim")
    hint.no_wrap, hint.overflow = True, "ellipsis"
    wide = width >= _WIDE
    texts = [*scene.live.values(), *([f"twin  {scene.twin}"] if scene.twin else [])]
    lines = [Text(text, no_wrap=True, overflow="ellipsis") for text in texts]
    room = height - _AROUND_TABLE - len(lines)
    return Group(_banner(scene), _points(scene, room, wide), _progress(scene, wide), *lines, _log(scene), hint)


def log_line(notice: Notice) -> Text:
    """One line of the log: time, kind, text."""
    return Text.assemble(
        (f"{clock(notice.time):>8}  ", "dim"),
        (f"{notice.kind:<8} ", "bold red" if notice.grave else "bold"),
        notice.text,
    )


def _banner(scene: Scene) -> Text:
    banner = Text(no_wrap=True, overflow="ellipsis")
    banner.append(f" {scene.state.upper()} ", style=_STATE_STYLES[scene.state])
    at_work = scene.state in (State.ARMED, State.RUNNING) and scene.step
    banner.append(f"  {scene.step if at_work else scene.reason}", style="bold")
    return banner


def _points(scene: Scene, room: int, wide: bool) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    for heading in _NUMBERS:
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for heading in _WORDS if wide else _WORDS[:-1]:
        table.add_column(Text(heading), no_wrap=True)
    rows = [*scene.rows, *([scene.running] if scene.running is not None else [])]
    shown = rows[-max(room, 3) :]
    for row in shown:
        words = [Text(word, style=_WORD_STYLES.get(word, "")) for word in (row.agrees, row.status)]
        effort = [row.effort] if wide else []
        table.add_row(row.omega, row.beta, row.alpha_2, row.predicted, row.difference, *words, *effort)
    if len(shown) < len(rows):
        table.title = f"after {len(rows) - len(shown)} earlier points"
        table.title_justify = "left"
    return table


def _progress(scene: Scene, wide: bool) -> Table:
    line = Table.grid(padding=(0, 2))
    left = "" if clock(scene.remaining) == ABSENT else f", about {clock(scene.remaining)} left"
    line.add_row(
        ProgressBar(total=1.0, completed=scene.fraction, width=30 if wide else 20),
        f"{100.0 * scene.fraction:3.0f} %",
        f"bench time {clock(scene.time)}{left}",
        *([Text(scene.activity, no_wrap=True, overflow="ellipsis")] if wide else []),
    )
    return line


def _log(scene: Scene) -> Group:
    lines = [log_line(notice) for notice in scene.notices]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return Group(Text(""), *lines, Text(""))
