"""What command line and window do alike with the tests of a queue: make them, check them, give them a folder."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.catalogue import load_protocol
from bench.cli.output import check_folder, default_folder, make_folder, result_names
from bench.config.validation import dotted, validated
from bench.progress import Progress, silent
from bench.queue.queued import Queued, Stage
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.cli.options import Options
    from bench.config.model import BenchConfiguration
    from bench.preflight.disk import Room
    from bench.protocol import Prepared, Protocol


@dataclass(frozen=True)
class Ready:
    """A test that this bench can do: its parameters are good, and it is prepared."""

    protocol: "Protocol[Any]"
    prepared: "Prepared[Any]"


def queued(protocol: "Protocol[Any]", parameters: Parameters, out: Path | None, **how: object) -> Queued:
    """A test with these parameters; `how` are other fields of `Queued`."""
    fields = {"protocol": protocol.name, "parameters": parameters.model_dump(mode="json"), **how}
    return Queued.model_validate({**fields, "out": None if out is None else str(out)})


def ready(test: Queued, number: int, configuration: "BenchConfiguration") -> Ready:
    """Check parameters and folder of a test against the bench. Raises InvalidInput that names the test."""
    try:
        protocol = load_protocol(test.protocol)
        parameters = validated(protocol.parameters, test.parameters, dotted)
        prepared = protocol.prepare(parameters, configuration, None)
        if test.out is not None:
            check_folder(Path(test.out), result_names(protocol))
    except InvalidInput as refused:
        raise InvalidInput(f"test {number}: {refused.item}", refused.value, refused.allowed) from None
    return Ready(protocol, prepared)


def all_ready(tests: Sequence[Queued], configuration: "BenchConfiguration") -> Mapping[int, Ready]:
    """Every test that waits, by its index. Raises InvalidInput for the first that cannot run, and for a folder that
    two would write to.
    """
    found: dict[int, Ready] = {}
    folders: dict[Path, int] = {}
    for index, test in enumerate(tests):
        if test.stage is not Stage.WAITING:
            continue
        found[index] = ready(test, index + 1, configuration)
        if test.out is not None and (first := folders.setdefault(Path(test.out).absolute(), index)) != index:
            allowed = f"test {first + 1} has this folder; give each one of its own"
            raise InvalidInput(f"test {index + 1}: out", test.out, allowed)
    return found


def room_refusal(found: Iterable["Room | None"]) -> InvalidInput | None:
    """Why tests that fit one by one do not fit together on the disk, or None. They are taken to share one."""
    rooms = [room for room in found if room is not None]
    needed, free = sum(room.needed for room in rooms), min((room.free for room in rooms), default=0)
    if needed <= free:
        return None
    allowed = f"together the tests may need {needed / 1e9:.2f} GB, {free / 1e9:.2f} GB are free; free some"
    return InvalidInput("queue", len(rooms), allowed)


def own_folder(test: Queued, moment: datetime, tests: Iterable[Queued] = ()) -> Path:
    """Where the results of a test go that begins now: where it says, or to a new folder, made here, that none of the
    other `tests` has. Raises InvalidInput when none can be made.
    """
    if test.out is not None:
        return Path(test.out)
    return make_folder(
        default_folder(test.protocol, moment), {Path(each.out) for each in tests if each.out is not None}
    )


def add_to_queue(
    path: Path,
    protocol: "Protocol[Any]",
    parameters: Parameters,
    configuration: "BenchConfiguration",
    options: "Options",
    progress: Progress = silent,
) -> int:
    """`rockbench run ... --queue FILE`: check the plan as a run would, and add it. Returns the exit code.

    Raises InvalidInput also while somebody else owns the queue.
    """
    progress("loading the program")
    from bench.preflight.compiled import compile_run, prepare
    from bench.queue.file import QueueFile
    from bench.queue.owner import owned
    from bench.queue.queue import Queue

    with owned(path, "`rockbench run --queue`"):
        store = QueueFile(path)
        queue = Queue(store.read(), store.write)
        prepared = prepare(protocol, parameters, configuration, progress)
        compile_run(protocol.name, prepared, options.out or Path(), progress).require()
        queue.add(
            queued(
                protocol,
                parameters,
                options.out,
                operator=options.operator,
                note="\n".join(options.note),
                realtime=options.realtime,
                ask=options.ask,
                unattended=options.yes,
            )
        )
    print(f"added as test {len(queue.tests)} of {path}")
    return 0
