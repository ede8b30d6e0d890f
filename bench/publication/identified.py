"""What a campaign found of its specimen, as other runs take it: values, uncertainties, and how they hang together."""

from bench.publication.campaign import Campaign
from bench.publication.specimen import finding_label, findings_table
from bench.report.page.document import Column, Part, Section, Table

_SHOWN = 5e-3
"""Least correlation coefficient that is not printed as 0."""


def identified_section(campaign: Campaign) -> Section | None:
    """Findings and correlations; None for a file of a campaign that identified nothing."""
    identified = campaign.record.identified
    if identified is None:
        return None
    text = (
        "What is known of the specimen after this campaign: its own findings, and those it was given that it did not "
        "replace. It is what the campaign left in its specimen file."
    )
    parts: list[Part] = [text, findings_table(identified, "What is known of the specimen")]
    correlated = [name for name in identified.names if any(name in one.pair for one in identified.correlations)]
    if correlated:
        labels = [finding_label(name) for name in correlated]
        columns = [Column("", words=True), *(Column(label, "1") for label in labels)]
        rows = [
            [label, *(f"{value:.2f}" if abs(value) >= _SHOWN else "0" for value in row)]
            for label, row in zip(labels, identified.correlation(correlated), strict=True)
        ]
        parts.append(Table("Correlation coefficients of the errors of what was identified", columns, rows))
    return Section("identified", "Identified specimen", parts)
