"""Ctrl-C at random moments of every command, as a terminal sends it: to a whole group of real processes.

    python -m tests.interrupts [--moments 200] [--seed 1] [--only NAME ...]

prints the worst reaction of every command, with the phase that the command was in by its own words, and how late this
machine was meanwhile. `tests/bench/app/cli/test_interrupts.py` runs a few of the moments.
"""

import argparse
import json
import lzma
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from io import StringIO
from math import inf
from pathlib import Path

import psutil

from bench.app.cli.main import main
from tests.lateness import Lateness
from tests.patience import LONG
from tests.whole import partial

STORED = Path(__file__).parent / "data" / "first_edition" / "harmonic_point.h5.xz"
SESSIONS = f"rockbench-{os.getuid()}" if sys.platform != "win32" else ""
ANSWERED = 0.5
"""Longest time to the answer [s]."""
RAMP = 3.0
"""Longest time to the end where a rig is open [s]: a fast ramp in virtual time, the recorder's last pages, the file."""
DRIVEN = 2.0
"""Latest moment after the rig was opened [s]."""
STARTED = 0.25
"""Earliest moment [s]: Python itself starts before, and answers in its own way."""


@dataclass(frozen=True)
class Command:
    """A command line in which FILE, QUEUE and CONFIG are files of a bed and NEW is a path that nothing is at.

    Moments are drawn from the first `span` [s]. `cold`: with nothing compiled yet. `serves`: ends well by Ctrl-C.
    `drives`: opens a rig.
    """

    name: str
    line: str
    span: float
    cold: bool = False
    serves: bool = False
    drives: bool = False


_POINT = "--omega 16 --beta 0.4"
COMMANDS = (
    Command("run: planning", "run harmonic", 20.0, drives=True),
    Command("run: point", f"run harmonic {_POINT} --out NEW", 9.0, drives=True),
    Command("run: earthquake", "run earthquake synthetic:kobe --beta 0.4 --out NEW", 12.0, drives=True),
    Command("run: free-rocking", "run free-rocking --out NEW", 8.0, drives=True),
    Command("run: free-vibration", "run free-vibration --out NEW", 8.0, drives=True),
    Command("run: identify", "run identify --out NEW", 8.0, drives=True),
    Command("run: stability", "run stability --omega 15 --no-bisect --out NEW", 9.0, drives=True),
    Command("run: json", f"run harmonic {_POINT} --json --out NEW", 9.0, drives=True),
    Command("run: dry", "run harmonic --dry-run", 20.0),
    Command("run: first", f"run harmonic {_POINT} --dry-run", 14.0, cold=True),
    Command("check", "check --out NEW", 6.0, drives=True),
    Command("queue", "queue QUEUE", 9.0, drives=True),
    Command("queue: dry", "queue QUEUE --dry-run", 6.0),
    Command("predict steady", f"predict steady {_POINT}", 2.5),
    Command("predict steady: first", f"predict steady {_POINT}", 12.0, cold=True),
    Command("predict map", "predict map --out NEW.h5", 5.0),
    Command("predict map: band", "predict map --band", 20.0),
    Command("predict history", f"predict history {_POINT}", 3.0),
    Command("predict seismic", "predict seismic synthetic:kobe --beta 0.4", 8.0),
    Command("predict stability", "predict stability", 6.0),
    Command("predict attractor", "predict attractor", 8.0),
    Command("predict modes", "predict modes", 1.5),
    Command("paper", "paper --html NEW.html", 18.0),
    Command("benchmark", "benchmark --quick", 40.0),
    Command("report", "report FILE --html NEW.html", 4.0),
    Command("report: pdf", "report FILE --pdf NEW.pdf", 4.0),
    Command("file info", "file info FILE", 1.2),
    Command("file verify", "file verify FILE", 1.2),
    Command("file recover", "file recover FILE --out NEW.h5", 1.5),
    Command("replay", "replay FILE", 8.0),
    Command("analyse", "analyse FILE --set measured_cycles=20 --out NEW.h5", 4.0),
    Command("export mat", "export FILE --to mat --out NEW", 2.0),
    Command("export csv", "export FILE --to csv --out NEW", 4.0),
    Command("export uff", "export FILE --to uff --out NEW", 3.0),
    Command("records info", "records info synthetic:kobe", 1.5),
    Command("records fit", "records fit synthetic:kobe", 3.0),
    Command("config", "config check CONFIG", 1.0),
    Command("devices", "devices", 1.5),
    Command("emulate", "emulate", 4.0, serves=True),
    Command("gui", "gui", 4.0, serves=True),
)


@dataclass(frozen=True)
class Moment:
    """When `command` is interrupted: `after` [s] from its start or, `opened`, from when the rig is open; and `again`
    [s] later, if not None.
    """

    command: Command
    after: float
    again: float | None
    opened: bool


