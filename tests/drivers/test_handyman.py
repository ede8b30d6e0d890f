import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.errors import RigError
from drivers.handyman import Handyman
from drivers.rig import Handwork
from sim.arrangement import Arrangement
from sim.errors import InvalidInput
from sim.specimen import Block, Specimen

BARE = Specimen()
COUPLED = Specimen(beta=0.64)
ALONE = Arrangement(Specimen(beta=0.0), watched=0.3)
OVERTURNING = math.atan(BARE.block.b / BARE.block.h_b)


def done(hands: Handyman, work: Handwork, amount: float | None, specimen: Specimen) -> Specimen:
    """What stands on the table after work that clamps and holds nothing."""
    after = hands.after(work, amount, Arrangement(specimen))
    assert after == Arrangement(after.specimen)
    return after.specimen


def natural_frequencies(specimen: Specimen) -> np.ndarray:
    """Of the frame without block, rad/s, from its characteristic polynomial."""
    f = specimen.frame
    # det(K - w^2 M) = 0 for K = [[k1 + k2, -k2], [-k2, k2]], M = diag(m1, m2)
    squares = np.roots([f.m1 * f.m2, -(f.m1 * f.k2 + f.m2 * (f.k1 + f.k2)), f.k1 * f.k2])
    return np.sqrt(np.sort(squares.real))


def test_a_mounted_spring_is_as_stiff_as_it_really_is() -> None:
    mounted = done(Handyman(BARE, spring_factor=1.1), Handwork.MOUNT_SPRING, 100.0, BARE)
    assert mounted.k_c == pytest.approx(110.0)


def test_a_spring_needs_a_stiffness() -> None:
    with pytest.raises(InvalidInput, match="stiffness"):
        done(Handyman(BARE), Handwork.MOUNT_SPRING, None, BARE)


def test_without_its_block_the_frame_is_bare() -> None:
    assert done(Handyman(COUPLED), Handwork.REMOVE_BLOCK, None, COUPLED) == BARE


def test_only_a_block_that_is_there_is_stood_up() -> None:
    assert done(Handyman(COUPLED), Handwork.STAND_BLOCK_UP, None, COUPLED) == COUPLED
    with pytest.raises(RigError, match="no block"):
        done(Handyman(BARE), Handwork.STAND_BLOCK_UP, None, BARE)


def test_a_locked_frame_has_no_block_and_its_modes_far_above_every_drive() -> None:
    locked = done(Handyman(COUPLED), Handwork.LOCK_FRAME, None, COUPLED)
    assert locked.beta is None
    assert natural_frequencies(locked) == pytest.approx(20.0 * natural_frequencies(BARE))


def test_unlocking_gives_the_frame_back_as_it_came() -> None:
    hands = Handyman(BARE)
    locked = done(hands, Handwork.LOCK_FRAME, None, done(hands, Handwork.LOCK_FRAME, None, BARE))
    assert done(hands, Handwork.UNLOCK_FRAME, None, locked) == BARE


def test_a_locked_frame_takes_no_spring_stiffer_than_it_says() -> None:
    """A spring that is mounted on a locked frame is still the one from the drawer."""
    hands = Handyman(BARE)
    locked = done(hands, Handwork.LOCK_FRAME, None, BARE)
    assert done(hands, Handwork.MOUNT_SPRING, 100.0, locked).k_c == pytest.approx(100.0)


def test_a_locked_frame_is_damped_as_one_of_its_stiffness() -> None:
    """Dashpots for the same damping ratios grow with the root of the stiffness: 20 times."""
    locked = done(Handyman(BARE), Handwork.LOCK_FRAME, None, BARE)
    assert BARE.frame.dashpots != locked.frame.dashpots
    assert locked.frame.dashpots == pytest.approx([20.0 * c for c in BARE.frame.dashpots])


@pytest.mark.parametrize(("work", "stiffness"), [(Handwork.REMOVE_BLOCK, None), (Handwork.MOUNT_SPRING, 100.0)])
def test_who_takes_the_block_off_or_mounts_a_spring_has_taken_the_clamps_off(
    work: Handwork, stiffness: float | None
) -> None:
    hands = Handyman(BARE)
    locked = done(hands, Handwork.LOCK_FRAME, None, BARE)
    assert done(hands, work, stiffness, locked).frame == BARE.frame


def test_a_held_block_has_its_spring_and_is_clamped_until_a_free_one_is_mounted() -> None:
    hands = Handyman(BARE, spring_factor=1.1)
    held = hands.after(Handwork.HOLD_BLOCK, 100.0, Arrangement(BARE))
    assert held.specimen.k_c == pytest.approx(110.0)
    assert held.block_clamped
    for work in (Handwork.MOUNT_SPRING, Handwork.REMOVE_BLOCK, Handwork.LOCK_FRAME, Handwork.WATCH_BLOCK):
        assert not hands.after(work, 0.3, held).block_clamped
    for work in (Handwork.STAND_BLOCK_UP, Handwork.LOCK_TABLE, Handwork.WATCH_STOREYS):
        assert hands.after(work, None, held).block_clamped


