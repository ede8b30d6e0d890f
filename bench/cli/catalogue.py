"""The protocols that the command line offers: one row each."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TextIO

from protocols.coupling_stiffness.parameters import CouplingStiffnessParameters
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.free_rocking.parameters import FreeRockingParameters
from protocols.free_vibration.parameters import FreeVibrationParameters
from protocols.harmonic.parameters import HarmonicParameters
from protocols.identify.parameters import IdentifyParameters
from protocols.laser_calibration.parameters import LaserCalibrationParameters
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.events import Event
    from bench.session import Experiment


class Display(Protocol):
    """Shows a run: a `bench.events.Subscriber`, and a `bench.progress.Progress` for what is done without a rig."""

    def __call__(self, event: "Event") -> None:
        """Show an event."""
        ...

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """Show what is done before the rig is opened and after it is closed."""
        ...


Progress = Callable[[TextIO, bool], AbstractContextManager[Display]]
"""Shows a run on a stream; the second argument says whether a person answers its questions there."""


def _live(stream: TextIO, person_answers: bool) -> AbstractContextManager[Display]:
    from bench.cli.console import progress_on

    return progress_on(stream, person_answers)


def _always(summary: Mapping[str, Any]) -> bool:  # noqa: ARG001 - whatever was found, it was carried out
    return True


@dataclass(frozen=True)
class Entry:
    """A protocol on the command line: its flags come from `parameters`, and `campaign` makes it from an instance.

    `passed` turns the summary of a run that was carried out into its exit code: 0, or 1 when it is False. `positional`
    names the parameter that is given by place.
    """

    name: str
    summary: str
    details: str
    parameters: type[Parameters]
    campaign: Callable[[Any], "Experiment"]
    progress: Progress = _live
    passed: Callable[[Mapping[str, Any]], bool] = _always
    positional: str | None = None


def _harmonic(parameters: HarmonicParameters) -> "Experiment":
    from protocols.harmonic.campaign import HarmonicCampaign

    return HarmonicCampaign(parameters)


def _identify(parameters: IdentifyParameters) -> "Experiment":
    from protocols.identify.experiment import Identification

    return Identification(parameters)


def _earthquake(parameters: EarthquakeParameters) -> "Experiment":
    from protocols.earthquake.campaign import EarthquakeCampaign

    return EarthquakeCampaign(parameters)


def _free_vibration(parameters: FreeVibrationParameters) -> "Experiment":
    from protocols.free_vibration.experiment import FreeVibration

    return FreeVibration(parameters)


def _coupling_stiffness(parameters: CouplingStiffnessParameters) -> "Experiment":
    from protocols.coupling_stiffness.experiment import CouplingStiffness

    return CouplingStiffness(parameters)


def _free_rocking(parameters: FreeRockingParameters) -> "Experiment":
    from protocols.free_rocking.experiment import FreeRockingTest

    return FreeRockingTest(parameters)


def _laser_calibration(parameters: LaserCalibrationParameters) -> "Experiment":
    from protocols.laser_calibration.experiment import LasersCalibrated

    return LasersCalibrated(parameters)


CATALOGUE = (
    Entry(
        name="harmonic",
        summary="Steady sine tests of the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
        details=(
            "Tests the bare frame at every frequency, then the coupled frame at every frequency and stiffness, and "
            "compares the measured gain of the peak drift with the predicted one. Without options: the campaign of the "
            "paper on the simulated bench."
        ),
        parameters=HarmonicParameters,
        campaign=_harmonic,
    ),
    Entry(
        name="identify",
        summary="Identify the table: what acceleration a volt of drive makes at each frequency.",
        details=(
            "Plays multisines with random phases at low level with the specimen on the table, after probes that need "
            "nothing to be known of it, and tells response, noise and nonlinear distortion apart. The result, "
            "table_model.json, is what `table_model` in the configuration of other runs names. Without options: the "
            "bare frame, over the band that replicating records takes."
        ),
        parameters=IdentifyParameters,
        campaign=_identify,
    ),
    Entry(
        name="earthquake",
        summary="Earthquake records on the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
        details=(
            "Each record is limited to a band, scaled, and fitted to the stroke; the table learns it with the bare "
            "frame, and it is played with every spring. The measured gain of the peak drift is compared with the one "
            "predicted for the motion that the table really made. A block that topples is a result. Records are files, "
            "or synthetic:NAME."
        ),
        parameters=EarthquakeParameters,
        campaign=_earthquake,
        positional="records",
    ),
    Entry(
        name="free-vibration",
        summary="Free decay of the bare frame: stiffness and damping with their covariance, given the weighed masses.",
        details=(
            "A short pulse of the table, or a hand on a locked table, sets the bare frame ringing. The exact response "
            "to the measured motion of the table is fitted to both lasers, several times. The result, specimen.json, "
            "is what other runs load in place of what is assumed of the specimen. Without options: five decays after "
            "pulses, about ten minutes."
        ),
        parameters=FreeVibrationParameters,
        campaign=_free_vibration,
    ),
    Entry(
        name="coupling-stiffness",
        summary="Stiffness of mounted springs, from the shift of the frame's modes with the block held.",
        details=(
            "Decays of the bare frame, then with each spring mounted and its block clamped to the table: the spring "
            "adds to the stiffness of the first storey. Its stiffness is the difference, and beta as mounted follows. "
            "The result, specimen.json, is what other runs load."
        ),
        parameters=CouplingStiffnessParameters,
        campaign=_coupling_stiffness,
    ),
    Entry(
        name="free-rocking",
        summary="Free rocking of the block: restitution of its impacts, measured over theoretical.",
        details=(
            "The stand-alone block is tilted by hand and let go on a locked table, a laser on its face, several times. "
            "The exact nonlinear motion is fitted to each recording, and the sizes of the swings tell the restitution "
            "again, impact by impact. The result, specimen.json, is what other runs load. Nothing is driven. Without "
            "options: three tilts to either side, about five minutes."
        ),
        parameters=FreeRockingParameters,
        campaign=_free_rocking,
    ),
    Entry(
        name="laser-calibration",
        summary="Calibrate both lasers, and the table's sensors, against one slow motion with the frame locked.",
        details=(
            "The storeys are clamped to the table, which moves slowly over the range that the tests see. Scale, smooth "
            "linearity error and delay of each laser follow, and how far the two agree. The result, "
            "laser_calibration.json, is what `laser_calibration` in the configuration of other runs names. Without "
            "options: eight passes of 50 mm, about four minutes."
        ),
        parameters=LaserCalibrationParameters,
        campaign=_laser_calibration,
    ),
)
