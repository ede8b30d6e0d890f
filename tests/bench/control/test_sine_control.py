"""The table's sine under control, through the engine, judged on the true motion of the virtual bench."""

from collections.abc import Sequence
from math import tau

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS
from bench.analysis.signals import SignalMap
from bench.control.oscillator import DriveCalibration, Segment
from bench.control.sine import Sine, SineControl, SineResponse, Tolerance
from bench.engine.engine import Engine
from bench.engine.interface import EventStream, Requests, Unattended
from bench.engine.steps import Arm, Calibrate, Dwell, Measured, OperatorAction, Plan, RampOut, SetHarmonics, Sweep
from bench.events import Acquired, Event
from bench.guard.guard import Guard
from bench.guard.limits import Limits, Ramps
from drivers.rig import OperatorTask
from drivers.simulated import SimulatedRig
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

RATE = 2000.0
AMPLITUDE = 1.01 * 9.81 / 8.0
ASKED = Tolerance(amplitude=0.001, phase=np.radians(0.1), distortion=0.01)
AIMED = Tolerance(amplitude=0.0005, phase=np.radians(0.05), distortion=0.005)
UPDATES = 6
LOOK, TURNING = 6, 2
Complex = NDArray[np.complex128]


class Bench:
    """The virtual bench under the engine, with its true motion and the drive it was given, tick by tick."""

    def __init__(self, seed: int = 1, lead: int = 200) -> None:
        self.rig = SimulatedRig(VirtualBenchParameters(), Specimen().bare(), seed=seed, lead=lead)
        self._velocity: list[NDArray[np.float64]] = []
        self._drive: list[NDArray[np.float64]] = []
        self.engine = Engine(
            self.rig,
            Guard(self.rig, Limits(), Ramps(), signals=SignalMap(self.rig.channels, "ground")),
            EventStream(self.rig.clock, [self._keep]),
            Requests(),
            Unattended(),
            block=200,
        )

    def _keep(self, event: Event) -> None:
        if isinstance(event, Acquired):
            self._velocity.append(self.rig.bench.truth.v.copy())
            self._drive.append(event.drive)

    @property
    def now(self) -> int:
        """Samples taken so far."""
        return sum(part.size for part in self._drive)

    def phase(self, sine: Sine, begin: int, end: int) -> complex:
        """exp(i phi) at sample 0 if the oscillator played a pure sine between two samples."""
        (volts,) = _fit(np.concatenate(self._drive), begin, end, sine.omega, 1)
        turn = volts * np.interp(sine.omega, sine.calibration.omega, np.array(sine.calibration.response))
        return turn / abs(turn)

    def moved(self, sine: Sine, turn: complex, begin: int, end: int) -> Complex:
        """Shares of the true acceleration, harmonics 1 to 10, as the accelerometer's channel would show them.

        The acceleration is the derivative of the true velocity. The channel adds delays that are known: half a tick, as
        the accelerometer averages over one, and that of the fourth-order Butterworth low-pass of 100 Hz.
        """
        orders = np.arange(1, 11)
        omega = orders * sine.omega
        acceleration = 1j * omega * _fit(np.concatenate(self._velocity), begin, end, sine.omega, 30)[:10]
        s = 1j * np.tan(0.5 * omega / RATE) / np.tan(np.pi * 100.0 / RATE)
        butterworth = 1.0 / ((s * s + 0.7653668647 * s + 1.0) * (s * s + 1.8477590650 * s + 1.0))
        late = np.exp(-0.5j * omega / RATE) * butterworth / np.abs(butterworth)
        return acceleration * late / (sine.amplitude * turn**orders)


def _fit(values: NDArray[np.float64], begin: int, end: int, omega: float, highest: int) -> Complex:
    """Amplitudes z_k of Im(z_k exp(i k omega n / RATE)) by least squares between two samples."""
    phase = omega / RATE * np.arange(begin, end)
    turns = np.exp(1j * phase[:, None] * np.arange(1, highest + 1))
    basis = np.concatenate((np.ones((phase.size, 1)), turns.imag, turns.real), axis=1)
    # over whole cycles the columns are almost orthogonal
    fit = np.linalg.solve(basis.T @ basis, basis.T @ values[begin:end])[1:]
    return fit[:highest] + 1j * fit[highest:]


def _believed(payload: float, wrong: float = 1.0, lag: float = 0.0, only_above: float = 0.0) -> DriveCalibration:
    """The shaker's response, with the measuring channel's, and then `wrong` and late by `lag` [s] above a frequency."""
    omega = np.concatenate((np.arange(10.0, 30.0), np.geomspace(30.0, 250.0, 14)))
    delay = 2.6131 / (tau * 100.0) + 0.5 / RATE
    response = Shaker().frequency_response(omega, payload) * np.exp(-1j * omega * delay)
    response = np.where(omega > only_above, response * wrong * np.exp(-1j * omega * lag), response)
    return DriveCalibration(tuple(omega.tolist()), tuple(response.tolist()))


