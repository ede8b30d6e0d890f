"""Traces are what the sensors saw: against motion that is made first, and then turned into what the sensors say."""

import numpy as np
import pytest

from bench.analysis.signals import SignalMap
from bench.app.display.buffers import Ring
from bench.app.ipc.broadcast import Reduction
from bench.app.ipc.messages import BIN, TRACES
from bench.events import Acquired
from drivers.rig import Block, Channel

RATE, N, BLOCK = 2000.0, 6000, 300
NOISE = 1e-6
"""Resolution of the displacement sensors [m]."""
CHANNELS = tuple(
    Channel(name, quantity, unit, scale, offset, (-2_000_000, 2_000_000), "made")
    for name, quantity, unit, scale, offset in (
        ("table_acceleration", "acceleration", "m/s2", 1e-4, 0.3),
        ("table_displacement", "displacement", "m", NOISE, 0.01),
        ("laser_1", "displacement", "m", NOISE, -0.02),
        ("laser_2", "displacement", "m", NOISE, 0.05),
    )
)


def _motion() -> tuple[np.ndarray, np.ndarray]:
    """The drive, and acceleration, displacement, u1 and u2, at rest for a second: other amplitudes and signs each."""
    time = np.arange(N) / RATE
    going = np.clip(time - 1.0, 0.0, None)
    sines = [a * np.sin(w * going) for a, w in ((1.3, 16.0), (0.004, 16.0), (0.003, 11.0), (-0.007, 23.0))]
    return 2.0 * np.sin(16.0 * going), np.column_stack(sines)


def _counts(motion: np.ndarray, reference: str) -> np.ndarray:
    """What the sensors say of it; lasers beside the table see it move too."""
    acceleration, table, u1, u2 = motion.T
    carried = table if reference == "ground" else 0.0
    seen = (acceleration, table, u1 + carried, u2 + carried)
    columns = [(values - c.offset) / c.scale for values, c in zip(seen, CHANNELS, strict=True)]
    return np.round(np.column_stack(columns)).astype(np.int32)


@pytest.mark.parametrize("reference", ["ground", "table"])
def test_traces_hold_the_extremes_of_the_motion_that_was_made(reference: str) -> None:
    drive, motion = _motion()
    counts = _counts(motion, reference)
    signals, reduction = SignalMap(CHANNELS, reference), Reduction(RATE)  # type: ignore[arg-type]
    values = np.column_stack([channel.to_unit(counts[:, k]) for k, channel in enumerate(CHANNELS)])
    signals.tare(values[:BLOCK])
    traces = [
        reduction(
            Acquired(
                1,
                Block(first, counts[first : first + BLOCK]),
                drive[first:][:BLOCK],
                signals.of(values[first : first + BLOCK]),
                time=4.0 + (first + BLOCK) / RATE,
            )
        )
        for first in range(0, N, BLOCK)
    ]
    acceleration, table, u1, u2 = motion.T
    expected = {
        "drive": drive, "acceleration": acceleration, "displacement": table, "u1": u1, "u2": u2, "drift": u2 - u1,
    }  # fmt: skip
    width = round(BIN * RATE)
    for column, name in enumerate(TRACES):
        bins = expected[name].reshape(-1, width)
        # two steps of each sensor that takes part
        close = 1e-4 if name == "acceleration" else 1e-6 if name == "drive" else 4 * NOISE
        for got, wanted in (("low", bins.min(axis=1)), ("high", bins.max(axis=1))):
            found = np.concatenate([getattr(each, got)[:, column] for each in traces])
            np.testing.assert_allclose(found, wanted, atol=close, rtol=1e-6, err_msg=f"{name}, {got}")
    assert [each.begin for each in traces] == pytest.approx(4.0 + np.arange(0, N, BLOCK) / RATE)
    assert {each.origin for each in traces} == {traces[0].begin}
    assert {each.step for each in traces} == {width / RATE}


@pytest.mark.parametrize(("rate", "block"), [(2000.0, 10), (2560.0, 256), (2048.0, 205), (1000.0, 5), (51200.0, 1)])
def test_bins_of_any_block_are_equally_spaced_without_gaps(rate: float, block: int) -> None:
    signals, reduction = SignalMap(CHANNELS, "ground"), Reduction(rate)
    values = np.sin(np.arange(20 * block))[:, None] * np.ones(len(CHANNELS))
    signals.tare(values[:block])
    ring = Ring(len(TRACES), 1000)
    for first in range(0, len(values), block):
        rows = values[first : first + block]
        counts = np.zeros(rows.shape, dtype=np.int32)
        time = (first + block) / rate
        event = Acquired(1, Block(first, counts), rows[:, 0], signals.of(rows), time=time)
        traces = reduction(event)
        assert traces.begin + traces.step * len(traces.low) == pytest.approx(time)
        np.testing.assert_allclose(traces.low[:, 0].min(), rows[:, 0].min(), rtol=1e-6)
        np.testing.assert_allclose(traces.high[:, 0].max(), rows[:, 0].max(), rtol=1e-6)
        ring.add(traces)
    time, low, _ = ring.newest_bins(1e3)
    assert np.isfinite(low).all()
    np.testing.assert_allclose(np.diff(time), time[1] - time[0])
