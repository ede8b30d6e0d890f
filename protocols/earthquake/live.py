"""Live view of a seismic campaign: gains, and the last achieved motion of the table on the record."""

from bench.live_view import GainCurve, LiveRun, LiveView, Panel
from protocols.common.replicate import TableMotion


def seismic_view(run: LiveRun) -> LiveView:
    """Gain against the stiffness ratio for each record; acceleration of the table in the last play, with the record."""
    motions = run.events(TableMotion)
    panel = Panel(
        "record and achieved motion",
        ("time", "s"),
        ("acceleration", "m/s2"),
        awaits="The record and the achieved motion of the table appear here after the first pass.",
    )
    if motions:
        last = motions[-1]
        panel.title = f"{last.motion}, {last.play}"
        panel.line("achieved", last.seconds, last.achieved).predicted("record", last.seconds, last.target)
    return GainCurve(), panel
