"""Specimen: a two-storey shear frame, a rocking block, and the spring between them.

The symbols are those of the paper (Tables 1 to 3), and the values in the paper are the defaults.
"""

from functools import cached_property
from math import hypot, inf, isclose, sqrt

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import COUPLING, Parameters, quantity

SLOWEST, FASTEST = 1e-3, 1e5
"""Plausible natural frequencies [rad/s] of a frame on a shake table; others are regarded as typing errors."""


DAMPING = (0.001, 0.15)
"""Usual damping ratios of a metal laboratory frame with or without dampers: 0.1 % to 15 %."""


class Frame(Parameters):
    """Two-storey shear frame (Tables 1 and 3)."""

    h1: float = quantity(0.200, "m", "height of the first storey, where the spring acts", gt=0, usual=(0.02, 3.0))
    h2: float = quantity(0.496, "m", "height of the second storey", gt=0, usual=(0.02, 3.0))
    m1: float = quantity(1.062, "kg", "mass of the first storey", gt=0, usual=(0.05, 20.0))
    m2: float = quantity(1.062, "kg", "mass of the second storey", gt=0, usual=(0.05, 20.0))
    k1: float = quantity(213.44, "N/m", "stiffness of the first storey", gt=0)
    k2: float = quantity(56.45, "N/m", "stiffness of the second storey", gt=0)
    xi1: float = quantity(0.010, "1", "damping ratio of the first mode of the bare frame", ge=0, lt=1, usual=DAMPING)
    xi2: float = quantity(0.035, "1", "damping ratio of the second mode of the bare frame", ge=0, lt=1, usual=DAMPING)

    @model_validator(mode="after")
    def _check_frame(self) -> "Frame":
        if self.h1 >= self.h2:
            raise InvalidInput(
                "h1", self.h1, f"it must be less than h2 = {self.h2:g} m, the height of the second storey"
            )
        try:
            lower, upper = self.natural_frequencies
        except ArithmeticError:
            lower, upper = 0.0, 0.0
        if not (lower >= SLOWEST and upper <= FASTEST):
            given = f"m1 = {self.m1:g} kg, m2 = {self.m2:g} kg and k2 = {self.k2:g} N/m"
            makes = f"with {given}, a natural frequency is not between {SLOWEST:g} and {FASTEST:g} rad/s"
            raise InvalidInput("k1", self.k1, makes)
        return self

    @cached_property
    def natural_frequencies(self) -> tuple[float, float]:
        """Undamped circular frequencies of the bare frame [rad/s], ascending (closed form of the 2x2 problem)."""
        trace = (self.k1 + self.k2) / self.m1 + self.k2 / self.m2
        product = self.k1 * self.k2 / (self.m1 * self.m2)
        upper = 0.5 * (trace + sqrt(trace * trace - 4.0 * product))
        return sqrt(product / upper), sqrt(upper)

    @cached_property
    def dashpots(self) -> tuple[float, float]:
        """Dashpots (c1, c2) [N s/m] that give the modal damping ratios: phi_i' C phi_i = 2 xi_i omega_i.

        The modes are mass-normalised. With C = [[c1 + c2, -c2], [-c2, c2]], each mode gives one linear equation,
        phi_1i^2 c1 + (phi_2i - phi_1i)^2 c2 = 2 xi_i omega_i.
        """
        rows: list[tuple[float, float]] = []
        right: list[float] = []
        for omega, xi in zip(self.natural_frequencies, (self.xi1, self.xi2), strict=True):
            rows.append(self._modal_shares(omega))
            right.append(2.0 * xi * omega)
        c1, c2 = np.linalg.solve(np.array(rows), np.array(right))
        return float(c1), float(c2)

    @property
    def passive_ratios(self) -> tuple[float, float]:
        """Smallest and largest xi2 / xi1 that two dashpots can give unless one is negative: those of each one alone."""
        first, second = self.natural_frequencies
        alone = zip(self._modal_shares(first), self._modal_shares(second), strict=True)
        smallest, largest = sorted(upper / lower * first / second for lower, upper in alone)
        return smallest, largest

    def _modal_shares(self, omega: float) -> tuple[float, float]:
        """phi_1^2 and (phi_2 - phi_1)^2 [1/kg] of the mass-normalised mode with the circular frequency `omega`."""
        top = self.k2 / (self.k2 - omega * omega * self.m2)
        norm = self.m1 + self.m2 * top * top
        return 1.0 / norm, (top - 1.0) ** 2 / norm


