"""What a worker process of this machine does first: leave Ctrl-C to the command that started it.

A terminal sends the interrupt to all processes of a command. The one in front ends the batch in order; a worker that
took it too would die in the middle of its own shutdown and say so at length.
"""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Called by dask in the worker process (see its documentation, "Customize initialization")."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
