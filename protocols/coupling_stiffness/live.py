"""Live view of the identification of springs: measured and labelled stiffness, and the last decay."""

import numpy as np

from bench.live_view import LiveRun, LiveView, Panel
from protocols.common.decays.live import decay_panel


def springs_view(run: LiveRun) -> LiveView:
    """Stiffness against the beta on the label, from every decay and from all decays of a spring, and the last decay."""
    panel = Panel(
        "stiffness of the springs",
        ("beta on the label", "1"),
        ("stiffness", "N/m"),
        awaits="The stiffness of each spring appears here after every decay; the line gives the labelled values.",
    )
    label, nominal = run.predicted("beta"), run.predicted("k_c")
    order = np.argsort(label)
    # the line of the labels passes through the origin
    panel.predicted("nominal", np.append(0.0, label[order]), np.append(0.0, nominal[order]))
    for name, together in (("one decay", False), ("all decays", True)):
        points = [point for point in run.points if (getattr(point, "decay", 0) == 0) == together]
        beta, stiffness, spread = (run.column(field, points) for field in ("beta", "k_c_n_m", "k_c_uncertainty"))
        panel.points(name, beta, stiffness, spread)
    return panel, decay_panel(run)
