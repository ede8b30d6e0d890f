"""An example below the help of every command."""

from collections.abc import Collection, Iterator

from cyclopts import App

from bench.catalogue import protocol_names

_EXAMPLES = {
    "": "predict steady --omega 16 --beta 0.4",
    "run": "run harmonic --omega 16 --beta 0.4 --seed 3",
    "queue": "queue evening.json --config bench.toml --dry-run",
    "gui": "gui --config bench.toml",
    "devices": "devices --port /dev/ttyUSB0",
    "emulate": "emulate --write lab.toml",
    "predict": "predict steady --omega 16 --beta 0.4 --json",
    "predict modes": "predict modes --beta 0.25 0.64 0.97",
    "predict history": "predict history --omega 16 --beta 0.4 --plot history.png",
    "predict steady": "predict steady --omega 16 --beta 0.4 --json",
    "predict spectrum": "predict spectrum --beta 0.25 0.64 --plot spectrum.png",
    "predict map": "predict map --csv map.csv --plot map.png",
    "predict seismic": "predict seismic RECORD.AT2 --beta 0.05:1.2:40",
    "predict band-study": "predict band-study RECORD.AT2 --plot band.png",
    "records": "records info RECORD.AT2",
    "records info": "records info RECORD.AT2 --plot record.png",
    "records fit": "records fit RECORD.AT2 --config bench.toml",
    "report": "report campaign.h5 --pdf report.pdf",
    "paper": "paper --html paper.html",
    "file": "file verify campaign.h5",
    "file info": "file info campaign.h5",
    "file verify": "file verify campaign.h5 --json",
    "file recover": "file recover campaign.h5 --out mended.h5",
    "replay": "replay campaign.h5 --speed 10",
    "analyse": "analyse campaign.h5 --list",
    "export": "export campaign.h5 --to mat",
    "config": "config init bench.toml",
    "config init": "config init bench.toml",
    "config check": "config check bench.toml",
    "benchmark": "benchmark --quick",
    "completion": "completion bash --install",
}
"""By the command's name, without `rockbench`."""


def commands(
    app: App, path: tuple[str, ...] = (), leave_out: Collection[str] = ()
) -> Iterator[tuple[tuple[str, ...], App]]:
    """Every command below `app`, and `app` itself, with the words that name it; loads what is not left out."""
    yield path, app
    for name in app:
        if not name.startswith("-") and (path not in ((), ("run",)) or name not in leave_out):
            yield from commands(app[name], (*path, name), leave_out)


def add_examples(app: App) -> None:
    """End the help of every command with an example: the one listed for it, or else its own name.

    Those of the protocols have theirs from them, when they are loaded.
    """
    for path, command in commands(app, leave_out=protocol_names()):
        name = " ".join(path)
        command.help_epilogue = f"Example: rockbench {_EXAMPLES.get(name, name)}"
