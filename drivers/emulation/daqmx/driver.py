"""The driver behind the server: tasks by name, their reservations, and their triggers."""

import threading
from collections.abc import Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.analog_output import AnalogOutput
from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure, SessionExists, SessionMissing
from drivers.emulation.daqmx.generation import Instant, OutputTerminal
from drivers.emulation.daqmx.lines import Lines, LineTask, Wires
from drivers.emulation.daqmx.models import Catalogue
from drivers.emulation.daqmx.task import Job, State, Task
from drivers.emulation.daqmx.watchdog import Watchdog
from drivers.emulation.plant import Plant
from sim.sensors import Converter


class Driver:
    """Devices, tasks and reservations, all guarded by `changed`.

    The driver outlives every client. `drive` is the output wired to the plant, None if no output is connected. `wires`
    are connected to the digital lines. `converter` produces the plant's counts. For `output_clock_error` and
    `packet`, see `DaqServer`.
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
        self.wires = wires
        self.terminals = {name: OutputTerminal(self.instant) for device in devices for name in device.output_names}
        self._tasks: dict[str, Task] = {}
        self._reserved: dict[str, Task] = {}
        self._unnamed = 0
        self._expired: set[str] = set()
        """Chassis whose watchdog has expired."""
        if drive is not None:
            plant.wire(self.terminals[drive])

    def create(self, name: str, *, may_attach: bool, may_create: bool) -> tuple[Task, bool]:
        """The task `name`, and whether it is new; for "", a name is generated.

        Raises SessionExists or SessionMissing if `may_attach` or `may_create` forbids it.
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
        """The task `name`. Raises DaqmxFailure if it was cleared or never created."""
        if name not in self._tasks:
            raise DaqmxFailure(
                DAQmxErrors.INVALID_TASK, f"Task specified is invalid or does not exist.\n\nTask Name: {name}"
            )
        return self._tasks[name]

    def reserve(self, task: Task) -> None:
        """Reserve the task's resources. Raises DaqmxFailure if one is in use."""
        with self.changed:
            # the task may have been cleared during this call
            job = self.task(task.name).required_job
            self.require_alive(job)
            if isinstance(job, Watchdog):
                self._require_nothing_reserved(task, job)
            job.engage(lambda resource: self._reserved.get(resource, task) is task)
            for resource in job.resources:
                if self._reserved.get(resource, task) is not task:
                    raise DaqmxFailure(
                        DAQmxErrors.PAL_RESOURCE_RESERVED,
                        f"The specified resource is reserved. The operation could not be completed as specified.\n\n"
                        f"Resource: {resource}\nTask Name: {task.name}",
                    )
            if isinstance(job, LineTask):
                self._require_direction(task, job)
            self._reserved.update(dict.fromkeys(job.resources, task))
            if task.state is State.IDLE:
                task.state = State.RESERVED

    def start(self, task: Task) -> None:
        """Start a task, or arm it if it has a trigger. Armed tasks that wait for its start signal start with it."""
        with self.changed:
            task.require_stopped()
            job = task.required_job
            job.check()
            self._require_terminals(job)
            self.reserve(task)
            task.state = State.ARMED
            # a task on the clock of another task starts with that clock
            if job.awaited is None and job.source is None:
                self._fire(task, job)
            self.changed.notify_all()

    def stop(self, task: Task) -> None:
        """End a task and release its resources. Raises DaqmxFailure if its run has failed."""
        with self.changed:
            self._end(task)
            if task.job is not None:
                task.job.verdict()

    def clear(self, task: Task) -> None:
        """End a task and remove it."""
        with self.changed:
            self._end(task)
            self._tasks.pop(task.name, None)

    def reset_device(self, device: DeviceModel) -> None:
        """Abort the device's tasks, set its outputs to 0 V and its lines low. The aborted tasks are not removed."""
        with self.changed:
            parts = [self.catalogue.device(name) for name in {device.name, *device.modules}]
            names = {part.name for part in parts}
            tasks = [task for task in self._tasks.values() if task.job and not names.isdisjoint(task.job.devices)]
            # the outputs go from what they play to 0 V at one tick, however long the other tasks take to end
            with self.instant.next():
                for task in tasks:
                    if isinstance(task.job, AnalogOutput):
                        self._end(task)
                for part in parts:
                    for output in part.output_names:
                        self.terminals[output].hold(0.0)
            for task in tasks:
                self._end(task)
                if isinstance(task.job, Watchdog):
                    task.job.disarm()
            for part in parts:
                self.lines.reset(part.name, part.line_names)
            self._expired.discard(device.name)

    def reset(self) -> None:
        """Clear all tasks, and set every device to its state at power-up."""
        with self.changed:
            for device in self.catalogue.devices:
                self.reset_device(device)
            for task in tuple(self._tasks.values()):
                self.clear(task)

    def _fire(self, task: Task, job: Job) -> None:
        with self.instant.next() as tick:
            if job.start_terminal is not None:
                self.first_tick = tick
            _begin(task, job, tick)
            for other in self._tasks.values():
                if other.job is not None and other.state is State.ARMED and _is_started_by(other.job, job):
                    _begin(other, other.job, tick)

    def _end(self, task: Task) -> None:
        if task.job is not None and task.state is not State.IDLE:
            task.job.end()
        self._reserved = {resource: holder for resource, holder in self._reserved.items() if holder is not task}
        task.state = State.IDLE
        self.changed.notify_all()

    def expire(self, parts: Sequence[DeviceModel], lines: dict[str, bool], volts: dict[str, float]) -> None:
        """Set `lines` and `volts` of the devices `parts`, whose watchdog has expired, and reject writes to their lines.

        A chassis rejects every operation until it is reset (cDAQ-9185 User Manual, "Watchdog Timer").
        """
        whole = len(parts) > 1
        error = DAQmxErrors.WRITE_FAILED_BECAUSE_WATCHDOG_EXPIRED
        if whole:
            self._expired.add(parts[0].name)
            error = DAQmxErrors.CHASSIS_WATCHDOG_TIMER_EXPIRED
        # the outputs first, which change at their next tick: one tick after the relay opened, the drive is at zero
        for output, value in volts.items():
            self.terminals[output].hold(value)
        for part in parts:
            self.lines.expire(part.name, {line: lines[line] for line in part.line_names if line in lines}, error)

    def lose_network(self) -> None:
        """Simulate a lost network connection to every chassis; watchdogs configured to do so expire."""
        with self.changed:
            for task in self._tasks.values():
                if isinstance(task.job, Watchdog):
                    task.job.lose_network()

    def require_alive(self, job: Job) -> None:
        """Raise DaqmxFailure if the job uses a chassis whose watchdog has expired."""
        for name in job.devices:
            if (owner := self.catalogue.device(name).clockwork) in self._expired:
                raise DaqmxFailure(
                    DAQmxErrors.CHASSIS_WATCHDOG_TIMER_EXPIRED,
                    "Watchdog timer has expired on the chassis. Reset the chassis to continue operation.\n\n"
                    f"Device: {owner}",
                )

    def _require_direction(self, task: Task, job: LineTask) -> None:
        """Raise DaqmxFailure if another task uses lines of the same direction group in the opposite direction."""
        for other in self._reserved.values():
            theirs = other.job
            if other is task or not isinstance(theirs, LineTask) or theirs.outwards == job.outwards:
                continue
            if shared := theirs.groups & job.groups:
                raise DaqmxFailure(
                    DAQmxErrors.DIG_LINES_RESERVED_OR_UNAVAILABLE,
                    "Some or all of the lines requested are reserved or unavailable.\n\n"
                    f"Lines: {sorted(shared)[0]}\nTask Name: {task.name}",
                )

    def _require_nothing_reserved(self, task: Task, watchdog: Watchdog) -> None:
        for other in self._reserved.values():
            if other is not task and other.job is not None and other.job.devices & watchdog.guarded:
                raise DaqmxFailure(
                    DAQmxErrors.CANT_RESERVE_WATCHDOG_TASK_WHILE_OTHER_TASKS_RESERVED,
                    "Watchdog timer task cannot be reserved while other tasks of the device are.\n\n"
                    f"Task Name: {task.name}\nOther Task: {other.name}",
                )

    def _require_terminals(self, job: Job) -> None:
        """Raise DaqmxFailure for a trigger or clock source that the job's devices and their chassis do not have."""
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


def _is_started_by(waiting: Job, fired: Job) -> bool:
    """Whether the job `fired`, which starts now, supplies all signals (trigger, clock) for which `waiting` waits."""
    triggered = waiting.awaited is None or _same(waiting.awaited, fired.start_terminal)
    return triggered and (waiting.source is None or _same(waiting.source, fired.clock_terminal))


def _same(one: str | None, other: str | None) -> bool:
    return one is not None and other is not None and one.strip("/").lower() == other.strip("/").lower()
