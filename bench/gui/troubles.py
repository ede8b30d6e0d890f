"""What went wrong, in three answers: what happened, what the bench did, what to do now. Knows nothing of Qt."""

from dataclasses import dataclass

from bench.gui import texts
from bench.link.messages import Ended, Refused
from sim.errors import Cause

QUIET = ("completed", "stopped")
"""Ends that are no trouble: nobody has to do anything."""


@dataclass(frozen=True)
class Trouble:
    """The three answers; `details` are shown on request."""

    what: str
    did: str
    now: str
    details: str = ""


def trouble_of(ended: Ended | Refused, *, driven: bool) -> Trouble | None:
    """Why the end of a run needs a person, or None. `driven` says whether the rig was armed in it."""
    if isinstance(ended, Refused):
        return _of_refusal(ended, driven=driven)
    if ended.status in QUIET:
        return None
    did = texts.DID[ended.status] if driven else texts.DID_NOTHING
    what = texts.RUN_ENDED.format(**vars(ended))
    return Trouble(what, f"{did} {texts.KEPT.format(out=ended.out)}", advice(ended.cause))


def _of_refusal(refused: Refused, *, driven: bool) -> Trouble:
    if not refused.failed:
        return Trouble(refused.text, texts.DID_REFUSE, texts.NOW_REFUSED, refused.details)
    if driven:
        return Trouble(refused.text, texts.DID_LOSE, texts.NOW_LOOK, refused.details)
    return Trouble(refused.text, texts.DID_NOT_START, advice(refused.cause), refused.details)


def advice(cause: Cause) -> str:
    """What to do about a cause: what the message says itself comes first, this is what follows from its kind."""
    return texts.NOW.get(cause.code, texts.NOW_LOOK).format(subject=cause.subject)
