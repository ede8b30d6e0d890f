"""What a table answers, and the controller of its sine, on tables in closed form."""

from math import tau

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from bench.analysis.cycles import HARMONICS, Cycle, fit_cycle
from bench.analysis.signals import ACCELERATION, SIGNALS
from bench.control.oscillator import DriveCalibration
from bench.control.sine import GAIN, LARGEST_STEP, Sine, SineControl, SineResponse, Tolerance
from protocols.harmonic.protocol import HarmonicParameters

AIMED = Tolerance(amplitude=0.0005, phase=np.radians(0.05), distortion=0.005)
UPDATES = 6
Complex = NDArray[np.complex128]


def _shares(*values: complex) -> Complex:
    shares = np.zeros(HARMONICS, dtype=np.complex128)
    shares[: len(values)] = values
    return shares


def _answer(played: Complex, achieved: Complex, doubt: float = 1e-5) -> SineResponse:
    return SineResponse(played, achieved, np.full(HARMONICS, doubt))


def _cycles(played: Complex, achieved: Complex, sine: Sine, turn: float, noise: float = 0.0) -> list[Cycle]:
    """Four cycles of signals with these shares, as a cycle analyser would fit them; `turn` is phi at its zero [rad]."""
    random = np.random.default_rng(3)
    made: list[Cycle] = []
    for index in range(4):
        phase = tau * (index + np.arange(600) / 600.0)
        values = np.zeros((600, len(SIGNALS) + 1))
        orders = np.arange(1, HARMONICS + 1)
        turns = np.exp(1j * orders * (phase + turn)[:, None])
        response = np.array([sine.calibration.at(np.array(k * sine.omega)) for k in orders])
        values[:, ACCELERATION] = sine.amplitude * np.imag(turns @ achieved) + noise * random.standard_normal(600)
        values[:, -1] = sine.amplitude * np.imag(turns @ (played / response))
        cycle = fit_cycle(index, phase, values)
        assert cycle is not None
        made.append(cycle)
    return made


def test_an_answer_is_told_in_the_phase_of_the_oscillator() -> None:
    sine = Sine(16.0, 1.2, DriveCalibration((10.0, 160.0), (2.0 + 1.0j, 3.0j)))
    achieved = _shares(0.97 * np.exp(0.05j), 0.02, -0.01j)
    turn = sine.turn(_cycles(_shares(1.0), achieved, sine, 1.234)[0])
    assert turn == pytest.approx(np.exp(1.234j), abs=1e-12)
    played = _shares(1.1 + 0.1j, 0.03j)
    answer = SineResponse.of(_cycles(played, achieved, sine, 1.234), sine, turn)
    np.testing.assert_allclose(answer.played, played, atol=1e-12)
    np.testing.assert_allclose(answer.achieved, achieved, atol=1e-12)
    assert answer.amplitude_error == pytest.approx(-0.03, abs=1e-12)
    assert answer.phase_error == pytest.approx(0.05, abs=1e-12)
    assert answer.distortion == pytest.approx(np.hypot(0.02, 0.01) / 0.97, abs=1e-12)


def test_the_doubt_is_that_of_a_fitted_amplitude() -> None:
    sine = Sine(16.0, 2.0, DriveCalibration.flat(1.0))
    answer = SineResponse.of(_cycles(_shares(1.0), _shares(1.0), sine, 0.3, noise=0.1), sine, np.exp(0.3j))
    # two quadratures of sigma sqrt(2 / N) each, over the amplitude, of four cycles
    expected = np.sqrt(2.0) * 0.1 * np.sqrt(2.0 / 600.0) / 2.0 / np.sqrt(4.0)
    assert answer.uncertainty.min() == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("gain", [0.8, 1.25, np.exp(0.3j)])
def test_gains_that_were_misjudged_are_learned_and_the_error_is_gone_in_six_looks(gain: complex) -> None:
    gains, disturbance = np.full(HARMONICS, gain), _shares(0.02j, 0.01, 0.03 + 0.01j, 0.0, 0.02j)
    control, played, answers = SineControl(HARMONICS, AIMED), _shares(1.0), list[SineResponse]()
    for _ in range(UPDATES + 1):
        answers.append(_answer(played, gains * played + disturbance))
        found = control.next(answers[-1])
        if found is not None:
            assert np.abs(np.array(found) - played).max() <= LARGEST_STEP * (1.0 + 1e-12)
            played = np.array(found)
    assert AIMED.met(answers[-1])
    assert not AIMED.met(answers[0])
    np.testing.assert_allclose(control.gains[[0, 2, 4]], gain, rtol=1e-6)


def test_noise_is_not_taken_for_a_harmonic() -> None:
    control = SineControl(HARMONICS, AIMED)
    achieved = _shares(1.01, 0.004, 0.02)
    found = control.next(_answer(_shares(1.0), achieved, doubt=0.003))
    assert found is not None
    assert found[1] == 0.0
    assert found[2] == pytest.approx(-GAIN * 0.02)


def test_what_is_within_the_tolerance_is_left_alone() -> None:
    control = SineControl(HARMONICS, AIMED)
    assert control.next(_answer(_shares(1.0), _shares(1.0003, 0.003j))) is None
    for bad in (_shares(1.0006), _shares(np.exp(0.001j)), _shares(1.0, 0.0, 0.006)):
        assert control.next(_answer(_shares(1.0), bad)) is not None


def test_the_protocol_asks_for_every_harmonic_that_is_fitted_and_for_no_more() -> None:
    assert HarmonicParameters().harmonics == HARMONICS
    with pytest.raises(ValidationError, match="harmonics"):
        HarmonicParameters(harmonics=HARMONICS + 1)


def test_harmonics_above_the_highest_are_left_alone() -> None:
    found = SineControl(3, AIMED).next(_answer(_shares(1.0), _shares(1.0, 0.02, 0.02, 0.02)))
    assert found is not None
    assert len(found) == 3


def test_a_look_that_comes_before_the_step_has_gone_through_asks_for_the_same_again() -> None:
    control = SineControl(HARMONICS, AIMED)
    look = _answer(_shares(1.0), _shares(0.95, 0.0, 0.02))
    assert control.next(look) == control.next(look)


def test_a_motion_that_does_not_repeat_is_not_chased() -> None:
    random = np.random.default_rng(1)
    control, played, found = SineControl(HARMONICS, AIMED), _shares(1.0), list[Complex]()
    for _ in range(200):
        wander = 0.01 * random.standard_normal(2 * HARMONICS).view(np.complex128)
        shares = control.next(_answer(played, played + _shares(-0.02) + wander, doubt=0.005))
        played = played if shares is None else np.array(shares)
        found.append(played)
    late = np.array(found[-50:])
    assert np.std(late, axis=0).max() < 0.001
    assert late[-1, 0] == pytest.approx(1.02, abs=0.004)
