"""Live view of a stability test: multipliers in the complex plane, and their modulus against frequency or amplitude."""

import numpy as np

from bench.live_view import LiveRun, LiveView, Panel

GROUNDS = {"table": "predicted", "fixed": "on fixed ground"}
CIRCLE = np.linspace(0.0, 2.0 * np.pi, 181)


def multiplier_view(run: LiveRun) -> LiveView:
    """Measured and predicted multipliers; the boundary of stability is the unit circle (modulus 1)."""
    by_amplitude = len(run.parameters.amplitude_factor) > 1
    place, axis = (
        ("amplitude_factor", ("amplitude factor", "1")) if by_amplitude else ("omega_rad_s", ("omega", "rad/s"))
    )
    plane = Panel(
        "dominant multiplier μ",
        ("Re μ", "1"),
        ("Im μ", "1"),
        awaits="The measured multipliers appear here, with the unit circle, after the first release.",
        equal=True,
    )
    modulus = Panel(
        "modulus |μ|", axis, ("|μ|", "1"), awaits="The measured moduli appear here after the first release."
    )
    plane.reference(np.cos(CIRCLE), np.sin(CIRCLE))
    planned = np.array(run.parameters.amplitude_factor if by_amplitude else run.parameters.omega)
    modulus.reference([planned.min(), planned.max()], [1.0, 1.0])
    for ground, name in GROUNDS.items():
        size, angle = run.predicted(f"{ground}_modulus"), run.predicted(f"{ground}_angle_rad")
        plane.predicted(name, size * np.cos(angle), size * np.sin(angle))
        modulus.predicted(name, run.predicted(place), size)
    size, angle = run.column("modulus"), run.column("angle_rad")
    plane.points("measured", size * np.cos(angle), size * np.sin(angle))
    modulus.points("measured", run.column(place), size, run.column("modulus_uncertainty"))
    return plane, modulus
