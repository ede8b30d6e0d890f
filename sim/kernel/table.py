"""Motion of the bench's moving parts, tick by tick, under a drive that is held between ticks.

Integration is by the classical Runge-Kutta method of order 4. Uplift, impact and catch end a step at their instant,
which is located with steps of the same method, so that the order is preserved. The end stops are stiff springs, not
events.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import math

import numpy as np
from numba import types

from sim.kernel.compiled import FLOAT, GRID, INT, ROW, VOID, compiled
from sim.kernel.plant import (
    FALLEN,
    PLANT,
    REST,
    ROCK_A,
    ROCK_B,
    STATES,
    Array,
    Plant,
    overturning_moment,
    rates,
    restitution_on_table,
    turn,
)

COLUMNS = 9
"""Number of columns of the samples: the state, then the table's mean acceleration over the previous tick."""

_NONE, _IMPACT, _CATCH, _UPLIFT = 0, 1, 2, 3
_REST_ANGLE = 1.0e-7
"""A bounce that stays below this angle [rad] is replaced by rest."""
_BOUNCES = 100
"""Number of events within one step after which the block is set to rest. Because of the rest angle, real motions have
far fewer.
"""
_INSTANT = 1.0e-14
"""Accuracy of the instant of an event [s]."""


@compiled(VOID(INT, ROW, FLOAT, FLOAT, FLOAT, FLOAT, PLANT, GRID), internal=True)
def advance(mode: int, y: Array, h: float, held: float, request: float, noise: float, p: Plant, work: Array) -> None:
    """Take one Runge-Kutta step of length `h` from `y`, and write the state to work[4]. work[0] contains the rates at
    `y`.

    The first-order lag of the amplifier, from `held` towards `request`, is exact.
    """
    decay = math.exp(-0.5 * h / p.lag) if p.lag > 0.0 else 0.0
    middle = request + (held - request) * decay
    end = request + (held - request) * decay * decay
    out = work[4]
    for i in range(STATES):
        out[i] = y[i] + 0.5 * h * work[0, i]
    rates(mode, out, middle, noise, p, work[1])
    for i in range(STATES):
        out[i] = y[i] + 0.5 * h * work[1, i]
    rates(mode, out, middle, noise, p, work[2])
    for i in range(STATES):
        out[i] = y[i] + h * work[2, i]
    rates(mode, out, end, noise, p, work[3])
    for i in range(STATES):
        out[i] = y[i] + h / 6.0 * (work[0, i] + 2.0 * (work[1, i] + work[2, i]) + work[3, i])


@compiled(FLOAT(INT, INT, ROW, FLOAT, FLOAT, PLANT, GRID), internal=True)
def margin(event: int, mode: int, y: Array, request: float, noise: float, p: Plant, work: Array) -> float:
    """Margin of the state `y` to `event` [rad, or N m for the uplift]: positive before the event, negative past it."""
    if event == _IMPACT:
        return y[6] if mode == ROCK_A else -y[6]
    if event == _CATCH:
        return p.catch_angle - abs(y[6])
    rates(mode, y, request, noise, p, work[5])
    return p.b * p.g * p.mass - abs(overturning_moment(y, work[5], p))


@compiled(FLOAT(INT, INT, ROW, FLOAT, FLOAT, FLOAT, FLOAT, PLANT, GRID), internal=True)
def locate(
    event: int, mode: int, y: Array, h: float, held: float, request: float, noise: float, p: Plant, work: Array
) -> float:
    """Instant of the first `event` within (0, h], with the state at that instant in work[4]; -1 if there is none.

    Illinois iteration on Runge-Kutta steps of varying length. A motion that starts on the ground has a root at 0, which
    is divided out, so that the return is found however short the bounce.
    """
    power, low_value = 0, 1.0
    if event == _IMPACT and y[6] == 0.0:
        sg = 1.0 if mode == ROCK_A else -1.0
        power = 1 if y[7] != 0.0 else 2
        low_value = sg * y[7] if y[7] != 0.0 else 0.5 * sg * work[0, 7]
        if low_value <= 0.0:
            # element by element here and below: numba compiles the assignment of arrays together with the formatting of
            # its error message, which takes a tenth of the whole compilation
            for i in range(STATES):
                work[4, i] = y[i]
            return 0.0
    else:
        low_value = max(margin(event, mode, y, held, noise, p, work), 0.0)
    low, high, high_value, t, previous, side = 0.0, h, -1.0, h, h, 0
    for iteration in range(100):
        advance(mode, y, t, held, request, noise, p, work)
        reached = request + (held - request) * math.exp(-t / p.lag) if p.lag > 0.0 else request
        value = margin(event, mode, work[4], reached, noise, p, work) / t**power
        if value < 0.0:
            high, high_value = t, value
            low_value *= 0.5 if side < 0 else 1.0
            side = -1 if iteration > 0 else 0
        else:
            if iteration == 0:
                return -1.0
            low, low_value = t, value
            high_value *= 0.5 if side > 0 else 1.0
            side = 1
        previous = t
        t = high - high_value * (high - low) / (high_value - low_value)
        if not low < t < high:
            t = 0.5 * (low + high)
        if value == 0.0 or abs(t - previous) <= _INSTANT:
            break
    return previous


