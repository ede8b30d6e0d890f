"""Combinations of record and spring beyond a limit: left out with the reason, the rest is played."""

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.engine.steps import Done, OperatorAction, Outcome, Publish
from bench.events import PointFinished, Warned
from bench.preflight.demands import StageDemands
from bench.preflight.margins import bounds, margins, refusal
from drivers.rig import OperatorTask
from protocols.earthquake.campaign import EarthquakeCampaign, earthquake_table
from protocols.earthquake.forecast import Combination, beyond_limits
from protocols.earthquake.plan import Pace
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint
from protocols.earthquake.records import FileSources

CONFIGURATION = BenchConfiguration()
DRIFT = CONFIGURATION.limits.drift


def combination(record: str, beta: float | None, drift: float) -> Combination:
    values = dict.fromkeys(bounds(CONFIGURATION), np.zeros(2)) | {"drift": np.array([drift, 0.0])}
    return Combination(record, beta, StageDemands(f"{record} {beta}", values))


def left(*rows: tuple[str, float | None, float]) -> dict[tuple[str, float | None], str]:
    return beyond_limits([combination(*row) for row in rows], CONFIGURATION)


def test_only_the_combination_beyond_a_limit_is_left_out() -> None:
    found = left(("a", None, 0.01), ("a", 0.25, 1.01 * DRIFT), ("a", 0.64, 0.99 * DRIFT))
    assert found == {("a", 0.25): f"drift {1.01 * DRIFT:.4g} m, limits.drift = {DRIFT:g} m"}


def test_a_record_beyond_a_limit_with_the_bare_frame_is_left_out_with_every_spring() -> None:
    found = left(("a", None, 2 * DRIFT), ("a", 0.25, 0.01), ("b", None, 0.01), ("b", 0.25, 0.01))
    assert found.keys() == {("a", None), ("a", 0.25)}
    assert found["a", 0.25].startswith("with the bare frame: drift")


def test_the_bare_frame_is_not_needed_for_a_record_without_a_spring() -> None:
    found = left(("a", None, 0.01), ("a", 0.25, 2 * DRIFT), ("b", None, 0.01), ("b", 0.25, 0.01))
    assert found.keys() == {("a", None), ("a", 0.25)}


def test_nothing_is_left_out_where_nothing_would_remain() -> None:
    assert left(("a", None, 0.01), ("a", 0.25, 2 * DRIFT)) == {}


ASKED = EarthquakeParameters(records=("synthetic:pacoima", "synthetic:newhall"), beta=(0.25, 0.97), draws=40)


@pytest.fixture(scope="module")
def campaign() -> EarthquakeCampaign:
    return EarthquakeCampaign(ASKED, CONFIGURATION)


def test_a_campaign_keeps_its_limits_without_what_it_leaves_out(campaign: EarthquakeCampaign) -> None:
    assert campaign.left_out.keys() == {("synthetic newhall", beta) for beta in (None, 0.25, 0.97)}
    found = campaign.forecast
    kept = margins(found.demands, bounds(CONFIGURATION))
    assert refusal(kept) is None
    assert not any("newhall" in each.demand.where for each in kept)
    warned = [text for text in found.warnings if "is omitted" in text]
    assert [text.partition(" is omitted: ")[0] for text in warned] == [
        "synthetic newhall with the bare frame",
        "synthetic newhall with beta = 0.25",
        "synthetic newhall with beta = 0.97",
    ]
    assert all("limits." in text for text in warned)
    assert found.duration is not None
    assert found.duration < Pace(ASKED, campaign.shakings, campaign.table.duration).total


def test_what_is_left_out_is_stored_and_a_replay_leaves_out_the_same(campaign: EarthquakeCampaign) -> None:
    stored = FileSources.stored(campaign.sources)
    assert stored is not None
    assert stored.left_out == campaign.left_out
    replayed = EarthquakeCampaign(ASKED, CONFIGURATION, campaign.sources)
    assert replayed.left_out == campaign.left_out
    assert "combinations" not in vars(replayed), "a replay simulates nothing of the forecast"


def test_every_combination_has_a_point_and_a_spring_without_a_record_is_not_mounted(
    campaign: EarthquakeCampaign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The table refuses the record that is left, so that no motion has to be scripted."""
    monkeypatch.setitem(vars(campaign), "left_out", campaign.left_out | {("synthetic pacoima", 0.25): "drift"})

    def refused(*_: object) -> object:
        yield Publish(Warned("not to be played"))
        return "refused by the table"

    monkeypatch.setattr("protocols.earthquake.plan.EarthquakePlan._bare_frame", refused)
    monkeypatch.setattr("protocols.earthquake.plan.table_model", refused)
    plan, mounted, points = campaign.plan(), list[object](), list[EarthquakePoint]()
    outcome: Outcome | None = None
    while True:
        try:
            step = plan.send(outcome)  # type: ignore[arg-type]
        except StopIteration:
            break
        if isinstance(step, OperatorAction) and step.work is OperatorTask.MOUNT_SPRING:
            mounted.append(step.specimen)
        if isinstance(step, Publish) and isinstance(step.event, PointFinished):
            assert isinstance(step.event.point, EarthquakePoint)
            points.append(step.event.point)
        outcome = Done()
    assert len(mounted) == 1
    assert [(point.record, point.beta, point.status) for point in points] == [
        ("synthetic pacoima", 0.25, "not played"),
        ("synthetic newhall", 0.25, "not played"),
        ("synthetic pacoima", 0.97, "not played"),
        ("synthetic newhall", 0.97, "not played"),
    ]
    assert points[0].reason == "omitted, since it would exceed a limit: drift"
    assert points[2].reason == "refused by the table"
    assert "the block toppled: 0 of 0" in earthquake_table(points)


def test_a_file_without_the_table_leaves_nothing_out(campaign: EarthquakeCampaign) -> None:
    before = {name: table for name, table in campaign.sources.items() if name != "left_out"}
    assert EarthquakeCampaign(ASKED, CONFIGURATION, before).left_out == {}
