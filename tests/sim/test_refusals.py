"""Meaningless input is refused with the name of what is wrong, and before anything is integrated."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from sim.ensemble import simulate_many
from sim.errors import InvalidInput
from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.kernel import rocking as kernel
from sim.rocking import Mode, State, Status, simulate
from sim.specimen import Block, Frame, Specimen

NAN, INF = float("nan"), float("inf")
QUIET = SampledRecord(np.zeros(2), 1.0)
BLOCK = Specimen(beta=0.4)


def sine(amplitude: float, omega: float = 16.0, duration: float = 1.0) -> SineProgram:
    return SineProgram([Sweep.dwell(duration, amplitude, omega)])


@pytest.mark.parametrize(
    ("named", "attempt"),
    [
        ("m1", lambda: simulate(Specimen(frame=Frame(m1=-1.0), beta=0.4), QUIET)),
        ("rho", lambda: simulate(Specimen(block=Block(rho=-2450.0), beta=0.4), QUIET)),
        ("k1", lambda: simulate(Specimen(frame=Frame(k1=NAN), beta=0.4), QUIET)),
        ("b", lambda: simulate(Specimen(block=Block(b=0.0), beta=0.4), QUIET)),
        ("beta", lambda: simulate(Specimen(beta=-0.1), QUIET)),
        ("beta", lambda: simulate(Specimen(beta=NAN), QUIET)),
        ("restitution", lambda: simulate(Specimen(block=Block(restitution_factor=1.03), beta=0.4), QUIET)),
        ("restitution", lambda: simulate(Specimen(block=Block(restitution_factor=-0.1), beta=0.4), QUIET)),
        # Housner's r of a slab wider than 1.41 times its height is negative: it would turn on the corner it left
        ("restitution", lambda: simulate(Specimen(block=Block(b=0.3, h_b=0.2), beta=0.4), QUIET)),
        ("record", lambda: simulate(BLOCK, SampledRecord(np.empty(0), 0.01))),
        ("record", lambda: simulate(BLOCK, SampledRecord(np.zeros(1), 0.01))),
        ("record", lambda: simulate(BLOCK, SampledRecord(np.array([0.0, NAN]), 0.01))),
        ("dt", lambda: simulate(BLOCK, SampledRecord(np.zeros(2), 0.0))),
        ("dt", lambda: simulate(BLOCK, SampledRecord(np.zeros(2), -0.01))),
        ("dt", lambda: simulate(BLOCK, SampledRecord(np.zeros(2), NAN))),
        ("excitation", lambda: simulate(BLOCK, SampledRecord(np.zeros(2), INF))),
        ("excitation", lambda: simulate(BLOCK, SineProgram([]))),
        ("excitation", lambda: simulate(BLOCK, sine(NAN))),
        ("duration", lambda: simulate(BLOCK, sine(1.0, duration=-1.0))),
        (r"^omega of a sweep = -16\.0 ", lambda: simulate(BLOCK, sine(1.0, omega=-16.0))),
        ("sample_times", lambda: simulate(BLOCK, QUIET, sample_times=[0.5, 0.2])),
        ("sample_times", lambda: simulate(BLOCK, QUIET, sample_times=[0.5, NAN])),
        ("sample_times", lambda: simulate(BLOCK, QUIET, sample_times=[-0.5, 0.5])),
        ("tolerance", lambda: simulate(BLOCK, QUIET, tolerance=0.0)),
        ("tolerance", lambda: simulate(BLOCK, QUIET, tolerance=-1e-10)),
        ("tolerance", lambda: simulate(BLOCK, QUIET, tolerance=NAN)),
        ("overturning_angle", lambda: simulate(BLOCK, QUIET, overturning_angle=NAN)),
        ("peaks_from", lambda: simulate(BLOCK, QUIET, peaks_from=NAN)),
        (r"^omega = inf ", lambda: simulate(BLOCK, QUIET, state=State(omega=INF))),
        (r"^v2 = nan ", lambda: simulate(BLOCK, QUIET, state=State(v2=NAN))),
        (r"^theta = 0\.1 ", lambda: simulate(Specimen(), QUIET, state=State(theta=0.1))),
        (r"^omega = -0\.2 ", lambda: simulate(Specimen(), QUIET, state=State(omega=-0.2))),
        ("theta", lambda: simulate(BLOCK, QUIET, state=State(theta=-1.6))),
        ("tolerance", lambda: simulate_many([BLOCK, BLOCK], QUIET, tolerance=0.0)),
        ("theta", lambda: simulate_many(BLOCK, QUIET, states=[State(), State(theta=2.0)])),
    ],
)
def test_refused_before_anything_is_integrated(
    named: str, attempt: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    integrated: list[object] = []
    for entry in ("run", "advance"):
        monkeypatch.setattr(kernel, entry, lambda *arguments: integrated.append(arguments))
    with pytest.raises(ValueError, match=named):
        attempt()
    assert not integrated


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (np.float64(1.5), "1.5"),
        (np.int64(-3), "-3"),
        ((np.float64(1.5), 2), "(1.5, 2)"),
        (["a", None, True], "['a', None, True]"),
        (Mode.ROCK_A, "1"),
        (Status.FAILED, "'failed'"),
        (Path("a b.toml"), "'a b.toml'"),
        ({"k1": 1.0}, "a table"),
        (State(u1=0.2), "an object of type State"),
        ([Specimen()], "[an object of type Specimen]"),
    ],
)
def test_a_refused_value_is_shown_without_its_representation_in_python(value: object, shown: str) -> None:
    assert str(InvalidInput("item", value, "no")) == f"item = {shown} is refused: no"
