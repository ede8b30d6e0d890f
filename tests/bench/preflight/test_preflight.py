"""Margins, refusals, disk and hash, each against numbers that are worked out by hand."""

import hashlib
import json
from collections import namedtuple
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.app import preflight
from bench.app.preflight import bytes_per_second, compile_run, disk_space, plan_hash
from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment, program
from bench.datafile import tables
from bench.guard.limits import Limits
from bench.guard.shaker import ShakerModel, largest_repeated_mean
from bench.preflight.demands import IdentifiedTable, SimulatedTable, load, response_of
from bench.preflight.margins import Demand, Forecast, Stage, bounds, margins, refusal, warnings
from bench.protocol import Plan, Prepared, Result
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.parameters import Parameters
from sim.shaker import Shaker
from sim.virtual_bench import VirtualBenchParameters

CONFIGURATION = BenchConfiguration()
STAGE = Stage("hold", (Segment(2.0, 1.0, 10.0),), 0.5)


class Silent(Prepared[HarmonicParameters]):
    """A protocol that predicts nothing."""

    def __init__(self) -> None:
        super().__init__(HarmonicParameters(), CONFIGURATION)

    def plan(self) -> Plan:
        raise NotImplementedError

    def result(self, points: Sequence[Parameters]) -> Result:
        raise NotImplementedError


class Telling(Silent):
    """A protocol with the demands it is given."""

    def __init__(self, *demands: Demand, duration: float = 100.0) -> None:
        super().__init__()
        self._forecast = Forecast(demands, (STAGE,), duration)

    @property
    def forecast(self) -> Forecast:
        return self._forecast


def _demand(quantity: str, value: float | None, likely: float | None = None) -> Demand:
    return Demand(quantity, value, value if likely is None else likely, "the test")


def test_the_tightest_margin_comes_first_and_the_unknown_last() -> None:
    demands = [_demand("drive_voltage", None), _demand("velocity", 0.15), _demand("drift", 0.06)]
    found = margins(demands, bounds(CONFIGURATION))
    assert [each.bound.quantity for each in found] == ["drift", "velocity", "drive_voltage"]
    assert [each.margin for each in found] == [pytest.approx(0.25), pytest.approx(0.75), None]


@pytest.mark.parametrize("quantity", list(bounds(CONFIGURATION)))
def test_what_is_beyond_a_limit_is_refused_by_its_name(quantity: str, tmp_path: Path) -> None:
    bound = bounds(CONFIGURATION)[quantity]
    allowed = compile_run("silent", Telling(_demand(quantity, bound.limit)), tmp_path)
    assert allowed.refusal is None
    beyond = compile_run("silent", Telling(_demand(quantity, 1.25 * bound.limit)), tmp_path)
    with pytest.raises(InvalidInput) as caught:
        beyond.require()
    assert (caught.value.item, caught.value.value) == (bound.owner, bound.limit)
    for words in ("the test", bound.name, "margin -25.0 %", bound.remedy, f"{1.25 * bound.limit:.4g}"):
        assert words in str(caught.value)


def test_the_limit_that_binds_most_is_the_one_that_is_named() -> None:
    demands = [_demand("velocity", 0.72), _demand("acceleration", 9.0), _demand("force", 710.0)]
    refused = refusal(margins(demands, bounds(CONFIGURATION)))
    assert refused is not None
    assert refused.item == "limits.acceleration"


def test_what_only_an_unlucky_specimen_exceeds_is_a_warning() -> None:
    found = margins([_demand("drift", 0.06, 0.10), _demand("velocity", 0.5)], bounds(CONFIGURATION))
    assert refusal(found) is None
    (said,) = warnings(found)
    assert "limits.drift = 0.08" in said
    assert "margin -25.0 %" in said
    beyond = margins([_demand("drift", 0.09, 0.10)], bounds(CONFIGURATION))
    assert warnings(beyond) == ()


def test_the_least_of_several_limits_binds() -> None:
    wide = Limits(displacement=0.2, drive_voltage=10.0, laser_range=3.0, current=30.0)
    found = bounds(BenchConfiguration(limits=wide))
    owners = {key: (bound.owner, bound.limit) for key, bound in found.items()}
    assert owners["displacement"] == ("the shaker's stroke", 0.075)
    assert owners["drive_voltage"][1] == 10.0
    strong = CONFIGURATION.simulation.model_copy(
        update={"bench": VirtualBenchParameters(shaker=Shaker(gain=6.0, voltage_limit=30.0))}
    )
    driven = bounds(CONFIGURATION.model_copy(update={"simulation": strong}))["drive_voltage"]
    assert (driven.owner, driven.limit) == ("the amplifier's voltage_limit", 5.0)
    assert owners["laser_1"] == ("the laser's range", 1.0)
    assert owners["current"] == ("the amplifier's current_limit", 18.0)
    hardware = BenchConfiguration.model_validate({"backend": "hardware", "hardware": {"daq": {"output_range": 5.0}}})
    assert bounds(hardware)["drive_voltage"].limit == 5.0


