"""The driver behind the server: tasks by name, what they have reserved, and how they start each other."""

import threading
from collections.abc import Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.catalogue import Catalogue
from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure, SessionExists, SessionMissing
from drivers.emulation.daqmx.job import Job
from drivers.emulation.daqmx.lines import Lines, Wires
from drivers.emulation.daqmx.task import State, Task
from drivers.emulation.daqmx.terminals import Instant, OutputTerminal
from drivers.emulation.daqmx.watchdog import Watchdog
from drivers.emulation.plant import Plant
from sim.sensors import Converter


class Driver:
    """Devices, tasks and reservations; `changed` guards all of it. It outlives every client.

    `drive` is the output that is wired to the plant; None leaves it unconnected. `wires` are at the digital lines.
    `converter` made the plant's counts. `output_clock_error` and `packet` as of `DaqServer`.
    """

    def __init__(
        self,
        plant: Plant,
        devices: Sequence[DeviceModel],
        converter: Converter,
        drive: str | None,
        wires: Wires,
        output_clock_error: float = 0.0,
        packet: int = 1,
    ) -> None:
        self.plant = plant
        self.output_clock_error = output_clock_error
        self.packet = packet
        self.converter = converter
        self.catalogue = Catalogue(devices)
        self.changed = threading.Condition()
        self.first_tick: int | None = None
        """Tick of the first sample of the clocked task that was started last."""
        self.instant = Instant(plant.tick)
        self.lines = Lines(wires)
        self.terminals = {name: OutputTerminal(self.instant) for device in devices for name in device.output_names}
        self._tasks: dict[str, Task] = {}
        self._reserved: dict[str, Task] = {}
        self._unnamed = 0
        if drive is not None:
            plant.wire(self.terminals[drive])

    def create(self, name: str, *, may_attach: bool, may_create: bool) -> tuple[Task, bool]:
        """A task of that name, and whether it is new; "" makes a name up.

        Raises SessionExists and SessionMissing.
        """
        with self.changed:
            if name in self._tasks:
                if not may_attach:
                    raise SessionExists(name)
                return self._tasks[name], False
            if not may_create:
                raise SessionMissing(name)
            if not name:
                name = f"_unnamedTask<{self._unnamed}>"
                self._unnamed += 1
            task = self._tasks[name] = Task(name)
            return task, True

    def task(self, name: str) -> Task:
        """The task of that name. Raises DaqmxFailure when it was cleared, or never was."""
        if name not in self._tasks:
            raise DaqmxFailure(
                DAQmxErrors.INVALID_TASK, f"Task specified is invalid or does not exist.\n\nTask Name: {name}"
            )
        return self._tasks[name]

    def reserve(self, task: Task) -> None:
        """Keep what the task needs from everybody else. Raises DaqmxFailure when somebody has it."""
        with self.changed:
            # it may have been cleared while this call was on its way
            job = self.task(task.name).required_job
            if isinstance(job, Watchdog):
                self._require_nothing_reserved(task, job)
            for resource in job.resources:
                if self._reserved.get(resource, task) is not task:
                    raise DaqmxFailure(
                        DAQmxErrors.PAL_RESOURCE_RESERVED,
                        f"The specified resource is reserved. The operation could not be completed as specified.\n\n"
                        f"Resource: {resource}\nTask Name: {task.name}",
                    )
            self._reserved.update(dict.fromkeys(job.resources, task))
            if task.state is State.IDLE:
                task.state = State.RESERVED

    def start(self, task: Task) -> None:
        """Start a task, or arm it when it waits for a trigger. What waits for its start starts with it."""
        with self.changed:
            task.require_stopped()
            job = task.required_job
            job.check()
            self._require_terminals(job)
            self.reserve(task)
            task.state = State.ARMED
            # what follows a clock of another task goes when that does
            if job.awaited is None and job.source is None:
                self._fire(task, job)
            self.changed.notify_all()

    def stop(self, task: Task) -> None:
        """End a task and give back what it had. Raises DaqmxFailure when its run had failed."""
        with self.changed:
            self._end(task)
            if task.job is not None:
                task.job.verdict()

    def clear(self, task: Task) -> None:
        """End a task and forget it."""
        with self.changed:
            self._end(task)
            self._tasks.pop(task.name, None)

    def reset_device(self, device: DeviceModel) -> None:
        """Abort its tasks, outputs to 0 V, lines low. The tasks themselves stay, stopped."""
        with self.changed:
            for name in {device.name, *device.modules}:
                part = self.catalogue.device(name)
                for task in self._tasks.values():
                    if task.job is not None and part.name in task.job.devices:
                        self._end(task)
                for output in part.output_names:
                    self.terminals[output].hold(0.0)
                self.lines.reset(part.name, part.line_names)

    def reset(self) -> None:
        """No task is left, every device is as at power-up."""
        with self.changed:
            for task in tuple(self._tasks.values()):
                self.clear(task)
            for device in self.catalogue.devices:
                self.reset_device(device)

    def _fire(self, task: Task, job: Job) -> None:
        with self.instant.next() as tick:
            if job.start_terminal is not None:
                self.first_tick = tick
            _begin(task, job, tick)
            for other in self._tasks.values():
                if other.job is not None and other.state is State.ARMED and _goes_with(other.job, job):
                    _begin(other, other.job, tick)

    def _end(self, task: Task) -> None:
        if task.job is not None and task.state is not State.IDLE:
            task.job.end()
        self._reserved = {resource: holder for resource, holder in self._reserved.items() if holder is not task}
        task.state = State.IDLE
        self.changed.notify_all()

    def _require_nothing_reserved(self, task: Task, watchdog: Watchdog) -> None:
        for other in self._reserved.values():
            if other is not task and other.job is not None and other.job.devices & watchdog.devices:
                raise DaqmxFailure(
                    DAQmxErrors.CANT_RESERVE_WATCHDOG_TASK_WHILE_OTHER_TASKS_RESERVED,
                    "Watchdog timer task cannot be reserved while other tasks of the device are.\n\n"
                    f"Task Name: {task.name}\nOther Task: {other.name}",
                )

    def _require_terminals(self, job: Job) -> None:
        """Raise DaqmxFailure when it would wait for a trigger or follow a clock that no device has."""
        own = {self.catalogue.device(name).clockwork for name in job.devices}
        devices = [device for device in self.catalogue.devices if device.clockwork in own]
        known = {terminal.lower() for device in devices for terminal in device.terminals}
        for wanted in (job.awaited, job.source):
            if wanted is not None and f"/{wanted.strip('/')}".lower() not in known:
                raise DaqmxFailure(
                    DAQmxErrors.INVALID_ROUTING_SOURCE_TERMINAL_NAME_ROUTING,
                    f"Source terminal to be routed could not be found on the device.\n\nSource Terminal: {wanted}",
                )


def _begin(task: Task, job: Job, tick: int) -> None:
    job.begin(tick)
    task.state = State.RUNNING


def _goes_with(waiting: Job, fired: Job) -> bool:
    """Whether a job that waits for trigger or clock, or both, has all of it from the one that starts."""
    triggered = waiting.awaited is None or _same(waiting.awaited, fired.start_terminal)
    return triggered and (waiting.source is None or _same(waiting.source, fired.clock_terminal))


def _same(one: str | None, other: str | None) -> bool:
    return one is not None and other is not None and one.strip("/").lower() == other.strip("/").lower()
