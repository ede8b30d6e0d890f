"""The guard: what it lets through, what it refuses, and how the output ends."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.analysis.signals import SignalMap
from bench.guard.conversion import Extremes
from bench.guard.guard import Exchange, Guard
from bench.guard.limits import Debounce, Limits, Ramps, Warnings
from bench.guard.quantities import WatchedQuantities
from bench.guard.sensors import TimeWatch
from bench.guard.shaker import ShakerModel
from bench.testing.loopback import LoopbackRig
from drivers.errors import RigError
from drivers.rig import Block
from sim.channel import STOREYS
from sim.errors import InvalidInput

N = 100
LIMITS = Limits(
    drive_voltage=5.0,
    drive_slew=200.0,
    displacement=0.04,
    velocity=3.0,
    acceleration=4.5,
    debounce=Debounce(displacement=0.002, velocity=0.002, acceleration=0.002),
)
RAMPS = Ramps(stop=1.0, abort=0.2)


def _armed(rig: LoopbackRig | None = None) -> tuple[Guard, LoopbackRig]:
    rig = rig or LoopbackRig()
    guard = Guard(rig, LIMITS, RAMPS)
    guard.arm()
    return guard, rig


def _sine(amplitude: float, first: int = 0, n: int = N) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * 2.0 * np.arange(first, first + n) / 1000.0)


def _run_out(guard: Guard, volts: np.ndarray) -> int:
    blocks = 0
    while not guard.at_zero:
        guard.exchange(volts)
        blocks += 1
        assert blocks < 100
    return blocks


def test_a_good_command_passes_unchanged_after_the_lead() -> None:
    guard, rig = _armed()
    sent = np.concatenate([_sine(2.0, N * k) for k in range(5)])
    played = np.concatenate([guard.exchange(block).drive for block in np.split(sent, 5)])
    np.testing.assert_array_equal(played, np.concatenate((np.zeros(rig.lead), sent))[: sent.size])
    np.testing.assert_array_equal(rig.played, played)


@pytest.mark.parametrize(
    ("bad", "named"),
    [
        (np.full(N, 6.0), "drive command"),
        (np.full(N, np.nan), "drive command"),
        (np.full(N, np.inf), "drive command"),
        (np.where(np.arange(N) < 50, 0.0, 4.0), "drive slew"),
    ],
)
def test_a_bad_command_is_named_and_never_sent(bad: np.ndarray, named: str) -> None:
    guard, rig = _armed()
    guard.exchange(_sine(2.0))
    before = guard.exchange(_sine(2.0, N))
    found = guard.exchange(bad)
    assert before.violation is None
    assert found.violation is not None
    assert found.violation.quantity == named
    _run_out(guard, bad)
    assert np.abs(rig.played).max() <= 2.0
    assert rig.played[-1] == 0.0
    assert np.abs(np.diff(rig.played)).max() <= LIMITS.drive_slew / rig.sample_rate


@pytest.mark.parametrize(("way", "length"), [("stop", 1.0), ("abort", 0.2)])
def test_a_ramp_is_smooth_and_as_long_as_configured(way: str, length: float) -> None:
    guard, rig = _armed()
    guard.exchange(np.full(N, 0.0))
    for level in np.linspace(0.1, 2.0, 20):
        guard.exchange(np.full(N, level))
    getattr(guard, way)()
    begin = rig.played.size
    _run_out(guard, np.full(N, 2.0))
    ramp = rig.played[begin + rig.lead :]
    assert ramp[0] == pytest.approx(2.0, rel=0.01)
    assert np.all(np.diff(ramp) <= 0.0)
    assert np.flatnonzero(ramp)[-1] + 1 == pytest.approx(length * rig.sample_rate, abs=2)
    assert np.abs(np.diff(ramp)).max() <= 2.0 * np.pi / 2.0 / (length * rig.sample_rate) * 1.01


def test_abort_overtakes_a_stop_from_where_it_is_and_stop_never_slows_an_abort() -> None:
    guard, rig = _armed()
    for level in np.linspace(0.0, 2.0, 20):
        guard.exchange(np.full(N, level))
    guard.stop()
    guard.exchange(np.full(N, 2.0))
    begin = rig.played.size
    guard.abort()
    guard.abort()
    guard.stop()
    _run_out(guard, np.full(N, 2.0))
    tail = rig.played[begin:]
    assert np.abs(np.diff(tail)).max() < 0.02
    assert np.flatnonzero(tail)[-1] <= rig.lead + 0.2 * rig.sample_rate


@pytest.mark.parametrize(("volts", "quantity"), [(4.2, "table displacement"), (4.8, "table acceleration")])
def test_measured_motion_beyond_a_limit_aborts(volts: float, quantity: str) -> None:
    factor = 0.01 if quantity == "table displacement" else 0.001
    rig = LoopbackRig({"table_displacement": lambda v: factor * v, "table_acceleration": lambda v: v})
    guard, _ = _armed(rig)
    levels = np.linspace(0.0, volts, 30)
    seen = [guard.exchange(np.full(N, level)).violation for level in levels] + [
        guard.exchange(np.full(N, volts)).violation for _ in range(3)
    ]
    found = [violation for violation in seen if violation is not None]
    assert found[0].quantity == quantity
    assert guard.ramping
    _run_out(guard, np.full(N, volts))
    assert rig.played[-1] == 0.0


def test_velocity_is_differenced_over_block_seams() -> None:
    rig = LoopbackRig({"table_displacement": lambda v: 0.035 * v})
    step = np.clip(np.arange(N) * 0.1, 0.0, 1.0)  # 35 mm in 10 ms: 1.75 m/s over the window of 20 ms
    limits = LIMITS.model_copy(update={"velocity": 1.5})
    guard = Guard(rig, limits, RAMPS)
    guard.arm()
    violations = [guard.exchange(block).violation for block in (np.zeros(N), step, np.ones(N), np.ones(N))]
    found = next(violation for violation in violations if violation is not None)
    assert found.quantity == "table velocity"
    assert found.value == pytest.approx(1.75, rel=0.02)


def test_a_single_spike_is_debounced() -> None:
    def spike(volts: np.ndarray) -> np.ndarray:
        values = np.zeros(volts.size)
        values[10] = 20.0
        return values

    guard, _ = _armed(LoopbackRig({"table_acceleration": spike}))
    assert all(guard.exchange(np.zeros(N)).violation is None for _ in range(5))


def test_a_sensor_at_its_rail_counts_as_beyond_the_limit() -> None:
    def saturated(volts: np.ndarray) -> np.ndarray:
        return np.where(np.arange(volts.size) > 50, np.nan, 0.0)

    guard, _ = _armed(LoopbackRig({"table_acceleration": saturated}))
    violation = guard.exchange(np.zeros(N)).violation
    assert violation is not None
    assert violation.quantity == "table acceleration"
    assert violation.value == np.inf


@pytest.mark.parametrize("every", [2, 5])
def test_missing_samples_do_not_hide_a_motion_beyond_its_limit(every: int) -> None:
    def intermittent(volts: np.ndarray) -> np.ndarray:
        return np.where(np.arange(volts.size) % every == 0, np.nan, 0.05)

    guard, _ = _armed(LoopbackRig({"table_displacement": intermittent}))
    violation = guard.exchange(np.zeros(N)).violation
    assert violation is not None
    assert violation.quantity == "table displacement"


def test_velocity_is_seen_through_missing_samples() -> None:
    def moving(volts: np.ndarray) -> np.ndarray:
        t = np.arange(volts.size) / 1000.0
        return np.where(np.arange(volts.size) % 5 == 0, np.nan, 3.5 * t - 0.02)

    limits = Limits(displacement=30.0, velocity=3.0, acceleration=4.5, debounce=Debounce(velocity=0.01))
    guard = Guard(LoopbackRig({"table_displacement": moving}), limits, RAMPS)
    guard.arm()
    violation = guard.exchange(np.zeros(N)).violation
    assert violation is not None
    assert violation.quantity == "table velocity"


def test_a_limit_that_a_channel_cannot_measure_is_refused() -> None:
    with pytest.raises(
        InvalidInput, match=r"limits\.acceleration = 40\.0 .* table_acceleration measures only up to 32\.77"
    ):
        Guard(LoopbackRig(), Limits(acceleration=40.0), RAMPS)


def test_a_ramp_steeper_than_the_slew_limit_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"ramps\.abort"):
        Guard(LoopbackRig(), Limits(drive_slew=100.0), Ramps(stop=1.0, abort=0.1))


def test_a_sensor_that_is_silent_for_too_long_aborts_although_each_block_is_short() -> None:
    guard, rig = _armed(LoopbackRig({"laser_1": lambda volts: np.full(volts.size, np.nan)}))
    seen = [guard.exchange(np.zeros(N)).violation for _ in range(6)]
    assert [violation is None for violation in seen] == [True] * 4 + [False] * 2
    assert seen[4] is not None
    assert "laser_1" in seen[4].quantity
    assert seen[4].sample == round(LIMITS.sensor_loss * rig.sample_rate) - 1


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.sampled_from(["stop", "abort"]),
            st.floats(-8.0, 8.0),
            st.sampled_from([float("nan"), float("inf"), 1e300]),
        ),
        max_size=12,
    )
)
def test_whatever_is_asked_the_output_stays_within_limits_and_ends_at_zero(acts: list[float | str]) -> None:
    guard, rig = _armed()
    for act in acts:
        if isinstance(act, str):
            getattr(guard, act)()
        else:
            guard.exchange(np.full(N, act))
    guard.abort()
    _run_out(guard, np.full(N, 8.0))
    assert np.abs(rig.played).max() <= LIMITS.drive_voltage
    assert np.abs(np.diff(rig.played, prepend=0.0)).max() <= LIMITS.drive_slew / rig.sample_rate + 1e-12
    assert rig.played[-1] == 0.0


def _bench_rig(**response: object) -> LoopbackRig:
    """A loopback with every channel that the guard knows; volts are answered as given, the others show noise only."""
    channels = ("table_displacement", "table_acceleration", "laser_1", "laser_2")
    return LoopbackRig({name: response.get(name, _noise) for name in channels})  # type: ignore[misc]


def _noise(volts: np.ndarray) -> np.ndarray:
    """One count to and fro."""
    return 0.001 * (np.arange(volts.size) % 2)


def _nothing(volts: np.ndarray) -> np.ndarray:
    return 0.0 * volts


def _until_violation(rig: LoopbackRig, limits: Limits, volts: float, shaker: ShakerModel | None = None) -> Exchange:
    """A slow rise to `volts`, then hold; the first exchange with a violation."""
    guard = Guard(rig, limits, RAMPS, shaker, SignalMap(rig.channels, "table"))
    guard.arm()
    guard.tare(guard.exchange(np.zeros(N)).values)
    levels = [np.linspace(volts * k / 30, volts * (k + 1) / 30, N) for k in range(30)]
    wobble = 0.01 * np.sin(np.arange(N))
    for block in [*levels, *[np.full(N, volts) + wobble] * 60]:
        found = guard.exchange(block)
        if found.violation is not None:
            return found
    raise AssertionError("nothing was noticed")


def test_force_and_current_are_estimated_from_the_motion() -> None:
    """4 m/s2 of 60 kg are 240 N; with 20 N/A and no springs 12 A."""
    shaker = ShakerModel(mass=60.0, stiffness=0.0, force_constant=20.0)
    rig = _bench_rig(table_acceleration=lambda v: v)
    found = _until_violation(rig, Limits(force=200.0, current=16.0), 4.0, shaker).violation
    assert found is not None
    assert (found.quantity, found.unit) == ("force on the table", "N")
    assert found.value == pytest.approx(200.0, rel=0.02)
    found = _until_violation(_bench_rig(table_acceleration=lambda v: v), Limits(current=10.0), 4.0, shaker).violation
    assert found is not None
    assert found.quantity == "coil current"


def test_heating_follows_the_square_of_the_current() -> None:
    """A constant 10 A reaches 8 A rms of a first-order mean after tau ln(1 / (1 - 0.64))."""
    tau = 2.0
    limits = Limits(heating=8.0, heating_time=tau)
    quantities = WatchedQuantities(_bench_rig().channels, 1000.0, tau, ShakerModel(20.0, 0.0, 20.0))
    values = np.zeros((4000, 4))
    values[:, 1] = 10.0
    heating = quantities.of(values)["heating"]
    reached = int(np.argmax(heating > limits.heating)) / 1000.0
    assert reached == pytest.approx(tau * np.log(1.0 / 0.36), abs=0.002)


def _warmed(rig: LoopbackRig, guard: Guard) -> float:
    """Drive some seconds at 5 A, and come to rest; mean square of the current up to now, by a loop over samples."""
    guard.arm()
    levels = np.linspace(0.0, 5.0, 20 * N)
    for block in (*np.split(levels, 20), *[np.full(N, 5.0)] * 30):
        guard.exchange(block)
    guard.stop()
    _run_out(guard, np.full(N, 5.0))
    guard.disarm()
    mean, forget = 0.0, np.exp(-1.0 / (2.0 * rig.sample_rate))
    for volts in rig.played:
        mean = forget * mean + (1.0 - forget) * volts**2
    return mean


@pytest.mark.parametrize("pause", [0.0, 3.4])
def test_the_coil_is_still_warm_when_the_rig_is_armed_again(pause: float) -> None:
    rig = _bench_rig(table_acceleration=lambda v: v, table_displacement=_nothing)
    limits = Limits(acceleration=10.0, heating=9.0, heating_time=2.0)
    guard = Guard(rig, limits, RAMPS, ShakerModel(20.0, 0.0, 20.0), SignalMap(rig.channels, "table"))
    heat = _warmed(rig, guard)
    assert heat > 0.2
    rig.clock.wait_until(rig.clock.now() + pause)
    # armed, but stopped before the first block: nothing is forgotten
    guard.arm()
    guard.disarm()
    guard.arm()
    found = guard.exchange(np.zeros(N)).magnitudes()["heating"]
    # whole seconds of the pause count; the block itself cools the coil further, by at most N samples
    cooled = heat * np.exp(-np.floor(pause) / 2.0)
    assert cooled * np.exp(-N / rig.sample_rate / 2.0) * (1.0 - 1e-9) <= found**2 <= cooled * (1.0 + 1e-9)


class Late(LoopbackRig):
    """Later blocks than the first few are read `late` [s] after their last sample."""

    late = 0.0

    def read(self, n: int) -> Block:
        block = super().read(n)
        if block.first > 10 * N:
            self.clock.wait_until(self.clock.now() + self.late)
        return block


def test_a_late_block_does_not_change_how_long_the_coil_cooled() -> None:
    """A replay knows the time of the first block of a run, and counts samples from there."""
    heats: list[float] = []
    for late in (0.0, 0.03):
        rig = Late({"table_displacement": _nothing, "table_acceleration": lambda v: v})
        limits = Limits(acceleration=10.0, heating=9.0, heating_time=2.0)
        guard = Guard(rig, limits, RAMPS, ShakerModel(20.0, 0.0, 20.0))
        rig.late = late
        _warmed(rig, guard)
        # a little more than three seconds after the last sample, less after the last block was read
        rig.clock.wait_until(rig.played.size / rig.sample_rate + 3.01)
        guard.arm()
        heats.append(guard.exchange(np.zeros(N)).magnitudes()["heating"])
    assert heats[0] == heats[1]


@pytest.mark.parametrize(
    ("channel", "reading", "quantity"),
    [("laser_1", 33.0, "share of the laser's range"), ("laser_2", 0.09, "drift")],
)
def test_the_specimen_is_watched(channel: str, reading: float, quantity: str) -> None:
    """Lasers of the loopback reach +-32.767."""
    limits = Limits(drift=100.0 if channel == "laser_1" else 0.08)
    found = _until_violation(_bench_rig(**{channel: lambda v: reading * v / 4.0}), limits, 4.0).violation
    assert found is not None
    assert found.quantity == quantity
    # a ratio is stated without a unit
    assert str(found).endswith(" 0.99" if channel == "laser_1" else " 0.08 m")


def test_a_warning_comes_once_and_before_the_end() -> None:
    rig = _bench_rig(table_acceleration=lambda v: v)
    guard = Guard(rig, Limits(acceleration=5.0, warning=Warnings(acceleration=0.8)), RAMPS)
    guard.arm()
    warnings = []
    for k in range(30):
        found = guard.exchange(np.linspace(4.5 * k / 30, 4.5 * (k + 1) / 30, N))
        assert found.violation is None
        warnings += found.warnings
    (warning,) = warnings
    assert warning.quantity == "table acceleration"
    assert warning.value == pytest.approx(4.0, rel=0.02)
    assert not guard.ramping


def test_a_stuck_sensor_ends_a_run_in_which_the_table_is_driven() -> None:
    rig = _bench_rig(laser_2=_nothing)
    guard = Guard(rig, Limits(stuck=0.5), RAMPS)
    guard.arm()
    seen = [guard.exchange(_sine(1.0, N * k)).violation for k in range(9)]
    found = [violation for violation in seen if violation is not None]
    assert found[0].quantity == "time with a constant count of laser_2"
    assert guard.ramping


@pytest.mark.parametrize("n", [20, 100, 500])
def test_a_stuck_sensor_is_found_whatever_the_block_and_however_slow_the_drive(n: int) -> None:
    """A volt at 0.5 Hz: within 100 ms around its peak it changes by 12 mV only."""
    guard = Guard(_bench_rig(laser_2=_nothing), Limits(stuck=0.5), RAMPS)
    guard.arm()
    drive = np.sin(2.0 * np.pi * 0.5 * np.arange(3000) / 1000.0)
    found = [guard.exchange(block).violation for block in np.split(drive, 3000 // n)]
    assert any(one is not None and "laser_2" in one.quantity for one in found)


def test_sensors_may_stand_still_while_nothing_is_driven() -> None:
    still = dict.fromkeys(("table_displacement", "table_acceleration", "laser_1", "laser_2"), _nothing)
    guard = Guard(_bench_rig(**still), Limits(stuck=0.5), RAMPS)
    guard.arm()
    assert all(guard.exchange(np.zeros(N)).violation is None for _ in range(20))


class TestTime:
    LIMITS = Limits(late=0.5, clock=1e-3)

    def test_regular_blocks_are_good(self) -> None:
        watch = TimeWatch(1000.0, self.LIMITS)
        assert not any(watch.check(7.0 + 0.1 * k * 1.0005, 100 * (k + 1)) for k in range(3000))

    @pytest.mark.parametrize("ratio", [1.0005, 0.9995, 1.00003])
    def test_an_allowed_difference_of_the_clocks_delays_no_block_however_long_the_run(self, ratio: float) -> None:
        watch = TimeWatch(1000.0, self.LIMITS)
        assert not any(watch.check(7.0 + 0.1 * k * ratio, 100 * (k + 1)) for k in range(30_000))
        (found,) = watch.check(7.0 + 3000.0 * ratio + 0.6, 3_000_100)
        assert found.quantity == "delay of a block of samples"
        assert found.value == pytest.approx(0.6, abs=0.01)

    def test_a_late_block(self) -> None:
        watch = TimeWatch(1000.0, self.LIMITS)
        watch.check(7.0, 100)
        assert watch.check(7.1 + 0.4, 200) == []
        (found,) = watch.check(7.2 + 0.51, 300)
        assert (found.quantity, found.unit, found.sample) == ("delay of a block of samples", "s", 299)
        assert found.value == pytest.approx(0.51)

    @pytest.mark.parametrize("ratio", [1.002, 0.998])
    def test_clocks_that_disagree(self, ratio: float) -> None:
        watch = TimeWatch(1000.0, self.LIMITS)
        found = [one for k in range(400) for one in watch.check(7.0 + 0.1 * k * ratio, 100 * (k + 1))]
        assert found[0].quantity == "relative difference between the clocks"
        assert found[0].sample < 35_000

    def test_single_late_blocks_are_no_clock(self) -> None:
        watch = TimeWatch(1000.0, self.LIMITS)
        late = [0.0, 0.1, 0.2, 0.3]
        assert not any(watch.check(0.1 * k + late[k % 4], 100 * (k + 1)) for k in range(1000))

    def test_a_first_block_that_comes_late_is_no_clock(self) -> None:
        """On a busy machine it does: all others are early against it."""
        watch = TimeWatch(1000.0, self.LIMITS)
        assert not any(watch.check(0.1 * k + (0.07 if k == 0 else 0.0), 100 * (k + 1)) for k in range(1000))


def test_an_open_safety_input_cuts_the_enable_line() -> None:
    guard, rig = _armed()
    rig.safety = {"emergency stop": True, "over-travel": True}
    assert guard.exchange(_sine(1.0)).opened == ()
    rig.safety["emergency stop"] = False
    assert guard.exchange(_sine(1.0, N)).opened == ("emergency stop",)
    assert rig.halted


def test_nothing_is_armed_while_a_safety_input_is_open() -> None:
    rig = LoopbackRig()
    rig.safety = {"amplifier ready": False}
    with pytest.raises(RigError, match="amplifier ready"):
        Guard(rig, LIMITS, RAMPS).arm()
    assert not rig.armed


@pytest.mark.parametrize("way", ["stop", "abort"])
def test_a_ramp_adds_nothing_to_the_fastest_command(way: str) -> None:
    """4.5 V at 44 rad/s slew by 198 V/s of the 200 allowed; the ramp of 0.2 s by itself by up to 35 V/s."""
    guard, rig = _armed(LoopbackRig({"table_displacement": lambda volts: 0.0 * volts}))
    command = 4.5 * np.sin(44.0 * np.arange(4 * N) / 1000.0)
    for block in np.split(command, 4):
        guard.exchange(block)
    getattr(guard, way)()
    phase = 44.0 * (np.arange(12 * N) + 4 * N) / 1000.0
    for block in np.split(4.5 * np.sin(phase), 12):
        guard.exchange(block)
    assert guard.at_zero
    assert np.abs(np.diff(rig.played)).max() <= LIMITS.drive_slew / rig.sample_rate * (1.0 + 1e-12)
    assert rig.played[-1] == 0.0


class _Uncuttable(LoopbackRig):
    """Its enable line does not obey; perhaps its output does not either."""

    def __init__(self, *, stops: bool) -> None:
        super().__init__()
        self.stops = stops

    def halt(self) -> None:
        raise RigError("the digital output does not answer")

    def stop(self) -> None:
        if not self.stops:
            raise RigError("the task is gone")
        super().stop()


@pytest.mark.parametrize(("stops", "told"), [(True, "switch the amplifier off"), (False, "press the emergency stop")])
def test_an_enable_line_that_does_not_obey_is_told_and_the_output_stopped(stops: bool, told: str) -> None:
    guard, rig = _armed(_Uncuttable(stops=stops))
    with pytest.raises(RigError, match=told):
        guard.halt()
    assert rig.armed is not stops
    rig.safety = {"emergency stop": False}
    if not stops:
        with pytest.raises(RigError, match=r"emergency stop opened, and the enable line could not be cut"):
            guard.exchange(np.zeros(N))


def test_only_the_table_itself_runs_away() -> None:
    """A lost sensor ends the run, and says nothing against a table at rest."""
    guard, _ = _armed(LoopbackRig({"laser_1": lambda volts: np.full(volts.size, np.nan)}))
    last = [guard.exchange(np.zeros(N)) for _ in range(6)][-1]
    assert last.violation is not None
    assert last.runaway is None
    guard, _ = _armed(LoopbackRig({"table_displacement": lambda volts: np.full(volts.size, 0.05)}))
    last = guard.exchange(np.zeros(N))
    assert last.runaway == last.violation


def test_the_place_of_a_storey_is_relative_to_its_lasers_measuring_range() -> None:
    """The valid counts of an analogue laser extend beyond the range at one end only: 3.8 to 20 mA, which is the
    converter's end.
    """
    rig = _bench_rig()
    asymmetric = [
        replace(channel, scale=1e-4, offset=0.0, valid=(-1025, 1000)) if channel.name in STOREYS else channel
        for channel in rig.channels
    ]
    quantities = WatchedQuantities(tuple(asymmetric), 1000.0, 60.0, None, (0.2, 0.2))
    names = [channel.name for channel in asymmetric]
    for name in STOREYS:
        for place in (0.099, -0.099):
            values = np.zeros((3, len(names)))
            values[1, names.index(name)] = place
            assert quantities.of(values)["laser_range"].max() == pytest.approx(0.99, abs=1e-12)
            bounds = quantities.bounds(values, Extremes(values.min(axis=0).tolist(), values.max(axis=0).tolist()))
            assert bounds["laser_range"] == pytest.approx(0.99, abs=1e-12)


@pytest.mark.parametrize(
    ("valid", "asked", "middle", "half"),
    [((-500, 500), 0.2, 0.0, 0.05), ((0, 2000), 0.2, 0.1, 0.1), ((-1020, 1020), 0.2, 0.0, 0.1)],
)
def test_a_laser_that_reads_less_or_from_its_start_keeps_its_own_range(
    valid: tuple[int, int], asked: float, middle: float, half: float
) -> None:
    """A plug-in may leave the configured ranges at their default."""
    channels = tuple(
        replace(channel, scale=1e-4, offset=0.0, valid=valid) if channel.name in STOREYS else channel
        for channel in _bench_rig().channels
    )
    quantities = WatchedQuantities(channels, 1000.0, 60.0, None, (asked, asked))
    values = np.zeros((1, len(channels)))
    for name in STOREYS:
        values[:, [channel.name for channel in channels].index(name)] = middle + 0.9 * half
    assert quantities.of(values)["laser_range"].max() == pytest.approx(0.9, abs=1e-12)
