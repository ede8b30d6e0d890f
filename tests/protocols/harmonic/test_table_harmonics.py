"""How much harmonics of the table would change the gain: why those that the control leaves need no place in the budget.

The rocking motion is simulated under the sine with a harmonic of it added, from the steady orbit under the sine alone.
"""

from math import tau

import numpy as np
import pytest

from sim.excitation import SampledRecord
from sim.linear import steady_response
from sim.rocking import Status, simulate
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit

AMPLITUDE = 1.01 * 9.81 / 8.0
PER_CYCLE, CYCLES = 128, 300
LEFT = {2: 0.0005, 3: 0.005}
"""Shares of the second and third harmonic: as much as is seen of even ones, and all that the control lets pass."""


def _coupled(orbit: Orbit, order: int, share: complex) -> float:
    """Peak drift [m] in the last cycles, when what the change has stirred up is gone."""
    dt = orbit.period / PER_CYCLE
    phase = orbit.phase + tau / PER_CYCLE * np.arange(CYCLES * PER_CYCLE + 1)
    record = SampledRecord(AMPLITUDE * np.imag(np.exp(1j * phase) + share * np.exp(1j * order * phase)), dt)
    times = (CYCLES - 3 + np.arange(600) / 201.0) * orbit.period
    motion = simulate(orbit.specimen, record, state=orbit.start, sample_times=times)
    assert motion.status is Status.COMPLETED
    assert motion.samples is not None
    return float(np.abs(motion.samples[:, 1] - motion.samples[:, 0]).max())


def _bare(omega: float, order: int, share: complex) -> float:
    """Peak drift [m] of the bare frame: linear, so the responses add up."""
    phase = tau / 2000.0 * np.arange(2000)
    drift = np.zeros(2000)
    for k, part in ((1, 1.0), (order, share)):
        u1, u2 = steady_response(Specimen(), k * omega, AMPLITUDE)
        drift += np.imag((u2 - u1) * part * np.exp(1j * k * phase))
    return float(np.abs(drift).max())


@pytest.mark.parametrize(
    ("beta", "omega"),
    [
        # each spring where its gain changes most
        (0.25, 12.5),
        (0.64, 20.0),
        (0.97, 12.5),
        *(
            pytest.param(*each, marks=pytest.mark.soak)
            for each in (
                *((0.25, omega) for omega in (15.0, 17.5, 20.0)),
                *((0.64, omega) for omega in (15.0, 17.5)),
                *((0.97, omega) for omega in (17.5, 20.0)),
            )
        ),
    ],
)
def test_what_is_left_of_the_harmonics_changes_the_gain_by_less_than_a_tenth_of_its_uncertainty(
    beta: float, omega: float
) -> None:
    orbit = rocking_orbit(Specimen().coupled(beta), omega, AMPLITUDE)
    pure = _coupled(orbit, 2, 0.0) / _bare(omega, 2, 0.0)
    for order, share in LEFT.items():
        for turn in np.exp(0.5j * np.pi * np.arange(4)):
            changed = _coupled(orbit, order, share * turn) / _bare(omega, order, share * turn)
            assert abs(changed / pure - 1.0) < 0.0007
