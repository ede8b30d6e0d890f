"""Live view of the identification: response of the table, and coherence."""

from bench.findings import TableIdentified
from bench.live_view import LiveRun, LiveView, Panel, response_panel


def response_view(run: LiveRun) -> LiveView:
    """Magnitude of the response, and coherence, against frequency."""
    found = run.events(TableIdentified)
    coherence = Panel(
        "coherence with the drive",
        ("frequency", "Hz"),
        ("coherence", "1"),
        awaits="The coherence appears here together with the response.",
        logarithmic="x",
    )
    if found:
        coherence.line("coherence", found[-1].frequency, found[-1].coherence)
    return response_panel(found[-1] if found else None), coherence
