from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import SeedSequence
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.optimize import minimize

from sim.arrangement import Arrangement
from sim.filter_unit import FilterUnit
from sim.sensors import Accelerometer, Laser, PlacedSensor
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE = 2000.0


def kick(n: int) -> Array:
    """A drive that makes the block rock at once."""
    return 4.5 * np.sin(16.0 * np.arange(n) / RATE)


def values(bench: VirtualBench, counts: NDArray[np.int16]) -> dict[str, Array]:
    """The channels as their calibrations have them."""
    return {c.name: counts[:, i].astype(np.float64) * c.scale + c.offset for i, c in enumerate(bench.channels)}


def bench_with(specimen: Specimen, seed: int = 1, **parts: object) -> VirtualBench:
    return VirtualBench(VirtualBenchParameters.model_validate(parts), specimen, seed)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 120), min_size=2, max_size=12), st.sampled_from([2000.0, 20_000.0]))
def test_counts_do_not_depend_on_how_the_drive_is_cut(blocks: list[int], rate: float) -> None:
    whole, cut = (bench_with(Specimen(beta=0.4), 7, sample_rate=rate) for _ in range(2))
    rocking = kick(int(0.4 * rate))
    volts = kick(sum(blocks))
    for bench in (whole, cut):
        bench.run(rocking)
        assert np.abs(bench.truth.theta).max() > 1e-3
    expected, start = whole.run(volts), 0
    for n in blocks:
        np.testing.assert_array_equal(cut.run(volts[start : start + n]), expected[start : start + n])
        start += n


def test_single_samples_are_the_block() -> None:
    whole, cut = (bench_with(Specimen(beta=0.4), 3) for _ in range(2))
    volts = kick(600)
    expected = whole.run(volts)
    np.testing.assert_array_equal(np.concatenate([cut.run(volts[i : i + 1]) for i in range(600)]), expected)


@pytest.mark.parametrize("watched", [None, 0.1])
@pytest.mark.parametrize("reference", ["ground", "table"])
def test_counts_are_those_of_the_instruments_one_by_one(reference: str, watched: float | None) -> None:
    parts: dict[str, object] = {
        "laser_1": {"reference": reference, "latency": 5, "rate": 1000.0},
        "laser_2": {"reference": reference, "latency": 0},
        "converter": {"clock_error": 2e-5},
    }
    further = _further("displacement", "table")
    p = VirtualBenchParameters.model_validate(parts)
    bench = VirtualBench(p, Specimen(beta=0.4), 11, [further])
    bench.mount(replace(bench.arrangement, watched=watched))
    counts, truth = bench.run(kick(1500)), bench.truth
    sources, rate, (x1, v1, x2, v2) = SeedSequence(11).spawn(8), p.tick_rate, bench.sights
    volts = np.array(
        [
            p.displacement_sensor.volts(truth.x, rate, np.random.default_rng(sources[1])),
            p.accelerometer.volts(truth.a, rate, np.random.default_rng(sources[2])),
            p.laser_1.stream(rate, sources[3]).read(x1, v1),
            p.laser_2.stream(rate, sources[4]).read(x2, v2),
            further.volts(truth.x, rate, np.random.default_rng(sources[7])),
        ]
    )
    filtered = p.filter_unit.stream(rate).read(volts).T
    np.testing.assert_array_equal(counts, p.converter.counts(filtered, np.random.default_rng(sources[5])))
    np.testing.assert_array_equal(x1, truth.u1 + (truth.x if reference == "ground" else 0.0))
    followed = np.allclose(x2 - x1, truth.u2 - truth.u1, rtol=0.0, atol=1e-12)
    assert followed == (watched is None)


