"""What the seismic campaign asks for: declared once, used by command line, file and documentation."""

from typing import Annotated

from pydantic import Field, field_validator

from sim.parameters import COUPLING, Parameters, each_once, quantity

Stiffness = Annotated[float, Field(gt=0, le=100)]


class EarthquakeParameters(Parameters):
    """Earthquake records on the bare and the coupled frame; stiffnesses and peak are those of the paper."""

    records: tuple[str, ...] = quantity(
        (),
        "",
        "records, before the flags: FILE, FILE@KEY=VALUE,... or synthetic:NAME[:SEED] (see `rockbench records`); "
        "absent: the seven synthetic ones",
    )
    beta: tuple[Stiffness, ...] = quantity(
        (0.25, 0.64, 0.97), "1", "stiffness ratios k_C/k1 of the coupling springs", min_length=1, usual=COUPLING
    )

    _each_once = field_validator("beta")(each_once)

    peak_factor: float = quantity(
        1.2, "1", "peak acceleration of the table over the uplift acceleration g/lambda", ge=0.05, le=5
    )
    table_band: str | None = quantity(
        None,
        "",
        "band LOW:HIGH [Hz] that the records are limited to before they are scaled (-6 dB, zero phase); absent: the "
        "usable band of the configured table",
    )
    length_ratio: float = quantity(
        1.0, "1", "model over prototype length: time is scaled by its root, acceleration kept", gt=0, le=1
    )
    trim: float = quantity(
        0.0005, "1", "share of the Arias intensity left out at either end of a record; 0 for none", ge=0, lt=0.1
    )
    longest: float = quantity(
        100.0,
        "s",
        "of a longer record, the part of this length with the most Arias intensity is played",
        ge=5,
        le=3600,
    )
    passes: int = quantity(
        5, "1", "passes at most in which the table learns a record, with the bare frame", ge=1, le=20
    )
    tolerance: float = quantity(
        0.005, "1", "rms error of the table without its noise, over the record's rms, that ends the passes", gt=0, lt=1
    )
    spectrum_tolerance: float = quantity(
        0.01,
        "1",
        "error of the table's response spectrum, 0.1 to 1 s and at the periods of the frame, without its noise, below "
        "which the passes end as well",
        gt=0,
        lt=1,
    )
    usable: float = quantity(
        0.05,
        "1",
        "rms error without its noise, over the record's rms, up to which the best drive is used although the passes "
        "ended before the tolerance: at a limit, at their number, or for want of samples",
        gt=0,
        lt=1,
    )
    decay: float = quantity(5.0, "s", "free vibration that is measured after a record", ge=0, le=120)
    rest: float = quantity(2.0, "s", "time at rest before a record, once the storeys are still", ge=0.5, le=60)
    draws: int = quantity(
        200,
        "1",
        "draws of the Monte Carlo behind each prediction; half of them for the bench alone, a quarter for each part",
        ge=40,
        le=5000,
    )
