"""The identification end to end, on virtual benches whose equations are known, and what its files say."""

import json
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bench.analysis.signals import DISPLACEMENT
from bench.app.catalogue import load_protocol
from bench.app.preflight import compile_run
from bench.app.session import SessionResult
from bench.config.model import BenchConfiguration
from bench.config.review import review
from bench.config.sections import Acquisition, Simulation
from bench.control.table_model import TableModel
from bench.datafile.reader import open_datafile
from bench.engine.steps import Done, Outcome, Play, Played, Publish, Step
from bench.events import Event, PointFinished, StepStarted, Warned
from bench.findings import TableIdentified
from bench.guard.limits import Limits, Ramps
from bench.preflight.demands import response_of
from bench.preflight.motion import RESTING, resting_demands
from bench.results import FILE
from protocols.common.calibrate import Unmeasurable
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.plan import OVERHEAD, Rules, _complete
from protocols.common.identification.signal import BLOCK_SHARE, SHARE, Grid, grid, planned, settling
from protocols.identify.protocol import IdentifiedBand
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.rocking import simulate
from sim.shaker import Shaker
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.bench.control.virtual_table import closed_form
from tests.protocols.progress import ends_at_100_percent, followed

DAMPED = Specimen(frame=Frame(xi1=0.2, xi2=0.2))
PROTOCOL = load_protocol("identify")
SHORT = IdentifyParameters(period=2.0, band_low=0.5, band_high=60.0, periods=2)


def bench(shaker: Shaker | None = None, specimen: Specimen = DAMPED, **changes: object) -> BenchConfiguration:
    simulation = Simulation(bench=VirtualBenchParameters(shaker=shaker or Shaker()))
    blocks = Acquisition(block_duration=0.2)
    return BenchConfiguration(specimen=specimen, acquisition=blocks, simulation=simulation, **changes)  # type: ignore[arg-type]


def run(
    parameters: IdentifyParameters, configuration: BenchConfiguration, out: Path, *, figures: bool = False
) -> tuple[SessionResult, list[Event]]:
    return followed(PROTOCOL, PROTOCOL.prepare(parameters, configuration, None), out, figures=figures)


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, BenchConfiguration, SessionResult, list[Event]]:
    out = tmp_path_factory.mktemp("identify") / "run"
    configuration = bench(Shaker(friction=0.0))
    return out, configuration, *run(SHORT, configuration, out, figures=True)


Identified = tuple[Path, BenchConfiguration, SessionResult, list[Event]]


def test_the_response_is_that_of_the_shakers_equations_within_its_uncertainty(identified: Identified) -> None:
    out, configuration, result, _ = identified
    assert result.status == "completed"
    model = TableModel.read(out / "table_model.json")
    f = np.array(model.frequency)
    assert (f[0], f[-1], f[1] - f[0]) == (0.5, 60.0, 0.5)
    truth = closed_form(f, configuration.simulation.bench.shaker, DAMPED, configuration.sample_rate)
    error = np.abs(model.response(f) - truth)
    # three realisations give each line an uncertainty with four degrees of freedom: twice it is passed by 12 %
    assert np.mean(error > 2.0 * np.array(model.uncertainty)) < 0.25
    assert np.sum(error**2) < 2.0 * np.sum(np.array(model.uncertainty) ** 2)
    assert np.max(error / np.abs(truth)) < 0.02
    assert model.specimen == "bare frame"
    assert timedelta(0) <= datetime.now(UTC) - model.date < timedelta(minutes=5)
    assert 0.1 < model.level < 0.6


def test_the_level_is_reached_from_below_and_never_passed_by_much(identified: Identified) -> None:
    out, configuration, _, events = identified
    probes = [event.text for event in events if isinstance(event, StepStarted) and event.text.startswith("probe 1")]
    assert probes == ["probe 1: 0.02 V"]
    # the damping of this specimen is unusual, and nothing else is warned of
    assert [event.text for event in events if isinstance(event, Warned)] == list(review(configuration).notices)
    with open_datafile(out / FILE) as record:
        names, moved = record.blocks["run"], np.abs(record.values("table_acceleration"))
        starts = record.blocks["row"]
        peaks = [moved[starts[names == run][0] : starts[names == run][-1]].max() for run in np.unique(names)]
    assert all(after < 12.0 * before for before, after in pairwise(peaks))
    assert SHORT.level * 0.9 < max(peaks) < SHORT.level * 1.1


