"""Traces of a run display: their columns in the blocks of traces, labels, units and displayed duration."""

from collections.abc import Sequence

from bench.analysis.signals import Further
from bench.app.display import texts
from bench.app.ipc.messages import TRACES
from bench.document.typography import unit_text

SHOWN = ("drive", "acceleration", "u1", "u2", "drift")
"""Names of the drawn columns, in the order of their labels in `texts.TRACES`."""
WINDOW = 10.0
"""Displayed duration [s]."""
STALE = 2.0
"""Age of the newest sample [s] above which traces and picture are marked as not live."""

Label = tuple[str, str, float]
"""Label, displayed unit, and displayed units per SI unit."""


def columns_of(further: Sequence[Further]) -> list[int]:
    """Indices of the drawn columns in a block of traces; `further` are the additional signals of the rig."""
    return [*(TRACES.index(name) for name in SHOWN), *range(len(TRACES), len(TRACES) + len(further))]


def labels_of(further: Sequence[Further], face: float | None) -> tuple[Label, ...]:
    """Labels of the drawn traces; `face` is the height [m] at which laser 2 measures the block, None while it measures
    storey 2.
    """
    others = tuple((each.name.replace("_", " "), unit_text(each.unit), 1.0) for each in further)
    if face is None:
        return (*texts.TRACES, *others)
    lasers = (
        (texts.ON_BLOCK.get(name, name).format(height=1e3 * face), unit, factor) for name, unit, factor in texts.TRACES
    )
    return (*lasers, *others)
