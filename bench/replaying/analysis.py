"""Results computed anew from recorded samples: the recorded plan leads the replay, other settings judge it."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.engine.steps import Outcome, Plan, Step
from bench.events import Event, Subscriber
from bench.record.reader import Record
from bench.replaying.compare import DRIVE, POINTS
from bench.replaying.session import Planned, Replayed, replay
from drivers.clock import VirtualClock
from sim.errors import RockbenchError
from sim.parameters import Parameters


class NotComparable(RockbenchError):
    """The recorded samples do not answer what was asked of them."""

    error_code = "not_comparable"


class Follower(Protocol):
    """Looks on while the recorded plan is carried out again, and comes to results of its own.

    It is a subscriber too: every event comes to it, the blocks of a step between `before` and `after`.
    """

    def before(self, step: Step) -> None:
        """A step is about to be carried out."""
        ...

    def after(self, step: Step, outcome: Outcome) -> None:
        """It came to `outcome`."""
        ...

    def __call__(self, event: Event) -> None: ...

    @property
    def points(self) -> Sequence[Parameters]:
        """The results so far, one for each recorded point."""
        ...


@dataclass(frozen=True)
class _Led:
    """An experiment whose plan is watched, or made for a changed configuration."""

    experiment: Planned
    configuration: BenchConfiguration
    follower: Follower | None

    def check(self, configuration: BenchConfiguration) -> None:  # noqa: ARG002 - the plan is made for this one's
        self.experiment.check(self.configuration)

    def plan(self, configuration: BenchConfiguration) -> Plan:  # noqa: ARG002
        plan = self.experiment.plan(self.configuration)
        return plan if self.follower is None else _watched(plan, self.follower)


def follow(
    record: Record,
    experiment: Planned,
    configuration: BenchConfiguration,
    make: Callable[[SignalMap], Follower],
    subscribers: Sequence[Subscriber] = (),
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Carry out the recorded plan again beside a follower: the replay and the follower's points.

    Raises NotComparable when this software does not come to the recorded points with the recorded settings: what
    other settings would show would be mixed with what the software changed.
    """
    signals = SignalMap(record.channels, configuration.laser_reference, configuration.calibrated)
    follower = make(signals)
    led = _Led(experiment, configuration, follower)
    clock = VirtualClock()
    # the follower comes first: it may look at a block before the plan has gone on
    heard = [follower, *subscribers]
    replayed = replay(record, led, configuration, clock=clock, subscribers=heard, signals=signals)
    if (why := replayed.parted(POINTS)) is not None:
        raise NotComparable(f"this software does not come to what was recorded with the same settings: {why}")
    return replayed, tuple(follower.points)


def carry_out(
    record: Record,
    experiment: Planned,
    configuration: BenchConfiguration,
    changed: BenchConfiguration,
    subscribers: Sequence[Subscriber] = (),
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Carry out a plan with other settings on the recorded samples: the replay and its points.

    `configuration` is the recorded one, `changed` the plan's. Raises NotComparable where the plan with these settings
    would have driven the table otherwise: the recorded motion is no answer to that drive.
    """
    led = _Led(experiment, changed, None)
    replayed = replay(record, led, configuration, clock=VirtualClock(), subscribers=subscribers)
    if (why := replayed.parted(DRIVE)) is not None:
        raise NotComparable(f"with these settings the table would have been driven otherwise ({why}): measure anew")
    return replayed, replayed.points


def _watched(plan: Plan, follower: Follower) -> Generator[Step, Outcome, None]:
    try:
        step = next(plan)
        while True:
            follower.before(step)
            outcome = yield step
            follower.after(step, outcome)
            step = plan.send(outcome)
    except StopIteration:
        return
    finally:
        plan.close()
