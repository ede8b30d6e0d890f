"""The command tree of `rockbench`; each command is loaded when it is used."""

import sys
import traceback
from collections.abc import Sequence
from inspect import getdoc
from pathlib import Path

from cyclopts import App, CycloptsError, UnusedCliTokensError

from bench.app.cli.interrupt import converted, report_interrupt
from bench.app.cli.output import reply_in_json, report_error
from bench.progress import Progress, silent
from bench.unfinished import forget_completed
from sim.errors import RockbenchError

SUMMARY = "Runs a shake-table bench for a frame coupled to a rocking block; compares measured and predicted gain."

GROUPS = {
    "run": ("Run a protocol on the bench.", "run harmonic --omega 16 --beta 0.4 --seed 3"),
    "predict": (
        "Predict modes, motions and gain coefficients from the model.",
        "predict steady --omega 16 --beta 0.4 --json",
    ),
    "records": (
        "Describe earthquake records, and fit them to the table.",
        "records info RECORD.AT2",
    ),
    "file": ("Inspect, verify and recover data files.", "file verify campaign.h5"),
    "config": ("Write or check a configuration file of the bench.", "config init bench.toml"),
}
"""Command groups, by name: summary and example."""

COMMANDS = {
    "check": (
        "run:check",
        "Check the loop of the configured bench at low amplitude, and give a remedy for each check that fails.",
        "",
    ),
    "queue": (
        "queue:queue",
        "Check every pending test, then run them in order; the file keeps the status of each.",
        "evening.json --config bench.toml --dry-run",
    ),
    "gui": ("window:gui", "Open the operator's window.", "--config bench.toml"),
    "watch": (
        "watch:watch",
        "Serve a read-only live page of the run under way on this computer.",
        "--address 0.0.0.0 --port 8000",
    ),
    "devices": (
        "devices:devices",
        "List the NI devices with their channels and ranges, the lasers on the serial ports, and the rig backends.",
        "--port /dev/ttyUSB0",
    ),
    "doctor": (
        "support:doctor",
        "Check whether this computer can run a bench: versions, clocks, disk, power settings, serial ports and "
        "graphics, with remedies.",
        "--out runs",
    ),
    "emulate": (
        "emulate:emulate",
        "Serve an emulated laboratory: the virtual bench in real time, accessed through the instruments' protocols.",
        "--write lab.toml",
    ),
    "predict modes": (
        "predict:modes",
        "Frequencies and shapes of the bare frame and of the linearised coupled system.",
        "--beta 0.25 0.64 0.97",
    ),
    "predict history": (
        "predict:history",
        "Time histories of drift, u1 and theta, with the sine switched on at rest or in the steady state.",
        "--omega 16 --beta 0.4 --plot history.png",
    ),
    "predict steady": (
        "predict:steady",
        "Steady motions at single points: gain coefficients, peaks, impacts and Floquet multipliers.",
        "--omega 16 --beta 0.4 --json",
    ),
    "predict spectrum": (
        "predict:spectrum",
        "Gain spectra: alpha_1 and alpha_2 against frequency for each stiffness, on both branches.",
        "--beta 0.25 0.64 --plot spectrum.png",
    ),
    "predict stability": (
        "predict:stability",
        "Frequencies at which rocking motions become stable or unstable, on fixed ground and on a table.",
        "--beta 0.64 0.97 --plot stability.png",
    ),
    "predict attractor": (
        "predict:attractor",
        "Long-term motions on a table, where the periodic rocking motion is unstable: period, peaks and falls.",
        "--omega 15 --beta 0.64 0.97",
    ),
    "predict map": (
        "predict:gain_map",
        "Gain maps: alpha_1 and alpha_2 against frequency and stiffness on both branches, with stability.",
        "--csv map.csv --plot map.png",
    ),
    "predict seismic": (
        "predict:seismic",
        "Gain curves under earthquake records: alpha_1 and alpha_2 against the stiffness.",
        "RECORD.AT2 --beta 0.05:1.2:40",
    ),
    "predict band-study": (
        "predict:band_study",
        "Gain and toppling under earthquake records, against the lower end of the table's band.",
        "RECORD.AT2 --plot band.png",
    ),
    "records info": (
        "records:info",
        "Describe earthquake records: peaks, Arias intensity, significant duration and hash.",
        "RECORD.AT2 --plot record.png",
    ),
    "records fit": (
        "records_fit:fit",
        "Fit a record to the stroke and the velocity of the configured bench, with rest at its beginning and end.",
        "RECORD.AT2 --config bench.toml",
    ),
    "report": ("report:report", "Create a report of a campaign from its data file.", "campaign.h5 --pdf report.pdf"),
    "paper": (
        "report:paper",
        "Reproduce the paper from simulation alone, statement by statement.",
        "--html paper.html",
    ),
    "file info": (
        "file:info",
        "Describe a data file: how the campaign ended, its channels, runs, points and tables.",
        "campaign.h5",
    ),
    "file verify": (
        "file:verify",
        "Check the datasets of a data file against their checksums and against the file layout.",
        "campaign.h5 --json",
    ),
    "file recover": (
        "file:recover",
        "Rebuild a file after a crash or a full disk, or upgrade one of an older version.",
        "campaign.h5 --out recovered.h5",
    ),
    "file bundle": (
        "support:bundle",
        "Collect a fault report: log, configuration, versions and latest data of a campaign in one archive.",
        "campaign.h5 --anonymous",
    ),
    "replay": (
        "replay:replay",
        "Replay a recorded campaign through the same engine, guard, analysis and displays.",
        "campaign.h5 --speed 10",
    ),
    "analyse": (
        "analyse:analyse",
        "Recompute every result of a recorded campaign from its samples, with other settings.",
        "campaign.h5 --list",
    ),
    "export": (
        "file:export",
        "Write a recorded campaign for other programs: every channel and the drive, and the tables of results.",
        "campaign.h5 --to mat",
    ),
    "config init": (
        "installation:init",
        "Write a configuration file with every key, its default, unit and limits.",
        "bench.toml",
    ),
    "config check": (
        "installation:check",
        "Check a configuration file and list every error, one line for each key.",
        "bench.toml",
    ),
    "benchmark": (
        "installation:benchmark",
        "Measure speed and error of the engine and of comparable integrators.",
        "--quick",
    ),
    "completion": (
        "installation:completion",
        "Print or install the shell completion script for the commands and options of rockbench.",
        "bash --install",
    ),
}
"""Commands by name: the function in this package, the first paragraph of its documentation, and example arguments."""


