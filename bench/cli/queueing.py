"""What command line and window do alike with the tests of a queue: make them, check them, give them a folder."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bench.cli.catalogue import CATALOGUE, Entry
from bench.cli.check import CHECK
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
    from bench.session import Experiment

ENTRIES = (*CATALOGUE, CHECK)
"""What can be queued."""


@dataclass(frozen=True)
class Ready:
    """A test whose parameters are good on this bench."""

    entry: Entry
    parameters: Parameters
    experiment: "Experiment"


def queued(entry: Entry, parameters: Parameters, out: Path | None, **how: object) -> Queued:
    """A test with these parameters; `how` are other fields of `Queued`."""
    fields = {"protocol": entry.name, "parameters": parameters.model_dump(mode="json"), **how}
    return Queued.model_validate({**fields, "out": None if out is None else str(out)})


def ready(test: Queued, number: int, entries: Iterable[Entry], configuration: "BenchConfiguration") -> Ready:
    """Check parameters and folder of a test against the bench. Raises InvalidInput that names the test."""
    named = {entry.name: entry for entry in entries}
    entry = named.get(test.protocol)
    if entry is None:
        raise InvalidInput(f"test {number}: protocol", test.protocol, f"one of {', '.join(named)}")
    parameters = validated(entry.parameters, test.parameters, lambda where: f"test {number}: {dotted(where)}")
    try:
        experiment = entry.campaign(parameters)
        experiment.check(configuration)
        if test.out is not None:
            check_folder(Path(test.out), result_names(experiment))
    except InvalidInput as refused:
        raise InvalidInput(f"test {number}: {refused.item}", refused.value, refused.allowed) from None
    return Ready(entry, parameters, experiment)


def all_ready(
    tests: Sequence[Queued], entries: Iterable[Entry], configuration: "BenchConfiguration"
) -> Mapping[int, Ready]:
    """Every test that waits, by its index. Raises InvalidInput for the first that cannot run, and for a folder that
    two would write to.
    """
    found: dict[int, Ready] = {}
    folders: dict[Path, int] = {}
    for index, test in enumerate(tests):
        if test.stage is not Stage.WAITING:
            continue
        found[index] = ready(test, index + 1, entries, configuration)
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
    entry: Entry,
    experiment: "Experiment",
    configuration: "BenchConfiguration",
    options: "Options",
    progress: Progress = silent,
) -> int:
    """`rockbench run ... --queue FILE`: check the plan as a run would, and add it. Returns the exit code.

    Raises InvalidInput also while somebody else owns the queue.
    """
    progress("loading the program")
    from bench.preflight.compiled import compile_run, load_bench
    from bench.queue.file import QueueFile
    from bench.queue.owner import owned
    from bench.queue.queue import Queue

    with owned(path, "`rockbench run --queue`"):
        store = QueueFile(path)
        queue = Queue(store.read(), store.write)
        load_bench(configuration, progress)
        progress("checking the protocol against the bench")
        experiment.check(configuration)
        compile_run(experiment, configuration, options.out or Path(), progress).require()
        queue.add(
            queued(
                entry,
                experiment.parameters,
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
