"""Live view of a harmonic campaign."""

from bench.live_view import GainCurve, LiveRun, LiveView


def gain_view(_run: LiveRun) -> LiveView:
    """The gain spectrum."""
    return (GainCurve(),)
