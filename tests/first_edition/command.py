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
from typing import Any

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

OF_DELAY = ("measured", *OF_CHECK)
"""Of a line for a delay: those of lasers take the ages of their held readings from single cycles. What is measured may
differ by the uncertainty that the first edition stated."""

OF_CALIBRATION = {
    "scale": "scale_uncertainty",
    "delay_s": "delay_uncertainty_s",
    "lowest_m": "residual_m",
    "highest_m": "residual_m",
    "largest_error_m": "residual_m",
}
"""Of a calibrated sensor: the cycles are fitted with 21 harmonics instead of 10, so that errors with short waves are
found, and the order is the best one instead of the lowest that is hardly worse. The linearity error of the reference
sensor is corrected, which changes the largest error. A value may differ by a share of the uncertainty that the first
edition stated, given for each."""

OF_LARGEST, OF_OTHERS = 1.0, 0.5
"""Shares of the stated uncertainty by which the largest error and the other values may differ."""

OF_CALIBRATION_RATIOS = {"scale_uncertainty": 1.0, "delay_uncertainty_s": 1.5, "residual_m": 1.5, "order": 7.0}
"""Of a calibrated sensor: largest ratio to the value of the first edition. The uncertainty of a laser's scale was twice
as large as it should be, and is a part of that of the table."""

OF_TILTS = (
    "r_exp_uncertainty",
    "r_motion_uncertainty",
    "ratio_uncertainty",
    "trend_uncertainty",
    "alpha_uncertainty_rad",
    "p_uncertainty_rad_s",
    "uncertainty_parts",
)
"""Of the results of tilts: what the clock of the laser contributes is not counted a second time as noise, so that
uncertainties are smaller, by at most a twentieth where this is the lesser part."""

ROUNDED = {"alpha_1_predicted": 1e-14, "alpha_2_predicted": 1e-14, "alpha_2_predicted_uncertainty": 1e-9}
"""Largest relative difference of what the kernel computes with fused operations and members in lanes today: less than
a millionth of the uncertainty."""

ELSEWHERE, OF_TREND = 1e-4, 1e-3
"""Largest relative difference of any number on a processor that rounds otherwise than the one of the first edition, and
of the trend of r: uncertainties of fits differ by up to 4e-5, results by less than 1e-7, and the trend, which is a
small difference, by 2e-4 of its uncertainty."""

Share = Callable[[str], float]
"""Share of its value by which the number with a key may differ."""


def rounded(key: str) -> float:
    """The share on the processor of the first edition."""
    return ROUNDED.get(key, 0.0)


def rounded_elsewhere(key: str) -> float:
    """The share on another processor."""
    return OF_TREND if key == "trend" else ELSEWHERE


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


def differences(old: object, new: object, where: str = "", share: Share = lambda _: 0.0) -> Iterator[str]:
    """What of `old` is not in `new`, digit for digit; `new` may have more keys, and more lines of a check.

    Numbers may differ by a `share` of their value. Sentences may be reworded; their numbers may not change, unless all
    may differ.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old.keys() - EXCEPTED - {*_changed(old)}:
            if key in new:
                yield from differences(old[key], new[key], f"{where}.{key}", share)
            else:
                yield f"{where}.{key} is missing"
        if "scale_uncertainty" in old:
            yield from _otherwise_calibrated(old, new, where)
        if _changed(old) == OF_TILTS:
            for key in OF_TILTS[:-1]:
                if not 0.95 * old[key] <= new[key] <= old[key]:
                    yield f"{where}.{key} was {old[key]!r} and is {new[key]!r}"
        if _changed(old) == OF_DELAY and abs(new["measured"] - old["measured"]) > old["uncertainty"]:
            yield f"{where}.measured was {old['measured']!r} and is {new['measured']!r}"
    elif isinstance(old, list) and isinstance(new, list) and old and _is_check_line(old[0]):
        lines = {(line["subject"], line["what"]): line for line in new}
        for line in old:
            name = line["subject"], line["what"]
            yield from differences(line, lines.get(name), f"{where}[{', '.join(name)}]", share)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{where}[{index}]", share)
    elif isinstance(old, str) and isinstance(new, str) and old.count(" ") >= SENTENCE <= new.count(" "):
        if not share("") and _NUMBER.findall(old) != _NUMBER.findall(new):
            yield f"{where} was {old!r} and is {new!r}"
    elif isinstance(old, float) and isinstance(new, float):
        if not isclose(old, new, rel_tol=share(where.rpartition(".")[2])):
            yield f"{where} was {old!r} and is {new!r}"
    elif type(old) is not type(new) or old != new:
        yield f"{where} was {old!r} and is {new!r}"


def _otherwise_calibrated(old: Mapping[str, Any], new: Mapping[str, Any], where: str) -> Iterator[str]:
    """Values of a calibrated sensor that differ by more than they may."""
    for key, was in old.items():
        now = new[key]
        if was is None:
            continue
        if key in OF_CALIBRATION:
            most = OF_LARGEST if key == "largest_error_m" else OF_OTHERS
            allowed = abs(now - was) <= most * (old[OF_CALIBRATION[key]] or 0.0)
        else:
            allowed = key not in OF_CALIBRATION_RATIOS or 0.0 <= now <= OF_CALIBRATION_RATIOS[key] * was
        if not allowed:
            yield f"{where}.{key} was {was!r} and is {now!r}"


def _is_check_line(value: object) -> bool:
    return isinstance(value, dict) and "what" in value and "remedy" in value


def _changed(old: Mapping[str, object]) -> tuple[str, ...]:
    """What is evaluated otherwise today, of a gain, a line of a check, or a calibrated sensor."""
    if _is_check_line(old):
        return OF_DELAY if str(old["what"]).startswith("delay ") else OF_CHECK
    if "scale_uncertainty" in old:
        return (*OF_CALIBRATION, *OF_CALIBRATION_RATIOS)
    if "r_exp_uncertainty" in old:
        return OF_TILTS
    return INTERVALS if "alpha_2" in old else ()