def _hold(
    beta: float | None, sine: Sine, segments: Sequence[Segment], looks: int, seed: int = 1, lead: int = 200
) -> tuple[list[Complex], list[int]]:
    """The true shares in the looks at a dwell under control, and how many updates came before each."""
    bench, shares, updates = Bench(seed, lead), list[Complex](), list[int]()
    window = round((LOOK - TURNING) * tau / sine.omega * RATE)

    def plan() -> Plan:
        if beta is None:
            yield OperatorAction(OperatorTask.REMOVE_BLOCK, Specimen().bare(), "take the block off")
        else:
            yield OperatorAction(OperatorTask.MOUNT_SPRING, Specimen().coupled(beta), "mount the spring")
        yield Arm(2.0)
        yield Calibrate(sine.calibration)
        yield Sweep(tuple(segments))
        control, turn, truth, done = SineControl(HARMONICS, AIMED), None, 0j, 0
        for _ in range(looks):
            outcome = yield Dwell(LOOK)
            assert isinstance(outcome, Measured), "the block fell"
            if turn is None:
                turn, truth = sine.turn(outcome.cycles[0]), bench.phase(sine, bench.now - window, bench.now)
            shares.append(bench.moved(sine, truth, bench.now - window, bench.now))
            updates.append(done)
            found = control.next(SineResponse.of(outcome.cycles[TURNING:], sine, turn))
            if found is not None:
                yield SetHarmonics(found)
                done += 1
        yield RampOut(fast=True)

    ending = bench.engine.run(plan())
    assert ending.status == "completed", ending
    return shares, updates


def _errors(shares: Complex) -> tuple[float, float, float]:
    """Relative error of the amplitude, of the phase [rad], total harmonic distortion over harmonics 2 to 10."""
    distortion = float(np.linalg.norm(shares[1:]) / np.abs(shares[0]))
    return float(np.abs(shares[0])) - 1.0, float(np.angle(shares[0])), distortion


def _assert_as_asked(shares: Complex) -> None:
    amplitude, phase, distortion = _errors(shares)
    assert abs(amplitude) <= ASKED.amplitude
    assert abs(phase) <= ASKED.phase
    assert distortion <= ASKED.distortion


@pytest.mark.parametrize(
    ("omega", "wrong"), [(12.5, 1.2), (16.0, 0.8), pytest.param(20.0, 1.2, marks=pytest.mark.soak)]
)
def test_the_bare_frame_is_moved_as_asked_within_six_updates(omega: float, wrong: float) -> None:
    sine = Sine(omega, AMPLITUDE, _believed(2.1, wrong))
    shares, updates = _hold(None, sine, (Segment(4.0, AMPLITUDE, omega),), UPDATES + 3)
    assert abs(_errors(shares[0])[0]) > 0.08
    assert updates[UPDATES] <= UPDATES
    for held in shares[UPDATES:]:
        _assert_as_asked(held)


STARTS = {
    (0.25, 12.5): (6.0, 26.0),
    (0.25, 15.0): (6.0, 22.0),
    (0.25, 17.5): (6.0, 22.0),
    (0.25, 20.0): (6.0, 22.0),
    (0.64, 15.0): (6.0, 24.0),
    (0.64, 17.5): (6.0, 24.0),
    (0.64, 20.0): (6.0, 24.0),
    (0.97, 12.5): (12.0, 28.0),
    (0.97, 17.5): (6.0, 28.0),
    (0.97, 20.0): (6.0, 24.0),
}
"""Ramps that lead to the stable rocking motions of the campaign: length [s] and frequency [rad/s]."""


def _start(beta: float, omega: float) -> tuple[Segment, ...]:
    duration, begin = STARTS[beta, omega]
    strong = 1.2 * AMPLITUDE
    return Segment(duration, strong, begin), Segment(begin - omega, strong, omega), Segment(6.0, AMPLITUDE, omega)


FEW = ((0.25, 12.5), (0.64, 20.0), (0.97, 17.5))
"""Those of them that every run of the tests takes."""


@pytest.mark.parametrize(
    ("beta", "omega"), [pytest.param(*point, marks=() if point in FEW else pytest.mark.soak) for point in STARTS]
)
def test_the_table_is_moved_as_asked_through_the_impacts_within_six_updates(beta: float, omega: float) -> None:
    """The drive is believed to be a fifth weaker than it is: the table moves 25 % too much at first."""
    sine = Sine(omega, AMPLITUDE, _believed(6.0, 0.8))
    shares, updates = _hold(beta, sine, _start(beta, omega), UPDATES + 3)
    amplitude, _, distortion = _errors(shares[0])
    assert amplitude > 0.2
    assert distortion > 1.5 * ASKED.distortion
    assert updates[UPDATES] <= UPDATES
    for held in shares[UPDATES:]:
        _assert_as_asked(held)


@pytest.mark.parametrize(
    ("beta", "omega", "wrong", "lag"),
    [
        (0.25, 12.5, 1.2, 0.0),
        (0.64, 20.0, 1.2, 0.0),
        (0.97, 17.5, 1.0, 0.002),
        *(
            pytest.param(*case, marks=pytest.mark.soak)
            for case in ((0.97, 17.5, 1.2, 0.0), (0.25, 12.5, 1.0, 0.002), (0.64, 20.0, 1.0, 0.002))
        ),
    ],
)
def test_harmonics_are_cancelled_where_their_response_is_misjudged(
    beta: float, omega: float, wrong: float, lag: float
) -> None:
    sine = Sine(omega, AMPLITUDE, _believed(6.0, wrong, lag, only_above=30.0))
    shares, _ = _hold(beta, sine, _start(beta, omega), UPDATES + 1)
    assert _errors(shares[0])[2] > 2.0 * ASKED.distortion
    _assert_as_asked(shares[UPDATES])


def test_a_long_wait_between_command_and_motion_is_no_trouble() -> None:
    """With two seconds of drive waiting in the rig, four cycles pass before a step is seen."""
    sine = Sine(16.0, AMPLITUDE, _believed(2.1, 0.9))
    shares, updates = _hold(None, sine, (Segment(4.0, AMPLITUDE, 16.0),), 16, lead=4000)
    assert np.abs([held[0] for held in shares]).max() < 1.15
    assert updates[-1] < 16
    _assert_as_asked(shares[-1])