def test_the_progress_ends_at_100_percent(identified: Identified) -> None:
    ends_at_100_percent(identified[3])


def test_file_model_and_summary_say_the_same(identified: Identified) -> None:
    out, _, result, events = identified
    model = TableModel.read(out / "table_model.json")
    with open_datafile(out / FILE) as record:
        stored = record.columns_of(TableIdentified)
        for name in ("frequency", "real", "imaginary", "uncertainty", "distortion", "coherence", "noise"):
            assert tuple(stored[name]) == getattr(model, name)
        assert record.points == json.loads((out / "summary.json").read_text(encoding="utf-8"))["points"]
        assert len(record.points) == sum(isinstance(event, PointFinished) for event in events)
        assert [event.kind for event in record.events].count("TableIdentified") == 1
        wanted = record.tables["prediction"]
        assert wanted["frequency"].values == pytest.approx(model.frequency)
        point = IdentifiedBand.model_validate(record.points[12])
    near = np.argmin(np.abs(np.array(model.frequency) - point.frequency_hz))
    assert point.gain_m_s2_v == pytest.approx(np.abs(model.response(np.array([model.frequency[near]])))[0], rel=0.1)
    assert result.table.splitlines()[3].split()[0] == "0.5"
    assert (out / "table_response.png").stat().st_size > 20_000
    assert sum(isinstance(event, TableIdentified) for event in events) == 1


def test_an_undamped_specimen_needs_a_number_of_discarded_periods() -> None:
    with pytest.raises(InvalidInput, match=r"discarded.*not damped.*specify the number of periods"):
        settling(Specimen(frame=Frame(xi1=0.0)))
    assert settling(Specimen()) > 0.0


def test_the_identified_table_is_loaded_by_other_runs_at_its_own_rate_only(identified: Identified) -> None:
    out, configuration, *_ = identified
    named = configuration.model_copy(update={"table_model": str(out / "table_model.json")})
    assert response_of(named) is not None
    other = VirtualBenchParameters(sample_rate=1000.0)
    with pytest.raises(InvalidInput, match="identified at 2000"):
        response_of(named.model_copy(update={"simulation": Simulation(bench=other)}))


def test_a_block_rests_while_its_table_is_identified(tmp_path: Path) -> None:
    """The linear moment against the simulation of the whole system: where it rests, and where it lifts."""
    parameters = IdentifyParameters(
        beta=0.97, level=3.0, period=2.0, band_low=1.0, band_high=30.0, periods=2, discarded=2
    )
    configuration, specimen = bench(specimen=Specimen()), Specimen().coupled(0.97)
    found = planned(parameters, configuration)
    assert found.binds == RESTING
    records = [found.grid.record(motion) for motion in found.motions]
    shares = [resting_demands(record, found.grid.sample_rate, specimen, configuration)[RESTING] for record in records]
    assert max(shares) == pytest.approx(BLOCK_SHARE, rel=1e-9)
    strongest = records[int(np.argmax(shares))]
    for factor, lifts in ((1.0, False), (0.95 / BLOCK_SHARE, False), (1.05 / BLOCK_SHARE, True)):
        peaks = simulate(specimen, SampledRecord(factor * strongest, 1.0 / found.grid.sample_rate)).peaks
        assert peaks is not None
        assert (peaks.theta > 0.0) is lifts
    result, events = run(parameters, configuration, tmp_path / "run")
    assert result.status == "completed"
    assert not any(isinstance(event, Warned) for event in events)
    assert TableModel.read(tmp_path / "run" / "table_model.json").specimen == "block with the spring of beta = 0.97"


@pytest.mark.parametrize(
    ("limits", "binds"),
    [
        (Limits(displacement=0.002), "displacement"),
        (Limits(velocity=0.01), "velocity"),
        (Limits(drift=0.004), "drift"),
        (Limits(drive_slew=40.0, drive_voltage=0.5), "drive_slew"),
    ],
)
def test_the_level_keeps_every_limit_at_a_distance(limits: Limits, binds: str, tmp_path: Path) -> None:
    configuration = bench(limits=limits, ramps=Ramps(abort=0.5, stop=4.0))
    found = planned(SHORT, configuration)
    assert (found.binds, found.level < SHORT.level) == (binds, True)
    assert found.demands[binds] == pytest.approx(SHARE * getattr(limits, binds))
    margins = compile_run("identify", PROTOCOL.prepare(SHORT, configuration, None), tmp_path).margins
    assert margins[0].bound.quantity == binds
    assert margins[0].margin == pytest.approx(1.0 - SHARE)


