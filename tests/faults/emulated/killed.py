"""A campaign whose process kills itself, while the laboratory lives on in another."""

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.emulation.laboratory import Laboratory
from drivers.hardware.parameters import Hardware
from drivers.hardware.rig import HardwareRig
from tests.faults.bench import FaultyBench, run
from tests.faults.emulated.setup import KEEPER, PLACES, SETTING, shortened
from tests.faults.emulated.truth import GRACE, OUTPUT
from tests.faults.emulated.witness import Truth, Witness
from tests.faults.rig import FaultyRig
from tests.faults.setup import BARE, PARAMETERS
from tests.patience import LONG

WATCHED = KEEPER + GRACE
"""How long the laboratory is watched after the death [s]."""
_ATTEMPTS = 3


@dataclass(frozen=True)
class Aftermath:
    """What became of a laboratory whose program was killed, and of its file: seconds from its death to the opening of
    the enable chain (None when that stayed closed), volts that the output stage holds, everything that happened, and
    what the next program found and left."""

    path: Path
    exit_code: int | None
    opened_after: float | None
    held: float
    truth: Truth
    witness: Witness
    found: str
    enabled_after: bool
    held_after: float


def kill_at(name: str, folder: Path, *, watchdog: bool, heartbeat: bool) -> Aftermath:
    """Run a campaign in a process of its own, whose death is at the place of that name; then open the device anew.

    A campaign that a busy machine ended before it came there is repeated.
    """
    for attempt in range(_ATTEMPTS):
        after = _killed(name, folder / f"{attempt}.h5", watchdog=watchdog, heartbeat=heartbeat)
        if after.exit_code == -signal.SIGKILL:
            break
    return after


def _killed(name: str, path: Path, *, watchdog: bool, heartbeat: bool) -> Aftermath:
    with Laboratory(PARAMETERS, BARE, seed=1, connection="analogue") as laboratory:
        witness = Witness(laboratory.bench)
        hardware = shortened(laboratory, watchdog=watchdog, heartbeat=heartbeat)
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["tests.faults.emulated.preload"])
        process = context.Process(target=_campaign, args=(name, path, hardware.model_dump_json()), daemon=True)
        process.start()
        process.join(LONG)
        died, opened_after = time.monotonic(), None
        while opened_after is None and (since := time.monotonic() - died) < WATCHED:
            if not laboratory.bench.enabled:
                opened_after = since
            time.sleep(0.005)
        # what waited in the buffer has been played
        time.sleep(SETTING.lead / SETTING.rate)
        held, truth = laboratory.daq.volts(OUTPUT), witness.told()
        with HardwareRig(hardware, lead=SETTING.lead) as rig:
            found = rig.description["tasks left by another client"]
            enabled_after, held_after = laboratory.bench.enabled, laboratory.daq.volts(OUTPUT)
    return Aftermath(path, process.exitcode, opened_after, held, truth, witness, found, enabled_after, held_after)


def _campaign(name: str, path: Path, hardware: str) -> None:
    """In the process that dies."""
    place = next(place for place in PLACES if place.name == name)
    rig = FaultyRig(HardwareRig(Hardware.model_validate_json(hardware), lead=SETTING.lead))
    rig.safety = {}
    run(FaultyBench(path, place, _die, setting=SETTING, rig=rig))


def _die(bench: Any) -> None:
    bench.recorder.sync()
    os.kill(os.getpid(), signal.SIGKILL)
