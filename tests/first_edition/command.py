"""The command `rockbench` and the data of its first edition, reached as a user reaches them: no module is imported."""

import lzma
import re
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from importlib.metadata import entry_points
from io import StringIO
from math import isclose
from pathlib import Path

import pytest

DATA = Path(__file__).parents[1] / "data" / "first_edition"


def unpack(name: str, folder: Path) -> Path:
    """The data file of this name in `folder`, which is unpacked there once."""
    path = folder / f"{name}.h5"
    if not path.exists():
        path.write_bytes(lzma.decompress((DATA / f"{name}.h5.xz").read_bytes()))
    return path


EXCEPTED = {"elapsed_s", "software", "plan_hash", "file", "figure", "further_figures"}
"""What holds a time, a version, a hash over both and over every key of the configuration, or a path."""

SENTENCE = 3
"""Spaces in a text that is a sentence, not a name."""

INTERVALS = (
    "alpha_1_uncertainty",
    "alpha_1_low",
    "alpha_1_high",
    "alpha_2_uncertainty",
    "alpha_2_low",
    "alpha_2_high",
    "alpha_2_bench_uncertainty",
    "dominating",
    "uncertainty_parts",
    "reason",
)
"""Of gains: the remaining transient is evaluated from the cycles and the linearity of the lasers without a shape, and
what does not agree is named in the reason."""

OF_CHECK = ("uncertainty",)
"""Of a line of a check: Student's t, since few phases determine a delay, and few ratios a scale, only roughly."""


@dataclass(frozen=True)
class Done:
    """How a command ended: its exit code and what it wrote."""

    code: int
    out: str
    err: str


Rockbench = Callable[..., Done]


def command(*arguments: object) -> Done:
    """Carry out a command line of the installed `rockbench` in this process."""
    (script,) = entry_points(group="console_scripts", name="rockbench")
    out, err, before = StringIO(), StringIO(), sys.argv
    # what a process of its own would take to its end
    hook, handlers = sys.unraisablehook, {number: signal.getsignal(number) for number in signal.valid_signals()}
    sys.argv = ["rockbench", *map(str, arguments)]
    try:
        with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as ended:
            script.load()()
    finally:
        sys.argv, sys.unraisablehook = before, hook
        signal.set_wakeup_fd(-1)
        # an interrupt is answered once in the life of a process, which goes on here
        sys.modules["bench.app.cli.interrupt"].__dict__["_watch"] = None
        for number, handler in handlers.items():
            if handler is not signal.getsignal(number):
                signal.signal(number, handler)
    return Done(int(ended.value.code or 0), out.getvalue(), err.getvalue())


_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def differences(old: object, new: object, where: str = "", rounded: Mapping[str, float] | None = None) -> Iterator[str]:
    """What of `old` is not in `new`, digit for digit; `new` may have more keys.

    Keys in `rounded` may differ by that share of their value. Sentences may be reworded; their numbers may not change.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        changed = INTERVALS if "alpha_2" in old else OF_CHECK if "what" in old and "remedy" in old else ()
        for key in old.keys() - EXCEPTED - {*changed}:
            if key in new:
                yield from differences(old[key], new[key], f"{where}.{key}", rounded)
            else:
                yield f"{where}.{key} is missing"
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{where}[{index}]", rounded)
    elif isinstance(old, str) and isinstance(new, str) and old.count(" ") >= SENTENCE <= new.count(" "):
        if _NUMBER.findall(old) != _NUMBER.findall(new):
            yield f"{where} was {old!r} and is {new!r}"
    elif (
        isinstance(old, float) and isinstance(new, float) and (allowed := (rounded or {}).get(where.rpartition(".")[2]))
    ):
        if not isclose(old, new, rel_tol=allowed):
            yield f"{where} was {old!r} and is {new!r}"
    elif type(old) is not type(new) or old != new:
        yield f"{where} was {old!r} and is {new!r}"
