"""Blocks judged by their extremes alone: the same decisions, sample for sample, as with every sample compared."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.analysis.signals import SignalMap
from bench.guard.conversion import Conversion, Extremes
from bench.guard.guard import Guard
from bench.guard.limits import Debounce, Limits, Persistence, Ramps, Violation, Warnings
from bench.guard.motion import ChannelLimit, MotionWatch
from bench.guard.quantities import WatchedQuantities
from bench.guard.sensors import SensorWatch
from bench.guard.shaker import ShakerModel
from bench.testing.loopback import LoopbackRig
from drivers.rig import Channel
from tests.calls import calls

RATE = 1000.0
INVALID = -32768
NAMES = ("table_displacement", "table_acceleration", "laser_1", "laser_2")
FURTHER = ("top", "base")
MEASURED = ("table_force", "coil_current")


def _channel(name: str, scale: float, higher: tuple[float, ...] = ()) -> Channel:
    return Channel(name, "displacement", "m", scale, 0.0, (-32767, 32767), "made", higher, {INVALID: "no target"})


def _channels(names: tuple[str, ...], scale: float = 1e-3, higher: tuple[float, ...] = ()) -> tuple[Channel, ...]:
    return tuple(_channel(name, scale, higher) for name in names)


def _limits(level: float, debounce: float, heating_time: float) -> Limits:
    """Every limit at `level`, every warning at 0.8 of it."""
    names = ("displacement", "velocity", "acceleration", "force", "current", "heating", "laser_range", "drift")
    return Limits(
        **dict.fromkeys(names, level),  # type: ignore[arg-type]
        heating_time=heating_time,
        sensor_loss=0.05,
        stuck=0.1,
        warning=Warnings(**dict.fromkeys(names, 0.8)),
        debounce=Debounce(**dict.fromkeys(names, debounce)),
    )


@dataclass(frozen=True)
class Bench:
    """A bench and the blocks of counts that it shows, with the drive played meanwhile."""

    channels: tuple[Channel, ...]
    shaker: ShakerModel | None
    limits: Limits
    further: tuple[ChannelLimit, ...]
    tared: int
    blocks: list[np.ndarray]
    drives: list[np.ndarray]


def _shape(draw: st.DrawFn, n: int, columns: int, level: int) -> np.ndarray:
    """A block of counts around a share of the limit: still, noisy, a jump, spikes, missing samples."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    share = draw(st.sampled_from((0.0, 0.1, 0.5, 0.78, 0.8, 0.82, 0.98, 1.0, 1.02, 2.0)))
    kind = draw(st.sampled_from(("still", "noise", "sine", "edge", "spike", "missing", "one missing")))
    top = share * level
    if kind == "still":
        found = np.full((n, columns), top)
    elif kind == "sine":
        found = top * np.sin(0.3 * np.arange(n)[:, None] + random.uniform(0.0, 6.0, columns))
    else:
        found = top * random.uniform(-1.0, 1.0, (n, columns))
    if kind == "edge":
        found[-1] = random.choice((-1, 1), columns) * top
    if kind == "spike":
        found[random.integers(n), random.integers(columns)] = 2.0 * level
    counts = np.clip(np.rint(found), -32767, 32767).astype(np.int16)
    if kind == "missing":
        counts[random.random((n, columns)) < 0.5] = INVALID
    if kind == "one missing":
        counts[random.integers(n), random.integers(columns)] = INVALID
    return counts