@dataclass
class Reaction:
    """What came of a signal `moment` [s] after the start. `late` [s]: how late this machine woke a sleeping thread."""

    command: Command
    moment: float
    twice: bool
    phase: str
    answer: float
    end: float
    late: float
    code: int
    faults: list[str] = field(default_factory=list[str])
    driving: bool = False


class Bed:
    """A folder with what the commands need: a short campaign and a queue."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.queue, self.configuration = folder, folder / "queue.json", folder / "rockbench.toml"
        tests = [{"protocol": "harmonic", "parameters": {"omega": [16.0], "beta": [0.4]}}]
        whole = {"format": "rocking-bench queue", "format_version": 1, "tests": tests}
        self.queue.write_text(json.dumps(whole), encoding="utf-8")
        _run("config", "init", str(self.configuration))

    @cached_property
    def file(self) -> Path:
        """A short stored campaign, unpacked when a command first needs it."""
        path = self.folder / "campaign.h5"
        path.write_bytes(lzma.decompress(STORED.read_bytes()))
        return path

    def reaction(self, drawn: Moment) -> Reaction | None:
        """What comes of a moment, or of an earlier one where this machine is faster than the command's span says."""
        for _ in range(7):
            if (found := self.react(drawn)) is not None:
                return found
            drawn = replace(drawn, after=drawn.after / 1.5 if drawn.opened else max(STARTED, drawn.after / 1.5))
        return None

    def react(self, drawn: Moment) -> Reaction | None:
        """Start the command and interrupt it at its moment; None if it ended before."""
        command, moment, second = drawn.command, drawn.after, drawn.again
        with tempfile.TemporaryDirectory(dir=self.folder) as made:
            # a short name: the path of a socket in it has at most 107 characters
            work, temporary = Path(made, "work"), Path(made, "t")
            work.mkdir()
            temporary.mkdir()
            queue = shutil.copy(self.queue, work)
            names = {"QUEUE": str(queue), "CONFIG": str(self.configuration)}
            if "FILE" in command.line:
                names["FILE"] = str(self.file)
            line = [names.get(word, word.replace("NEW", str(work / "new"))) for word in command.line.split()]
            environment = os.environ | {"TMPDIR": str(temporary), "QT_QPA_PLATFORM": "offscreen"}
            environment.pop("PYTHONDONTWRITEBYTECODE", None)
            # the suite switches announcements off; here they belong to what must not be left
            environment.pop("ROCKBENCH_SESSIONS", None)
            if command.cold:
                environment["NUMBA_CACHE_DIR"] = str(Path(made, "cache"))
            process = subprocess.Popen(
                [sys.executable, "-m", "bench", *line],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=environment,
                cwd=work,
                start_new_session=True,
            )
            lines = list[tuple[float, str]]()
            reader = threading.Thread(target=_read, args=(process, lines))
            reader.start()
            try:
                while drawn.opened and process.poll() is None and not any(work.rglob("campaign.h5")):
                    time.sleep(0.02)
                time.sleep(moment)
                if process.poll() is not None:
                    return None
                before = len(lines)
                driving = command.drives and any(work.rglob("campaign.h5"))
                with Lateness() as lateness:
                    asked = time.monotonic()
                    os.killpg(process.pid, signal.SIGINT)
                    if second is not None:
                        # a process that ends meanwhile needs no second one, and is not waited for longer
                        try:
                            process.wait(second)
                        except subprocess.TimeoutExpired:
                            os.killpg(process.pid, signal.SIGINT)
                    process.wait(LONG)
                    end = time.monotonic() - asked
            finally:
                process.kill()
                process.wait()
                reader.join()
            # a command that ended by itself in this very moment has nothing to answer
            said = [at - asked for at, text in lines[before:] if "interrupt" in text or "closed" in text]
            phase = next((text for _, text in reversed(lines[:before])), "before the first line")
            reaction = Reaction(
                command,
                moment,
                second is not None,
                phase[:90],
                min([end, *said]),
                end,
                lateness.worst,
                process.returncode,
                # a rig that is opened in this very moment has no file yet
                driving=driving or any("ramped" in text or "ending the run" in text for _, text in lines),
            )
            _judge(reaction, lines, process.pid, work, temporary)
        return reaction


def _run(*arguments: str) -> None:
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as errors:
        code = main(arguments)
    assert code == 0, errors.getvalue()


def _read(process: "subprocess.Popen[bytes]", lines: list[tuple[float, str]]) -> None:
    assert process.stderr is not None
    lines.extend((time.monotonic(), line.decode(errors="replace").rstrip()) for line in process.stderr)
    process.stderr.close()


