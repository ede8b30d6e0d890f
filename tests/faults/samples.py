"""Ways to falsify the blocks that are read: made for a rig, they turn one block into another."""

from collections.abc import Callable

import numpy as np

from drivers.rig import Block, Channel, Counts
from tests.faults.rig import FaultyRig

Change = Callable[[Block], Block]
"""Returns the block itself where there is nothing to change."""
Making = Callable[[FaultyRig], Change]


def _in_counts(change: Callable[[Counts, tuple[Channel, ...]], None]) -> Making:
    """A change of a copy of the counts, shape (n, n_channels), in place."""

    def make(rig: FaultyRig) -> Change:
        def changed(block: Block) -> Block:
            counts = np.array(block.counts)
            change(counts, rig.channels)
            return Block(block.first, counts)

        return changed

    return make


def invalid(*columns: int) -> Making:
    """A count below all that are measurements, on some channels."""

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:
        for column in columns:
            counts[:, column] = channels[column].valid[0] - 1

    return _in_counts(change)


def at_rail(column: int) -> Making:
    """A count above all that are measurements."""

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:
        counts[:, column] = channels[column].valid[1] + 1

    return _in_counts(change)


def flipped(column: int) -> Making:
    """The sign of a channel turned round."""

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:
        counts[:, column] = np.clip(-counts[:, column], *channels[column].valid)

    return _in_counts(change)


def spike(column: int) -> Making:
    """One sample at the end of what can be measured."""

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:
        counts[len(counts) // 2, column] = channels[column].valid[1]

    return _in_counts(change)


def lost_for(column: int, n: int) -> Making:
    """`n` samples that are none."""

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:
        counts[10 : 10 + n, column] = channels[column].valid[0] - 1

    return _in_counts(change)


def stuck(*columns: int) -> Making:
    """The first counts that are seen, for ever."""
    held: dict[int, int] = {}

    def change(counts: Counts, channels: tuple[Channel, ...]) -> None:  # noqa: ARG001
        for column in columns:
            counts[:, column] = held.setdefault(column, int(counts[0, column]))

    def make(rig: FaultyRig) -> Change:
        held.clear()
        return _in_counts(change)(rig)

    return make


def once(making: Making, after: int = 0) -> Making:
    """In the next block only, which is not among the first `after` of an arming."""

    def make(rig: FaultyRig) -> Change:
        change, done = making(rig), False

        def changed(block: Block) -> Block:
            nonlocal done
            if done or block.first < after * len(block):
                return block
            done = True
            return change(block)

        return changed

    return make


def shifted(samples: int) -> Making:
    """Blocks that say that they begin elsewhere."""
    return lambda _rig: lambda block: Block(block.first + samples, block.counts)


def shortened(samples: int) -> Making:
    """Blocks that lack their last samples."""
    return lambda _rig: lambda block: Block(block.first, block.counts[:-samples])


def late(seconds: float) -> Making:
    """Blocks that come too late."""

    def make(rig: FaultyRig) -> Change:
        clock = rig.inner.clock

        def changed(block: Block) -> Block:
            clock.wait_until(clock.now() + seconds)
            return Block(block.first, block.counts)

        return changed

    return make


def jump(seconds: float) -> Making:
    """A clock that is put forward or back."""

    def make(rig: FaultyRig) -> Change:
        def changed(block: Block) -> Block:
            rig.faulty_clock.offset += seconds
            return Block(block.first, block.counts)

        return changed

    return make
