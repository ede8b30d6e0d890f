"""What was tested: the parameters of the specimen, and its modes as in Fig. 3 of the paper."""

from collections.abc import Sequence

from bench.config.declared import declared
from bench.prediction.files import rows_of
from bench.prediction.modes import modes_table
from bench.publication.numbers import plain, with_uncertainty
from bench.publication.typography import moment, typeset, unit_text
from bench.record.tables import arrays
from bench.report.modes_figure import modes_figure
from bench.report.page.document import Column, Part, Picture, Section, Table
from sim.identified import Identified, spring_label
from sim.specimen import Specimen
from sim.uncertainty import SpecimenUncertainty

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
    "restitution_factor": "r/r_th",
}
"""How parameters are written, where it is not by their names."""


def specimen_section(
    specimen: Specimen, uncertainty: SpecimenUncertainty | None, identified: Identified | None = None
) -> Section:
    """The parameters of frame, block and spring, and what of them was measured; `uncertainty` is None where they are
    taken as exact.
    """
    text = (
        "A two-storey shear frame whose first storey a spring couples to a rigid block that rocks on its base. Every "
        "prediction in this report was computed from these values."
    )
    if uncertainty is None:
        text += " They are those of the paper's Tables 1 to 3 unless said otherwise, and taken as exact."
    measured = () if identified is None else identified.names
    parts: list[Part] = [text, _parameters(specimen, uncertainty, measured), _derived(specimen)]
    if identified is not None and identified.findings:
        parts.append(findings_table(identified))
    return Section("specimen", "Specimen", parts)


def modes_section(specimen: Specimen, betas: Sequence[float]) -> Section:
    """Frequencies and shapes, as a figure and as a table."""
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
        Column("rate of growth", "1/s"),
        Column("u₁", "1"),
        Column("u₂", "1"),
        Column("ϑ", "rad/m"),
    ]
    divergent = bool(table["divergent"].values.any())
    note = " A divergent mode has negative stiffness: it grows and has no frequency." if divergent else ""
    return Section(
        "modes",
        "Modes (as Fig. 3 of the paper)",
        [
            "Modes of the bare frame and of the linearised coupled system, Eq. 12 to 14, without damping." + note,
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
        others = " that was not measured" if any(spring_label(name) for name in measured) else ""
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
    return Table(
        "Parameters of the specimen, and the half widths within which every value is equally likely", columns, rows
    )


def finding_label(name: str) -> str:
    """How the quantity of a finding is written."""
    label = spring_label(name)
    return SYMBOLS.get(name, name) if label is None else f"k_C, spring of β = {label:g}"


def findings_table(identified: Identified, title: str = "What was identified of the specimen") -> Table:
    """Findings with their expanded uncertainties and where they are from."""
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
        ("ω₁, ω₂", "circular frequencies of the bare frame", f"{plain(first, 6)}, {plain(second, 6)}", "rad/s"),
        ("c₁, c₂", "dashpots that give the modal damping ratios", f"{plain(c1, 6)}, {plain(c2, 6)}", "N s/m"),
        ("M", "mass of the block", plain(block.mass, 5), "kg"),
        ("J", "moment of inertia of the block about a base corner", plain(block.inertia, 6), "kg m²"),
        ("λ", "slenderness of the block, h_b/b", plain(block.slenderness, 4), "1"),
        ("r", "restitution: angular velocity after over before an impact", plain(block.restitution, 6), "1"),
        ("g/λ", "base acceleration that lifts the stand-alone block", plain(specimen.uplift_acceleration, 6), "m/s²"),
    ]
    columns = [Column("symbol", words=True), Column("meaning", words=True), Column("value"), Column("unit", words=True)]
    return Table("What follows from them (nominal values)", columns, [list(row) for row in values])
