"""Live view of a harmonic campaign."""

from bench.live_view import GainCurve, LiveRun, LiveView


def gain_view(_run: LiveRun) -> LiveView:
    """Measured gains and predicted lines of alpha_2 over the frequency."""
    return (GainCurve(),)
