"""Studies of the audit: each measures quantities of one drawn bench after another, whose true values are known."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import degrees

from bench.analysis.free_decay.response import NAMES
from sim.errors import InvalidInput
from tests.benchmarks import (
    calibrated_lasers,
    check_delays,
    coverage,
    coverage_record,
    identify_block,
    identify_frame,
    multipliers,
    table_response,
)
from tests.benchmarks.coverage_sensors import CASES
from tests.benchmarks.estimates import Estimate, Omitted

Outcome = Mapping[str, Estimate] | Omitted
"""The estimates of a bench by the keys of the study's quantities."""


@dataclass(frozen=True)
class Study:
    """A study of the audit.

    `bench` carries out the bench of a seed. `quantities` are the symbols of its estimates by key, `case` describes it
    in the table. `seconds` is the processor time of a bench, by which the studies are ordered. Uncertainties are
    relative to the true value, or in `units`: symbol, and number of units in the estimate's one.
    """

    name: str
    case: str
    quantities: Mapping[str, str]
    bench: Callable[[int], Outcome]
    seconds: float
    units: Mapping[str, tuple[str, float]] = field(default_factory=dict[str, tuple[str, float]])


MORE_POINTS = ((15.0, 0.25), (15.0, 0.64), (17.5, 0.64), (20.0, 0.97))
"""Further stable points of the paper's campaign."""

TWO_POINTS = ((16.0, 0.40), (20.0, 0.64))

HARMONIC = {
    "default": ("default lasers", (*coverage.POINTS, *MORE_POINTS)),
    "calibrated": ("with `laser-calibration`", coverage.POINTS),
    "smooth": ("linearity of 0.5 to 2 periods", TWO_POINTS),
    "short waves": ("linearity of 3 to 6 periods", coverage.POINTS),
    "clock": ("sample clock off by 30 ppm", TWO_POINTS),
    "amplitude drift": ("amplitude drifts by 0.2 %", TWO_POINTS),
    "noisy laser": ("noise of laser 1 0.1 mm", TWO_POINTS),
    "filter": ("filter cards 10 % off", TWO_POINTS),
}
"""Description and points of the cases of steady sines."""


CAMPAIGN = ("default", "calibrated")
"""Cases whose points are also tested within a campaign, with the bare frame at all of its frequencies; of the other
cases, this is done for `MOVED`."""

MOVED = (20.0, 0.64)
"""Point at which the bare frame moves much less than the coupled one, so that its other frequencies matter most."""


def _harmonic(seed: int, case: str, omega: float, beta: float, *, campaign: bool = False) -> Outcome:
    found = coverage.scored(seed, CASES[case], omega, beta, campaign=campaign)
    return found if isinstance(found, Omitted) else {"alpha_2": found.estimate}


RECORDS = (("l-aquila", 0.25), ("l-aquila", 0.97), ("pacoima", 0.25), ("pacoima", 0.97))
"""Synthetic records and stiffness ratios of the peak drift ratio."""

MORE_RECORDS = (
    ("parkfield", 0.25),
    ("parkfield", 0.64),
    ("erzincan", 0.64),
    ("erzincan", 0.97),
    ("kobe", 0.25),
    ("kobe", 0.64),
    ("el-centro", 0.25),
    ("el-centro", 0.64),
)
"""Further ones, with default lasers only."""

SOURCES: dict[coverage_record.Source, str] = {
    "motion": "",
    "check": ", with `--laser-check --laser-block 0`",
    "data sheet": ", with `--laser-block 0`",
}
"""What the errors of the lasers are known from, and the options of a run."""

SEISMIC: tuple[tuple[str, coverage_record.Source, tuple[tuple[str, float], ...]], ...] = (
    ("default", "motion", (*RECORDS, *MORE_RECORDS)),
    ("short waves", "motion", RECORDS[::3]),
    ("clock", "motion", RECORDS[::3]),
    ("noisy laser", "motion", RECORDS[::3]),
    ("filter", "motion", RECORDS[::3]),
    ("calibrated", "motion", RECORDS),
    ("default", "data sheet", RECORDS),
    ("short waves", "data sheet", RECORDS[::3]),
    ("default", "check", RECORDS),
    ("smooth", "check", RECORDS),
    ("short waves", "check", RECORDS[::3]),
)
"""Cases of lasers under records, what their errors are known from, and the records."""


def _record(seed: int, name: str, beta: float, case: str, source: coverage_record.Source) -> Outcome:
    try:
        return {"alpha_2": coverage_record.measured(seed, name, beta, CASES[case], source).estimate}
    except InvalidInput as lost:
        # a storey leaves the range of its laser
        return Omitted(str(lost))


