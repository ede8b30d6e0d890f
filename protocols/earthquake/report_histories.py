"""Motion of table and frame under earthquake records, from the raw channels: as in Fig. 7, 8(b) and 9(b)."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT, SignalMap
from bench.config.validation import validated
from bench.events import RunningGain
from bench.publication.campaign import Campaign
from bench.record.reader import Record
from bench.report.earthquake_histories import DriftPicture, MotionPicture, drift_figure, motion_figure
from bench.report.page.document import Notice, Part, Picture
from protocols.earthquake.live import STEP, History
from protocols.earthquake.observed import observe
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import Shaking, shakings
from protocols.earthquake.sources import FileSources
from sim.errors import InvalidInput

Floats = NDArray[np.float64]

QUIET = 1.5
"""Time at the beginning of a run from which the zero of the signals is taken [s]: the table rests for 2 s."""


@dataclass(frozen=True)
class Played:
    """A record, played once: rows of the file from the drive's begin to its last gain; `run`: where its run begins."""

    name: str
    beta: float | None
    run: int
    start: int
    stop: int


def played_records(record: Record) -> list[Played]:
    """Every play of the file that was watched, in order; `beta` is None for the bare frame."""
    gains, blocks = record.columns_of(RunningGain), record.blocks
    found: list[Played] = []
    if not gains:
        return found
    rows, runs, times = (blocks[column] for column in ("row", "run", "time"))
    for time, name, beta, seconds in zip(
        *(gains[column] for column in ("time", "record", "beta", "seconds")), strict=True
    ):
        block = bisect_right(times, time + 1e-6) - 1
        if block < 0:
            continue
        stop = int(rows[block + 1]) if block + 1 < rows.size else record.rows
        begin = int(rows[bisect_left(runs, runs[block])])
        samples = round(seconds * record.sample_rate)
        one = Played(str(name), None if beta is None else float(beta), begin, stop - samples, stop)
        # one play grows block by block; another one begins elsewhere
        if found and (found[-1].run, found[-1].name, found[-1].beta) == (one.run, one.name, one.beta):
            # the last gain ends within a block, the first one at the end of one: only that tells where the play begins
            start = found.pop().start
            one = replace(one, start=start, stop=start + samples)
        found.append(one)
    return [one for one in found if one.start >= one.run]


def signals_of(record: Record, signals: SignalMap, played: Played) -> Floats:
    """Signals of the play, shape (n, n_signals), counted from the zero at rest."""

    def values(start: int, stop: int) -> Floats:
        return np.column_stack([record.values(channel.name, slice(start, stop)) for channel in record.channels])

    signals.tare(values(played.run, played.run + round(QUIET * record.sample_rate)))
    return signals.of(values(played.start, played.stop))


MOST = 7
"""Records in a figure of histories."""


def histories_parts(campaign: Campaign) -> list[Part]:
    """The table's motions and the drifts, from the raw channels."""
    record, configuration = campaign.record, campaign.configuration
    if configuration is None:
        return [Notice("Histories are not drawn: this version of the software does not know the file's configuration.")]
    try:
        signals = SignalMap(record.channels, configuration.laser_reference, configuration.calibrated)
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn: {refused}.")]
    names = list(dict.fromkeys(row["record"] for row in campaign.seismic_points))
    plays = played_records(record)
    try:
        known = {shaking.name: shaking for shaking in _shakings(campaign)}
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn, for the records are not at hand: {refused}.")]
    every = max(round(STEP * record.sample_rate), 1)
    motions: list[MotionPicture] = []
    drifts: list[DriftPicture] = []
    for name in names:
        shaking = known.get(name)
        if shaking is None:
            continue
        for play in _bare_and_softest([play for play in plays if play.name == name]):
            shown = signals_of(record, signals, play)
            if play.beta is None:
                asked = shaking.target.acceleration
                achieved = shown[: asked.size : every, ACCELERATION]
                motions.append(MotionPicture(name, STEP, asked[::every][: achieved.size], achieved))
            drifts.append(
                DriftPicture(name, play.beta, STEP, shown[::every, DRIFT], _expected(campaign, shaking, play, shown))
            )
    parts: list[Part] = []
    for first in range(0, len(motions), MOST):
        figure = motion_figure(motions[first : first + MOST])
        caption = "Acceleration of the table under the records: as asked, and as measured with the bare frame."
        parts.append(Picture(figure, caption, "Acceleration over time, a row for each record."))
    for first in range(0, len(names), MOST):
        some = [drift for drift in drifts if drift.name in names[first : first + MOST]]
        if some:
            caption = (
                "Drift of the bare frame and of the coupled one with the softest spring: measured, and predicted for "
                "the motion that the table made."
            )
            parts.append(Picture(drift_figure(some), caption, "Drift over time, a row for each record."))
    return parts


def _shakings(campaign: Campaign) -> tuple[Shaking, ...]:
    """The records as the campaign used them: those in the file, or read anew where an older file has none of them.

    Raises InvalidInput where they are not there any more.
    """
    assert campaign.configuration is not None
    parameters = validated(EarthquakeParameters, campaign.parameters)
    return shakings(parameters, campaign.configuration, FileSources.stored(campaign.record.tables))


def _bare_and_softest(plays: Sequence[Played]) -> list[Played]:
    """The last test of the bare frame, and the last one with the softest spring."""
    bare = [play for play in plays if play.beta is None]
    springs = sorted(
        (play for play in plays if play.beta is not None), key=lambda play: (play.beta or 0.0, -play.start)
    )
    return [*bare[-1:], *springs[:1]]


def _expected(campaign: Campaign, shaking: Shaking, play: Played, shown: Floats) -> Floats:
    """The predicted drift [m] every STEP under the motion that the table made; empty where that cannot be seen."""
    specimen = campaign.specimen.bare() if play.beta is None else campaign.specimen.coupled(play.beta)
    try:
        base = observe(shown, shaking.target.rest, campaign.record.sample_rate).base
    except InvalidInput:
        return np.zeros(0)
    return History.of(specimen, base).drift