def rockbench_app(arguments: Sequence[str] = ()) -> App:
    """The command tree. Only the command named in `arguments` is loaded; all protocols for `run` without a protocol."""
    app = App(
        name="rockbench",
        help=SUMMARY,
        help_epilogue="Example: rockbench predict steady --omega 16 --beta 0.4",
        help_format="plaintext",
        version=_version,
        exit_on_error=False,
        print_error=False,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    groups = {"": app}
    for name, (summary, example) in GROUPS.items():
        groups[name] = App(name=name, help=summary, help_epilogue=f"Example: rockbench {example}", version_flags=())
        app.command(groups[name])
    for path, (target, summary, example) in COMMANDS.items():
        group, _, name = path.rpartition(" ")
        words = path.split()
        # the command of a protocol is an App with the protocol's own example
        own = {"help_epilogue": f"Example: rockbench {path} {example}", "version_flags": ()} if example else {}
        groups[group].command(f"{__package__}.{target}", name=name, help=summary, **own)
        if [*arguments[: len(words)]] == words:
            _document(groups[group][name])
    if not arguments or arguments[0] == "run":
        from bench.app.catalogue import CHECK, protocol_names

        names = [name for name in protocol_names() if name != CHECK]
        for name in names:
            groups["run"].command(f"{__package__}.run:{name}", name=name)
            if arguments and not {*arguments[1:2]} & {*names}:
                # the list of protocols shows their summaries
                _ = groups["run"][name]
    return app


_READERS = ("file", "export", "report", "replay", "analyse")
"""Commands that evaluate a data file."""


def reads_files(arguments: Sequence[str]) -> bool:
    """Whether a command line evaluates a data file."""
    return bool(arguments) and arguments[0] in _READERS


def unreadable(error: BaseException) -> str:
    """Message for an unexpected error while a file is read, with its location in the source code."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    said = " ".join(str(error).split())
    what = f"{type(error).__name__}{': ' if said else ''}{said:.200}"
    place = f"{Path(frame.filename).name}, line {frame.lineno}"
    return (
        f"the contents of the file cannot be evaluated ({what}; {place}): check the file with `rockbench file verify`"
    )


def _version() -> str:
    from importlib.metadata import version

    return f"rockbench {version('rocking-bench')}"


def _document(command: App) -> None:
    """Replace the summary of a command by its full help, with one line per paragraph, which the terminal wraps."""
    text = getdoc(command.default_command) or ""
    command.help = "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def main(argv: Sequence[str] | None = None, progress: Progress = silent) -> int:
    """Execute a command line and return its exit code; `progress` reports each stage.

    0: done. 1: the command failed, or its run failed or was aborted. 2: a RockbenchError, usually an input refused
    before anything started. 130: ended by Ctrl-C.
    An error is one line on standard error, and with --json an object on standard output (docs/errors.md).
    """
    arguments = sys.argv[1:] if argv is None else list(argv)
    forget_completed()
    app = rockbench_app(arguments)
    # needed even for a command line that cannot be parsed
    reply_in_json(sys.stdout if "--json" in arguments else None)
    try:
        command, bound, handed = app.parse_args(arguments, exit_on_error=False, print_error=False)
        code = command(*bound.args, **bound.kwargs, **dict.fromkeys(handed, progress))
    except UnusedCliTokensError as error:
        report_error(f"unexpected argument: {' '.join(error.unused_tokens or [])} (see --help)", "usage")
        return 2
    except CycloptsError as error:
        report_error(error, "usage")
        return 2
    except RockbenchError as error:
        report_error(error)
        return 2
    except MemoryError as error:
        if reads_files(arguments):
            report_error(unreadable(error), "damaged_file")
            return 1
        report_error("the computer is out of memory: close other programs")
        return 1
    except KeyboardInterrupt as interrupt:
        report_interrupt(str(interrupt) or None)
        return 130
    except Exception as error:
        if (interrupt := converted(error)) is not None:
            report_interrupt(str(interrupt) or None)
            return 130
        # damaged contents may cause any exception
        if isinstance(error, OSError) or not reads_files(arguments):
            raise
        report_error(unreadable(error), "damaged_file")
        return 1
    return code if isinstance(code, int) else 0
