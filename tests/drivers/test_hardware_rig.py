"""The hardware backend on the emulated wire: real nidaqmx over gRPC, real pyserial, the virtual bench behind them."""

import sys
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.emulation.laboratory import Connection, Device, Laboratory
from drivers.errors import ConnectionLost, DeviceNotFound, DeviceTimeout, RigError
from drivers.hardware.rig import HardwareRig
from drivers.laboratory_client import ask
from drivers.rig import Handwork, Rig
from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.drivers.conformance import RigConformance, RigFactory, play, started

LEAD = 600
SERIAL = pytest.mark.skipif(sys.platform == "win32", reason="emulated serial lasers need pseudo-terminals")


def laboratory(connection: Connection, device: Device = "usb") -> Laboratory:
    """A laboratory whose clients listen to the lasers for as short a time as they may."""
    emulated = Laboratory(VirtualBenchParameters(), Specimen(), seed=1, connection=connection, device=device)
    lasers = emulated.hardware.lasers.model_copy(update={"listening": 1.0})
    emulated.hardware = emulated.hardware.model_copy(update={"lasers": lasers})
    return emulated


class OnEmulatedWire(RigConformance):
    """The suite on one laboratory, a fresh client in each test."""

    connection: Connection = "analogue"
    device: Device = "usb"

    @pytest.fixture(scope="class")
    @classmethod
    def emulated(cls) -> Iterator[Laboratory]:
        with laboratory(cls.connection, cls.device) as emulated:
            yield emulated

    @pytest.fixture
    def make_rig(self, emulated: Laboratory) -> Iterator[RigFactory]:
        rigs: list[Rig] = []

        def make() -> Rig:
            rigs.append(HardwareRig(emulated.hardware, lead=LEAD))
            return rigs[-1]

        yield make
        for rig in rigs:
            rig.close()


class TestAnalogue(OnEmulatedWire):
    pass


@SERIAL
class TestSerial(OnEmulatedWire):
    connection = "serial"


@pytest.fixture(scope="module")
def crio() -> Iterator[Laboratory]:
    with laboratory("analogue", "crio") as emulated:
        yield emulated


def test_a_controller_with_24_bit_inputs(crio: Laboratory) -> None:
    with HardwareRig(crio.hardware, lead=LEAD) as rig:
        (block,) = play(started(rig), np.zeros(200), 200)
    assert block.counts.dtype == np.int32
    assert all(channel.storage is np.int32 for channel in rig.channels)
    assert "NI 9239" in rig.channels[0].device


@pytest.fixture
def serial() -> Iterator[Laboratory]:
    with laboratory("serial") as emulated:
        yield emulated


@SERIAL
class TestSerialFaults:
    def test_an_unplugged_laser_ends_the_run_and_the_relay_is_open(self, serial: Laboratory) -> None:
        with HardwareRig(serial.hardware, lead=LEAD) as rig:
            play(started(rig), np.full(400, 0.2), 200)
            serial.lasers[0].unplug()
            with pytest.raises(ConnectionLost, match="laser_1"):
                play(rig, np.full(4000, 0.2), 200)
            with pytest.raises(RigError):
                rig.read(1)
        assert not serial.bench.enabled

    def test_a_laser_without_target_says_why_and_the_run_goes_on(self, serial: Laboratory) -> None:
        with HardwareRig(serial.hardware, lead=LEAD) as rig:
            play(started(rig), np.zeros(400), 200)
            ask(str(serial.hardware.hands), "laser", storey=2, fault="target", arguments=["none"])
            blocks = play(rig, np.zeros(1000), 200)
        names = [channel.name for channel in rig.channels]
        channel, counts = rig.channels[names.index("laser_2")], blocks[-1].counts[:, names.index("laser_2")]
        assert np.isnan(channel.to_unit(counts)).all()
        assert {channel.faults[int(count)] for count in counts} == {"no reflection is seen"}
        assert not np.isnan(rig.channels[2].to_unit(blocks[-1].counts[:, 2])).any()

    def test_a_laser_that_is_not_there_is_named(self, serial: Laboratory) -> None:
        wrong = serial.hardware.laser_1.model_copy(update={"port": "/dev/not-there"})
        with pytest.raises(DeviceNotFound, match="/dev/not-there"):
            HardwareRig(serial.hardware.model_copy(update={"laser_1": wrong}), lead=LEAD)

    def test_a_serial_laser_needs_its_port(self, serial: Laboratory) -> None:
        wrong = serial.hardware.laser_2.model_copy(update={"port": None})
        with pytest.raises(InvalidInput, match=r"hardware\.laser_2\.port"):
            HardwareRig(serial.hardware.model_copy(update={"laser_2": wrong}), lead=LEAD)


class TestDaqFaults:
    @pytest.fixture
    def wire(self) -> Iterator[Laboratory]:
        with laboratory("analogue") as emulated:
            yield emulated

    @pytest.mark.parametrize(("call", "code"), [("ReadBinaryI16", -200279), ("WriteAnalogF64", -200290)])
    def test_an_error_of_the_device_ends_the_run_with_its_code(self, wire: Laboratory, call: str, code: int) -> None:
        with HardwareRig(wire.hardware, lead=LEAD) as rig:
            play(started(rig), np.full(400, 0.2), 200)
            wire.daq.fail_next(call, code)
            with pytest.raises(RigError) as failed:
                play(rig, np.full(400, 0.2), 200)
            assert failed.value.code == code
            assert not wire.bench.enabled
            # the next run begins anew
            assert play(started(rig), np.zeros(100))[0].first == 0

    def test_a_server_that_is_gone_ends_the_run(self, wire: Laboratory) -> None:
        with HardwareRig(wire.hardware, lead=LEAD) as rig:
            play(started(rig), np.zeros(400), 200)
            wire.daq.vanish()
            with pytest.raises((ConnectionLost, DeviceTimeout)):
                play(rig, np.zeros(400), 200)

    def test_hands_reach_the_specimen_and_stay_off_an_armed_bench(self, wire: Laboratory) -> None:
        with HardwareRig(wire.hardware, lead=LEAD) as rig:
            rig.handwork(Handwork.MOUNT_SPRING, 0.4 * 213.44)
            assert wire.bench.specimen.beta == pytest.approx(0.4)
            with pytest.raises(RigError, match="stiffness"):
                rig.handwork(Handwork.MOUNT_SPRING)
            rig.arm()
            with pytest.raises(RigError, match="hands belong"):
                rig.handwork(Handwork.REMOVE_BLOCK)


def test_the_analogue_output_of_a_laser_must_fit_its_input() -> None:
    with laboratory("analogue") as wire:
        narrow = wire.hardware.laser_1.model_copy(update={"range": 5.0})
        with pytest.raises(InvalidInput, match=r"hardware\.laser_1\.range"):
            HardwareRig(wire.hardware.model_copy(update={"laser_1": narrow}), lead=LEAD)
