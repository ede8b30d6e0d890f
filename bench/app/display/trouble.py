"""Fault reports for the operator: event, reaction of the bench and next step."""

from dataclasses import dataclass

from bench.app.ipc.messages import Ended, Refused
from bench.guard.sensors import TIMING
from sim.errors import Cause, CauseCode

QUIET = ("completed", "stopped")
"""Statuses of an ended run that require no action."""


RUN_ENDED = "Run {status}: {reason}."
DID = {
    "aborted": "The drive was ramped quickly to zero, and the rig was stopped.",
    "halted": "The enable line was cut at once, without a ramp.",
    "failed": "The output was ramped to zero, or cut if the rig no longer responded.",
}
DID_NOTHING = "The table was not driven."
KEPT = "The data recorded until then are in {out}."
DID_REFUSE = "The run was not started: nothing was armed or written."
DID_NOT_START = "The rig was never armed; all devices were closed again."
DID_LOSE = (
    "A session that ends brings the output to zero; if its process crashed, only the watchdog or the heartbeat does, "
    "where they are configured. The data recorded until then remain readable."
)
NOW_REFUSED = "Change the value named above, then check the plan again."
NOW_LOOK = (
    "Look at the bench: if the table moves, press the emergency stop. Then run the loop check on the Setup page before "
    "the next test."
)
NOW_LIMIT = (
    "A limit was exceeded ({subject}): inspect the specimen and the sensors before the next test. If they are in "
    "order, check the margins of the plan and reduce the motion."
)
NOW_LATE = (
    "The computer or the link to a device was too slow ({subject}); the motion was within its limits. "
    "Close other programs, check cables and network, then start again."
)
_NOW_DEVICE = (
    "Check the power supply and the cables of the device named above, then search for devices and run the loop check "
    "on the Setup page."
)
_NOW_DISK = (
    'Free disk space, or enter a folder on another disk in the field "Results in". `rockbench file info` describes '
    "the recorded file."
)
NOW = {
    "request": "Clear STOP in the bar at the top when the bench is safe. A new run starts from the beginning.",
    "client_lost": (
        "This window did not respond for several seconds. Close other programs, then start again. With the option "
        '"Continue without this window", a run continues in this case.'
    ),
    "declined": "Complete the task, or remove it from the plan, then start again.",
    "safety_input": (
        "Find the cause at the bench and reset the safety input there. In the next run, the header must show it as "
        "good."
    ),
    "limit": NOW_LIMIT,
    "disk": _NOW_DISK,
    "data_file": _NOW_DISK,
    "memory": "Close other programs, or restart the computer, then start again.",
    "device_timeout": _NOW_DEVICE,
    "connection_lost": _NOW_DEVICE,
    "device_not_found": _NOW_DEVICE,
    "command_refused": _NOW_DEVICE,
}
"""Next step by code of the cause. For all other codes, it is NOW_LOOK, or NOW_REFUSED if the run was not started."""


@dataclass(frozen=True)
class Trouble:
    """A fault report: event, reaction and next step; `details` are shown on request."""

    what: str
    did: str
    now: str
    details: str = ""


def trouble_of(ended: Ended | Refused, *, driven: bool) -> Trouble | None:
    """The fault report of a run; None if it ended without a fault. `driven` is whether the rig was armed in the run."""
    if isinstance(ended, Refused):
        return _of_refusal(ended, driven=driven)
    if ended.status in QUIET:
        return None
    did = DID[ended.status] if driven else DID_NOTHING
    what = RUN_ENDED.format(**vars(ended))
    return Trouble(what, f"{did} {KEPT.format(out=ended.out)}", advice(ended.cause))


def _of_refusal(refused: Refused, *, driven: bool) -> Trouble:
    if not refused.failed:
        now = NOW.get(refused.cause.code, NOW_REFUSED).format(subject=refused.cause.subject)
        return Trouble(refused.text, DID_REFUSE, now, refused.details)
    if driven:
        return Trouble(refused.text, DID_LOSE, NOW_LOOK, refused.details)
    return Trouble(refused.text, DID_NOT_START, advice(refused.cause), refused.details)


def advice(cause: Cause) -> str:
    """Next step for a cause, by its code."""
    if cause.code == CauseCode.LIMIT and cause.subject in TIMING:
        return NOW_LATE.format(subject=cause.subject)
    return NOW.get(cause.code, NOW_LOOK).format(subject=cause.subject)
