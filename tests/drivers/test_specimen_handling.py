import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.errors import RigError
from drivers.rig import OperatorTask
from drivers.specimen_handling import SpecimenHandling
from sim.arrangement import Arrangement
from sim.errors import InvalidInput
from sim.specimen import Block, Specimen

BARE = Specimen()
COUPLED = Specimen(beta=0.64)
ALONE = Arrangement(Specimen(beta=0.0), watched=0.3)
OVERTURNING = math.atan(BARE.block.b / BARE.block.h_b)


def done(hands: SpecimenHandling, work: OperatorTask, amount: float | None, specimen: Specimen) -> Specimen:
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
    mounted = done(SpecimenHandling(BARE, spring_factor=1.1), OperatorTask.MOUNT_SPRING, 100.0, BARE)
    assert mounted.k_c == pytest.approx(110.0)


def test_a_spring_needs_a_stiffness() -> None:
    with pytest.raises(InvalidInput, match="stiffness"):
        done(SpecimenHandling(BARE), OperatorTask.MOUNT_SPRING, None, BARE)


def test_without_its_block_the_frame_is_bare() -> None:
    assert done(SpecimenHandling(COUPLED), OperatorTask.REMOVE_BLOCK, None, COUPLED) == BARE


def test_only_a_block_that_is_there_is_stood_up() -> None:
    assert done(SpecimenHandling(COUPLED), OperatorTask.STAND_BLOCK_UP, None, COUPLED) == COUPLED
    with pytest.raises(RigError, match="no block"):
        done(SpecimenHandling(BARE), OperatorTask.STAND_BLOCK_UP, None, BARE)


def test_a_locked_frame_has_no_block_and_its_modes_far_above_every_drive() -> None:
    locked = done(SpecimenHandling(COUPLED), OperatorTask.LOCK_FRAME, None, COUPLED)
    assert locked.beta is None
    assert natural_frequencies(locked) == pytest.approx(20.0 * natural_frequencies(BARE))


def test_unlocking_gives_the_frame_back_as_it_came() -> None:
    hands = SpecimenHandling(BARE)
    locked = done(hands, OperatorTask.LOCK_FRAME, None, done(hands, OperatorTask.LOCK_FRAME, None, BARE))
    assert done(hands, OperatorTask.UNLOCK_FRAME, None, locked) == BARE


def test_a_locked_frame_takes_no_spring_stiffer_than_it_says() -> None:
    """A spring that is mounted on a locked frame is still the one from the drawer."""
    hands = SpecimenHandling(BARE)
    locked = done(hands, OperatorTask.LOCK_FRAME, None, BARE)
    assert done(hands, OperatorTask.MOUNT_SPRING, 100.0, locked).k_c == pytest.approx(100.0)


def test_a_locked_frame_is_damped_as_one_of_its_stiffness() -> None:
    """Dashpots for the same damping ratios grow with the root of the stiffness: 20 times."""
    locked = done(SpecimenHandling(BARE), OperatorTask.LOCK_FRAME, None, BARE)
    assert BARE.frame.dashpots != locked.frame.dashpots
    assert locked.frame.dashpots == pytest.approx([20.0 * c for c in BARE.frame.dashpots])


@pytest.mark.parametrize(("work", "stiffness"), [(OperatorTask.REMOVE_BLOCK, None), (OperatorTask.MOUNT_SPRING, 100.0)])
def test_who_takes_the_block_off_or_mounts_a_spring_has_taken_the_clamps_off(
    work: OperatorTask, stiffness: float | None
) -> None:
    hands = SpecimenHandling(BARE)
    locked = done(hands, OperatorTask.LOCK_FRAME, None, BARE)
    assert done(hands, work, stiffness, locked).frame == BARE.frame


def test_a_held_block_has_its_spring_and_is_clamped_until_a_free_one_is_mounted() -> None:
    hands = SpecimenHandling(BARE, spring_factor=1.1)
    held = hands.after(OperatorTask.HOLD_BLOCK, 100.0, Arrangement(BARE))
    assert held.specimen.k_c == pytest.approx(110.0)
    assert held.block_clamped
    for work in (
        OperatorTask.MOUNT_SPRING,
        OperatorTask.REMOVE_BLOCK,
        OperatorTask.LOCK_FRAME,
        OperatorTask.WATCH_BLOCK,
    ):
        assert not hands.after(work, 0.3, held).block_clamped
    for work in (OperatorTask.STAND_BLOCK_UP, OperatorTask.LOCK_TABLE, OperatorTask.WATCH_STOREYS):
        assert hands.after(work, None, held).block_clamped


