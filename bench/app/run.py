"""Runs of a protocol from scripts and notebooks: `bench.run`; docs/python.md describes it."""

from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from bench.app.catalogue import load_protocol
from bench.app.cli.interrupt import interruptible
from bench.app.folders import checked_folder, default_folder, make_folder, remove_unused, result_names
from bench.app.measurements import Campaign
from bench.app.predictions import File, configured, python_names, valid
from bench.app.preflight import prepare
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_specimen
from bench.config.review import review
from bench.config.sections import Simulation
from bench.config.toml import with_identified
from bench.config.validation import validated
from bench.engine.interface import Requests
from bench.events import Event, Progress
from sim.errors import InvalidInput


def run(
    protocol: str,
    parameters: Mapping[str, Any] | None = None,
    /,
    *,
    configuration: BenchConfiguration | File | None = None,
    specimen: File | None = None,
    seed: int | None = None,
    out: File | None = None,
    operator: Callable[[str], bool] | None = None,
    realtime: bool = False,
    progress: Callable[[str, float], None] | None = None,
    **more: Any,
) -> Campaign:
    """Run a protocol and return its campaign, whose `status` states how it ended.

    parameters, more : parameters of the protocol, as a mapping and as keyword arguments.
    configuration : configuration of the bench or its file; by default, a simulated bench.
    specimen : specimen file (.json).
    seed, realtime : seed of a simulated bench, and whether it runs in real instead of virtual time.
    out : folder for the results, by default runs/<protocol>-<date>T<time>.
    operator : called with each request to the person at the bench; must return True once the task is done. Without it,
        a bench that performs the tasks itself, such as the simulated one, confirms every request, and a run on any
        other bench is refused.
    progress : called with an activity and its completed fraction, 0 to 1.

    Raises InvalidInput for a refusal before the table moves, and KeyboardInterrupt after Ctrl-C (or SIGTERM), once the
    output is at zero and the file, if it exists, is closed.
    """
    chosen = load_protocol(protocol)
    values = valid(chosen.parameters, {**(parameters or {}), **more})
    bench = configured(configuration)
    if seed is not None and bench.backend != "simulated":
        raise InvalidInput("seed", seed, f"the backend {bench.backend} has no seed; omit it")
    if seed is not None:
        simulation = validated(Simulation, bench.simulation.model_dump(mode="json") | {"seed": seed})
        bench = bench.model_copy(update={"simulation": simulation})
    if specimen is not None:
        bench = with_identified(bench, read_specimen(Path(specimen)))
    review(bench).require()
    if operator is None and not bench.serves_itself:
        allowed = (
            "this bench needs an operator: pass a function that shows a request and returns True once the task is done"
        )
        raise InvalidInput("operator", None, allowed)
    person, requests = _Person(operator), Requests()
    named = None if out is None else Path(out)

    def follow(event: Event) -> None:
        if progress is not None and isinstance(event, Progress):
            progress(event.activity, event.fraction)

    def phase(text: str, done: int = 0, total: int = 0, /) -> None:
        if progress is not None:
            progress(text, done / total if total else 0.0)

    with python_names():
        folder = checked_folder(named, default_folder(protocol, datetime.now()), result_names(chosen))
        folder = make_folder(folder) if named is None else folder
        try:
            with interruptible(requests, asking=lambda: person.asking) as interrupts:
                with requests.without_rig():
                    prepared = prepare(chosen, values, bench, phase)
                run_session(
                    chosen,
                    prepared,
                    out=folder,
                    operator=person,
                    subscribers=[follow],
                    requests=requests,
                    realtime=realtime,
                    progress=phase,
                )
        finally:
            if out is None:
                remove_unused(folder)
    if interrupts.first is not None:
        raise KeyboardInterrupt(f"the run was interrupted; its results are in {folder}")
    return Campaign(folder)


class _Person:
    """The operator of a run: the caller's function, or the bench itself."""

    def __init__(self, answer: Callable[[str], bool] | None) -> None:
        self._answer, self.asking = answer, False
        self.name = "the bench itself" if answer is None else "operator of the script"

    def confirm(self, request: str) -> bool:
        """Whether the task of `request` is done; Ctrl-C during the wait counts as a refusal."""
        if self._answer is None:
            return True
        self.asking = True
        try:
            return bool(self._answer(request))
        except KeyboardInterrupt:
            return False
        finally:
            self.asking = False