def test_a_seed_is_a_bench() -> None:
    one, same, other = (bench_with(Specimen(beta=0.4), seed).run(kick(400)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert all((one[:, i] != other[:, i]).any() for i in range(4))


def test_an_empty_block_is_empty() -> None:
    assert bench_with(Specimen()).run(np.empty(0)).shape == (0, 4)


def test_channels_report_the_motion_through_their_calibrations() -> None:
    """Slow motion, so that filter and latency hardly matter: tolerances are delay times rate of change."""
    bench = bench_with(Specimen(), filter_unit=FilterUnit(order=2, cutoff=500.0))
    t = np.arange(12_000) / RATE
    seen = values(bench, bench.run(1.5 * np.sin(2.0 * np.pi * 0.4 * t)))
    truth = bench.truth
    delay = 0.003
    assert np.abs(seen["table_displacement"] - truth.x).max() < delay * np.abs(truth.v).max() + 1e-4
    assert np.abs(seen["table_acceleration"] - truth.a)[20:].max() < 0.08
    for name, u, v in (("laser_1", truth.u1, truth.v1), ("laser_2", truth.u2, truth.v2)):
        assert np.abs(u).max() > 1e-3
        assert np.abs(seen[name] - truth.x - u).max() < delay * np.abs(truth.v + v).max() + 4e-4


def test_a_laser_on_the_table_does_not_see_the_table() -> None:
    bench = bench_with(Specimen(), laser_1=Laser(reference="table"), laser_2=Laser(reference="table"))
    seen = values(bench, bench.run(0.5 * np.sin(6.0 * np.arange(4000) / RATE)))
    ground = np.abs(seen["laser_1"] - bench.truth.u1 - bench.truth.x).max()
    assert np.abs(seen["laser_1"] - bench.truth.u1).max() < 0.2 * ground


def test_a_scale_error_is_not_known_to_the_calibration() -> None:
    volts = 1.5 * np.sin(16.0 * np.arange(6000) / RATE)
    honest, wrong = bench_with(Specimen()), bench_with(Specimen(), accelerometer=Accelerometer(scale_error=0.05))
    ratio = values(wrong, wrong.run(volts))["table_acceleration"].std()
    ratio /= values(honest, honest.run(volts))["table_acceleration"].std()
    assert wrong.channels == honest.channels
    assert ratio == pytest.approx(1.05, rel=2e-3)


def test_a_laser_out_of_range_and_a_saturated_input_are_not_measurements() -> None:
    bench = bench_with(Specimen(), laser_1=Laser(measuring_range=0.010))
    counts = bench.run(np.concatenate([np.zeros(200), np.full(1200, 10.0)]))
    limits = dict(zip((c.name for c in bench.channels), (c.valid for c in bench.channels), strict=True))
    low, high = limits["laser_1"]
    assert ((low <= counts[:200, 2]) & (counts[:200, 2] <= high)).all()
    assert counts[-1, 2] < low
    assert limits["table_acceleration"] == (-8191, 8190)


def test_a_toppled_block_is_caught_and_pulls_the_frame_where_the_springs_balance() -> None:
    """The storeys rest where the potential energy of Eq. (5) is least with the block at the catch angle."""
    specimen = Specimen(beta=0.64)
    bench = bench_with(
        specimen,
        laser_1=Laser(reference="table", linearity=0.0),
        laser_2=Laser(reference="table"),
        shaker=Shaker(force_noise=0.0),
    )
    bench.run(8.0 * np.sin(9.0 * np.arange(8000) / RATE))
    assert bench.fallen
    bench.coast(120.0)
    seen = values(bench, bench.run(np.zeros(400)))["laser_1"][-100:].mean()
    side = float(np.sign(bench.truth.theta[-1]))
    assert np.abs(bench.truth.theta[-1]) == 0.35
    f, corner = specimen.frame, 0.0 if side > 0 else 2.0 * specimen.block.b

    def energy(u: Array) -> float:
        theta = 0.35 * side
        dx = specimen.d + corner * (1.0 - np.cos(theta)) - f.h1 * np.sin(theta) - u[0]
        dy = -f.h1 * (1.0 - np.cos(theta)) - corner * np.sin(theta)
        spring = 0.5 * specimen.k_c * (np.hypot(dx, dy) - specimen.d) ** 2
        return 0.5 * f.k1 * u[0] ** 2 + 0.5 * f.k2 * (u[1] - u[0]) ** 2 + spring

    expected = minimize(energy, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-14}).x[0]
    assert abs(expected) > 0.01
    assert seen == pytest.approx(expected, abs=5e-4)
    bench.mount(bench.arrangement)
    bench.run(np.zeros(400))
    assert not bench.fallen
    assert np.abs(bench.truth.u1).max() < 1e-4


def test_mounting_another_specimen_stands_it_still() -> None:
    bench = bench_with(Specimen(beta=0.4))
    bench.run(kick(2000))
    bench.mount(Arrangement(Specimen()))
    bench.coast(0.001)
    truth = bench.truth
    assert truth.u1[0] == truth.u2[0] == truth.theta[0] == truth.v[0] == 0.0
    assert bench.specimen.beta is None


def test_a_filter_that_the_sample_rate_cannot_carry_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"filter_unit\.cutoff"):
        VirtualBenchParameters(sample_rate=150.0)


