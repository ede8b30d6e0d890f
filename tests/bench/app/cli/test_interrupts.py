"""Ctrl-C in real processes: answered within half a second in whatever phase a command is, and nothing is left behind.

Nine early moments of commands of every kind; with the mark soak twenty moments of all commands, also later ones.
`python -m tests.interrupts` runs two hundred.
"""

import sys

import pytest

from tests.interrupts import Bed, Moment, moments

if sys.platform == "win32":
    pytest.skip("sends SIGINT to a group of processes", allow_module_level=True)

KINDS = (
    "run: planning",
    "run: point",
    "queue",
    "predict steady: first",
    "predict map",
    "predict modes",
    "report: pdf",
    "export csv",
    "gui",
)
"""Planning in native code, rigs that are driven, a kernel that is compiled, files that are written, a window."""
MOMENTS = [
    # a draw in which each command is in the phase that it stands for, and a rig that is driven gets a second signal
    *moments(len(KINDS), seed=466_552, only=KINDS, latest=1.5),
    *(pytest.param(each, marks=pytest.mark.soak) for each in moments(20, seed=20, latest=6.0)),
]


@pytest.fixture(scope="module")
def bed(tmp_path_factory: pytest.TempPathFactory) -> Bed:
    return Bed(tmp_path_factory.mktemp("interrupts"))


@pytest.mark.parametrize("moment", MOMENTS, ids=lambda each: each.command.name)
def test_ctrl_c_is_answered_and_leaves_nothing(bed: Bed, moment: Moment) -> None:
    reaction = bed.reaction(moment)
    assert reaction is not None
    assert reaction.faults == [], reaction
