"""What went wrong, in three answers: what happened, what the bench did, what to do now. Knows nothing of Qt."""

import re
from dataclasses import dataclass

from bench.events import LimitExceeded
from bench.gui import texts
from bench.link.messages import Ended, Refused

QUIET = ("completed", "stopped")
"""Ends that are no trouble: nobody has to do anything."""


@dataclass(frozen=True)
class Trouble:
    """The three answers; `details` are shown on request."""

    what: str
    did: str
    now: str
    details: str = ""


def trouble_of(ended: Ended | Refused, *, driven: bool, limit: LimitExceeded | None) -> Trouble | None:
    """Why the end of a run needs a person, or None. `driven` says whether the rig was armed in it."""
    if isinstance(ended, Refused):
        return _of_refusal(ended, driven=driven)
    if ended.status in QUIET:
        return None
    did = texts.DID[ended.status] if driven else texts.DID_NOTHING
    now = texts.NOW_LIMIT.format(quantity=limit.quantity) if limit is not None else advice(ended.reason)
    return Trouble(texts.RUN_ENDED.format(**vars(ended)), f"{did} {texts.KEPT.format(out=ended.out)}", now)


def _of_refusal(refused: Refused, *, driven: bool) -> Trouble:
    if not refused.failed:
        return Trouble(refused.text, texts.DID_REFUSE, texts.NOW_REFUSED, refused.details)
    if driven:
        return Trouble(refused.text, texts.DID_LOSE, texts.NOW_LOOK, refused.details)
    return Trouble(refused.text, texts.DID_NOT_START, advice(refused.text), refused.details)


def advice(reason: str) -> str:
    """What to do about `reason`: what it says itself comes first, this is what follows from its kind."""
    for pattern, answer in texts.NOW:
        if re.search(pattern, reason, re.IGNORECASE):
            return answer
    return texts.NOW_LOOK