FRAME = {"k1": "k₁", "k2": "k₂", "xi1": "ξ₁", "xi2": "ξ₂", "omega1": "ω₁", "omega2": "ω₂"}

BLOCK = {
    "ratio": "r / r_th",
    "ratio by motion": "r / r_th, by the motion",
    "ratio by amplitudes": "r / r_th, by the amplitudes",
    "trend": "trend of r",
    "alpha": "α",
    "p": "p",
}


def _frame(seed: int, excitation: str) -> Outcome:
    found = identify_frame.trial(seed, 1, excitation).estimates
    return dict(zip((*NAMES, "k_c")[: len(found)], found, strict=True))


def _block(seed: int) -> Outcome:
    return dict(zip(identify_block.NAMES, identify_block.repeat(seed, as_drawn=True), strict=True))


MULTIPLIERS = ((15.0, 0.97), (15.6, 0.97), (12.5, 0.64))


def _multiplier(seed: int, omega: float, beta: float) -> Outcome:
    found = multipliers.released(omega, beta, seed, 0.04, ["--starts", "3"])
    return found if isinstance(found, Omitted) else {"modulus": found.modulus, "angle": found.angle}


CHECK = {
    "accelerometer": "delay of the accelerometer",
    "laser_1": "delay of laser 1",
    "lasers": "delay of laser 2 against laser 1",
}


def studies() -> dict[str, Study]:
    """All studies by name, in the order of the table."""
    alpha_2 = {"alpha_2": "α₂"}
    alone = [(case, point, False) for case, (_, points) in HARMONIC.items() for point in points]
    campaign = [(case, point, True) for case in CAMPAIGN for point in (*coverage.POINTS, *MORE_POINTS)]
    campaign += [(case, MOVED, True) for case in HARMONIC if case not in CAMPAIGN]
    found = [
        Study(
            f"alpha_2, {case}, {'campaign, ' if together else ''}{omega:g}, {beta:g}",
            f"({omega:g}, {beta:.2f}), {HARMONIC[case][0]}{', in a campaign' if together else ''}",
            alpha_2,
            partial(_harmonic, case=case, omega=omega, beta=beta, campaign=together),
            (1.6 if case == "calibrated" else 0.6) + 0.8 * together,
        )
        for case, (omega, beta), together in (*alone, *campaign)
    ]
    found += [
        Study(
            f"record, {case}, {'' if source == 'motion' else f'{source}, '}{name}, {beta:g}",
            f"synthetic {name}, β {beta:.2f}, {HARMONIC[case][0]}{SOURCES[source]}",
            alpha_2,
            partial(_record, name=name, beta=beta, case=case, source=source),
            0.3 if source == "data sheet" else 0.5,
        )
        for case, source, records in SEISMIC
        for name, beta in records
    ]
    found += [
        Study("frame, pulse", "pulse, one decay", FRAME | {"k_c": "k_C"}, partial(_frame, excitation="pulse"), 6.5),
        Study("frame, hand", "release by hand, one decay", FRAME, partial(_frame, excitation="hand"), 6.4),
        Study("block", "free rocking, 6 tilts", BLOCK, _block, 2.5, {"trend": ("10⁻⁶/rad", 1e6)}),
    ]
    found += [
        Study(
            f"multiplier, {omega:g}, {beta:g}",
            f"({omega:g}, {beta:.2f})",
            {"modulus": "modulus of μ", "angle": "angle of μ"},
            partial(_multiplier, omega=omega, beta=beta),
            5.0,
            {"modulus": ("", 1.0), "angle": ("°", degrees(1.0))},
        )
        for omega, beta in MULTIPLIERS
    ]
    found += [
        Study(
            "table",
            "identification of a table without friction",
            {key: f"response, {key}" for place in table_response.PLACES for key in table_response.keys(place)},
            table_response.responses,
            1.8,
            {table_response.keys(place)[1]: ("mrad", 1e3) for place in table_response.PLACES},
        ),
        *(
            Study(
                f"laser-calibration, {case}",
                f"`laser-calibration`, {HARMONIC[case][0]}",
                calibrated_lasers.NAMES,
                partial(calibrated_lasers.calibrated, case=case),
                1.3,
                {"curve": ("µm", 1e6), "reference": ("µm", 1e6)},
            )
            for case in ("default", "smooth", "short waves")
        ),
        Study("check", "`check`, lasers at 4 kHz", CHECK, check_delays.delays, 0.8, dict.fromkeys(CHECK, ("µs", 1e6))),
    ]
    return {each.name: each for each in found}
