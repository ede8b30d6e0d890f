"""A motion fed piece by piece: bit for bit the one call's, whatever the pieces; dense output; what ends it."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim.errors import InvalidInput
from sim.excitation import ROW, SampledRecord
from sim.rocking import Motion, State, Status, simulate
from sim.specimen import Block, Specimen
from sim.streaming import Stream
from tests.sim.runs import A_S

COUPLED, DT = Specimen(beta=0.64, block=Block(restitution_factor=0.9)), 0.005
T = DT * np.arange(1600)
SHAKE = np.where(T < 5.0, 1.9 * A_S * np.sin(17.0 * T) * np.sin(np.pi / 5.0 * T) ** 2, 0.0)
"""Rest, uplift, rocking and rest again: every kind of phase, every event but overturning."""


def outcome(motion: Motion) -> tuple[object, ...]:
    """All that a run says of itself, to compare bit for bit."""
    return motion.status, motion.end_time, motion.end, motion.peaks, motion.impacts, motion.steps


def fed(
    values: NDArray[np.float64], cuts: list[int], **options: object
) -> tuple[tuple[object, ...], NDArray[np.float64]]:
    stream = Stream(COUPLED, DT, **options)  # pyright: ignore[reportArgumentType]
    rows = [stream.feed(values[a:b]) for a, b in pairwise([0, *sorted(cuts), values.size])]
    return outcome(stream.motion()), np.concatenate(rows)


def test_the_shake_goes_through_every_phase() -> None:
    motion = simulate(COUPLED, SampledRecord(SHAKE, DT), sample_times=T)
    assert motion.status is Status.COMPLETED
    assert motion.samples is not None
    assert motion.impacts > 10
    still = motion.samples[:, 4] == 0.0
    assert np.count_nonzero(np.diff(still.astype(int))) >= 2  # rest, rocking, and rest again


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, SHAKE.size), max_size=12), st.sampled_from([0, 1, 3]), st.booleans())
def test_how_the_samples_are_cut_makes_no_difference(cuts: list[int], divisions: int, held: bool) -> None:
    whole, rows = fed(SHAKE, [], divisions=divisions, held=held)
    cut, pieces = fed(SHAKE, cuts, divisions=divisions, held=held)
    assert cut == whole
    assert (pieces == rows).all()
    assert len(rows) == divisions * (SHAKE.size if held else SHAKE.size - 1)


@pytest.mark.parametrize("held", [True, False])
def test_one_sample_at_a_time(held: bool) -> None:
    whole, rows = fed(SHAKE, [], held=held)
    cut, pieces = fed(SHAKE, list(range(SHAKE.size)), held=held)
    assert cut == whole
    assert (pieces == rows).all()


def test_a_stream_is_the_simulation_of_its_record() -> None:
    motion = simulate(COUPLED, SampledRecord(SHAKE, DT), sample_times=T[1:])
    whole, rows = fed(SHAKE, [17, 900])
    assert whole == outcome(motion)
    assert motion.samples is not None
    assert (rows == motion.samples).all()


def test_output_between_coarse_updates_of_the_drive() -> None:
    coarse, _ = fed(SHAKE, [])
    dense, rows = fed(SHAKE, [333], divisions=20)
    assert dense == coarse
    times = (np.arange(20 * (SHAKE.size - 1)) + 1) * (DT / 20)
    motion = simulate(COUPLED, SampledRecord(SHAKE, DT), sample_times=np.minimum(times, T[-1]))
    assert motion.samples is not None
    # across an impact omega jumps: the two clocks may disagree by rounding about which side a sample is on
    assert np.abs(rows[:, :5] - motion.samples[:, :5]).max() < 1e-11
    # and finer straight pieces of the same lines are the same motion
    fine = Stream(COUPLED, DT / 20)
    other = fine.feed(np.interp(np.arange(20 * (SHAKE.size - 1) + 1) / 20, np.arange(SHAKE.size), SHAKE))
    assert np.abs(rows[:, :2] - other[:, :2]).max() < 1e-9


def test_held_values_are_steps() -> None:
    rows = np.zeros((SHAKE.size, ROW))
    rows[:, 0], rows[:, 8] = DT, SHAKE

    class Steps:
        duration = SHAKE.size * DT

        def packed(self) -> NDArray[np.float64]:
            return rows

    motion = simulate(COUPLED, Steps())
    whole, _ = fed(SHAKE, [], held=True)
    assert whole == outcome(motion)
    assert motion.impacts > 10


def test_waiting_before_the_shake_changes_nothing_but_the_time() -> None:
    _, early = fed(SHAKE, [])
    _, late = fed(np.concatenate((np.zeros(777), SHAKE)), [])
    assert not late[:777].any()
    # SHAKE begins with 0: one more straight line at rest
    assert (late[777:] == early).all()


def test_peaks_run_along_and_may_start_later() -> None:
    stream, seen = Stream(COUPLED, DT), 0.0
    for a, b in pairwise(range(0, SHAKE.size + 1, 200)):
        rows = stream.feed(SHAKE[a:b])
        seen = max(seen, float(np.abs(rows[:, 4]).max()))
        assert stream.motion().peaks.theta >= seen
    late = Stream(COUPLED, DT, peaks_from=6.0)
    late.feed(SHAKE)
    assert late.motion().peaks == simulate(COUPLED, SampledRecord(SHAKE, DT), peaks_from=6.0).peaks
    assert late.time == pytest.approx(T[-1], abs=1e-12)


def test_overturning_ends_the_stream_with_its_time_and_side() -> None:
    push = np.full(2000, -2.0)
    one = simulate(COUPLED, SampledRecord(push, DT))
    stream = Stream(COUPLED, DT, divisions=4)
    rows = np.concatenate([stream.feed(push[a : a + 50]) for a in range(0, 2000, 50)])
    assert stream.status is one.status is Status.OVERTURNED_B
    assert stream.time == one.end_time
    assert stream.state == one.end
    assert len(rows) == int(one.end_time / (DT / 4))
    assert stream.feed(push).shape == (0, 6)
    assert stream.time == one.end_time


def test_memory_does_not_grow_with_duration() -> None:
    def greatest(blocks: int) -> int:
        stream = Stream(COUPLED, DT)
        stream.feed(SHAKE[:400])
        tracemalloc.start()
        for _ in range(blocks):
            stream.feed(SHAKE[400:800])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    greatest(2)
    assert greatest(200) < 1.1 * greatest(10)


def test_steps_grow_linearly_with_duration() -> None:
    counts: list[int] = []
    stream = Stream(COUPLED, DT)
    for _ in range(4):
        stream.feed(SHAKE)
        counts.append(stream.motion().steps)
    assert np.diff(counts) == pytest.approx(counts[0], rel=0.05)


@pytest.mark.parametrize(
    ("item", "dt", "options"),
    [
        ("dt", 0.0, {}),
        ("dt", float("nan"), {}),
        ("dt", float("inf"), {}),
        ("divisions", DT, {"divisions": -1}),
        ("peaks_from", DT, {"peaks_from": float("nan")}),
        ("tolerance", DT, {"tolerance": 0.0}),
        ("overturning_angle", DT, {"overturning_angle": float("nan")}),
        ("theta", DT, {"state": State(theta=2.0)}),
    ],
)
def test_bad_options_are_refused_by_name(item: str, dt: float, options: dict[str, object]) -> None:
    with pytest.raises(InvalidInput, match=f"^{item} = "):
        Stream(**{"specimen": COUPLED, "dt": dt, **options})  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("values", [[0.0, float("nan")], [[0.0], [1.0]], [float("inf")]])
def test_bad_samples_are_refused_and_nothing_has_moved(values: list[float]) -> None:
    stream = Stream(COUPLED, DT)
    stream.feed(SHAKE[:100])
    before = stream.state, stream.time
    with pytest.raises(InvalidInput, match=r"^acceleration = "):
        stream.feed(values)
    assert (stream.state, stream.time) == before
    stream.feed(SHAKE[100:])
    assert outcome(stream.motion()) == fed(SHAKE, [])[0]
