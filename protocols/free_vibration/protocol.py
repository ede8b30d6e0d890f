"""Free vibration of the bare frame: parameters and the protocol."""

from typing import TYPE_CHECKING, Literal

from pydantic import model_validator

from bench.protocol import Prepared, Protocol, Sources
from protocols.common.decays.parameters import DecayParameters, DecayPoint
from sim.errors import InvalidInput
from sim.parameters import quantity

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration


class FreeVibrationParameters(DecayParameters):
    """Free decays of the bare frame, after a pulse of the table or let go by hand on a locked table."""

    excitation: Literal["pulse", "hand"] = quantity(
        "pulse", "", "what sets the frame in motion: a short motion of the table, or a hand that lets storey 2 go"
    )
    pull: float = quantity(0.020, "m", "how far storey 2 is held aside before it is let go by hand", gt=0, le=0.2)

    @model_validator(mode="after")
    def _hands_make_no_pulse_and_pulses_do_not_pull(self) -> "FreeVibrationParameters":
        others = {"hand": ("drift", "pulse"), "pulse": ("pull",)}
        for item in others[self.excitation]:
            value, default = getattr(self, item), FreeVibrationParameters.model_fields[item].default
            if value != default:
                other = "pulse" if self.excitation == "hand" else "hand"
                raise InvalidInput(item, value, f'it belongs to the excitation "{other}"; leave it out')
        return self


def _prepare(
    parameters: FreeVibrationParameters, configuration: "BenchConfiguration", stored: "Sources | None"
) -> Prepared[FreeVibrationParameters]:
    from protocols.free_vibration.experiment import FreeVibration

    return FreeVibration(parameters, configuration, stored)


PROTOCOL = Protocol(
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
    prepare=_prepare,
    figures=("free_vibration.png",),
    files=("specimen.json",),
)