def test_a_table_that_does_not_answer_is_told_before_it_is_driven_harder(tmp_path: Path) -> None:
    dead = bench(Shaker(gain=1e-4, voltage_limit=30.0))
    found = planned(SHORT, bench())
    assert found.level == SHORT.level
    result, events = run(SHORT, dead.model_copy(update={"limits": Limits(drive_slew=3e4)}), tmp_path / "run")
    assert result.status == "failed"
    assert "the table does not respond to a drive of 0.2 V" in result.reason
    assert sum(isinstance(event, StepStarted) and "V" in event.text for event in events) == 2
    assert not (tmp_path / "run" / "table_model.json").exists()
    assert "Nothing was identified" in result.table


@pytest.mark.parametrize("odd", [False, True])
@pytest.mark.parametrize("period", [1.5, 4.0])
def test_the_lines_cover_the_band_that_replication_needs(odd: bool, period: float) -> None:
    configuration = bench()
    lines = grid(IdentifyParameters(odd_lines=odd, period=period, band_low=0.75), configuration, DAMPED)
    f = lines.frequency
    assert f[0] <= 0.75 < f[1]
    assert f[-2] < 2.0 * configuration.table_band[1] <= f[-1]
    assert not odd or np.all(lines.lines % 2 == 1)
    volts = lines.record(np.exp(1j * np.arange(lines.lines.size)))
    assert volts[0] == volts[-1] == 0.0
    whole = lines.used(volts)
    assert whole.shape == (3, lines.samples)
    np.testing.assert_allclose(whole[0], whole[2], atol=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"band_low": 5.0, "band_high": 4.0}, "band_low"),
        ({"band_high": 1200.0}, "half the sample rate"),
        ({"band_low": 0.2, "period": 2.0}, "period of at least 5 s"),
        ({"realisations": 1}, "realisations"),
    ],
)
def test_what_cannot_be_identified_is_refused(changes: dict[str, float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        PROTOCOL.prepare(IdentifyParameters(**changes), bench(), None)  # type: ignore[arg-type]


@pytest.mark.parametrize(("losses", "where"), [(0, 40), (1, 40), (2, 40), (0, 3), (0, 20), (0, 99)])
def test_a_multisine_with_missing_samples_is_repeated_once(losses: int, where: int) -> None:
    """Its first 38 samples and its last 8 are not used."""
    volts, rules = np.zeros(106), Rules(Limits(), 1000.0, 20.0, 60.0)
    lines = Grid(np.array([1]), 30, 1000.0, 1, 2)
    assert lines.fade == 8
    running = _complete(volts, rules, lines, "multisine 2")
    warned: list[str] = []
    plays = 0

    def answered(step: Step) -> Outcome:
        nonlocal plays
        if isinstance(step, Publish) and isinstance(step.event, Warned):
            warned.append(step.event.text)
        if not isinstance(step, Play):
            return Done()
        plays += 1
        signals = np.zeros((106, 6))
        if plays <= losses or where != 40:
            signals[where : where + 7, DISPLACEMENT] = np.nan
        return Played(signals, volts)

    def finished() -> Outcome:
        step = next(running)
        while True:
            try:
                step = running.send(answered(step))
            except StopIteration as end:
                return end.value

    if losses < 2:
        outcome = finished()
        assert isinstance(outcome, Played)
        assert np.isfinite(outcome.signals).all() == (where == 40)
    else:
        with pytest.raises(Unmeasurable, match=r"multisine 2: .* missing in both attempts \(7 in the last one\)"):
            finished()
    assert warned == ["multisine 2: samples of the table's motion are missing (7); it is repeated"] * min(losses, 1)
    # the repetition is expected to take as long again
    assert rules.expected == pytest.approx(60.0 + min(losses, 1) * (0.106 + OVERHEAD))