def _further(measures: str, place: str) -> PlacedSensor:
    unit, volts = {"acceleration": ("m/s2", 0.1), "velocity": ("m/s", 2.0), "displacement": ("m", 50.0)}[measures]
    return PlacedSensor.model_validate(
        {"name": "one", "measures": measures, "unit": unit, "place": place, "sensitivity": volts, "noise_density": 1e-3}
    )


FURTHER = [_further("acceleration", place) for place in ("table", "storey 1", "storey 2")]


def test_further_sensors_change_no_other_count_and_do_not_depend_on_how_the_drive_is_cut() -> None:
    """But for the converter's noise, which is drawn for all inputs of a tick together."""
    parameters, volts = VirtualBenchParameters.model_validate({"converter": {"noise": 0.0}}), kick(3000)
    alone = VirtualBench(parameters, Specimen(), 1).run(volts)
    whole, cut = (VirtualBench(parameters, Specimen(), 1, FURTHER) for _ in range(2))
    expected = whole.run(volts)
    np.testing.assert_array_equal(expected[:, :4], alone)
    assert expected.shape == (3000, 7)
    parts = [cut.run(part) for part in np.split(volts, [1, 8, 8, 500, 1499])]
    np.testing.assert_array_equal(np.concatenate(parts), expected)


@pytest.mark.parametrize("place", ["table", "storey 1", "storey 2"])
def test_a_further_sensor_measures_the_motion_of_its_place(place: str) -> None:
    """The acceleration integrates to the velocity, and that to the displacement, of the true motion."""
    quiet = {"converter": {"noise": 0.0, "bits": 16}, "filter_unit": {"order": 1, "cutoff": 900.0}}
    sensors = [_further(each, place) for each in ("acceleration", "velocity", "displacement")]
    sensors = [each.model_copy(update={"noise_density": 0.0}) for each in sensors]
    bench = VirtualBench(VirtualBenchParameters.model_validate(quiet), Specimen(), 1, sensors)
    counts, truth, rate = bench.run(kick(4000)), bench.truth, bench.parameters.sample_rate
    relative = {"table": np.zeros(4000), "storey 1": truth.u1, "storey 2": truth.u2}[place]
    speed = {"table": np.zeros(4000), "storey 1": truth.v1, "storey 2": truth.v2}[place]
    acceleration, velocity, displacement = (
        channel.to_unit(counts[:, k]) for k, channel in enumerate(bench.channels[4:], 4)
    )
    assert np.abs(velocity - truth.v - speed).max() < 0.02 * np.abs(velocity).max()
    assert np.abs(displacement - truth.x - relative).max() < 0.02 * np.abs(displacement).max()
    assert np.abs(np.cumsum(acceleration) / rate - velocity).max() < 0.02 * np.abs(velocity).max()


def test_an_error_of_the_sample_clock_is_another_rate_under_the_same_name() -> None:
    fast = bench_with(Specimen(beta=0.4), converter={"clock_error": 0.005})
    true = bench_with(Specimen(beta=0.4), sample_rate=2010.0)
    np.testing.assert_array_equal(fast.run(kick(800)), true.run(kick(800)))
    assert fast.parameters.sample_rate == RATE