@pytest.mark.parametrize(
    ("work", "amount"),
    [
        (OperatorTask.MOUNT_SPRING, 100.0),
        (OperatorTask.HOLD_BLOCK, 100.0),
        (OperatorTask.REMOVE_BLOCK, None),
        (OperatorTask.LOCK_FRAME, None),
        (OperatorTask.UNLOCK_FRAME, None),
        (OperatorTask.WATCH_BLOCK, 0.2),
        (OperatorTask.PULL_FRAME, 0.01),
    ],
)
def test_the_table_stays_locked_until_it_is_unlocked(work: OperatorTask, amount: float | None) -> None:
    hands = SpecimenHandling(BARE)
    locked = hands.after(work, amount, hands.after(OperatorTask.LOCK_TABLE, None, Arrangement(BARE)))
    assert locked.table_locked
    assert not hands.after(OperatorTask.UNLOCK_TABLE, None, locked).table_locked


def test_the_watched_block_stands_alone_and_the_laser_stays_with_it() -> None:
    hands = SpecimenHandling(BARE)
    watched = hands.after(OperatorTask.WATCH_BLOCK, 0.3, Arrangement(COUPLED))
    assert watched == ALONE
    gone = hands.after(OperatorTask.REMOVE_BLOCK, None, watched)
    assert gone == Arrangement(BARE, watched=0.3)
    assert hands.after(OperatorTask.WATCH_STOREYS, None, gone) == Arrangement(BARE)
    assert hands.after(OperatorTask.WATCH_STOREYS, None, watched) == Arrangement(ALONE.specimen)


@pytest.mark.parametrize("work", [OperatorTask.MOUNT_SPRING, OperatorTask.HOLD_BLOCK])
def test_no_spring_is_mounted_while_laser_2_looks_at_the_block(work: OperatorTask) -> None:
    hands = SpecimenHandling(BARE)
    with pytest.raises(RigError, match=f"{work.value} is refused.*watch storeys"):
        hands.after(work, 100.0, ALONE)
    hands.after(work, 100.0, hands.after(OperatorTask.WATCH_STOREYS, None, ALONE))


def test_a_hand_holds_until_the_block_stands_or_another_thing_does() -> None:
    hands = SpecimenHandling(BARE)
    tilted = hands.after(OperatorTask.TILT_BLOCK, -0.05, ALONE)
    assert tilted == replace(ALONE, tilt=-0.05)
    pulled = hands.after(OperatorTask.PULL_FRAME, 0.02, hands.after(OperatorTask.LOCK_TABLE, None, tilted))
    assert pulled == replace(ALONE, tilt=-0.05, pull=0.02, table_locked=True)
    assert hands.after(OperatorTask.STAND_BLOCK_UP, None, tilted) == ALONE
    for work in (OperatorTask.WATCH_BLOCK, OperatorTask.REMOVE_BLOCK, OperatorTask.LOCK_FRAME):
        assert not hands.after(work, 0.3, pulled).held


@pytest.mark.parametrize(
    ("work", "amount", "now", "remedy"),
    [
        (OperatorTask.TILT_BLOCK, 0.05, Arrangement(BARE), "no block.*watch block"),
        (OperatorTask.TILT_BLOCK, 0.05, Arrangement(COUPLED), "not stand alone.*watch block"),
        (OperatorTask.TILT_BLOCK, 0.05, replace(ALONE, block_clamped=True), "not stand alone"),
        (
            OperatorTask.PULL_FRAME,
            0.05,
            SpecimenHandling(BARE).after(OperatorTask.LOCK_FRAME, None, ALONE),
            "unlock frame",
        ),
    ],
)
def test_what_cannot_be_done_says_why(work: OperatorTask, amount: float, now: Arrangement, remedy: str) -> None:
    with pytest.raises(RigError, match=f"{work.value} is refused.*{remedy}"):
        SpecimenHandling(BARE).after(work, amount, now)


@pytest.mark.parametrize(
    ("work", "item", "amounts"),
    [
        (OperatorTask.HOLD_BLOCK, "stiffness", [None, math.nan]),
        (OperatorTask.WATCH_BLOCK, "height", [None, math.inf, 0.0, -0.1, 2.0 * Block().h_b]),
        (OperatorTask.TILT_BLOCK, "tilt", [None, math.nan, 0.0, OVERTURNING, -OVERTURNING, 1.0]),
        (OperatorTask.PULL_FRAME, "pull", [None, math.nan, 0.0, -0.496, 1.0]),
    ],
)
def test_an_amount_out_of_its_range_is_refused(work: OperatorTask, item: str, amounts: list[float | None]) -> None:
    for amount in amounts:
        with pytest.raises(InvalidInput, match=item):
            SpecimenHandling(BARE).after(work, amount, Arrangement(ALONE.specimen))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_block_is_held_up_to_where_it_overturns(side: float) -> None:
    tilt = side * 0.999 * OVERTURNING
    assert SpecimenHandling(BARE).after(OperatorTask.TILT_BLOCK, tilt, ALONE).tilt == tilt