def test_an_experiment_without_predictions_has_no_margins_but_a_hash(tmp_path: Path) -> None:
    found = compile_run("silent", Silent(), tmp_path)
    assert (found.margins, found.room, found.refusal, dict(found.tables)) == ((), None, None, {})
    assert len(found.plan_hash) == 64


def test_a_record_that_does_not_fit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four channels of 2 bytes and a drive of 4 at 2 kHz: 24 kB/s."""
    assert bytes_per_second(CONFIGURATION) == 24_000.0
    usage = namedtuple("usage", "total used free")
    seen: list[Path] = []

    def full(path: Path) -> usage:
        seen.append(path)
        return usage(10**9, 10**9 - 5_000_000, 5_000_000)

    monkeypatch.setattr(preflight.shutil, "disk_usage", full)
    folder = tmp_path / "a" / "b"
    refused = compile_run("silent", Telling(duration=1000.0), folder).refusal
    assert refused is not None
    assert seen[0] == tmp_path
    assert (refused.item, refused.value) == ("--out", str(folder))
    assert "may need 79.2 MB, but 5.0 MB are free" in str(refused)
    assert disk_space(CONFIGURATION, 50.0, folder).refusal() is None


def test_a_sine_asks_what_the_closed_forms_say() -> None:
    """2 m/s2 at 10 rad/s: 20 mm, 0.2 m/s; 60 kg on 500 N/m by 50 N/A; shaker of the default parameters."""
    shaker, mass = Shaker(friction=0.0), 10.0
    found = load(
        program([Segment(4.0, 2.0, 10.0), Segment(20.0, 2.0, 10.0)]),
        0.0,
        1e4,
        payload=mass,
        shaker=ShakerModel(60.0, 500.0, 50.0),
        response=SimulatedTable(shaker),
        heating_time=60.0,
    )
    current = 2.0 * (60.0 - 500.0 / 100.0) / 50.0
    # coil volts for 20 mm at 10 rad/s: resistance times the current that moves mass, springs and dashpot, and back-EMF
    needed = complex(-60.0 * 100.0 + 500.0, 30.0 * 10.0) * 0.02 / 50.0
    volts = abs(0.8 * needed + 50.0 * 10.0j * 0.02) / 3.0
    expected = {
        "displacement": 0.02,
        "velocity": 0.2,
        "acceleration": 2.0,
        "force": 120.0,
        "current": current,
        "heating": current / np.sqrt(2.0),
        "drive_voltage": volts,
        "drive_slew": 10.0 * volts,
    }
    assert found == pytest.approx(expected, rel=1e-3)


def test_what_comes_before_does_not_count_and_a_chirp_goes_through_its_slowest_sine() -> None:
    segments = [Segment(1.0, 5.0, 20.0), Segment(1.0, 1.0, 20.0), Segment(5.0, 1.0, 10.0)]
    found = load(program(segments), 2.0, 0.0, payload=0.0, shaker=None, response=None, heating_time=60.0)
    assert found == pytest.approx({"displacement": 0.01, "velocity": 0.1, "acceleration": 1.0}, rel=0.02)


def _hash(**changes: object) -> str:
    given = {
        "protocol": "harmonic",
        "parameters": HarmonicParameters(),
        "configuration": CONFIGURATION,
        "version": "1.0",
        "forecast": Forecast((_demand("drift", 0.05),), (STAGE,), 100.0),
    }
    return plan_hash(**(given | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "change",
    [
        {"protocol": "check"},
        {"parameters": HarmonicParameters(starts=5)},
        {"configuration": BenchConfiguration(limits=Limits(drift=0.081))},
        {"version": "1.1"},
        {"forecast": Forecast((_demand("drift", 0.0500001),), (STAGE,), 100.0)},
        {"forecast": Forecast((_demand("drift", 0.05),), (Stage("hold", (Segment(2.0, 1.0, 10.1),), 0.5),), 100.0)},
        {"forecast": Forecast((_demand("drift", 0.05),), (STAGE,), 101.0)},
    ],
)
def test_the_hash_changes_with_whatever_decides_the_run(change: dict[str, object]) -> None:
    assert _hash(**change) != _hash()


def test_the_hash_is_the_same_for_the_same_run_and_for_its_last_bits() -> None:
    again = BenchConfiguration.model_validate(json.loads(CONFIGURATION.model_dump_json()))
    assert _hash(configuration=again, parameters=HarmonicParameters()) == _hash()
    last_bits = Forecast((_demand("drift", np.nextafter(0.05, 1.0)),), (STAGE,), 100.0)
    assert _hash(forecast=last_bits) == _hash()
    assert int(_hash(), 16).bit_length() <= 8 * hashlib.sha256().digest_size


def test_the_tables_can_be_stored(tmp_path: Path) -> None:
    found = compile_run("silent", Telling(_demand("drift", 0.05), _demand("force", None)), tmp_path)
    for name, table in found.tables.items():
        tables.check(name, table)
    assert found.tables["preflight"]["margin"].values == pytest.approx([0.375, np.nan], nan_ok=True)
    assert list(found.tables["planned_drive"]["amplitude"].values) == [1.0]


def test_a_real_table_is_predicted_from_its_identification_only(tmp_path: Path) -> None:
    hardware = BenchConfiguration(backend="hardware")
    assert response_of(hardware) is None
    path = tmp_path / "table.json"
    lines = {"coherence": [1.0, 1.0], "uncertainty": [0.0, 0.0], "distortion": [0.0, 0.0], "noise": [0.0, 0.0]}
    model = {"date": "2026-01-01T00:00:00Z", "specimen": "bare frame", "sample_rate": 2000.0, "level": 0.5}
    response = {"frequency": [1.0, 10.0], "real": [3.0, 3.0], "imaginary": [-4.0, -4.0]}
    path.write_text(json.dumps(model | lines | response), encoding="utf-8")
    identified = response_of(BenchConfiguration(backend="hardware", table_model=str(path)))
    assert isinstance(identified, IdentifiedTable)
    assert identified.gain(np.array([12.5]), 3.0) == pytest.approx([5.0])
    with pytest.raises(InvalidInput, match="wider band"):
        identified.gain(np.array([100.0]), 3.0)


def test_the_heating_of_a_long_record_is_that_of_its_strong_part() -> None:
    """A strong 60 s in 600 s, against the guard's running mean as a loop over samples."""
    from bench.preflight.motion import resting_demands
    from sim.specimen import Specimen

    rate = 50.0
    t = np.arange(0.0, 600.0, 1.0 / rate)
    strong = np.exp(-(((t - 300.0) / 30.0) ** 2))
    acceleration = 0.4 * strong * np.sin(12.0 * t)
    shaker = CONFIGURATION.shaker_model
    assert shaker is not None
    found = resting_demands(acceleration, rate, Specimen().bare(), CONFIGURATION)
    displacement = -acceleration / 12.0**2
    mean = greatest = 0.0
    forget = np.exp(-1.0 / (CONFIGURATION.limits.heating_time * rate))
    for square in shaker.current(acceleration, displacement) ** 2:
        mean = forget * mean + (1.0 - forget) * square
        greatest = max(greatest, mean)
    rms = float(np.sqrt(np.mean(shaker.current(acceleration, displacement) ** 2)))
    assert found["heating"] == pytest.approx(np.sqrt(greatest), rel=5e-3)
    assert found["heating"] > 1.5 * rms


