"""Writing to the emulated device through the real client: each sample once, in step with the inputs."""

from collections.abc import Iterator

import grpc
import numpy as np
import pytest
from nidaqmx.constants import OutputDataTransferCondition, RegenerationMode, TaskMode
from nidaqmx.errors import DaqError, DaqWriteError, RpcError

from drivers.emulation.daqmx.models import compact_rio
from tests.drivers.emulation.daqmx_loopback import LSB, Desk, Wires, counts, staircase, write
from tests.patience import eventually


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk(speed=2.0) as desk:
        yield desk


def index_of_start(plant: Wires, first: float) -> int:
    """The tick at which the output has left zero."""
    played = plant.played(plant.tick())
    start = int(np.argmax(played != 0.0))
    assert played[start] == first
    return start


@pytest.mark.parametrize("master", ["inputs", "output"])
def test_sample_i_leaves_while_sample_i_is_taken(desk: Desk, master: str) -> None:
    inputs, output = desk.inputs("Dev1/ai0"), desk.output(buffer=4000)
    volts = staircase(6000)
    write(output, volts[:4000])
    first, second = (inputs, output) if master == "inputs" else (output, inputs)
    second.triggers.start_trigger.cfg_dig_edge_start_trig(first.triggers.start_trigger.term)
    second.start()
    desk.plant.pass_ticks(20)
    assert inputs.in_stream.total_samp_per_chan_acquired == 0
    assert output.out_stream.total_samp_per_chan_generated == 0
    assert desk.plant.output == 0.0
    first.start()
    taken = []
    for k in range(10):
        taken.append(counts(inputs, 200))
        write(output, volts[4000 + 200 * k : 4200 + 200 * k])
    assert (np.concatenate(taken)[:, 0] == np.rint(volts[:2000] / LSB)).all()


def test_modules_of_a_controller_start_together() -> None:
    with Desk(compact_rio(), speed=2.0) as desk:
        inputs, output = desk.inputs("cRIO1Mod1/ai0"), desk.output("cRIO1Mod3/ao0")
        inputs.control(TaskMode.TASK_RESERVE)
        assert inputs.triggers.start_trigger.term == "/cRIO1/it0/StartTrigger"
        write(output, staircase(1000))
        output.triggers.start_trigger.cfg_dig_edge_start_trig("/cRIO1/it0/StartTrigger")
        output.start()
        inputs.start()
        volts = np.array(inputs.read(400, 20.0))
        # the filter of the inputs delays by 40 samples and a little
        assert volts[41:] == pytest.approx(staircase(400)[1:-40], abs=0.02 * 1000 * LSB)
        assert volts[:40] == pytest.approx(0.0, abs=1e-9)


def test_at_half_the_rate_each_value_stays_for_two_ticks(desk: Desk) -> None:
    output = desk.output(rate=1000.0)
    write(output, staircase(2000))
    output.start()
    eventually(lambda: output.out_stream.total_samp_per_chan_generated > 200)
    start = index_of_start(desk.plant, staircase(1)[0])
    played = desk.plant.played(start + 400)[start:]
    assert (played == np.repeat(staircase(200), 2)).all()


def test_an_output_that_runs_dry_holds_its_last_value_until_it_is_written_anew(desk: Desk) -> None:
    output = desk.output()
    write(output, staircase(300))
    output.start()
    desk.plant.pass_ticks(320)
    with pytest.raises(DaqWriteError) as error:
        write(output, np.zeros(10))
    assert error.value.error_code == -200290
    assert error.value.samps_per_chan_written == 0
    for ask in ("total_samp_per_chan_generated", "space_avail"):
        with pytest.raises(DaqError) as failure:
            getattr(output.out_stream, ask)
        assert failure.value.error_code == -200290
    last = staircase(300)[-1]
    assert desk.plant.output == last
    with pytest.raises(DaqError) as failure:
        output.stop()
    assert failure.value.error_code == -200290
    assert desk.plant.output == last
    write(output, np.zeros(100))
    output.start()
    assert desk.plant.output == 0.0


def test_what_was_played_before_it_ran_dry_is_what_was_written(desk: Desk) -> None:
    output = desk.output()
    write(output, staircase(300))
    output.start()
    desk.plant.pass_ticks(400)
    start = index_of_start(desk.plant, staircase(1)[0])
    played = desk.plant.played(start + 350)[start:]
    assert (played[:300] == staircase(300)).all()
    assert (played[300:] == staircase(300)[-1]).all()


