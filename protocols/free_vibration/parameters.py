"""What the free vibration test asks for: declared once, used by command line, file and documentation."""

from typing import Literal

from pydantic import model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity


class DecayParameters(Parameters):
    """How the frame is set in motion, for how long it is watched, and what the weighing of the storeys leaves open."""

    drift: float = quantity(
        0.030,
        "m",
        "peak of the drift that a pulse is to reach; less where a limit of the bench asks for it",
        gt=0,
        le=1,
    )
    pulse: float | None = quantity(
        None,
        "s",
        "length of the pulse; absent: one over the geometric mean of the frame's frequencies",
        gt=0,
        le=10,
        usual=(0.02, 3.0),
    )
    window: float | None = quantity(
        None,
        "s",
        "time after the excitation that is watched; absent: until a twelfth of the first mode is left, 60 s at most",
        ge=5,
        le=300,
    )
    repeats: int = quantity(
        5, "1", "decays that are combined: their scatter is held against their uncertainty", ge=1, le=50
    )
    mass_uncertainty: float = quantity(
        0.0005, "kg", "standard uncertainty of the weighed mass of each storey", ge=0, le=0.1
    )
    mass_correlation: float = quantity(
        0.0, "1", "correlation of the errors of the two masses: 1 where they are the balance's, as a whole", ge=0, le=1
    )


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