def _judge(found: Reaction, lines: list[tuple[float, str]], group: int, work: Path, temporary: Path) -> None:
    """Note on `found` everything that must not be."""
    texts = [text for _, text in lines]
    faults = found.faults
    # at the very end of a process Python has let go of the signal's handler: a shell calls that 130 as well
    done = found.code in (0, -signal.SIGINT)
    if found.code != 130 and not (found.command.serves and done) and not done:
        faults.append(f"exit code {found.code}")
    if any("Traceback" in text or "Exception ignored" in text for text in texts):
        faults.append("a traceback: " + " | ".join(texts[-3:]))
    if any("\x1b" in text or "\r" in text for text in texts):
        faults.append("control characters")
    told = [text for text in texts if text.startswith("rockbench: error")]
    if len(told) > 1 or (found.code == 130 and not told):
        faults.append(f"{len(told)} lines of error: {told}")
    if found.answer > ANSWERED + found.late:
        faults.append(f"answered after {found.answer:.2f} s")
    if found.end > (RAMP if found.driving else ANSWERED) + found.late and not found.command.serves:
        faults.append(f"ended after {found.end:.2f} s")
    # the folder in which sessions announce themselves stays, empty
    left = [str(path) for path in temporary.rglob("*") if path != Path(temporary, SESSIONS)]
    if not (done or found.driving):
        faults.extend(misjudged(found.command, told, work))
    else:
        left += [str(path) for pattern in (".*", "*.part", "*.new") for path in work.rglob(pattern)]
    if left:
        faults.append(f"left behind: {left[:5]}")
    # a child got the same signal and is ending as well, a little later where Qt is being loaded in it
    end = time.monotonic() + ANSWERED + found.late
    while running := _running(group):
        if time.monotonic() > end:
            faults.append(f"a child is left: {running}")
            return
        time.sleep(0.005)


def _running(group: int) -> list[str]:
    """Command lines of the processes of a group, without those that have ended and that nobody has asked about yet."""
    found = list[str]()
    for process in psutil.process_iter():
        with suppress(psutil.Error, ProcessLookupError):
            if os.getpgid(process.pid) == group and process.status() != psutil.STATUS_ZOMBIE:
                found.append(" ".join(process.cmdline()))
    return found


def misjudged(command: Command, told: list[str], work: Path) -> list[str]:
    """What is wrong with the files of an interrupted command: each is whole and has the name that was asked for."""
    # the lock of a queue stays, and is let go of; the window keeps its queue in a folder of its own
    kept = {"queue.json", "queue.json.lock", "queue.json.owner", *(("runs",) if command.name == "gui" else ())}
    found = sorted(path for path in work.iterdir() if path.name not in kept)
    # a run's folder is no result before its rig was opened
    asked = set[str]() if command.drives else {word.replace("NEW", "new") for word in command.line.split()}
    faults = [f"left behind: {path}" for path in found if path.name not in asked]
    results = [path for path in found if path.name in asked]
    faults += [f"not whole: {why}" for path in results if (why := partial(path))]
    if any("is complete" in text for text in told) and not results:
        faults.append(f"called complete, but nothing is there: {told}")
    if results and any("no partial" in text or "nothing was written" in text for text in told):
        faults.append(f"{results} are there, but the command states: {told}")
    return faults


def moments(count: int, seed: int, only: Sequence[str] = (), latest: float = inf) -> list[Moment]:
    """`count` of them, spread over the commands."""
    chance = random.Random(seed)
    chosen = [each for each in COMMANDS if not only or each.name in only]
    drawn = list[Moment]()
    for number in range(count):
        # in long strides, so that few moments are of different kinds too
        command = chosen[number * 7 % len(chosen)]
        opened = command.drives and chance.random() < 0.5
        after = chance.uniform(0.0, DRIVEN) if opened else chance.uniform(STARTED, min(command.span, latest))
        again = chance.uniform(0.0, 0.3) if chance.random() < 0.3 else None
        drawn.append(Moment(command, after, again, opened))
    return drawn


def print_reactions() -> int:
    """Print every reaction, then the worst of each command. Returns 1 when any was at fault."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=())
    asked = parser.parse_args()
    found = list[Reaction]()
    with tempfile.TemporaryDirectory() as folder:
        bed = Bed(Path(folder))
        for drawn in moments(asked.moments, asked.seed, asked.only):
            command, reaction = drawn.command, bed.reaction(drawn)
            if reaction is None:
                print(f"{command.name:24} ends before every moment", flush=True)
                continue
            found.append(reaction)
            print(
                f"{command.name:24} {reaction.moment:6.2f} s {'twice' if reaction.twice else 'once ':5} "
                f"answer {reaction.answer:5.2f} s  end {reaction.end:5.2f} s  late {reaction.late:4.2f} s  "
                f"code {reaction.code}  {reaction.phase}  {'; '.join(reaction.faults)}",
                flush=True,
            )
    print(f"\n{'command':24} moments  worst answer   worst end  machine late  in the phase of the worst answer")
    for command in COMMANDS:
        own = [each for each in found if each.command is command]
        if own:
            worst = max(own, key=lambda each: each.answer)
            print(
                f"{command.name:24} {len(own):7}  {worst.answer:10.2f} s  {max(each.end for each in own):8.2f} s  "
                f"{max(each.late for each in own):10.2f} s  {worst.phase}"
            )
    bad = [each for each in found if each.faults]
    print(f"\n{len(found)} moments, {len(bad)} at fault")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(print_reactions())
