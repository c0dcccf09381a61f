"""Causes that are found and not fitted: what repeating itself in held-out records proves.

Some causes leave what nothing else does: samples that stop at one value, words that are lost, lines of the
supply. Their finders have false alarm rates of their own, and much of what they find shows in no level. Such
a cause is proven when it is found again, alike, in records that it was not read from.

Where lines are is known far better than how high they should be, and kinematics do not err as levels do. So
causes that move lines tell themselves by how much what they read off positions speaks for them. And lines of
a damaged bearing that noise would not show in a record, nor in another, are there however wrong levels are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from gearsim_twin.causes.cause import REPEATED_NATS, Values
from gearsim_twin.causes.context import Context
from gearsim_twin.model import READ, Extension

__all__ = ["REPEATED_NATS", "proof_nats", "with_proofs"]

# Two readings of one number agree within so many standard deviations, or within this part of it: courses of
# speed and noise differ from record to record.
_SIGMAS, _PART = 4.0, 0.35


def proof_nats(extension: Extension, heldout: Context) -> float:
    """What finding a cause again adds to its evidence; 0 where it is no such cause or is not found again.

    Parameters
    ----------
    extension : Extension
        As read off the records for training.
    heldout : Context
        Of the records held out, beside the model without the cause.

    Notes
    -----
    What reading its numbers has cost is given back: the second reading had no choice.
    """
    cause = extension.cause
    told = getattr(cause, "told_again", None)
    if told is not None:
        return float(told(extension.values, extension.context, heldout))
    if extension.free or not getattr(cause, "proven", False) or not cause.applies(heldout):
        return 0.0
    again = any(_alike(extension, start) for start in cause.starts(heldout))
    if not again and (seen := getattr(cause, "seen_again", None)) is not None:
        again = float(seen(extension.values, heldout)) > REPEATED_NATS
    return REPEATED_NATS + extension.reading_nats if again else 0.0


def with_proofs(extensions: Sequence[Extension], heldout: Callable[[], Context]) -> list[float]:
    """`proof_nats` of some extensions; the held-out records are looked at only if one of them asks for it."""
    wanted = [_asks(each) for each in extensions]
    if not any(wanted):
        return [0.0] * len(extensions)
    context = heldout()
    pairs = zip(extensions, wanted, strict=True)
    return [proof_nats(each, context) if asked else 0.0 for each, asked in pairs]


def _asks(extension: Extension) -> bool:
    cause = extension.cause
    if getattr(cause, "told_again", None) is not None:
        return True
    return not extension.free and bool(getattr(cause, "proven", False))


def _alike(extension: Extension, start: Values) -> bool:
    for parameter in extension.cause.parameters:
        key = f"{READ}{parameter.name}"
        if parameter.name not in start or key not in start:
            return False
        one, other = float(extension.values[parameter.name]), float(start[parameter.name])
        spread = math.hypot(float(extension.values[key]), float(start[key]))
        if abs(one - other) > max(_SIGMAS * spread, _PART * max(abs(one), abs(other))):
            return False
    return True