@pytest.mark.parametrize(
    ("work", "amount"),
    [
        (Handwork.MOUNT_SPRING, 100.0),
        (Handwork.HOLD_BLOCK, 100.0),
        (Handwork.REMOVE_BLOCK, None),
        (Handwork.LOCK_FRAME, None),
        (Handwork.UNLOCK_FRAME, None),
        (Handwork.WATCH_BLOCK, 0.2),
        (Handwork.PULL_FRAME, 0.01),
    ],
)
def test_the_table_stays_locked_until_it_is_unlocked(work: Handwork, amount: float | None) -> None:
    hands = Handyman(BARE)
    locked = hands.after(work, amount, hands.after(Handwork.LOCK_TABLE, None, Arrangement(BARE)))
    assert locked.table_locked
    assert not hands.after(Handwork.UNLOCK_TABLE, None, locked).table_locked


def test_the_watched_block_stands_alone_and_the_laser_stays_with_it() -> None:
    hands = Handyman(BARE)
    watched = hands.after(Handwork.WATCH_BLOCK, 0.3, Arrangement(COUPLED))
    assert watched == ALONE
    gone = hands.after(Handwork.REMOVE_BLOCK, None, watched)
    assert gone == Arrangement(BARE, watched=0.3)
    assert hands.after(Handwork.WATCH_STOREYS, None, gone) == Arrangement(BARE)
    assert hands.after(Handwork.WATCH_STOREYS, None, watched) == Arrangement(ALONE.specimen)


@pytest.mark.parametrize("work", [Handwork.MOUNT_SPRING, Handwork.HOLD_BLOCK])
def test_no_spring_is_mounted_while_laser_2_looks_at_the_block(work: Handwork) -> None:
    hands = Handyman(BARE)
    with pytest.raises(RigError, match=f"{work.value} is refused.*watch storeys"):
        hands.after(work, 100.0, ALONE)
    hands.after(work, 100.0, hands.after(Handwork.WATCH_STOREYS, None, ALONE))


def test_a_hand_holds_until_the_block_stands_or_another_thing_does() -> None:
    hands = Handyman(BARE)
    tilted = hands.after(Handwork.TILT_BLOCK, -0.05, ALONE)
    assert tilted == replace(ALONE, tilt=-0.05)
    pulled = hands.after(Handwork.PULL_FRAME, 0.02, hands.after(Handwork.LOCK_TABLE, None, tilted))
    assert pulled == replace(ALONE, tilt=-0.05, pull=0.02, table_locked=True)
    assert hands.after(Handwork.STAND_BLOCK_UP, None, tilted) == ALONE
    for work in (Handwork.WATCH_BLOCK, Handwork.REMOVE_BLOCK, Handwork.LOCK_FRAME):
        assert not hands.after(work, 0.3, pulled).held


@pytest.mark.parametrize(
    ("work", "amount", "now", "remedy"),
    [
        (Handwork.TILT_BLOCK, 0.05, Arrangement(BARE), "no block.*watch block"),
        (Handwork.TILT_BLOCK, 0.05, Arrangement(COUPLED), "not stand alone.*watch block"),
        (Handwork.TILT_BLOCK, 0.05, replace(ALONE, block_clamped=True), "not stand alone"),
        (Handwork.PULL_FRAME, 0.05, Handyman(BARE).after(Handwork.LOCK_FRAME, None, ALONE), "unlock frame"),
    ],
)
def test_what_cannot_be_done_says_why(work: Handwork, amount: float, now: Arrangement, remedy: str) -> None:
    with pytest.raises(RigError, match=f"{work.value} is refused.*{remedy}"):
        Handyman(BARE).after(work, amount, now)


@pytest.mark.parametrize(
    ("work", "item", "amounts"),
    [
        (Handwork.HOLD_BLOCK, "stiffness", [None, math.nan]),
        (Handwork.WATCH_BLOCK, "height", [None, math.inf, 0.0, -0.1, 2.0 * Block().h_b]),
        (Handwork.TILT_BLOCK, "tilt", [None, math.nan, 0.0, OVERTURNING, -OVERTURNING, 1.0]),
        (Handwork.PULL_FRAME, "pull", [None, math.nan, 0.0, -0.496, 1.0]),
    ],
)
def test_an_amount_out_of_its_range_is_refused(work: Handwork, item: str, amounts: list[float | None]) -> None:
    for amount in amounts:
        with pytest.raises(InvalidInput, match=item):
            Handyman(BARE).after(work, amount, Arrangement(ALONE.specimen))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_block_is_held_up_to_where_it_overturns(side: float) -> None:
    tilt = side * 0.999 * OVERTURNING
    assert Handyman(BARE).after(Handwork.TILT_BLOCK, tilt, ALONE).tilt == tilt
