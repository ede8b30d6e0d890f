"""The masses of the storeys: as a specimen file has them, else as configured."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.engine.steps import Outcome, Say, Step
from bench.events import Warned
from protocols.common.decays.parameters import DecayParameters
from sim.errors import InvalidInput
from sim.identified import Identified

MASSES = ("m1", "m2")


def known_masses(known: Identified | None) -> Identified | None:
    """What is known, where both masses are; else None."""
    return known if known is not None and set(MASSES) <= set(known.names) else None


def masses_weighed(parameters: DecayParameters, known: Identified | None) -> NDArray[np.float64]:
    """Covariance of both masses [kg2], shape (2, 2)."""
    if (found := known_masses(known)) is not None:
        return found.covariance(MASSES)
    rho = parameters.mass_correlation
    return parameters.mass_uncertainty**2 * np.array([[1.0, rho], [rho, 1.0]])


def check_masses(parameters: DecayParameters, configuration: BenchConfiguration) -> None:
    """Raise InvalidInput for a stated weighing where the specimen file has one of its own."""
    if (known := known_masses(configuration.identified)) is None:
        return
    for item in ("mass_uncertainty", "mass_correlation"):
        value = getattr(parameters, item)
        if value != DecayParameters.model_fields[item].default:
            allowed = f"{_text(known)} are those of the specimen file: leave it out, or take both out of that file"
            raise InvalidInput(item, value, allowed)


def masses_told(configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """A warning where the configuration has other masses than the specimen file, whose masses count."""
    if (known := known_masses(configuration.identified)) is None:
        return
    frame = configuration.specimen.frame
    found = {name: finding for name in MASSES if (finding := known.finding(name)) is not None}
    if any(finding.value != getattr(frame, name) for name, finding in found.items()):
        asked = f"specimen.frame has m1 = {frame.m1:.6g} kg, m2 = {frame.m2:.6g} kg"
        text = f"the masses are those of the specimen file, {_text(known)}; {asked}, which does not count"
        yield Say(Warned(text))


def _text(known: Identified) -> str:
    found = [finding for name in MASSES if (finding := known.finding(name)) is not None]
    return ", ".join(f"{one.name} = {one.value:.6g} kg ({one.standard_uncertainty:.2g} kg)" for one in found)
