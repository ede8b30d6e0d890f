"""A plan within a plan: outcomes, exceptions and the end go where `yield from` has them."""

from collections.abc import Generator, Sequence

import pytest

from bench.config.model import BenchConfiguration
from bench.engine.steps import Done, Dwell, Fallen, Measured, Outcome, Publish, RampOut, Step
from bench.events import PointFinished
from bench.protocol import Plan, Prepared, Result, each_step
from sim.parameters import Parameters, quantity


class Point(Parameters):
    """The number of cycles that came."""

    cycles: int = quantity(..., "1", "cycles")


class Recovering(Prepared[Parameters]):
    """A plan that publishes a point, and ends its test where a dwell fails."""

    closed = False

    def plan(self) -> Plan:
        return self.collected(self._steps())

    def result(self, points: Sequence[Parameters]) -> Result:
        return Result(tuple(points), f"{len(points)} points")

    def _steps(self) -> Generator[Step, Outcome, None]:
        try:
            try:
                outcome = yield Dwell(3)
            except TimeoutError:
                yield RampOut(fast=True)
                return
            assert isinstance(outcome, Measured)
            yield Publish(PointFinished(Point(cycles=len(outcome.cycles))))
        finally:
            self.closed = True


@pytest.fixture
def prepared() -> Recovering:
    return Recovering(Parameters(), BenchConfiguration())


def test_published_points_become_the_result(prepared: Recovering) -> None:
    plan = prepared.plan()
    assert next(plan) == Dwell(3)
    assert plan.send(Measured(())) == Publish(PointFinished(Point(cycles=0)))
    with pytest.raises(StopIteration) as end:
        plan.send(Done())
    assert end.value.value.points == (Point(cycles=0),)


def test_an_exception_thrown_at_a_step_reaches_the_steps_that_handle_it(prepared: Recovering) -> None:
    plan = prepared.plan()
    next(plan)
    assert plan.throw(TimeoutError()) == RampOut(fast=True)
    with pytest.raises(StopIteration) as end:
        plan.send(Done())
    assert end.value.value.points == ()


def test_an_exception_that_is_not_handled_ends_the_plan(prepared: Recovering) -> None:
    plan = prepared.plan()
    next(plan)
    with pytest.raises(ValueError, match="converter"):
        plan.throw(ValueError("converter"))
    assert prepared.closed


def test_a_closed_plan_closes_its_steps(prepared: Recovering) -> None:
    plan = prepared.plan()
    next(plan)
    plan.close()
    assert prepared.closed


def test_a_step_may_be_replaced_by_several_or_by_none() -> None:
    def steps() -> Generator[Step, Outcome, tuple[Outcome, Outcome]]:
        return (yield Dwell(1)), (yield Dwell(2))

    def carry_out(step: Step) -> Generator[Step, Outcome, Outcome]:
        if step == Dwell(2):
            return Fallen()
        yield step
        return (yield RampOut())

    plan = each_step(steps(), carry_out)
    assert [next(plan), plan.send(Measured(()))] == [Dwell(1), RampOut()]
    with pytest.raises(StopIteration) as end:
        plan.send(Done())
    first, second = end.value.value
    assert (first, type(second)) == (Done(), Fallen)