def test_a_stop_holds_the_value_of_the_moment(desk: Desk) -> None:
    output = desk.output(buffer=8000)
    write(output, staircase(8000))
    output.start()
    desk.plant.pass_ticks(100)
    output.stop()
    held = desk.plant.output
    assert held in staircase(8000)
    desk.plant.pass_ticks(50)
    assert desk.plant.output == held


def test_a_full_buffer_takes_what_fits_and_says_how_much(desk: Desk) -> None:
    output = desk.output(buffer=500)
    with pytest.raises(DaqWriteError) as error:
        write(output, staircase(700), timeout=0.05)
    assert error.value.error_code == -200292
    assert error.value.samps_per_chan_written == 500
    assert output.out_stream.curr_write_pos == 500
    assert output.out_stream.space_avail == 0


def test_a_write_waits_for_room(desk: Desk) -> None:
    output = desk.output(buffer=6000)
    output.ao_channels[0].ao_data_xfer_req_cond = OutputDataTransferCondition.ON_BOARD_MEMORY_EMPTY
    write(output, staircase(6000))
    began = desk.plant.tick()
    output.start()
    assert write(output, staircase(300)) == 300
    # 299 samples have left, the first not before the tick after `began`; one waits on board
    assert desk.plant.tick() >= began + 299


def test_the_memory_of_the_device_takes_samples_beyond_the_buffer(desk: Desk) -> None:
    output = desk.output(buffer=6000)
    channel = output.ao_channels[0]
    assert channel.ao_data_xfer_req_cond is OutputDataTransferCondition.ON_BOARD_MEMORY_LESS_THAN_FULL
    channel.ao_data_xfer_req_cond = OutputDataTransferCondition.ON_BOARD_MEMORY_HALF_FULL_OR_LESS
    write(output, staircase(6000))
    output.start()
    # half of 8191 samples
    write(output, staircase(4096), timeout=0.0)
    with pytest.raises(DaqWriteError) as error:
        write(output, staircase(20_000), timeout=0.0)
    assert error.value.error_code == -200292
    assert 0 <= error.value.samps_per_chan_written < 20_000


def test_the_counters_follow_the_clock(desk: Desk) -> None:
    output = desk.output(buffer=8000)
    write(output, staircase(8000))
    output.start()
    desk.plant.pass_ticks(10)
    start = index_of_start(desk.plant, staircase(1)[0])
    for _ in range(20):
        earliest = desk.plant.tick()
        generated = output.out_stream.total_samp_per_chan_generated
        latest = desk.plant.tick()
        assert earliest - start + 1 <= generated <= latest - start + 1
    assert output.out_stream.curr_write_pos == 8000


def test_nothing_to_play_is_no_start(desk: Desk) -> None:
    output = desk.output()
    with pytest.raises(DaqError) as error:
        output.start()
    assert error.value.error_code == -200462


@pytest.mark.parametrize("bad", [10.001, -10.001, np.nan, np.inf])
def test_values_that_the_output_has_not_are_refused(desk: Desk, bad: float) -> None:
    output = desk.output()
    with pytest.raises(DaqWriteError) as error:
        write(output, np.array([0.0, bad, 0.0]))
    assert error.value.error_code == -200561
    assert output.out_stream.curr_write_pos == 0


def test_a_single_value_goes_out_at_once_and_stays(desk: Desk) -> None:
    task = desk.task("now")
    task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
    task.write(1.5)
    assert desk.plant.output == 1.5
    task.close()
    assert desk.plant.output == 1.5


def test_other_outputs_do_not_drive_the_plant(desk: Desk) -> None:
    task = desk.task("now")
    task.ao_channels.add_ao_voltage_chan("Dev1/ao1")
    task.write(1.5)
    assert desk.plant.output == 0.0


def test_a_trigger_that_the_device_has_not_is_refused(desk: Desk) -> None:
    output = desk.output()
    write(output, staircase(10))
    output.triggers.start_trigger.cfg_dig_edge_start_trig("/Dev2/ai/StartTrigger")
    with pytest.raises(DaqError) as error:
        output.start()
    assert error.value.error_code == -89120
    output.triggers.start_trigger.disable_start_trig()
    output.start()


def test_playing_samples_again_and_again_is_not_emulated(desk: Desk) -> None:
    output = desk.output()
    output.out_stream.regen_mode = RegenerationMode.ALLOW_REGENERATION
    write(output, staircase(10))
    with pytest.raises(RpcError) as error:
        output.start()
    assert error.value.rpc_code is grpc.StatusCode.UNIMPLEMENTED
