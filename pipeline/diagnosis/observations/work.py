"""How much has been simulated: a measure of effort that is the same on every machine.

A search that is given up after a time would find more on a fast machine than on a slow or busy one, and two runs of one
specimen could differ. Newton steps are most of a search's time and do not depend on the machine. They are counted for
each thread by itself, so that specimens measured side by side do not count for each other.
"""

from __future__ import annotations

from threading import local


class _Count(local):
    newton_steps = 0


_done = _Count()


def newton_steps() -> int:
    """Newton steps of all simulations that this thread has run so far."""
    return _done.newton_steps


def counted(steps: int) -> None:
    """Add the Newton steps of a simulation."""
    _done.newton_steps += steps
