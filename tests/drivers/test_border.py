"""The border to a rig backend: what it passes on, and what it keeps of the safety inputs."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.testing.loopback import LoopbackRig
from drivers.border import CheckedRig
from drivers.errors import BackendFault
from drivers.rig import Alignment


class Converting(LoopbackRig):
    """A rig that converts what it is given in place."""

    def write(self, volts: NDArray[np.float64]) -> None:
        super().write(volts.copy())
        volts *= 0.0


def test_a_backend_cannot_change_the_drive_that_the_guard_keeps() -> None:
    rig = CheckedRig(Converting(), "converting")
    rig.arm()
    drive = np.full(100, 0.5)
    rig.write(drive)
    np.testing.assert_array_equal(drive, 0.5)


def test_an_input_that_was_named_at_rest_is_required_for_ever() -> None:
    backend = LoopbackRig()
    backend.safety = {"emergency stop": True, "limit switch": True}
    rig = CheckedRig(backend, "loopback")
    assert rig.interlocks() == {"emergency stop": True, "limit switch": True}
    rig.arm()
    rig.stop()
    backend.safety = {}
    assert rig.interlocks() == {"emergency stop": False, "limit switch": False}
    backend.safety = {"emergency stop": True, "limit switch": True}
    assert rig.interlocks() == {"emergency stop": True, "limit switch": True}


@pytest.mark.parametrize("end", ["stop", "halt"])
def test_an_input_that_is_named_only_while_armed_may_be_absent_at_rest(end: str) -> None:
    backend = LoopbackRig()
    backend.safety = {"emergency stop": True}
    rig = CheckedRig(backend, "loopback")
    rig.interlocks()
    rig.arm()
    backend.safety = {"emergency stop": True, "amplifier ready": True}
    assert rig.interlocks() == backend.safety
    backend.safety = {"emergency stop": True}
    assert rig.interlocks() == {"emergency stop": True, "amplifier ready": False}
    getattr(rig, end)()
    assert rig.interlocks() == {"emergency stop": True}


def test_an_alignment_that_is_not_known_yet_is_no_fault() -> None:
    backend = LoopbackRig()
    backend.alignments = (Alignment(backend.channels[0].name, np.nan, np.nan, np.nan, 0.0, 0, 0, 0, 0),)
    (found,) = CheckedRig(backend, "loopback").alignments
    assert np.isnan(found.offset)


@pytest.mark.parametrize("given", [np.array([]), np.zeros(3), [], None, "", {}])
def test_raw_values_of_another_type_name_the_backend(given: object) -> None:
    class Lying(LoopbackRig):
        def raw_values(self) -> Any:
            return given

    with pytest.raises(BackendFault, match=r"loopback.*raw values .* must be a tuple of valid RawValues"):
        CheckedRig(Lying(), "loopback").raw_values()
