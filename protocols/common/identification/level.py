"""How strong the multisines may be: what the bench and a standing block leave of the level that is asked for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.preflight.bounds import bounds
from bench.preflight.response import response_of
from protocols.common.identification.motion import RESTING, largest
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.signal import Complex, Grid, drive_for, grid, wanted_motions
from sim.specimen import Specimen

SHARE = 0.75
"""Share of each limit that is used."""

BLOCK_SHARE = 0.6
"""The same of the moment that lifts the block: what is not known of its spring, its frame and its base is outside."""


@dataclass(frozen=True, eq=False)
class Planned:
    """What is to be played: acceleration spectra `motions` at the lines of `grid`, whose largest peak is `level`.

    `asked` are the largest magnitudes of what they are predicted to ask for, see the module `motion`. `binds` names
    what sets the level.
    """

    grid: Grid
    motions: tuple[Complex, ...]
    level: float
    asked: dict[str, float]
    binds: str


def specimen_of(parameters: IdentifyParameters, configuration: BenchConfiguration) -> Specimen:
    """What stands on the table during the identification."""
    specimen = configuration.known_specimen
    return specimen.bare() if parameters.beta is None else specimen.coupled(parameters.beta)


def mounted_name(specimen: Specimen) -> str:
    """What stands on the table, as a table model calls it."""
    return "bare frame" if specimen.beta is None else f"block with the spring of beta = {specimen.label:g}"


def planned(parameters: IdentifyParameters, configuration: BenchConfiguration) -> Planned:
    """The motions at the level that is allowed. Raises InvalidInput for a band that cannot be made.

    The drive counts where the table is known, simulated or identified before.
    """
    specimen = specimen_of(parameters, configuration)
    lines = grid(parameters, configuration, specimen)
    unit = wanted_motions(parameters, lines)
    each = [_asked(lines, motion, specimen, configuration) for motion in unit]
    asked = {name: max(one[name] for one in each) for name in each[0]}
    limits = {name: SHARE * bound.limit for name, bound in bounds(configuration).items()} | {RESTING: BLOCK_SHARE}
    allowed = {name: limits[name] / value for name, value in asked.items() if value > 0.0}
    binds = min(allowed, key=lambda name: allowed[name])
    if parameters.level <= allowed[binds]:
        binds = "level"
    level = min(parameters.level, *allowed.values())
    scaled = {name: level * value for name, value in asked.items()}
    return Planned(lines, tuple(level * motion for motion in unit), level, scaled, binds)


def _asked(lines: Grid, motion: Complex, specimen: Specimen, configuration: BenchConfiguration) -> dict[str, float]:
    found = largest(lines.record(motion), lines.sample_rate, specimen, configuration)
    return found | _drive(lines, motion, specimen, configuration)


def _drive(lines: Grid, motion: Complex, specimen: Specimen, configuration: BenchConfiguration) -> dict[str, float]:
    """Peaks of the drive and of its slew, where something is known of the table within the whole band."""
    response = response_of(configuration)
    if response is None:
        return {}
    omega: NDArray[np.float64] = 2.0 * np.pi * lines.frequency
    payload = specimen.frame.m1 + specimen.frame.m2 + (specimen.block.mass if specimen.beta is not None else 0.0)
    gain = response.gain(omega, payload).astype(np.complex128)
    volts = lines.record(drive_for(motion, gain, lines, configuration.table_band[1]))
    slew = np.diff(volts) * lines.sample_rate
    return {"drive_voltage": float(np.abs(volts).max()), "drive_slew": float(np.abs(slew).max())}
