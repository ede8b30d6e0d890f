"""Counter output that switches the lasers off at known times of the DAQ device's timebase."""

from nidaqmx.constants import AcquisitionType

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import translated
from drivers.daqmx.parameters import AUTOMATIC, Daq, device_name
from drivers.timebase.marking import Pulses

NAME = "rockbench_marker"


class Marker:
    """Trains of pulses of the counter `daq.laser_marker`: `pulses` begin when the sample clock of a run starts; other
    trains run free between the runs.

    The lasers are on while the output is low. The counters and the sample clock of a device share one timebase.
    """

    def __init__(self, connection: Connection, daq: Daq, pulses: Pulses) -> None:
        self._connection, self._pulses = connection, pulses
        self._task: library.Task | None = None
        self.counter = _counter(connection, daq)

    def prepare(self, trigger: str) -> None:
        """Create the task, which starts on `trigger`; until then its output is low."""
        self._create(self._pulses, trigger)

    def run_free(self, pulses: Pulses) -> None:
        """Output `pulses` from now on, until `prepare` or `clear`."""
        self._create(pulses, None)
        self.arm()

    def arm(self) -> None:
        """Arm the task on its trigger."""
        if self._task is not None:
            with translated(f"arming the pulses of {self.counter}"):
                self._task.start()

    def clear(self) -> None:
        """End the pulses; the output is then low."""
        task, self._task = self._task, None
        if task is not None:
            with translated("clearing the pulse task"):
                task.close()

    def _create(self, pulses: Pulses, trigger: str | None) -> None:
        self.clear()
        if self.counter is None:
            return
        with translated(f"preparing the pulses of {self.counter}"):
            self._task = task = library.task(NAME, self._connection.options(NAME))
            task.co_channels.add_co_pulse_chan_time(
                self.counter, initial_delay=pulses.delay, low_time=pulses.low, high_time=pulses.high
            )
            task.timing.cfg_implicit_timing(sample_mode=AcquisitionType.FINITE, samps_per_chan=pulses.number)
            if trigger is not None:
                task.triggers.start_trigger.cfg_dig_edge_start_trig(trigger)


def _counter(connection: Connection, daq: Daq) -> str | None:
    """The configured counter; with `automatic`, the first one of the output's device, or None if it has none."""
    if daq.laser_marker != AUTOMATIC:
        return daq.laser_marker
    with translated("looking for a counter"):
        name = device_name(daq.output).lower()
        for device in library.system(connection.options()).devices:
            if device.name.lower() == name:
                return next((counter.name for counter in device.co_physical_chans), None)
    return None
