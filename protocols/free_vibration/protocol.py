"""Free vibration of the bare frame."""

from typing import Literal

from pydantic import model_validator

from bench.protocol import Protocol, RunView, deferred
from protocols.common.decays.parameters import DecayParameters, DecayPoint
from sim.errors import InvalidInput
from sim.parameters import quantity


class FreeVibrationParameters(DecayParameters):
    """Free decays of the bare frame after a pulse of the table, or after a release by hand on a locked table."""

    excitation: Literal["pulse", "hand"] = quantity(
        "pulse", "", "excitation: pulse (short motion of the table) or hand (release of storey 2 by hand)"
    )
    pull: float = quantity(0.020, "m", "displacement of storey 2 before the release by hand", gt=0, le=0.2)

    @model_validator(mode="after")
    def _check_excitation(self) -> "FreeVibrationParameters":
        others = {"hand": ("drift", "pulse"), "pulse": ("pull",)}
        for item in others[self.excitation]:
            value, default = getattr(self, item), FreeVibrationParameters.model_fields[item].default
            if value != default:
                other = "pulse" if self.excitation == "hand" else "hand"
                raise InvalidInput(item, value, f'it applies only to the excitation "{other}"; omit it')
        return self


PROTOCOL = Protocol(
    name="free-vibration",
    summary="Free decay of the bare frame: stiffness and damping with their covariance, given the storey masses.",
    details=(
        "A short pulse of the table, or a release by hand on a locked table, excites the bare frame. For each of "
        "several decays, the exact response to the measured motion of the table is fitted to the signals of both "
        "lasers. Other runs can use the result, specimen.json, in place of the assumed values. Without options, a run "
        "has five decays after pulses and takes about ten minutes."
    ),
    example="--config bench.toml --operator Weber",
    parameters=FreeVibrationParameters,
    point=DecayPoint,
    prepare=deferred("protocols.free_vibration.experiment:FreeVibration"),
    figures=("free_vibration.png",),
    files=("specimen.json",),
    report=deferred("protocols.free_vibration.report:vibration_sections"),
    view=RunView(
        headline="k1_n_m",
        labels={
            "k1_n_m": "stiffness k₁",
            "k2_n_m": "stiffness k₂",
            "xi1": "damping ξ₁",
            "xi2": "damping ξ₂",
            "omega1_rad_s": "frequency ω₁",
            "omega2_rad_s": "frequency ω₂",
        },
        live=deferred("protocols.common.decays.live:decay_view"),
    ),
)