class Block(Parameters):
    """Rigid rocking block (Table 2), which neither slides nor lifts off at both corners."""

    b: float = quantity(0.025, "m", "half width of the block", gt=0, usual=(0.005, 0.5))
    h_b: float = quantity(0.200, "m", "half height of the block", gt=0, usual=(0.02, 2.0))
    s: float = quantity(0.10, "m", "depth of the block, across the plane of motion", gt=0, usual=(0.01, 1.0))
    rho: float = quantity(2450.0, "kg/m3", "density of the block", gt=0, usual=(400.0, 12_000.0))
    restitution_factor: float = quantity(
        1.0, "1", "ratio of measured to theoretical restitution r_exp/r_th (the paper measured 0.992)", ge=0, le=2
    )

    @model_validator(mode="after")
    def _check_restitution(self) -> "Block":
        # if r < 0, as for a slab 1.42 times as wide as high, the impact would return the block to the previous corner
        if not 0.0 <= self.restitution <= 1.0:
            allowed = (
                f"with b = {self.b:g} m and h_b = {self.h_b:g} m it gives r = {self.restitution:.4g}, outside 0 to 1: "
                "an impact can neither increase nor reverse the speed"
            )
            raise InvalidInput("restitution_factor", self.restitution_factor, allowed)
        return self

    @property
    def mass(self) -> float:
        """M = rho 2b 2h_b s [kg]."""
        return self.rho * 4.0 * self.b * self.h_b * self.s

    @property
    def slenderness(self) -> float:
        """lambda = h_b / b."""
        return self.h_b / self.b

    @property
    def inertia(self) -> float:
        """J_A = J_B = 4/3 M (b^2 + h_b^2) about a base corner [kg m2]."""
        return 4.0 / 3.0 * self.mass * hypot(self.b, self.h_b) ** 2

    @property
    def restitution(self) -> float:
        """r = factor (J - 2b S_y) / J, S_y = M b: ratio of angular velocities after and before an impact (Housner)."""
        return self.restitution_factor * (1.0 - 2.0 * self.b * self.mass * self.b / self.inertia)

    def restitution_on(self, table_mass: float) -> float:
        """Restitution on a table that moves freely during the impact; `table_mass` [kg] is that without specimen.

        Housner's balance including the table's share of the horizontal momentum gives (r J - mu) / (J - mu) with
        mu = (M h_b)^2 / (m_t + M).
        """
        mu = (self.mass * self.h_b) ** 2 / (table_mass + self.mass)
        return (self.restitution * self.inertia - mu) / (self.inertia - mu)


class Spring(Parameters):
    """Coupling spring whose stiffness has been measured."""

    label: float = quantity(
        ..., "1", "label of the spring: beta, the ratio of its nominal stiffness to k1", gt=0, usual=COUPLING
    )
    k_c: float = quantity(..., "N/m", "measured stiffness of the spring", gt=0, usual=(5.0, 1100.0))