def test_the_heating_is_that_of_programmes_without_pause() -> None:
    """Forty repetitions, by a loop over samples."""
    rate, time = 50.0, 60.0
    squares = np.concatenate((np.full(500, 4.0), np.linspace(9.0, 0.0, 1000)))
    forget = float(np.exp(-1.0 / (time * rate)))
    mean = greatest = 0.0
    for square in np.tile(squares, 40):
        mean = forget * mean + (1.0 - forget) * square
        greatest = max(greatest, mean)
    assert largest_repeated_mean(squares, forget) == pytest.approx(greatest, rel=1e-6)
    assert largest_repeated_mean(squares, 1.0) == pytest.approx(np.mean(squares))


def test_the_heating_of_a_short_sine_is_that_of_its_repetitions() -> None:
    """A sine for 24 s: the mean over rise and sine, hardly above it for a coil that is slow in comparison."""
    found = load(
        program([Segment(4.0, 2.0, 10.0), Segment(10.0, 2.0, 10.0)]),
        0.0,
        10.0,
        payload=0.0,
        shaker=ShakerModel(60.0, 0.0, 50.0),
        response=None,
        heating_time=6e3,
    )
    # the rise is half a cosine or a line; between a third and a half of its duration counts
    power = 0.5 * (2.0 * 60.0 / 50.0) ** 2
    low, high = (power * (20.0 + 4.0 * share) / 24.0 for share in (0.3, 0.5))
    assert low < found["heating"] ** 2 < 1.005 * high