@st.composite
def benches(draw: st.DrawFn) -> Bench:
    further = draw(st.booleans())
    names = NAMES + (FURTHER if further else ()) + draw(st.sampled_from(((), MEASURED, MEASURED[:1], MEASURED[1:])))
    higher = draw(st.sampled_from(((), (1e-9,), (-2e-9, 1e-14))))
    channels = _channels(names, draw(st.sampled_from((1e-3, -1e-3))), higher)
    level = draw(st.sampled_from((1.0, 3.0)))
    limits = _limits(level, draw(st.sampled_from((0.0, 0.001, 0.003, 0.05))), draw(st.sampled_from((0.01, 1.0, 60.0))))
    shaker = draw(st.sampled_from((None, ShakerModel(0.5, 0.4, 1.0), ShakerModel(1.0, 0.0, 0.7))))
    # a block is longer or shorter than the window of the velocity
    sizes = draw(st.lists(st.sampled_from((1, 2, 7, 20, 21, 60)), min_size=1, max_size=25))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return Bench(
        channels,
        shaker,
        limits,
        (ChannelLimit("top", "m", 6, level, 0.8, 0.002), ChannelLimit("base", "m", 7, level, 1.0, 0.0))
        if further
        else (),
        draw(st.integers(0, 10)),
        [_shape(draw, n, len(channels), round(1000 * level)) for n in sizes],
        [draw(st.sampled_from((0.0, 0.01, 4.0))) * random.uniform(-1.0, 1.0, n) for n in sizes],
    )


def _decisions(bench: Bench, *, short: bool) -> list[tuple[list[Violation], list[Violation], list[Violation]]]:
    """Limits exceeded, warnings and failures of sensors, block by block."""
    conversion = Conversion(bench.channels)
    signals = SignalMap(bench.channels, "table")
    motion = MotionWatch(bench.channels, RATE, bench.limits, bench.shaker, bench.further)
    sensors = SensorWatch(bench.channels, RATE, bench.limits)
    found, first = [], 0
    for number, (counts, drive) in enumerate(zip(bench.blocks, bench.drives, strict=True)):
        values, extremes = conversion.of(counts)
        known = extremes if short else None
        if number == bench.tared:
            signals.tare(values)
            motion.drift_watched = True
        exceeded, near = motion.check(first, values, signals.of(values), known)
        found.append((exceeded, near, sensors.check(first, counts, values, drive, known)))
        first += len(counts)
    return found


@settings(max_examples=60, deadline=None)
@given(benches())
def test_decisions_are_those_of_the_comparison_of_every_sample(bench: Bench) -> None:
    assert _decisions(bench, short=True) == _decisions(bench, short=False)


@pytest.mark.soak
@settings(max_examples=2000, deadline=None)
@given(benches())
def test_decisions_are_those_of_the_comparison_of_every_sample_on_many_benches(bench: Bench) -> None:
    assert _decisions(bench, short=True) == _decisions(bench, short=False)


@settings(max_examples=60, deadline=None)
@given(benches())
def test_bounds_are_never_below_the_magnitudes(bench: Bench) -> None:
    conversion = Conversion(bench.channels)
    bounded, compared = (
        WatchedQuantities(bench.channels, RATE, bench.limits.heating_time, bench.shaker) for _ in range(2)
    )
    for counts in bench.blocks:
        values, extremes = conversion.of(counts)
        sizes = compared.of(values)
        if extremes is None:
            bounded.of(values)
            continue
        bounds = bounded.bounds(values, extremes)
        assert bounds.keys() == sizes.keys()
        for key, size in sizes.items():
            if key in ("current", "heating"):
                assert bounds[key] >= float(size.max())
            else:
                assert bounds[key] == float(size.max()), key
        bounded.skip(values, bounds)


def test_the_heating_of_blocks_passed_over_is_made_up_for_bit_for_bit() -> None:
    channels, shaker = _channels(NAMES), ShakerModel(0.5, 0.4, 1.0)
    random = np.random.default_rng(1)
    blocks = [random.integers(-900, 900, (50, 4)).astype(np.int16) for _ in range(300)]
    conversion = Conversion(channels)
    skipping, comparing = (WatchedQuantities(channels, RATE, 2.0, shaker) for _ in range(2))
    for number, counts in enumerate(blocks):
        values, extremes = conversion.of(counts)
        assert extremes is not None
        expected = comparing.of(values)
        if number % 97 == 96:
            np.testing.assert_array_equal(skipping.of(values)["heating"], expected["heating"])
        else:
            skipping.skip(values, skipping.bounds(values, extremes))


