"""Protocols that are still to be rebuilt on `bench.protocol`, each behind the one interface."""

from collections.abc import Callable, Generator, Sequence
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.protocol import Prepared, Protocol, Result, Sources
from protocols.check.line import CheckLine, Verdict
from protocols.check.parameters import CheckParameters
from protocols.check.table import sentence
from protocols.coupling_stiffness.parameters import CouplingStiffnessParameters
from protocols.coupling_stiffness.point import SpringPoint
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.point import EarthquakePoint
from protocols.free_rocking.parameters import FreeRockingParameters
from protocols.free_rocking.point import RockingPoint
from protocols.free_vibration.parameters import FreeVibrationParameters
from protocols.free_vibration.point import DecayPoint
from protocols.identify.parameters import IdentifyParameters
from protocols.identify.point import IdentifiedBand
from protocols.laser_calibration.parameters import LaserCalibrationParameters
from protocols.laser_calibration.point import CalibratedSensor
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration
    from bench.engine.steps import Outcome, Step
    from bench.preflight.forecast import Forecast
    from bench.record.tables import Table


class Adapted(Prepared[Any]):
    """An experiment of the former interface."""

    def __init__(
        self, where: str, parameters: Any, configuration: "BenchConfiguration", stored: "Sources | None" = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        module, _, name = where.partition(":")
        self.experiment: Any = getattr(import_module(module), name)(parameters)
        if stored is not None and hasattr(self.experiment, "restore"):
            self.experiment.restore(stored)
        self.experiment.check(configuration)

    @cached_property
    def forecast(self) -> "Forecast":
        from bench.preflight.forecast import Forecast

        each = self.experiment
        return each.preflight(self.configuration, self.progress) if hasattr(each, "preflight") else Forecast()

    @cached_property
    def prediction(self) -> "Table":
        return self.experiment.predict(self.configuration)

    @cached_property
    def sources(self) -> "Sources":
        return self.experiment.sources(self.configuration) if hasattr(self.experiment, "sources") else {}

    def plan(self) -> "Generator[Step, Outcome, Result]":
        from bench.engine.steps import Say
        from bench.events import PointFinished

        points: list[Parameters] = []
        plan = self.experiment.plan(self.configuration)
        try:
            step = next(plan)
            while True:
                if isinstance(step, Say) and isinstance(step.event, PointFinished):
                    points.append(step.event.point)
                step = plan.send((yield step))
        except StopIteration:
            return self.result(points)
        finally:
            plan.close()

    def result(self, points: Sequence[Parameters]) -> Result:
        each = self.experiment
        figures: dict[str, Callable[[Path], None]] = {
            each.figure_name: lambda path: each.figure(points, self.prediction, path)
        }
        for name in getattr(each, "further_figures", ()):
            figures[name] = partial(self._further, name)
        files: dict[str, Callable[[Path], None]] = {}
        if hasattr(each, "keep"):
            files[each.kept_name] = each.keep
        judged = [point.verdict for point in points if isinstance(point, CheckLine)]
        return Result(
            tuple(points),
            each.table(points),
            figures,
            each.findings(points) if hasattr(each, "findings") else {},
            files,
            all(verdict is not Verdict.FAILED for verdict in judged) if each.name == "check" else None,
        )

    def _further(self, name: str, path: Path) -> None:
        # one call draws all of them
        if name == self.experiment.further_figures[0]:
            self.experiment.draw_further(path.parent)


IDENTIFY = Protocol(
    name="identify",
    summary="Identify the table: what acceleration a volt of drive makes at each frequency.",
    details=(
        "Plays multisines with random phases at low level with the specimen on the table, after probes that need "
        "nothing to be known of it, and tells response, noise and nonlinear distortion apart. The result, "
        "table_model.json, is what `table_model` in the configuration of other runs names. Without options: the "
        "bare frame, over the band that replicating records takes."
    ),
    example="--config bench.toml --dry-run",
    parameters=IdentifyParameters,
    point=IdentifiedBand,
    prepare=partial(Adapted, "protocols.identify.experiment:Identification"),
    figures=("table_response.png",),
    files=("table_model.json",),
)

EARTHQUAKE = Protocol(
    name="earthquake",
    summary="Earthquake records on the bare and the coupled frame: gain coefficient alpha_2 against prediction.",
    details=(
        "Each record is limited to a band, scaled, and fitted to the stroke; the table learns it with the bare "
        "frame, and it is played with every spring. The measured gain of the peak drift is compared with the one "
        "predicted for the motion that the table really made. A block that topples is a result. Records are files, "
        "or synthetic:NAME."
    ),
    example="RECORD.AT2 --beta 0.25 0.64",
    parameters=EarthquakeParameters,
    point=EarthquakePoint,
    prepare=partial(Adapted, "protocols.earthquake.campaign:EarthquakeCampaign"),
    figures=(
        "gain_curves.png",
        "table_motions.png",
        "drift_histories.png",
    ),
    positional="records",
)

FREE_VIBRATION = Protocol(
    name="free-vibration",
    summary="Free decay of the bare frame: stiffness and damping with their covariance, given the weighed masses.",
    details=(
        "A short pulse of the table, or a hand on a locked table, sets the bare frame ringing. The exact response "
        "to the measured motion of the table is fitted to both lasers, several times. The result, specimen.json, "
        "is what other runs load in place of what is assumed of the specimen. Without options: five decays after "
        "pulses, about ten minutes."
    ),
    example="--config bench.toml --operator Weber",
    parameters=FreeVibrationParameters,
    point=DecayPoint,
    prepare=partial(Adapted, "protocols.free_vibration.experiment:FreeVibration"),
    figures=("free_vibration.png",),
    files=("specimen.json",),
)

COUPLING_STIFFNESS = Protocol(
    name="coupling-stiffness",
    summary="Stiffness of mounted springs, from the shift of the frame's modes with the block held.",
    details=(
        "Decays of the bare frame, then with each spring mounted and its block clamped to the table: the spring "
        "adds to the stiffness of the first storey. Its stiffness is the difference, and beta as mounted follows. "
        "The result, specimen.json, is what other runs load."
    ),
    example="--beta 0.4 --specimen FILE",
    parameters=CouplingStiffnessParameters,
    point=SpringPoint,
    prepare=partial(Adapted, "protocols.coupling_stiffness.experiment:CouplingStiffness"),
    figures=("coupling_stiffness.png",),
    files=("specimen.json",),
)

FREE_ROCKING = Protocol(
    name="free-rocking",
    summary="Free rocking of the block: restitution of its impacts, measured over theoretical.",
    details=(
        "The stand-alone block is tilted by hand and let go on a locked table, a laser on its face, several times. "
        "The exact nonlinear motion is fitted to each recording, and the sizes of the swings tell the restitution "
        "again, impact by impact. The result, specimen.json, is what other runs load. Nothing is driven. Without "
        "options: three tilts to either side, about five minutes."
    ),
    example="--config bench.toml --specimen FILE",
    parameters=FreeRockingParameters,
    point=RockingPoint,
    prepare=partial(Adapted, "protocols.free_rocking.experiment:FreeRockingTest"),
    figures=("free_rocking.png",),
    files=("specimen.json",),
)

LASER_CALIBRATION = Protocol(
    name="laser-calibration",
    summary="Calibrate both lasers, and the table's sensors, against one slow motion with the frame locked.",
    details=(
        "The storeys are clamped to the table, which moves slowly over the range that the tests see. Scale, smooth "
        "linearity error and delay of each laser follow, and how far the two agree. The result, "
        "laser_calibration.json, is what `laser_calibration` in the configuration of other runs names. Without "
        "options: eight passes of 50 mm, about four minutes."
    ),
    example="--config bench.toml",
    parameters=LaserCalibrationParameters,
    point=CalibratedSensor,
    prepare=partial(Adapted, "protocols.laser_calibration.experiment:LasersCalibrated"),
    figures=("laser_errors.png",),
    files=("laser_calibration.json",),
)

CHECK = Protocol(
    name="check",
    summary="Check the loop of the configured bench at low level, line by line: passed or failed, and what to do.",
    details=(
        "Listens to every channel at rest, then drives sines of one velocity with the frame locked to the table, and "
        "compares polarity, scale and delay of all sensors, and the drive. The exit code is 1 also when a line failed."
    ),
    example="--config bench.toml",
    parameters=CheckParameters,
    point=CheckLine,
    prepare=partial(Adapted, "protocols.check.experiment:LoopCheck"),
    figures=("margins.png",),
    log_line=sentence,
)
