"""Ctrl-C in real processes: answered within half a second in whatever phase a command is, and nothing is left behind.

`python -m tests.interrupts` runs two hundred such moments.
"""

import sys

import pytest

from tests.interrupts import Bed, Moment, moments

if sys.platform == "win32":
    pytest.skip("sends SIGINT to a group of processes", allow_module_level=True)

COUNT = 20


@pytest.fixture(scope="module")
def bed(tmp_path_factory: pytest.TempPathFactory) -> Bed:
    return Bed(tmp_path_factory.mktemp("interrupts"))


@pytest.mark.parametrize("moment", moments(COUNT, seed=20, latest=6.0), ids=lambda each: each.command.name)
def test_ctrl_c_is_answered_and_leaves_nothing(bed: Bed, moment: Moment) -> None:
    reaction = bed.reaction(moment)
    assert reaction is not None
    assert reaction.faults == [], reaction