@settings(max_examples=40, deadline=None)
@given(benches())
def test_all_channels_at_once_have_the_values_of_each(bench: Bench) -> None:
    conversion = Conversion(bench.channels)
    for counts in bench.blocks:
        for given_ in (counts, np.asfortranarray(counts), counts.astype(np.int32)):
            values, extremes = conversion.of(given_)
            expected = np.stack([each.to_unit(counts[:, k]) for k, each in enumerate(bench.channels)], axis=1)
            np.testing.assert_array_equal(values, expected)
            if np.isnan(expected).any():
                assert extremes is None
            else:
                assert extremes == Extremes(expected.min(axis=0).tolist(), expected.max(axis=0).tolist())


def _refusal(volts: np.ndarray, command: float, limits: Limits) -> tuple[str, int] | None:
    """The comparison of every sample."""
    if not np.isfinite(volts).all():
        return "drive command", 0
    if np.abs(volts).max() > limits.drive_voltage:
        return "drive command", int(np.argmax(np.abs(volts)))
    change = np.abs(np.diff(volts, prepend=command))
    if change.max() > limits.drive_slew / RATE:
        return "drive slew", int(np.argmax(change))
    return None


_EDGES = (0.0, -0.0, 0.2, -0.2, 4.9, 5.0, -5.0, float(np.nextafter(5.0, 6.0)), np.nan, np.inf, -np.inf)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.lists(st.one_of(st.sampled_from(_EDGES), st.floats(-6.0, 6.0)), min_size=1, max_size=6), max_size=6))
def test_a_command_is_refused_as_by_the_comparison_of_every_sample(blocks: list[list[float]]) -> None:
    limits = Limits(drive_voltage=5.0, drive_slew=200.0)
    guard = Guard(LoopbackRig(), limits, Ramps(stop=1.0, abort=0.2))
    guard.arm()
    command = 0.0
    for block in blocks:
        volts = np.array(block)
        found = guard.refusal(volts)
        assert (None if found is None else (found.quantity, found.sample)) == _refusal(volts, command, limits)
        if found is not None:
            break
        guard.exchange(volts)
        command = float(volts[-1])


@pytest.mark.parametrize("shaker", [None, ShakerModel(20.0, 100.0, 20.0)])
def test_a_quiet_block_costs_few_calls(shaker: ShakerModel | None) -> None:
    """Operation counts hold on noisy machines, where times do not."""
    n = 100

    def noisy(volts: np.ndarray) -> np.ndarray:
        return 0.01 * volts + 0.001 * (np.arange(volts.size) % 2)

    rig = LoopbackRig(dict.fromkeys(NAMES, noisy))
    conversion, motion = Conversion(rig.channels), MotionWatch(rig.channels, RATE, Limits(), shaker)
    sensors, signals = SensorWatch(rig.channels, RATE, Limits()), SignalMap(rig.channels, "table")
    motion.drift_watched = True
    counts = [rig.respond(np.sin(0.01 * np.arange(k * n, (k + 1) * n))) for k in range(30)]
    short, full = [], []
    for number, each in enumerate(counts):
        values, extremes = conversion.of(each)
        assert extremes is not None
        made = signals.of(values)
        for counted, known in ((short, extremes), (full, None)):
            if number % 2 == (counted is short):
                continue
            on_motion = calls(partial(motion.check, number * n, values, made, known))
            drive = each[:, 0].astype(float)
            counted.append(on_motion + calls(partial(sensors.check, number * n, each, values, drive, known)))
    assert np.median(short) < 60
    assert np.median(short) < 0.4 * np.median(full)


def test_a_warned_limit_does_not_keep_later_blocks_from_the_short_way() -> None:
    """The count of a warning stays where it was once the warning is given."""
    channels = _channels(NAMES)
    motion = MotionWatch(channels, RATE, _limits(1.0, 0.002, 60.0))
    conversion, seen = Conversion(channels), []

    class Watched(Persistence):
        def first(self, bad: np.ndarray) -> int | None:
            seen.append(bad.size)
            return super().first(bad)

    motion._over["acceleration"] = Watched(2)
    warned = 0
    for number, level in enumerate((100, 900, 100, 100, 100)):
        counts = np.tile(np.array([[0, level, 0, 0], [1, level - 1, 1, 1]], dtype=np.int16), (10, 1))
        values, extremes = conversion.of(counts)
        warned += len(motion.check(20 * number, values, values, extremes)[1])
    assert (warned, len(seen)) == (1, 1)
