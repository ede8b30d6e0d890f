"""Safety inputs and heartbeat of the hardware rig on the emulated laboratory."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from bench.config.model import BenchConfiguration
from bench.guard.guard import Guard
from bench.guard.limits import Limits, Ramps
from bench.testing.conformance import play, started
from drivers.border import CheckedRig
from drivers.emulation.control import ask
from drivers.emulation.laboratory import Device, Laboratory
from drivers.errors import RigError, SafetyInputOpen
from drivers.hardware.rig import HardwareRig
from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.patience import LONG, eventually

LEAD = 1000
BLOCK = 100
NAMES = ("emergency stop", "over-travel", "over-travel 2", "amplifier ready")


@pytest.fixture
def laboratory() -> Iterator[Laboratory]:
    with Laboratory(VirtualBenchParameters(), Specimen(), seed=1, connection="analogue") as laboratory:
        yield laboratory


@pytest.fixture
def rig(laboratory: Laboratory) -> Iterator[HardwareRig]:
    with HardwareRig(laboratory.hardware, lead=LEAD) as rig:
        yield rig


def test_the_guard_cuts_in_the_block_in_which_an_input_opens(laboratory: Laboratory, rig: HardwareRig) -> None:
    guard = Guard(rig, Limits(), Ramps())
    guard.arm()
    assert guard.exchange(np.zeros(BLOCK)).opened == ()
    laboratory.safety.break_wire("emergency_stop")
    # nothing but this program has noticed
    assert laboratory.bench.enabled
    assert guard.exchange(np.zeros(BLOCK)).opened == ("emergency stop",)
    assert not laboratory.bench.enabled
    assert laboratory.daq.volts("Dev1/ao0") == 0.0
    with pytest.raises(RigError, match="arming is refused: emergency stop open"):
        guard.arm()


def test_inputs_that_cannot_be_read_end_the_run(laboratory: Laboratory, rig: HardwareRig) -> None:
    play(started(rig), np.full(400, 0.2), 200)
    assert rig.interlocks() == dict.fromkeys(NAMES, True)
    laboratory.daq.fail_next("ReadDigitalLines", -200279)
    with pytest.raises(RigError, match="reading the safety inputs"):
        rig.interlocks()
    assert not laboratory.bench.enabled
    assert laboratory.daq.volts("Dev1/ao0") == 0.0
    # the next run begins anew
    assert play(started(rig), np.zeros(100))[0].first == 0


def test_a_table_that_runs_away_opens_the_switch_of_its_end(laboratory: Laboratory, rig: HardwareRig) -> None:
    started(rig)
    deadline = time.monotonic() + LONG
    while all(rig.interlocks().values()):
        assert time.monotonic() < deadline
        play(rig, np.full(BLOCK, 4.0))
    assert set(laboratory.safety.contacts) >= set(NAMES)
    assert not laboratory.safety.contacts["over-travel"]
    # the chain has opened by itself, whatever the program makes of it
    assert not laboratory.bench.enabled


def test_a_program_that_hangs_is_switched_off_by_the_relay_of_its_heartbeat(laboratory: Laboratory) -> None:
    daq = laboratory.hardware.daq.model_copy(update={"watchdog": None})
    with HardwareRig(laboratory.hardware.model_copy(update={"daq": daq}), lead=LEAD) as rig:
        play(started(rig, 3000), np.zeros(400), 200)
        eventually(lambda: not laboratory.bench.enabled)
        contacts = ask(str(laboratory.hardware.emulator_address), "truth")["contacts"]
        # the device keeps its line high; only the pulses are missing
        assert contacts["enable relay"]
        assert not contacts["heartbeat relay"]
        assert rig.interlocks() == dict.fromkeys(NAMES, True) | {"amplifier ready": False}


def test_a_halt_from_another_thread_is_no_input_that_opened(laboratory: Laboratory, rig: HardwareRig) -> None:
    """The amplifier is no longer ready then, because the program says so."""
    started(rig, 4000)
    seen: list[dict[str, bool]] = []
    over = threading.Event()

    def look() -> None:
        while not over.is_set():
            seen.append(dict(rig.interlocks()))

    thread = threading.Thread(target=look)
    thread.start()
    eventually(lambda: len(seen) > 3)
    rig.halt()
    assert not laboratory.bench.enabled
    over.set()
    thread.join()
    assert all(all(one.values()) for one in seen)


@pytest.fixture
def observing() -> Iterator[tuple[Laboratory, HardwareRig]]:
    """A rig that observes its lasers for two seconds when it is armed: a bench takes ten."""
    with Laboratory(VirtualBenchParameters(), Specimen(), seed=1, connection="serial") as laboratory:
        lasers = laboratory.hardware.lasers.model_copy(update={"observation_time": 2.0})
        with HardwareRig(laboratory.hardware.model_copy(update={"lasers": lasers}), lead=LEAD) as rig:
            yield laboratory, rig


def test_a_halt_while_the_lasers_are_observed_prevents_the_run(observing: tuple[Laboratory, HardwareRig]) -> None:
    laboratory, rig = observing
    halt = threading.Timer(0.2, rig.halt)
    halt.start()
    with pytest.raises(RigError, match="enable line was cut"):
        rig.arm()
    halt.join()
    assert not laboratory.bench.enabled


def test_an_input_that_opens_while_the_lasers_are_observed_prevents_the_run(
    observing: tuple[Laboratory, HardwareRig],
) -> None:
    laboratory, rig = observing
    guard = Guard(rig, Limits(), Ramps())
    opening = threading.Timer(0.2, laboratory.safety.break_wire, ("over_travel",))
    opening.start()
    with pytest.raises(SafetyInputOpen, match="cannot be prepared: over-travel open"):
        guard.arm()
    opening.join()
    assert not laboratory.bench.enabled


@pytest.mark.parametrize(
    ("device", "modules"),
    [
        ("usb", ()),
        ("crio", ()),
        ("cDAQ-9174", ("9205", "9263", "9401", "9485")),
        ("cDAQ-9185", ("9239", "9215", "9269", "9401")),
        ("cRIO-9045", ("9239", "9263", "9401")),
        ("cRIO-9049", ("9239", "9205", "9269", "9485", "9421")),
        ("PCIe-6351", ()),
        ("USB-6351", ()),
    ],
)
def test_every_laboratory_is_wired(device: Device, modules: tuple[str, ...]) -> None:
    parameters, specimen = VirtualBenchParameters(), Specimen()
    emulated = Laboratory(parameters, specimen, seed=1, connection="analogue", device=device, modules=modules)
    with emulated as laboratory:
        BenchConfiguration(backend="hardware", hardware=laboratory.hardware)
        with HardwareRig(laboratory.hardware, lead=LEAD) as rig:
            assert rig.interlocks() == dict.fromkeys(NAMES[:3], True)
            play(started(rig), np.zeros(200))
            assert rig.interlocks() == dict.fromkeys(NAMES, True)
            assert all(name in rig.description for name in (*NAMES, "heartbeat"))


def test_an_amplifier_that_is_ready_only_while_enabled_can_be_armed_again(laboratory: Laboratory) -> None:
    with CheckedRig(HardwareRig(laboratory.hardware, lead=LEAD), "hardware") as rig:
        for end in (rig.stop, rig.halt):
            assert rig.interlocks() == dict.fromkeys(NAMES[:3], True)
            play(started(rig), np.zeros(200))
            assert rig.interlocks() == dict.fromkeys(NAMES, True)
            end()
        assert rig.interlocks() == dict.fromkeys(NAMES[:3], True)


def test_the_relay_of_the_heartbeat_outlasts_some_blocks(laboratory: Laboratory) -> None:
    daq = laboratory.hardware.daq
    assert daq.heartbeat is not None
    hasty = daq.model_copy(update={"heartbeat": daq.heartbeat.model_copy(update={"timeout": 0.39})})
    with pytest.raises(ValueError, match="4 blocks or more") as caught:
        BenchConfiguration(backend="hardware", hardware=laboratory.hardware.model_copy(update={"daq": hasty}))
    error = caught.value.errors()[0]["ctx"]["error"]  # type: ignore[attr-defined]
    assert isinstance(error, InvalidInput)
    assert error.item == "hardware.daq.heartbeat.timeout"
