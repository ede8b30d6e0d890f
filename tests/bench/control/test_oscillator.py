"""The oscillator: continuous in phase, amplitude and value; the same in blocks of any size."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.control.oscillator import DriveCalibration, Oscillator, Segment, program, sweeps

RATE = 1000.0
LEGS = (Segment(2.0, 1.2, 22.0), Segment(3.0, 1.2, 16.0), Segment(0.5, 0.4, 16.0))


def _oscillator() -> Oscillator:
    oscillator = Oscillator(RATE)
    oscillator.use(DriveCalibration((10.0, 30.0), (2.0, 2.0)))
    for sweep in sweeps(LEGS, oscillator.amplitude, oscillator.omega):
        oscillator.follow(sweep)
    return oscillator


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 900), min_size=1, max_size=12))
def test_block_sizes_do_not_matter(sizes: list[int]) -> None:
    whole = _oscillator().next(sum(sizes))
    oscillator = _oscillator()
    pieces = np.concatenate([oscillator.next(size) for size in sizes])
    np.testing.assert_allclose(pieces, whole, rtol=0, atol=1e-12)


def test_the_drive_is_the_base_motion_that_the_model_integrates_over_the_gain() -> None:
    volts = _oscillator().next(5500)
    rows = program(LEGS).packed()
    t = np.arange(1, 5501) / RATE
    edges = np.concatenate(([0.0], np.cumsum(rows[:, 0])))
    segment = np.minimum(np.searchsorted(edges, t, side="left") - 1, len(rows) - 1)
    local = t - edges[segment]
    amplitude = sum(rows[segment, 1 + power] * local**power for power in range(4))
    phase = rows[segment, 5] + rows[segment, 6] * local + 0.5 * rows[segment, 7] * local**2
    np.testing.assert_allclose(volts, amplitude * np.sin(phase) / 2.0, atol=1e-9)


def test_after_the_last_leg_the_sine_is_held() -> None:
    oscillator = _oscillator()
    oscillator.next(5500)
    held = oscillator.next(4000)
    t = np.arange(4000) / RATE
    basis = np.stack((np.cos(16.0 * t), np.sin(16.0 * t)), axis=1)
    fit, residual, *_ = np.linalg.lstsq(basis, held, rcond=None)
    assert np.hypot(*fit) == pytest.approx(0.2, rel=1e-9)
    assert residual[0] < 1e-18


def test_a_trim_changes_the_amplitude_without_a_jump() -> None:
    oscillator = _oscillator()
    before = oscillator.next(6000)
    oscillator.trim((1.1,))
    after = oscillator.next(2000)
    steps = np.abs(np.diff(np.concatenate((before[-10:], after))))
    assert steps.max() < 0.22 * 16.0 / RATE * 1.1
    assert np.abs(after[-500:]).max() == pytest.approx(0.22, rel=1e-3)


def _held(oscillator: Oscillator, n: int = 4000) -> np.ndarray:
    """Complex amplitudes of harmonics 1 to 4 of the next samples; the phase is zero one sample before them."""
    volts = oscillator.next(n)
    phase = 16.0 * np.arange(1, n + 1) / RATE
    orders = np.arange(1, 5)
    basis = np.concatenate((np.sin(phase[:, None] * orders), np.cos(phase[:, None] * orders)), axis=1)
    fit = np.linalg.lstsq(basis, volts, rcond=None)[0]
    return fit[:4] + 1j * fit[4:]


def test_harmonics_are_played_in_the_fundamentals_phase_through_the_response_at_their_own_frequency() -> None:
    calibration = DriveCalibration((10.0, 20.0, 40.0), (2.0j, 1.0 + 1.0j, 4.0))
    oscillator = Oscillator(RATE)
    oscillator.use(calibration)
    oscillator.follow(sweeps((Segment(1.0, 3.0, 16.0),), 0.0, 16.0)[0])
    oscillator.next(1000)
    oscillator.trim((0.9 + 0.1j, 0.05, 0.02j))
    oscillator.next(400)
    turn = np.exp(16j * 1.4)  # the sweep begins at phase 0, and 1.4 s of 16 rad/s have gone by
    # linear in between, real and imaginary part apart: at 16 rad/s 0.4 (2j) + 0.6 (1 + 1j), and so on
    response = np.array([0.6 + 1.4j, 0.4 * (1.0 + 1.0j) + 0.6 * 4.0, 4.0])
    expected = 3.0 * np.array([0.9 + 0.1j, 0.05, 0.02j]) / response * turn ** np.arange(1, 4)
    np.testing.assert_allclose(_held(oscillator), [*expected, 0.0], atol=1e-9)


def test_a_trim_is_given_up_when_the_drive_moves_on() -> None:
    oscillator = _oscillator()
    oscillator.next(5500)
    oscillator.trim((1.1, 0.1, 0.1j))
    oscillator.next(400)
    assert np.abs(_held(oscillator)) == pytest.approx([0.22, 0.02, 0.02, 0.0], abs=1e-9)
    oscillator.follow(sweeps((Segment(1.0, 0.4, 16.0),), oscillator.amplitude, oscillator.omega)[0])
    before = oscillator.next(1000)
    assert np.abs(_held(oscillator)) == pytest.approx([0.2, 0.0, 0.0, 0.0], abs=1e-9)
    assert np.abs(np.diff(before)).max() < 2.0 * 0.22 * 16.0 / RATE


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 300), min_size=1, max_size=8))
def test_a_trim_does_not_depend_on_the_size_of_the_blocks(sizes: list[int]) -> None:
    pieces: list[np.ndarray] = []
    for cut in ([sum(sizes)], sizes):
        oscillator = _oscillator()
        oscillator.next(5500)
        oscillator.trim((1.1, 0.1 + 0.2j))
        pieces.append(np.concatenate([oscillator.next(size) for size in cut]))
    np.testing.assert_allclose(pieces[1], pieces[0], rtol=0, atol=1e-12)


def test_moving_before_calibration_is_refused() -> None:
    oscillator = Oscillator(RATE)
    oscillator.follow(sweeps((Segment(1.0, 1.0, 16.0),), 0.0, 16.0)[0])
    with pytest.raises(RuntimeError, match="drive must be calibrated"):
        oscillator.next(10)


def test_amplitudes_of_a_held_sine_that_are_kept_are_those_of_the_formula_bit_for_bit() -> None:
    """They are computed again once calibration, amplitude, frequency or shares change."""
    oscillator, rate, n = Oscillator(2000.0), 2000.0, 200
    calibrations = (
        DriveCalibration((5.0, 20.0, 90.0), (1.0 + 0.3j, 2.0 - 0.1j, 0.7j)),
        DriveCalibration((5.0, 20.0, 90.0), (1.1 + 0.3j, 2.0 - 0.1j, 0.7j)),
    )
    oscillator.use(calibrations[0])
    oscillator.follow(sweeps((Segment(0.1, 1.3, 14.0),), 0.0, 14.0)[0])
    oscillator.next(200)
    oscillator.trim((1.0, 0.0, 0.02 - 0.03j, 0.0, 0.01j))
    settled = round(2.0 * np.pi / 14.0 * rate)
    phase = 0.1 * 14.0
    for calibration in (*calibrations, *calibrations):
        oscillator.use(calibration)
        oscillator.next(settled)
        phase = (phase + 14.0 / rate * settled) % (2.0 * np.pi)
        for _ in range(2):
            turn = np.exp(1j * (phase + 14.0 / rate * np.arange(1, n + 1, dtype=np.float64)))
            power, expected = np.ones_like(turn), np.zeros(n)
            for k, share in enumerate((1.0, 0.0, 0.02 - 0.03j, 0.0, 0.01j), 1):
                power = power * turn
                if share:
                    factor = np.array(1.3) * np.array([complex(share)]) / calibration.at(k * np.array(14.0))
                    expected += np.imag(factor * power)
            np.testing.assert_array_equal(oscillator.next(n), expected)
            phase = (phase + 14.0 / rate * n) % (2.0 * np.pi)


def test_a_held_sine_looks_its_response_up_once() -> None:
    class Counted(DriveCalibration):
        def at(self, omega: np.ndarray) -> np.ndarray:
            looked_up.append(1)
            return super().at(omega)

    looked_up: list[int] = []
    oscillator = Oscillator(2000.0)
    oscillator.use(Counted((1.0,), (1.0,)))
    oscillator.follow(sweeps((Segment(0.1, 1.3, 14.0),), 0.0, 14.0)[0])
    oscillator.next(200)
    looked_up.clear()
    for _ in range(50):
        oscillator.next(200)
    assert len(looked_up) == 1


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 900), min_size=1, max_size=8))
def test_a_change_begins_at_its_sample_in_blocks_of_any_size(sizes: list[int]) -> None:
    def changed() -> Oscillator:
        oscillator = _oscillator()
        oscillator.next(6000)
        oscillator.trim((1.2,), blend=0.5, wait=700)
        return oscillator

    oscillator, held = changed(), _oscillator()
    held.next(6000)
    pieces = np.concatenate([oscillator.next(size) for size in (*sizes, 2000)])
    np.testing.assert_allclose(pieces, changed().next(pieces.size), rtol=0, atol=1e-12)
    unchanged = held.next(pieces.size)
    np.testing.assert_allclose(pieces[:700], unchanged[:700], rtol=0, atol=1e-12)
    half = round(np.pi / 16.0 * RATE)
    np.testing.assert_allclose(pieces[700 + half + 1 :], 1.2 * unchanged[700 + half + 1 :], rtol=0, atol=1e-12)


def test_a_later_command_replaces_changes_that_have_not_begun() -> None:
    oscillator, plain = _oscillator(), _oscillator()
    oscillator.next(6000)
    plain.next(6000)
    oscillator.trim((1.1,), wait=300)
    oscillator.trim((1.4,), wait=900)
    oscillator.trim((1.0,), wait=0)
    np.testing.assert_array_equal(oscillator.next(2000), plain.next(2000))


COMMANDS = {
    "calibration": lambda oscillator: oscillator.use(DriveCalibration.flat(3.0 + 1.0j)),
    "harmonics": lambda oscillator: oscillator.trim((1.0, 0.1j), blend=0.2),
    "later harmonics": lambda oscillator: oscillator.trim((1.0, 0.1j), blend=0.2, wait=150),
    "sweep": lambda oscillator: oscillator.follow(sweeps([Segment(0.3, 0.6, 20.0)], 0.4, 16.0)[0]),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_acts_on_the_next_block_although_blocks_are_computed_together(command: str) -> None:
    """Of two oscillators, one computes every block by itself, since the next one has another size."""
    together, single = _oscillator(), _oscillator()
    for oscillator in (together, single):
        oscillator.next(5500)
    expected, pieces = list[np.ndarray](), list[np.ndarray]()
    for block in range(20):
        if block == 3:
            COMMANDS[command](together)
            COMMANDS[command](single)
        pieces.append(together.next(100))
        expected += [single.next(60), single.next(40)]
    np.testing.assert_allclose(np.concatenate(pieces), np.concatenate(expected), rtol=0, atol=1e-12)
    unchanged = _oscillator()
    unchanged.next(5500)
    assert np.abs(np.concatenate(pieces) - unchanged.next(2000)).max() > 1e-2
