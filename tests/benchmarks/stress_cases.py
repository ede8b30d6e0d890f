"""Scenes made to break an integrator with events, drawn from a seeded generator, one function per kind of trouble."""

from collections.abc import Callable
from dataclasses import dataclass
from math import asin, cos, hypot, pi, sin, sqrt

import numpy as np
from numpy.random import Generator

from sim.excitation import Excitation, SampledRecord, SineProgram, Sweep
from sim.rocking import REST_ANGLE, TOLERANCE, State
from sim.specimen import Block, Frame, Specimen
from tests.sim.runs import kernel_run

AT_REST = State()


@dataclass(frozen=True, eq=False)
class Case:
    """A scene; `watch` [s] are times at which something is expected to go wrong."""

    specimen: Specimen
    excitation: Excitation
    state: State = AT_REST
    watch: tuple[float, ...] = ()


def spread(rng: Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(low * (high / low) ** rng.random())


def nearly(rng: Generator) -> float:
    """1, or 1 up to rounding, or 1 give or take any power of ten down to rounding."""
    pick = rng.integers(4)
    if pick == 0:
        return 1.0
    return 1.0 + float(rng.choice([-1.0, 1.0])) * (2.3e-16 if pick == 1 else spread(rng, 1e-16, 1e-2))


def side(rng: Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def block(rng: Generator, r: float | None = None, slenderness: tuple[float, float] = (1.0, 60.0)) -> Block:
    """A block of some slenderness, and of restitution `r` when it is given."""
    b = 0.2 / spread(rng, *slenderness)
    plain = Block(b=b)
    return plain if r is None else Block(b=b, restitution_factor=min(2.0, r / plain.restitution))


def free(rng: Generator, r: float | None = None) -> Specimen:
    """A block without spring; its frame is that of the paper and follows on its own."""
    return Specimen(beta=0.0, block=block(rng, r))


def crest(shape: Block) -> float:
    """atan(b / h_b) [rad]: the block balances on its corner."""
    return asin(shape.b / hypot(shape.b, shape.h_b))


def gained(specimen: Specimen, theta: float, a_g: float) -> float:
    """Work [J] of gravity and of a constant base acceleration on a free block from 0 to theta >= 0."""
    shape, versine = specimen.block, 2.0 * sin(0.5 * theta) ** 2
    work = specimen.g * (shape.h_b * versine - shape.b * sin(theta))
    return shape.mass * (work + a_g * (shape.h_b * sin(theta) + shape.b * versine))


def record(rng: Generator, scale: float) -> SampledRecord:
    """A short record with zeros, spikes, steps, plateaus, noise or the fastest swing its step can carry."""
    n, dt = int(rng.integers(2, 18)), spread(rng, 1e-4, 0.1)
    pick = rng.integers(6)
    values = np.zeros(n)
    if pick == 1:
        values[rng.integers(n)] = side(rng)
    elif pick == 2:
        values[rng.integers(n) :] = side(rng)
    elif pick == 3:
        values[:] = rng.choice([-1.0, 0.0, 1.0], n)
    elif pick == 4:
        values[:] = rng.normal(size=n)
    elif pick == 5:
        values[::2], values[1::2] = 1.0, -1.0
    return SampledRecord(scale * values, dt)


def sines(rng: Generator, scale: float) -> SineProgram:
    """Up to three sweeps, slow and fast, with jumps of amplitude between them."""
    sweeps: list[Sweep] = []
    for _ in range(int(rng.integers(1, 4))):
        amplitude = (scale * float(rng.random()), scale * float(rng.random()))
        omega = (spread(rng, 0.5, 300.0), spread(rng, 0.5, 300.0))
        sweeps.append(Sweep(spread(rng, 1e-3, 4.0 / max(omega) * pi), amplitude, omega))
    return SineProgram(sweeps, phase=float(rng.uniform(0.0, 2.0 * pi)))


def drive(rng: Generator, specimen: Specimen) -> Excitation:
    """Any base motion between a millionth and a thousand times what lifts the block."""
    scale = specimen.uplift_acceleration * spread(rng, 1e-6, 1e3)
    return record(rng, scale) if rng.random() < 0.6 else sines(rng, scale)


def grazing(rng: Generator) -> Case:
    """A push outwards turns the falling block back just before, at, or just after it touches the ground."""
    specimen, sign = free(rng), side(rng)
    a_g = specimen.uplift_acceleration * float(rng.uniform(1.05, 3.0))
    theta = crest(specimen.block) * spread(rng, 1e-6, 0.5)
    clearance = theta * float(rng.choice([0.0, 1.0, -1.0])) * spread(rng, 1e-17, 1e-2)
    # below the ground the same energy is continued: there the block arrives with what the clearance is worth
    energy = gained(specimen, theta, a_g) - np.sign(clearance) * gained(specimen, abs(clearance), a_g)
    omega = -sqrt(max(0.0, 2.0 * energy / specimen.block.inertia))
    push = gained(specimen, 1e-9, a_g) / 1e-9 / specimen.block.inertia
    duration = 2.5 * abs(omega) / push
    return Case(
        specimen,
        SampledRecord(np.full(2, sign * a_g), duration),
        State(theta=sign * theta, omega=sign * omega),
        (abs(omega) / push,),
    )


def uplift_touched(rng: Generator) -> Case:
    """The crest of a sine touches the moment that lifts the block: a double root of the uplift condition."""
    specimen = free(rng) if rng.random() < 0.7 else Specimen(beta=spread(rng, 1e-3, 1.0))
    omega, phase = spread(rng, 1.0, 100.0), float(rng.uniform(0.0, 2.0 * pi))
    amplitude = specimen.uplift_acceleration * nearly(rng)
    sweep = Sweep.dwell(float(rng.uniform(0.3, 2.0)) * 2.0 * pi / omega, amplitude, omega)
    return Case(specimen, SineProgram([sweep], phase), State(), ((0.5 * pi - phase) % pi / omega,))


def uplift_at_a_sample(rng: Generator) -> Case:
    """Samples of a record that only just reach what lifts the block, so that it lifts at the end of a step."""
    specimen = free(rng)
    n, dt = int(rng.integers(3, 14)), spread(rng, 1e-4, 0.1)
    values = rng.uniform(-0.9, 0.9, n)
    for k in rng.integers(1, n, 3):
        values[k] = side(rng) * nearly(rng)
    places = tuple(dt * float(k) for k in rng.integers(1, n, 3))
    return Case(specimen, SampledRecord(values * specimen.uplift_acceleration, dt), State(), places)


def impact_at_a_sample(rng: Generator) -> Case:
    """A record whose samples fall on the impacts of the free block, exactly or next to them."""
    specimen, theta = free(rng), 0.0
    theta = side(rng) * crest(specimen.block) * spread(rng, 1e-8, 0.9)
    long, start = SampledRecord(np.zeros(2), 30.0).packed(), State(theta=theta)
    which = int(rng.integers(1, 4))
    _, report, _ = kernel_run(
        specimen, long, start.as_array(), impacts=which, order=16, tolerance=TOLERANCE, rest_angle=REST_ANGLE
    )
    time, parts = float(report[1]), int(rng.integers(1, 8))
    values = np.zeros(2 * parts + 1)
    if rng.random() < 0.3:
        values[parts + 1 :] = specimen.uplift_acceleration * side(rng) * nearly(rng)
    return Case(specimen, SampledRecord(values, time / parts * nearly(rng)), start, (time,))


def chatter(rng: Generator) -> Case:
    """Bounces that get shorter and shorter, restitution from 0 to 0.9999, pushed down harder or softer."""
    r = float(rng.choice([0.0, 1.0 - spread(rng, 1e-4, 1.0)], p=[0.05, 0.95]))
    specimen = free(rng, r) if rng.random() < 0.8 else Specimen(beta=0.5, block=block(rng, r))
    shape = specimen.block
    theta = crest(shape) * spread(rng, 1e-9, 0.3)
    pull = shape.b * specimen.g * shape.mass / shape.inertia
    flight = sqrt(2.0 * theta / pull)
    duration = min(2.5 * flight / max(1.0 - r, 1e-6), 600.0 * flight)
    level = specimen.uplift_acceleration * float(rng.choice([0.0, rng.uniform(-0.99, 0.99)]))
    return Case(specimen, SampledRecord(np.full(2, level), duration), State(theta=side(rng) * theta))


def near_overturning(rng: Generator) -> Case:
    """A free block thrown so that it only just reaches, or only just passes, its balance."""
    specimen, sign = free(rng), side(rng)
    shape = specimen.block
    alpha, theta = crest(shape), 0.0
    theta = alpha * float(rng.choice([0.0, rng.uniform(0.0, 0.99)]))
    weight = shape.mass * specimen.g * hypot(shape.b, shape.h_b)
    omega = sqrt(2.0 * weight * (1.0 - cos(alpha - theta)) / shape.inertia) * nearly(rng)
    duration = float(rng.uniform(2.0, 50.0)) * sqrt(shape.inertia / weight)
    return Case(specimen, SampledRecord(np.zeros(2), duration), State(theta=sign * theta, omega=sign * omega))


def coupled(rng: Generator) -> Case:
    """The paper's frame and block with a spring from none to a hundred times the first storey."""
    specimen = Specimen(beta=float(rng.choice([0.0, spread(rng, 1e-3, 100.0)], p=[0.05, 0.95])))
    return Case(specimen, drive(rng, specimen))


def shapes(rng: Generator) -> Case:
    """Needles and slabs, a centimetre or twenty metres high."""
    h_b = spread(rng, 0.005, 10.0)
    specimen = Specimen(beta=spread(rng, 1e-3, 2.0), block=Block(b=max(1e-4, h_b / spread(rng, 0.72, 500.0)), h_b=h_b))
    return Case(specimen, drive(rng, specimen))


def frames(rng: Generator) -> Case:
    """Frames from a thousandth to ten thousand times as stiff, a hundredth to a hundred times as heavy."""
    plain = Frame()
    frame = Frame(
        m1=plain.m1 * spread(rng, 0.01, 100.0),
        m2=plain.m2 * spread(rng, 0.01, 100.0),
        k1=plain.k1 * spread(rng, 1e-3, 1e4),
        k2=plain.k2 * spread(rng, 1e-3, 1e4),
    )
    specimen = Specimen(frame=frame, beta=spread(rng, 1e-3, 2.0))
    return Case(specimen, drive(rng, specimen))


def records(rng: Generator) -> Case:
    """Records of every kind, from a block that stands or rocks already."""
    specimen = Specimen(beta=spread(rng, 0.05, 2.0))
    theta = crest(specimen.block) * float(
        rng.choice([0.0, rng.uniform(-0.9, 0.9), side(rng) * spread(rng, 1e-14, 0.1)])
    )
    state = State(theta=theta, omega=float(rng.normal()) * 0.3 if rng.random() < 0.5 else 0.0)
    return Case(specimen, record(rng, specimen.uplift_acceleration * spread(rng, 1e-6, 1e3)), state)


def anything(rng: Generator) -> Case:
    """All of it at once."""
    h_b = spread(rng, 0.02, 2.0)
    plain = Block(b=h_b / spread(rng, 0.8, 100.0), h_b=h_b)
    shape = Block(b=plain.b, h_b=h_b, restitution_factor=min(2.0, float(rng.random()) / plain.restitution))
    base = Frame()
    frame = Frame(
        m1=base.m1 * spread(rng, 0.1, 10.0), k1=base.k1 * spread(rng, 0.01, 100.0), xi2=float(rng.random()) / 2
    )
    specimen = Specimen(frame=frame, block=shape, beta=spread(rng, 1e-3, 100.0), d=spread(rng, 0.02, 1.0))
    u, v = rng.normal(size=2) * 0.2 * specimen.d, rng.normal(size=2) * spread(rng, 1e-6, 1.0)
    theta = crest(shape) * float(rng.uniform(-0.9, 0.9))
    state = State(
        float(np.clip(u[0], -0.9 * specimen.d, 0.9 * specimen.d)), float(u[1]), float(v[0]), float(v[1]), theta
    )
    return Case(specimen, drive(rng, specimen), state)


KINDS: dict[str, tuple[Callable[[Generator], Case], int]] = {
    "grazing returns": (grazing, 12),
    "uplift touched": (uplift_touched, 10),
    "uplift at a sample": (uplift_at_a_sample, 10),
    "impact at a sample": (impact_at_a_sample, 10),
    "chatter": (chatter, 6),
    "near overturning": (near_overturning, 10),
    "spring 0 to 100": (coupled, 9),
    "slender and squat": (shapes, 8),
    "stiff and soft": (frames, 8),
    "records": (records, 9),
    "anything": (anything, 8),
}
"""Kinds of trouble, each with how many of a hundred cases are given to it."""
