import numpy as np
import pytest

from drivers.errors import RigError
from drivers.handyman import Handyman
from drivers.rig import Handwork
from sim.errors import InvalidInput
from sim.specimen import Specimen

BARE = Specimen()
COUPLED = Specimen(beta=0.64)


def natural_frequencies(specimen: Specimen) -> np.ndarray:
    """Of the frame without block, rad/s, from its characteristic polynomial."""
    f = specimen.frame
    # det(K - w^2 M) = 0 for K = [[k1 + k2, -k2], [-k2, k2]], M = diag(m1, m2)
    squares = np.roots([f.m1 * f.m2, -(f.m1 * f.k2 + f.m2 * (f.k1 + f.k2)), f.k1 * f.k2])
    return np.sqrt(np.sort(squares.real))


def test_a_mounted_spring_is_as_stiff_as_it_really_is() -> None:
    mounted = Handyman(BARE, spring_factor=1.1).after(Handwork.MOUNT_SPRING, 100.0, BARE)
    assert mounted.k_c == pytest.approx(110.0)


def test_a_spring_needs_a_stiffness() -> None:
    with pytest.raises(InvalidInput, match="stiffness"):
        Handyman(BARE).after(Handwork.MOUNT_SPRING, None, BARE)


def test_without_its_block_the_frame_is_bare() -> None:
    assert Handyman(COUPLED).after(Handwork.REMOVE_BLOCK, None, COUPLED) == BARE


def test_only_a_block_that_is_there_is_stood_up() -> None:
    assert Handyman(COUPLED).after(Handwork.STAND_BLOCK_UP, None, COUPLED) == COUPLED
    with pytest.raises(RigError, match="no block"):
        Handyman(BARE).after(Handwork.STAND_BLOCK_UP, None, BARE)


def test_a_locked_frame_has_no_block_and_its_modes_far_above_every_drive() -> None:
    locked = Handyman(COUPLED).after(Handwork.LOCK_FRAME, None, COUPLED)
    assert locked.beta is None
    assert natural_frequencies(locked) == pytest.approx(20.0 * natural_frequencies(BARE))


def test_unlocking_gives_the_frame_back_as_it_came() -> None:
    hands = Handyman(BARE)
    locked = hands.after(Handwork.LOCK_FRAME, None, hands.after(Handwork.LOCK_FRAME, None, BARE))
    assert hands.after(Handwork.UNLOCK_FRAME, None, locked) == BARE


def test_a_locked_frame_takes_no_spring_stiffer_than_it_says() -> None:
    """A spring that is mounted on a locked frame is still the one from the drawer."""
    hands = Handyman(BARE)
    locked = hands.after(Handwork.LOCK_FRAME, None, BARE)
    assert hands.after(Handwork.MOUNT_SPRING, 100.0, locked).k_c == pytest.approx(100.0)


def test_a_locked_frame_is_damped_as_one_of_its_stiffness() -> None:
    """Dashpots for the same damping ratios grow with the root of the stiffness: 20 times."""
    locked = Handyman(BARE).after(Handwork.LOCK_FRAME, None, BARE)
    assert BARE.frame.dashpots != locked.frame.dashpots
    assert locked.frame.dashpots == pytest.approx([20.0 * c for c in BARE.frame.dashpots])


@pytest.mark.parametrize(("work", "stiffness"), [(Handwork.REMOVE_BLOCK, None), (Handwork.MOUNT_SPRING, 100.0)])
def test_who_takes_the_block_off_or_mounts_a_spring_has_taken_the_clamps_off(
    work: Handwork, stiffness: float | None
) -> None:
    hands = Handyman(BARE)
    locked = hands.after(Handwork.LOCK_FRAME, None, BARE)
    assert hands.after(work, stiffness, locked).frame == BARE.frame
