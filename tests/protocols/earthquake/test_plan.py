"""The campaign's plan, step by step, on a table whose answer is scripted: falls and losses come when the test wants."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2, U1
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.control.replication import ReplicationParameters
from bench.control.table_model import TableModel
from bench.control.target import integrated
from bench.engine.steps import Arm, Done, Fallen, OperatorAction, Outcome, Play, Played, Publish, RampOut, Step
from bench.events import PointFinished, Progress, StepStarted
from drivers.rig import OperatorTask, RigError
from protocols.common.identification.signal import grid
from protocols.earthquake.campaign import EarthquakeCampaign
from protocols.earthquake.plan import Pace, table_model
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint
from protocols.earthquake.records import shakings
from protocols.earthquake.table import TableSource, identification, stored_table, table_warnings
from sim.errors import InvalidInput
from sim.shaker import Shaker
from sim.virtual_bench import VirtualBenchParameters

Array = NDArray[np.float64]

GAIN = 2.0
"""Of the scripted table [m/s2/V], at every frequency."""

ASKED = EarthquakeParameters(
    records=("synthetic:kobe", "synthetic:parkfield"),
    beta=(0.64,),
    table_band="1.5:25",
    length_ratio=0.25,
    draws=40,
    decay=2.0,
)
ONE = ASKED.model_copy(update={"records": ("synthetic:kobe",)})


def table(**changes: object) -> TableModel:
    f = tuple(np.arange(0.5, 80.0, 0.25).tolist())
    flat = {"real": GAIN, "imaginary": 0.0, "uncertainty": 1e-6, "distortion": 1e-6, "coherence": 1.0, "noise": 1e-9}
    lines = {name: (value,) * len(f) for name, value in flat.items()}
    model = TableModel(
        date=datetime.now(UTC), specimen="bare frame", sample_rate=2000.0, level=0.5, frequency=f, **lines
    )
    return model.model_copy(update=changes)


@pytest.fixture
def stored(tmp_path: Path) -> Callable[..., BenchConfiguration]:
    """A configuration that names the table; further changes to the model."""

    def make(**changes: object) -> BenchConfiguration:
        path = tmp_path / "table.json"
        table(**changes).write(path)
        return BenchConfiguration(table_model=str(path))

    return make


def moved(volts: Array, gain: float = GAIN) -> Array:
    """Signals, shape (n, 6), of a table with this gain: the frame is an oscillator, every sensor has its noise."""
    rate = 2000.0
    signals = np.zeros((volts.size, 6))
    signals[:, ACCELERATION] = gain * volts
    signals[:, DISPLACEMENT] = integrated(gain * volts, rate)[1]
    for column, natural in ((U1, 1.0), (DRIFT, 2.5)):
        omega = 2.0 * np.pi * natural
        b, a = signal.bilinear([-1.0], [1.0, 0.1 * omega, omega**2], rate)
        signals[:, column] = signal.lfilter(b, a, gain * volts)
    signals[:, LASER_1] = signals[:, U1] + signals[:, DISPLACEMENT]
    signals[:, LASER_2] = signals[:, LASER_1] + signals[:, DRIFT]
    noise = np.array([1e-5, 1e-8, 1e-6, 1e-6, 1e-6, 1e-6])
    return signals + noise * np.random.default_rng(1).standard_normal(signals.shape)


Answer = Callable[[Step, str], Outcome | None]


def played_through(
    configuration: BenchConfiguration, parameters: EarthquakeParameters, answer: Answer
) -> tuple[list[Step], list[EarthquakePoint]]:
    """Every step of the plan, and its points; `answer` is shown a step and what is being done, None is the usual."""
    plan = EarthquakeCampaign(parameters, configuration).plan()
    steps, doing = list[Step](), ""
    try:
        step = next(plan)
        while True:
            steps.append(step)
            if isinstance(step, Publish) and isinstance(step.event, StepStarted):
                doing = step.event.text
            usual = Played(moved(step.volts), step.volts) if isinstance(step, Play) else Done()
            step = plan.send(answer(step, doing) or usual)
    except StopIteration:
        pass
    events = [step.event for step in steps if isinstance(step, Publish)]
    points = [event.point for event in events if isinstance(event, PointFinished)]
    return steps, [point for point in points if isinstance(point, EarthquakePoint)]


def test_two_falls_and_what_is_done_about_each(stored: Callable[..., BenchConfiguration]) -> None:
    """The first block falls while its record plays, the second in the ramp after it."""

    def falls(step: Step, doing: str) -> Outcome | None:
        if isinstance(step, Play) and doing == "synthetic kobe, beta = 0.64":
            signals = moved(step.volts)[: step.volts.size // 2]
            signals[-2000:, U1] += 0.1
            return Fallen(signals)
        return Fallen() if isinstance(step, RampOut) and doing == "synthetic parkfield, beta = 0.64" else None

    steps, points = played_through(stored(), ASKED, falls)
    plays = [step.volts for step in steps if isinstance(step, Play)]
    # one pass is enough for a table that is exactly as identified: pass and test of two records, then the spring
    assert len(plays) == 6
    rest = np.zeros(4000)
    for learned, bare, coupled in ((plays[0], plays[1], plays[4]), (plays[2], plays[3], plays[5])):
        np.testing.assert_array_equal(bare, np.concatenate((learned, rest)))
        np.testing.assert_array_equal(coupled, bare)
    mounted = next(
        k for k, step in enumerate(steps) if isinstance(step, OperatorAction) and step.work is OperatorTask.MOUNT_SPRING
    )
    done = [step for step in steps[mounted:] if not isinstance(step, Publish)]
    kinds = [type(step) for step in done]
    assert kinds == [OperatorAction, *[Arm, Play, RampOut, OperatorAction] * 2]
    assert [done[3], done[7]] == [RampOut(fast=True), RampOut(fast=False)]
    assert [step.work for step in done if isinstance(step, OperatorAction)][1:] == [OperatorTask.STAND_BLOCK_UP] * 2
    assert [(point.record, point.status) for point in points] == [
        ("synthetic kobe", "overturned"),
        ("synthetic parkfield", "overturned"),
    ]
    shares = [step.event.fraction for step in steps if isinstance(step, Publish) and isinstance(step.event, Progress)]
    # after each pass, each bare test and each record with the spring
    assert len(shares) == 6
    assert shares == sorted(shares)
    assert (shares[0] > 0.0, shares[-1]) == (True, pytest.approx(1.0))


def test_a_fall_without_a_block_ends_the_campaign(stored: Callable[..., BenchConfiguration]) -> None:
    def falls(step: Step, doing: str) -> Outcome | None:
        return Fallen() if isinstance(step, Play) and "pass 1" in doing else None

    with pytest.raises(RigError, match="the block was removed"):
        played_through(stored(), ONE, falls)


@pytest.mark.parametrize(("gain", "status"), [(0.97, "measured"), (0.9, "not played")])
def test_a_correction_beyond_a_limit_keeps_a_good_drive_and_tells_the_truth(
    stored: Callable[..., BenchConfiguration], gain: float, status: str
) -> None:
    configuration = stored()
    (shaking,) = shakings(ONE, configuration)
    first = float(np.abs(shaking.target.acceleration).max()) / GAIN
    # the drive passes with its margin of 10 %, no correction does
    tight = configuration.limits.model_copy(update={"drive_voltage": 1.1 * 1.01 * first})
    limited = configuration.model_copy(update={"limits": tight})

    def weak(step: Step, _: str) -> Outcome | None:
        return Played(moved(step.volts, gain * GAIN), step.volts) if isinstance(step, Play) else None

    steps, (point,) = played_through(limited, ONE, weak)
    assert point.status == status
    assert "drive_voltage" in point.reason
    assert "within every limit" not in point.reason
    assert f"error of {100.0 * (1.0 - gain):.0f}." in point.reason
    plays = [step.volts for step in steps if isinstance(step, Play)]
    assert len(plays) == (3 if status == "measured" else 1)
    for volts in plays[1:]:
        np.testing.assert_array_equal(volts[: plays[0].size], plays[0])


@pytest.mark.parametrize("lost_passes", [1, 2])
def test_a_lost_sample_costs_a_pass_and_not_the_record(
    stored: Callable[..., BenchConfiguration], lost_passes: int
) -> None:
    left = lost_passes

    def loses(step: Step, _: str) -> Outcome | None:
        nonlocal left
        if not isinstance(step, Play) or left == 0:
            return None
        left -= 1
        signals = moved(step.volts)
        signals[1000:1003, ACCELERATION] = np.nan
        return Played(signals, step.volts)

    steps, (point,) = played_through(stored(), ONE, loses)
    plays = [step.volts for step in steps if isinstance(step, Play)]
    np.testing.assert_array_equal(plays[0], plays[1])
    assert (len(plays), point.status) == ((4, "measured") if lost_passes == 1 else (2, "not played"))
    text = "samples of the table's motion were missing in both attempts at the pass (3 in"
    assert lost_passes == 1 or text in point.reason


@pytest.mark.parametrize(("low", "high"), [(0.8, 80.0), (0.5, 49.0)])
def test_a_model_with_too_narrow_a_band_is_refused(
    stored: Callable[..., BenchConfiguration], low: float, high: float
) -> None:
    """A record between 1.5 and 25 Hz needs the table from 0.75 to 50 Hz."""
    whole = table()
    kept = [k for k, f in enumerate(whole.frequency) if low <= f <= high]
    names = ("frequency", "real", "imaginary", "uncertainty", "distortion", "coherence", "noise")
    narrow = {name: tuple(getattr(whole, name)[k] for k in kept) for name in names}
    with pytest.raises(InvalidInput, match=r"needs 0\.75 to 50 Hz"):
        stored_table(ONE, stored(**narrow))


def test_a_model_that_covers_the_band_exactly_is_accepted(stored: Callable[..., BenchConfiguration]) -> None:
    """The lowest line is a multiple of the resolution, 7 times 0.1 Hz, which is 0.7000000000000001."""
    lines = tuple((np.arange(7, 801) * 0.1).tolist())
    assert lines[0] > 0.7
    names = ("real", "imaginary", "uncertainty", "distortion", "coherence", "noise")
    ones = dict.fromkeys(names, (1.0,) * len(lines))
    asked = ONE.model_copy(update={"table_band": "1.4:25"})
    assert stored_table(asked, stored(frequency=lines, **ones)) is not None


def test_a_model_of_something_else_than_the_bare_frame_is_told(stored: Callable[..., BenchConfiguration]) -> None:
    other = stored(specimen="block with the spring of beta = 0.97")
    (said,) = EarthquakeCampaign(ONE, other).forecast.warnings
    assert "'block with the spring of beta = 0.97' on the table" in said
    Path(other.table_model or "").unlink()
    configuration = stored()
    assert table_warnings(ONE, configuration, stored_table(ONE, configuration)) == ()


def test_a_mode_below_the_band_is_told() -> None:
    """The paper's frame has its first mode at 1.006 Hz; 1.6 times that is where a record's band may begin."""
    for low, told in ((1.6, 0), (1.62, 1)):
        found = table_warnings(ONE.model_copy(update={"table_band": f"{low}:25"}), BenchConfiguration(), None)
        assert len(found) == told
        assert all("first mode at 1.01 Hz is below" in warning for warning in found)


def test_the_identification_is_planned_beforehand_down_to_any_band() -> None:
    def reaching(low: float) -> tuple[EarthquakeParameters, BenchConfiguration]:
        shaker = Shaker(band_low=low)
        simulated = Simulation(bench=VirtualBenchParameters(shaker=shaker))
        return ONE.model_copy(update={"table_band": f"{low:g}:25"}), BenchConfiguration(simulation=simulated)

    asked, low = reaching(0.4)
    EarthquakeCampaign(asked, low)
    wanted = identification(asked, low)
    f = grid(wanted, low, low.specimen.bare()).frequency
    assert f[0] <= 0.2
    assert np.sum((f >= 0.2) & (f < 0.4)) >= 4
    assert wanted.period > 8.0
    assert identification(ONE, low).period == 8.0
    with pytest.raises(InvalidInput, match=r"from 0\.0667 Hz"):
        EarthquakeCampaign(*reaching(0.05))


def test_the_forecast_holds_the_identification_and_what_was_made_of_each_record(
    stored: Callable[..., BenchConfiguration],
) -> None:
    configuration = BenchConfiguration()
    campaign = EarthquakeCampaign(ONE, configuration)
    found, known = campaign.forecast, EarthquakeCampaign(ONE, stored()).forecast
    assert found.stages[0].name == "the identification of the table"
    assert [stage.name for stage in found.stages[1:]] == [stage.name for stage in known.stages]
    longer = campaign.table.duration
    assert (found.duration or 0.0) - (known.duration or 0.0) == pytest.approx(longer)
    assert longer > 3 * 3 * 8.0
    (note,) = found.notes
    assert note.startswith("synthetic kobe: ")
    assert all(step in note for step in campaign.shakings[0].prepared.steps)


def test_an_identification_counts_in_the_campaigns_progress() -> None:
    configuration = BenchConfiguration()
    source = TableSource.of(ONE, configuration, None)
    pace = Pace(ONE, shakings(ONE, configuration), source.duration)
    plan = table_model(source, configuration, pace)
    step = next(plan)
    while not isinstance(step, Play):
        step = plan.send(Done())
    assert step.watch is not None
    told = step.watch(np.zeros((4000, 6)))
    assert isinstance(told, Progress)
    assert told.fraction == pytest.approx(2.0 / pace.total)


def test_the_spectrum_is_asked_for_at_the_periods_of_the_frame_too(
    stored: Callable[..., BenchConfiguration], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The modes of the paper's frame lie at 6.3 and 16.3 rad/s."""
    asked = list[ReplicationParameters]()

    def refuse(_: object, __: object, ___: object, parameters: ReplicationParameters, *____: object) -> None:
        asked.append(parameters)
        raise InvalidInput("target", "any", "not today")

    monkeypatch.setattr("protocols.earthquake.plan.replicate", refuse)
    _, (point,) = played_through(stored(), ONE.model_copy(update={"spectrum_tolerance": 0.02}), lambda *_: None)
    assert point.status == "not played"
    assert asked[0].spectrum_tolerance == 0.02
    assert asked[0].spectrum_periods == pytest.approx((2.0 * np.pi / 6.3, 2.0 * np.pi / 16.3), rel=0.01)