@compiled(INT(INT, ROW, FLOAT, FLOAT, PLANT, GRID), internal=True)
def impact(mode: int, y: Array, request: float, noise: float, p: Plant, work: Array) -> int:
    """Transfer the block from one corner to the other (Housner), or to rest. Returns the new mode."""
    y[6] = 0.0
    turn(y, restitution_on_table(p) * y[7], p)
    other = ROCK_B if mode == ROCK_A else ROCK_A
    rates(other, y, request, noise, p, work[0])
    pulled_back = work[0, 7] if other == ROCK_B else -work[0, 7]
    rates(REST, y, request, noise, p, work[5])
    holds = abs(overturning_moment(y, work[5], p)) <= p.b * p.g * p.mass
    if holds and pulled_back > 0.0 and y[7] * y[7] < 2.0 * pulled_back * _REST_ANGLE:
        turn(y, 0.0, p)
        return REST
    return other


@compiled(INT(INT, ROW, FLOAT, FLOAT, PLANT, GRID), internal=True)
def passed(mode: int, y: Array, request: float, noise: float, p: Plant, work: Array) -> int:
    """Event passed by a step that ends in the state `y`; _NONE if no event is passed."""
    if mode == REST:
        return _UPLIFT if p.mass > 0.0 and margin(_UPLIFT, mode, y, request, noise, p, work) < 0.0 else _NONE
    if mode == FALLEN:
        return _NONE
    if margin(_IMPACT, mode, y, request, noise, p, work) < 0.0:
        return _IMPACT
    return _CATCH if margin(_CATCH, mode, y, request, noise, p, work) < 0.0 else _NONE


@compiled(types.Tuple((INT, FLOAT))(INT, ROW, FLOAT, FLOAT, FLOAT, FLOAT, PLANT, GRID), internal=True)
def substep(
    mode: int, y: Array, h: float, held: float, request: float, noise: float, p: Plant, work: Array
) -> tuple[int, float]:
    """Advance `y` by the time `h`, including all events. Returns the mode and the amplifier's output."""
    left = h
    for bounce in range(_BOUNCES + 1):
        last = bounce == _BOUNCES
        if last and mode in (ROCK_A, ROCK_B):
            y[6] = 0.0
            turn(y, 0.0, p)
            mode = REST
        rates(mode, y, held, noise, p, work[0])
        if mode == REST and p.mass > 0.0 and not last:
            moment = overturning_moment(y, work[0], p)
            if abs(moment) > p.b * p.g * p.mass:
                mode = ROCK_A if moment > 0.0 else ROCK_B
                rates(mode, y, held, noise, p, work[0])
        advance(mode, y, left, held, request, noise, p, work)
        reached = request + (held - request) * math.exp(-left / p.lag) if p.lag > 0.0 else request
        event, limit, instant = passed(mode, work[4], reached, noise, p, work), left, -1.0
        if event == _NONE and y[6] * y[7] < 0.0 and work[4, 7] * y[7] < 0.0:
            # the block reversed within the step: check for contact at the lowest point
            event, limit = _IMPACT, left * y[7] / (y[7] - work[4, 7])
        if event != _NONE and not last:
            instant = locate(event, mode, y, limit, held, request, noise, p, work)
            if instant < 0.0:
                advance(mode, y, left, held, request, noise, p, work)
        for i in range(STATES):
            y[i] = work[4, i]
        if instant < 0.0:
            return mode, reached
        left -= instant
        held = request + (held - request) * math.exp(-instant / p.lag) if p.lag > 0.0 else request
        if event == _IMPACT:
            mode = impact(mode, y, held, noise, p, work)
        elif event == _CATCH:
            y[6] = math.copysign(p.catch_angle, y[6])
            turn(y, 0.0, p)
            mode = FALLEN
        else:
            rates(mode, y, held, noise, p, work[0])
            mode = ROCK_A if overturning_moment(y, work[0], p) > 0.0 else ROCK_B
    return mode, held


@compiled(INT(PLANT, FLOAT, INT, ROW, ROW, INT, ROW, ROW, GRID))
def stream(
    p: Plant,
    tick: float,
    substeps: int,
    requests: Array,
    noise: Array,
    mode: int,
    y: Array,
    carried: Array,
    samples: Array,
) -> int:
    """For every request, sample the plant, then hold the request for one tick [s]. Returns the mode.

    requests, noise : shape (n,), commands to the amplifier [V or A] and force noise [N], each held for one tick.
    y : state, shape (8,), updated.  carried : shape (2,), [amplifier output, last mean acceleration], updated.
    samples : shape (n, 9); row i is the state at tick i, before request i acts, and the mean acceleration over the
    previous tick. The rows do not depend on how the requests are divided among calls.
    """
    work = np.empty((6, STATES))
    h = tick / substeps
    for i in range(requests.size):
        for k in range(STATES):
            samples[i, k] = y[k]
        samples[i, STATES] = carried[1]
        held, velocity = carried[0] if p.lag > 0.0 else requests[i], y[1]
        for _ in range(substeps):
            mode, held = substep(mode, y, h, held, requests[i], noise[i], p, work)
        # the mean over the tick: an instantaneous value would miss the impulse of an impact, and would always be taken
        # at the same phase of the sawtooth under a held drive (1.5 % too low with the default shaker)
        carried[0], carried[1] = held, (y[1] - velocity) / tick
    return mode
