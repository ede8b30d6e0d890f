"""Counts between the rails, worked by hand from size and resolution of the converter."""

import pytest

from drivers.daqmx.inputs import valid_counts


@pytest.mark.parametrize(
    ("size", "resolution", "left", "expected"),
    [
        # rails at -32768 and 32767
        (16, 16, False, (-32767, 32766)),
        # a 12-bit converter in the lower bits: rails at -2048 and 2047
        (16, 12, False, (-2047, 2046)),
        # the same in the upper bits: 16 counts per step
        (16, 12, True, (-32752, 32736)),
        # 24 bits in 32, rails at -8388608 and 8388607
        (32, 24, False, (-8388607, 8388606)),
        (32, 24, True, (-2147483392, 2147483136)),
    ],
)
def test_rails_are_one_step_outside(size: int, resolution: int, left: bool, expected: tuple[int, int]) -> None:
    assert valid_counts(size, resolution, left=left) == expected
