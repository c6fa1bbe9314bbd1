"""Work on photos that must not cost a specimen: what breaks on one photo refuses that photo, and no more.

``work on one photo -> its outcome, or why there is none``
``work on all photos of a series together -> its outcome, without the photo on which it breaks``
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import TypeVar

import cv2

from pipeline.messages import Message
from pipeline.records import Rejected

Found = TypeVar("Found")
Outcome = TypeVar("Outcome")

UNFORESEEN = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
    cv2.error,
)
"""What a picture nobody foresaw can raise; trouble with the disk and a key pressed are none of the photo's."""


def guarded(image: str, work: Callable[[], Found]) -> Found | Rejected:
    """The outcome of work on one photo; numbers nobody foresaw cost that photo, not the specimen."""
    try:
        return work()
    except UNFORESEEN as error:
        told = " ".join(str(error).split())[:200]
        return Rejected(image, Message("photo/program-error", error=type(error).__name__, told=told))


def jointly(
    names: Sequence[str],
    outcomes: Sequence[Outcome | Rejected],
    work: Callable[[Sequence[Outcome | Rejected]], Found],
) -> Found | Rejected:
    """Work on all photos of a series together; where it breaks, without those that are to blame.

    These are all on which it breaks without the others, or else the first one without which it does not.

    Parameters
    ----------
    names : sequence of str
        Of the photos.
    outcomes : sequence of object or Rejected
        What there is of each so far.
    work : callable
        Passes over what was rejected.

    Returns
    -------
    object or Rejected
        What the work found; why it breaks if it does whichever photo is left out.
    """
    whole = guarded("", partial(work, outcomes))
    if not isinstance(whole, Rejected):
        return whole
    refused = [Rejected(name, whole.said) for name in names]
    left = [k for k, outcome in enumerate(outcomes) if not isinstance(outcome, Rejected)]

    def without(blamed: Collection[int]) -> Found | Rejected:
        return guarded("", partial(work, [refused[k] if k in blamed else one for k, one in enumerate(outcomes)]))

    alone = [k for k in left if isinstance(without({*left} - {k}), Rejected)]
    for blamed in (alone if len(alone) < len(left) else [], *([k] for k in left)):
        found = without(blamed) if blamed else whole
        if not isinstance(found, Rejected):
            return found
    return whole
