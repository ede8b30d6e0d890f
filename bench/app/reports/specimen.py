"""Report sections on the specimen: parameters, identified values, and modes as in Fig. 3 of the paper."""

from collections.abc import Sequence

from bench.config.declared import declared
from bench.datafile.tables import arrays
from bench.document.campaign import Campaign
from bench.document.document import Column, Part, Picture, Section, Table
from bench.document.typography import moment, plain, typeset, unit_text, with_uncertainty
from bench.figures.modes_figure import modes_figure
from bench.prediction.files import rows_of
from bench.prediction.steady import modes_table
from sim.identified import Identified, spring_label
from sim.knowledge import SpecimenUncertainty
from sim.specimen import Specimen

SYMBOLS = {
    "h1": "h₁",
    "h2": "h₂",
    "m1": "m₁",
    "m2": "m₂",
    "k1": "k₁",
    "k2": "k₂",
    "xi1": "ξ₁",
    "xi2": "ξ₂",
    "rho": "ρ",
    "restitution_factor": "r/rₜₕ",
}
"""Printed symbols of the parameters whose symbols differ from their names."""

_SHOWN = 5e-3
"""Correlation coefficients below this magnitude are printed as 0."""


def specimen_section(
    specimen: Specimen, uncertainty: SpecimenUncertainty | None, identified: Identified | None = None
) -> Section:
    """Report section on the parameters of frame, block and spring, and on the identified properties. Without
    `uncertainty`, the parameters are treated as exact.
    """
    text = (
        "A two-storey shear frame, with its first storey coupled by a spring to a rigid block that rocks on its base. "
        "Every prediction in this report was computed from these values."
    )
    if uncertainty is None:
        text += " They are those of the paper's Tables 1 to 3 unless stated otherwise, and are treated as exact."
    measured = () if identified is None else identified.names
    parts: list[Part] = [text, _parameters(specimen, uncertainty, measured), _derived(specimen)]
    if identified is not None and identified.findings:
        parts.append(findings_table(identified))
    return Section("specimen", "Specimen", parts)


def identified_section(campaign: Campaign) -> Section | None:
    """Report section on the identified properties and their correlations; None if nothing was identified."""
    identified = campaign.record.identified
    if identified is None:
        return None
    text = (
        "Known properties of the specimen after this campaign, as in its specimen file: the campaign's "
        "findings, and earlier ones that it did not replace."
    )
    parts: list[Part] = [text, findings_table(identified, "Known properties of the specimen")]
    correlated = [name for name in identified.names if any(name in one.pair for one in identified.correlations)]
    if correlated:
        labels = [finding_label(name) for name in correlated]
        columns = [Column("", words=True), *(Column(label, "1") for label in labels)]
        rows = [
            [label, *(f"{value:.2f}" if abs(value) >= _SHOWN else "0" for value in row)]
            for label, row in zip(labels, identified.correlation(correlated), strict=True)
        ]
        parts.append(Table("Correlation coefficients of the errors of the identified values", columns, rows))
    return Section("identified", "Identified specimen", parts)


def modes_section(specimen: Specimen, betas: Sequence[float]) -> Section:
    """Report section on the modes: frequencies and shapes, as a figure and as a table."""
    table = modes_table(specimen, betas)
    rows = [
        [
            "bare frame" if row["system"] == "bare" else f"β = {row['beta']:g}",
            str(row["mode"]),
            plain(row["omega_rad_s"], 5),
            plain(row["frequency_hz"], 4),
            plain(row["growth_rate_per_s"], 4),
            plain(row["shape_u1"], 3),
            plain(row["shape_u2"], 3),
            plain(row["shape_theta_rad_per_m"], 3),
        ]
        for row in rows_of(table)
    ]
    columns = [
        Column("system", words=True),
        Column("mode"),
        Column("ω", "rad/s"),
        Column("f", "Hz"),
        Column("growth rate", "1/s"),
        Column("u₁", "1"),
        Column("u₂", "1"),
        Column("ϑ", "rad/m"),
    ]
    divergent = bool(table["divergent"].values.any())
    note = " A divergent mode has negative stiffness: it grows exponentially and has no frequency." if divergent else ""
    return Section(
        "modes",
        "Modes (as in Fig. 3 of the paper)",
        [
            "Modes of the bare frame and of the linearised coupled system, Eqs. 12 to 14, without damping." + note,
            Table("Modes (predicted, from the specimen's nominal values; shapes scaled to u₁ = 1)", columns, rows),
            Picture(
                modes_figure(arrays(table), specimen),
                "Modes of the bare frame and of the linearised coupled system (predicted).",
                "Drawings of frame, spring and block, at rest and displaced, for each mode, with its frequency.",
            ),
        ],
    )


