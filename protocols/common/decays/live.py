"""Live view of free decays."""

from bench.live_view import LiveRun, LiveView, Panel


def decay_panel(run: LiveRun) -> Panel:
    """The last decay that was fitted, with the motion of the fitted frame."""
    panel = Panel(
        run.fits[-1].name if run.fits else "decay",
        ("time", "s"),
        ("displacement", "m"),
        awaits="The signals of both lasers and the fitted decay appear here after the first decay.",
    )
    return panel.fit(run.fits[-1]) if run.fits else panel


def decay_view(run: LiveRun) -> LiveView:
    """The last fitted decay, and the stiffness of each storey by decay, relative to the mean of the decays so far."""
    decays = [point for point in run.points if getattr(point, "decay", 0) > 0]
    stiffness = Panel(
        "stiffness, deviation from the mean",
        ("decay", "1"),
        ("deviation", "%"),
        awaits="The stiffnesses appear here after each decay.",
    )
    number = run.column("decay", decays)
    for name in ("k1", "k2") if decays else ():
        value, spread = run.column(f"{name}_n_m", decays), run.column(f"{name}_uncertainty", decays)
        mean = float(value.mean())
        stiffness.points(name, number, 100.0 * (value / mean - 1.0), 100.0 * spread / mean)
    return decay_panel(run), stiffness
