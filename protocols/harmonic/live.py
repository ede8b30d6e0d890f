"""Live view of a harmonic campaign."""

from bench.live_view import GainCurve, LiveRun, LiveView


def gain_view(_run: LiveRun) -> LiveView:
    """Measured points and predicted curves of alpha_2 against frequency."""
    return (GainCurve(),)