def _parameters(specimen: Specimen, uncertainty: SpecimenUncertainty | None, measured: Sequence[str] = ()) -> Table:
    widths: dict[str, float] = {}
    if uncertainty is not None:
        widths = {
            **dict.fromkeys(("k1", "k2"), uncertainty.stiffness),
            **dict.fromkeys(("xi1", "xi2"), uncertainty.damping),
            "restitution_factor": uncertainty.restitution,
        }
    rows: list[list[str]] = []
    for group, owner in ((specimen.frame, "frame"), (specimen.block, "block"), (specimen, "spring")):
        for entry in declared(type(group)):
            value = getattr(group, entry.name)
            if entry.group is not None or not isinstance(value, float) or entry.name == "beta":
                continue
            width = widths.get(entry.name)
            half = "not stated" if width is None else f"± {100.0 * width:g} %"
            half = "measured" if entry.name in measured else half
            part = "all" if entry.name == "g" else owner
            rows.append(
                [
                    SYMBOLS.get(entry.name, entry.name),
                    part,
                    typeset(entry.description),
                    plain(value, 6),
                    unit_text(entry.unit),
                    half,
                ]
            )
    if uncertainty is not None:
        half = f"± {100.0 * uncertainty.spring:g} %"
        others = " if it was not measured" if any(spring_label(name) for name in measured) else ""
        rows.append(["k_C", "spring", f"stiffness of the spring{others}", "β k₁", "N/m", half])
    columns = [
        Column("symbol", words=True),
        Column("part", words=True),
        Column("meaning", words=True),
        Column("value"),
        Column("unit", words=True),
        Column("half width"),
    ]
    if uncertainty is None:
        return Table("Parameters of the specimen", columns[:-1], [row[:-1] for row in rows])
    return Table("Parameters of the specimen, and the half widths of their uniform distributions", columns, rows)


def finding_label(name: str) -> str:
    """Printed symbol of the identified quantity `name`."""
    label = spring_label(name)
    return SYMBOLS.get(name, name) if label is None else f"k_C, spring of β = {label:g}"


def findings_table(identified: Identified, title: str = "Identified properties of the specimen") -> Table:
    """Table of the identified properties with expanded uncertainties (k = 2), sources and dates."""
    columns = [
        Column("quantity", words=True),
        Column("measured"),
        Column("unit", words=True),
        Column("from", words=True),
        Column("date", words=True),
    ]
    rows: list[list[str]] = []
    for found in identified.findings:
        name = finding_label(found.name)
        value = with_uncertainty(found.value, 2.0 * found.standard_uncertainty)
        rows.append([name, value, unit_text(found.unit), typeset(found.source), moment(found.date.isoformat())])
    return Table(f"{title} (expanded uncertainties, k = 2)", columns, rows)


def _derived(specimen: Specimen) -> Table:
    frame, block = specimen.frame, specimen.block
    first, second = frame.natural_frequencies
    c1, c2 = frame.dashpots
    values = [
        ("ω₁, ω₂", "natural circular frequencies of the bare frame", f"{plain(first, 6)}, {plain(second, 6)}", "rad/s"),
        ("c₁, c₂", "dashpot coefficients for the modal damping ratios", f"{plain(c1, 6)}, {plain(c2, 6)}", "N s/m"),
        ("M", "mass of the block", plain(block.mass, 5), "kg"),
        ("J", "moment of inertia of the block about a base corner", plain(block.inertia, 6), "kg m²"),
        ("λ", "slenderness of the block, h_b/b", plain(block.slenderness, 4), "1"),
        (
            "r",
            "restitution: ratio of the angular velocities after and before an impact",
            plain(block.restitution, 6),
            "1",
        ),
        ("g/λ", "base acceleration at uplift of the stand-alone block", plain(specimen.uplift_acceleration, 6), "m/s²"),
    ]
    columns = [Column("symbol", words=True), Column("meaning", words=True), Column("value"), Column("unit", words=True)]
    return Table("Derived quantities (nominal values)", columns, [list(row) for row in values])
