"""Results computed anew from recorded samples: the recorded plan leads the replay, other settings judge it."""

from collections.abc import Callable, Generator, Sequence
from typing import Any

from bench.config.model import BenchConfiguration
from bench.engine.steps import Outcome, Plan, Step
from bench.events import Subscriber
from bench.protocol import Follower, Prepared
from bench.record.reader import Record
from bench.replaying.compare import DRIVE, POINTS
from bench.replaying.session import Replayed, replay
from drivers.clock import VirtualClock
from sim.errors import RockbenchError
from sim.parameters import Parameters


class NotComparable(RockbenchError):
    """The recorded samples do not answer what was asked of them."""

    error_code = "not_comparable"


def follow(
    record: Record,
    prepared: Prepared[Any],
    make: Callable[[], Follower],
    subscribers: Sequence[Subscriber] = (),
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Carry out the recorded plan again, watched by a follower: the replay and the follower's points.

    Raises NotComparable when this software does not come to the recorded points with the recorded settings: what
    other settings would show would be mixed with what the software changed.
    """
    configuration = prepared.configuration
    follower = make()
    # the follower comes first: it may look at a block before the plan has gone on
    heard = [follower, *subscribers]
    plan = _watched(prepared.plan(), follower)
    replayed = replay(record, plan, configuration, clock=VirtualClock(), subscribers=heard)
    if (why := replayed.parted(POINTS)) is not None:
        raise NotComparable(f"this software does not come to what was recorded with the same settings: {why}")
    return replayed, tuple(follower.points)


def carry_out(
    record: Record, changed: Prepared[Any], configuration: BenchConfiguration, subscribers: Sequence[Subscriber] = ()
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Carry out a plan with `changed` settings on the recorded samples: the replay and its points.

    `configuration` is the recorded one. Raises NotComparable where the plan with these settings would have driven the
    table otherwise: the recorded motion is no answer to that drive.
    """
    replayed = replay(record, changed.plan(), configuration, clock=VirtualClock(), subscribers=subscribers)
    if (why := replayed.parted(DRIVE)) is not None:
        raise NotComparable(f"with these settings the table would have been driven otherwise ({why}): measure anew")
    return replayed, replayed.points


def _watched(plan: Plan, follower: Follower) -> Generator[Step, Outcome, object]:
    try:
        step = next(plan)
        while True:
            follower.before(step)
            outcome = yield step
            follower.after(step, outcome)
            step = plan.send(outcome)
    except StopIteration as end:
        return end.value
    finally:
        plan.close()
