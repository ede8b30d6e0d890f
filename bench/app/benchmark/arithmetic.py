"""Operations of a Taylor step, counted by executing its source, and the fraction of the core's peak rate achieved."""

from collections.abc import Callable
from math import cos, pi, sin, sqrt
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.app.benchmark.section import Cell, Column, Section, in_turn
from bench.comparators.case import SPECIMEN, START, drive
from bench.comparators.kernel.multiply_adds import CHAINS, multiply_adds, multiply_adds_in_lanes
from sim.ensemble import side_by_side
from sim.kernel.lanes import LANES
from sim.kernel.taylor import WORK_ROWS, forcing_coefficients, rocking_coefficients
from sim.rocking import TOLERANCE, Drive, RockingRun

COLUMNS = (
    Column("method", "method"),
    Column("order", "order", "d"),
    Column("flops", "flops per step", "d"),
    Column("step_us", "time per step [us]", ".2f"),
    Column("rate", "rate [Gflop/s]", ".2f"),
    Column("peak", "peak of the core [Gflop/s]", ".1f"),
    Column("share", "share [%]", ".0f"),
)

MEMBERS = 2 * LANES
"""Number of trajectories computed side by side."""

ROUNDS = 200_000
"""Multiply-adds of each chain in the measurement of the peak."""


class Counted:
    """A number whose sums, differences, products, quotients and roots are counted; a fused multiply-add counts twice.

    The sine and the cosine are not counted.
    """

    operations = 0

    def __init__(self, value: float) -> None:
        self.value = value

    def __add__(self, other: "Counted | float") -> "Counted":
        return self._result(self.value + _value(other))

    def __sub__(self, other: "Counted | float") -> "Counted":
        return self._result(self.value - _value(other))

    def __rsub__(self, other: float) -> "Counted":
        return self._result(other - self.value)

    def __mul__(self, other: "Counted | float") -> "Counted":
        return self._result(self.value * _value(other))

    def __truediv__(self, other: "Counted | float") -> "Counted":
        return self._result(self.value / _value(other))

    def __rtruediv__(self, other: float) -> "Counted":
        return self._result(other / self.value)

    def __neg__(self) -> "Counted":
        return Counted(-self.value)

    __radd__, __rmul__ = __add__, __mul__

    @staticmethod
    def _result(value: float, operations: int = 1) -> "Counted":
        Counted.operations += operations
        return Counted(value)

    @staticmethod
    def fma(x: "Counted | float", y: "Counted | float", z: "Counted | float") -> "Counted":
        """x y + z."""
        return Counted._result(_value(x) * _value(y) + _value(z), 2)

    @staticmethod
    def root(x: "Counted") -> "Counted":
        """Square root."""
        return Counted._result(sqrt(x.value))

    @staticmethod
    def sine(x: "Counted") -> "Counted":
        """Sine, not counted."""
        return Counted(sin(x.value))

    @staticmethod
    def cosine(x: "Counted") -> "Counted":
        """Cosine, not counted."""
        return Counted(cos(x.value))


def _value(number: "Counted | float") -> float:
    return number.value if isinstance(number, Counted) else number


class Cells:
    """An array of counted numbers, accessed by the functions of `sim.kernel.lanes`."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        self._values: dict[tuple[int, ...], Counted] = {
            place: Counted(float(value)) for place, value in np.ndenumerate(values)
        }

    def get(self, *place: int) -> Counted:
        """The number at `place`."""
        return self._values[place]

    def put(self, *place_and_value: Any) -> None:
        """Set the number at a place, the leading arguments, to the last argument."""
        *place, value = place_and_value
        self._values[tuple(place)] = value

    def zero(self) -> Counted:
        """Zero."""
        return Counted(0.0)

    def values(self) -> list[float]:
        """The numbers in the order of their places."""
        return [self._values[place].value for place in sorted(self._values)]


def _is_nonzero(x: Counted) -> bool:
    return x.value != 0.0


_COUNTING: dict[str, Callable[..., Any]] = {
    **dict.fromkeys(("get", "get2"), Cells.get),
    **dict.fromkeys(("put", "put2"), Cells.put),
    "zero": Cells.zero,
    "fma": Counted.fma,
    "root": Counted.root,
    "sine": Counted.sine,
    "cosine": Counted.cosine,
    "some": _is_nonzero,
}
"""Replacements for the functions of `sim.kernel.lanes`."""


def _counting(function: Callable[..., None]) -> Callable[..., None]:
    """The function for counted numbers: the same code with the operations of `_COUNTING`."""
    assert isinstance(function, FunctionType)
    return FunctionType(function.__code__, {**function.__globals__, **_COUNTING}, argdefs=function.__defaults__)


def series(order: int) -> tuple[int, NDArray[np.float64]]:
    """Number of operations of the series of one step of the standard case from its start, at `order`, and the
    coefficients, shape (6, order + 1).
    """
    n = order
    start = np.zeros((6, n + 1))
    start[:, 0] = START.as_array()
    packed, row = Cells(SPECIMEN.packed()), Cells(drive().packed()[0])
    a, c, w = Cells(np.zeros(n + 1)), Cells(start), Cells(np.zeros((WORK_ROWS, n + 1)))
    side = float(np.sign(START.omega))
    Counted.operations = 0
    _counting(forcing_coefficients)(row, 0.0, a, n)
    _counting(rocking_coefficients)(packed, side, a, c, w, n)
    return Counted.operations, np.reshape(c.values(), (6, n + 1))


def arithmetic(repetitions: int) -> Section:
    """Operations per step, rate and share of the peak for a single run and for members in lanes, on one core."""
    run = RockingRun(SPECIMEN, Drive(drive()), START, None, None, TOLERANCE, 0.5 * pi)
    together = [run] * MEMBERS
    scalars = np.full(2 + CHAINS, 0.5)
    vectors = np.full((2 + CHAINS, LANES), 0.5)
    timings = in_turn(
        {
            "single": (run.motion, repetitions),
            "members": (lambda: side_by_side(together), repetitions),
            "scalars": (lambda: multiply_adds(scalars, ROUNDS), repetitions),
            "vectors": (lambda: multiply_adds_in_lanes(vectors, ROUNDS), repetitions),
        }
    )
    flops, _ = series(run.order)
    steps = timings["single"].result.steps
    rows: list[dict[str, Cell]] = []
    for name, key, count, lanes, peak in (
        ("single run", "single", 1, 1, "scalars"),
        ("members in lanes", "members", MEMBERS, LANES, "vectors"),
    ):
        step = timings[key].minimum / count / steps
        greatest = 2.0 * CHAINS * ROUNDS * lanes / timings[peak].minimum
        rows.append(
            {
                "method": name,
                "order": run.order,
                "flops": flops,
                "step_us": 1e6 * step,
                "rate": 1e-9 * flops / step,
                "peak": 1e-9 * greatest,
                "share": 100.0 * flops / step / greatest,
            }
        )
    notes = (
        f"{steps} steps of the standard case without peaks. The operations are those of the series of a rocking step, "
        "counted by executing its source; sines, the length of the step, its end state and the search for events take "
        "time but are not counted.",
        f"Peak: independent fused multiply-adds of single numbers, and of vectors of {LANES}, in a compiled loop.",
    )
    return Section("arithmetic", "Operations per step and share of the core's peak", COLUMNS, rows, notes)