class Specimen(Parameters):
    """Frame, block and spring.

    `beta = None` is the bare frame: no block, no spring.

    The equations use `beta` and `k_c`. The `label` identifies a spring for the user, and does not change when k1 or k_C
    is measured.
    """

    frame: Frame = Frame()
    block: Block = Block()
    beta: float | None = quantity(
        None, "1", "stiffness ratio k_C/k1 of the spring; absent for the bare frame", ge=0, usual=COUPLING
    )
    spring_label: float | None = quantity(
        None, "1", "label of the mounted spring; if absent, beta", ge=0, usual=COUPLING
    )
    spring_k1: float | None = quantity(
        None,
        "N/m",
        "reference k1 of the springs' labels: nominal k_C = label times this value; if absent, k1",
        gt=0,
        usual=(40.0, 1100.0),
        example=213.44,
    )
    springs: tuple[Spring, ...] = quantity((), "", "springs whose stiffness has been measured")
    d: float = quantity(0.10, "m", "free length of the spring (not given in the paper)", gt=0, usual=(0.005, 1.0))
    g: float = quantity(9.81, "m/s2", "acceleration of gravity", gt=0, usual=(9.76, 9.84))

    @model_validator(mode="after")
    def _check_labels(self) -> "Specimen":
        labels = [spring.label for spring in self.springs]
        if len(set(labels)) < len(labels):
            raise InvalidInput("springs", labels, "each label may occur only once")
        if self.spring_label is not None and self.beta is None:
            raise InvalidInput("spring_label", self.spring_label, "the bare frame has no spring: omit it")
        return self

    @property
    def mass(self) -> float:
        """Mass on the table [kg]: the storeys of the frame and, unless the frame is bare, the block."""
        block = self.block.mass if self.beta is not None else 0.0
        return self.frame.m1 + self.frame.m2 + block

    @property
    def k_c(self) -> float:
        """Stiffness of the spring [N/m]; 0 for the bare frame."""
        return (self.beta or 0.0) * self.frame.k1

    @property
    def label(self) -> float | None:
        """Label of the mounted spring in requests, results and figures; None for the bare frame."""
        return self.beta if self.spring_label is None else self.spring_label

    @property
    def nominal_k_c(self) -> float:
        """Nominal stiffness of the mounted spring [N/m], from its label; 0 for the bare frame."""
        return (self.label or 0.0) * (self.spring_k1 or self.frame.k1)

    @property
    def uplift_acceleration(self) -> float:
        """g / lambda [m/s2]: base acceleration at which the stand-alone block lifts (Eq. 9)."""
        return self.g / self.block.slenderness

    def coupled(self, label: float) -> "Specimen":
        """Return the specimen with the spring labelled `label`. Its stiffness is the measured one or, if there is none,
        that of the mounted spring if this has the label, or else the nominal one.

        Raises InvalidInput for a label that is negative or not finite.
        """
        if not 0.0 <= label < inf:
            raise InvalidInput("beta", label, "the label of a spring, k_C/k1, must be finite and 0 or more")
        measured = next((each.k_c for each in self.springs if isclose(each.label, label)), None)
        if measured is not None:
            return self.with_spring(measured, label)
        if self.spring_label is not None and isclose(self.spring_label, label):
            return self
        return self._mounted(label) if self.spring_k1 is None else self.with_spring(label * self.spring_k1, label)

    def with_spring(self, k_c: float, label: float | None = None) -> "Specimen":
        """Return the specimen with a spring of stiffness `k_c` [N/m], labelled `label` or, by default, by its stiffness
        ratio.

        Raises InvalidInput for a stiffness that is negative or not finite.
        """
        if not 0.0 <= k_c < inf:
            raise InvalidInput("k_c", k_c, "the stiffness of a spring [N/m] must be finite and 0 or more")
        nominal = k_c / (self.spring_k1 or self.frame.k1)
        return self._mounted(k_c / self.frame.k1, nominal if label is None else label)

    def bare(self) -> "Specimen":
        """Return the frame without the block and the spring."""
        return self._mounted(None)

    def _mounted(self, beta: float | None, label: float | None = None) -> "Specimen":
        kept = {name: getattr(self, name) for name in ("frame", "block", "spring_k1", "springs", "d", "g")}
        return Specimen(**kept, beta=beta, spring_label=label if label != beta else None)

    def packed(self) -> NDArray[np.float64]:
        """Parameters for `sim.kernel`, shape (16,), in the order of `sim.kernel.packing`."""
        f, k, (c1, c2) = self.frame, self.block, self.frame.dashpots
        frame = (f.m1, f.m2, f.k1, f.k2, c1, c2, f.h1, self.k_c, self.d)
        block = (k.b, k.h_b, k.mass, k.inertia, k.restitution, self.g, 0.0 if self.beta is None else 1.0)
        return np.array((*frame, *block))
