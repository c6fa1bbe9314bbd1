"""Work on one item after the other in a process of its own: one that hangs or dies costs that item alone.

Code in a library that hangs cannot be asked to stop; a process can be ended. It is started once, does one item after
the other, and is started anew only after it was ended or has died.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

Item = TypeVar("Item")
Done = TypeVar("Done")


def apart(
    work: Callable[[Item], Done],
    items: Iterable[Item],
    *,
    seconds: float,
    lost: Callable[[Item, bool], Done],
    preload: str = "os",
) -> Iterator[Done]:
    """Do work on items, in their order.

    Parameters
    ----------
    work : callable
        Of a module, not within a function; never raises. It, the items and what it gives go from process to process.
    items : iterable
    seconds : float
        s for one item.
    lost : callable
        What is given for an item instead: the item, and whether its time was over; else its process died.
    preload : str
        Module that the work needs, loaded before the time of the first item begins.

    Yields
    ------
    object
        For each item.
    """
    with contextlib.ExitStack() as running:
        child: subprocess.Popen[bytes] | None = None
        for item in items:
            over = threading.Event()
            if child is None:
                child = running.enter_context(_ended(_started(preload)))
            try:
                with _limited(child, seconds, over):
                    done: Done = _answer(child, (work, item))
            except (EOFError, OSError, pickle.UnpicklingError):
                child, done = None, lost(item, over.is_set())
            if over.is_set():  # just after it had answered
                child = None
            yield done


def _started(preload: str) -> subprocess.Popen[bytes]:
    """An interpreter of its own: a fork inherits locks of threads, `multiprocessing` runs the caller's script again."""
    paths = os.pathsep.join(path or os.curdir for path in sys.path)
    child = subprocess.Popen(
        [sys.executable, "-m", __name__, preload],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": paths},
    )
    with contextlib.suppress(EOFError, OSError):  # one that cannot start fails at its first item
        _answer(child, None)
    return child


def _answer(child: subprocess.Popen[bytes], question: object) -> Any:
    """What a process says to a question; EOFError, OSError or UnpicklingError where it ends instead."""
    if child.stdin is None or child.stdout is None:
        raise ValueError("the process needs pipes for its input and output")
    pickle.dump(question, child.stdin)
    child.stdin.flush()
    return pickle.load(child.stdout)


@contextlib.contextmanager
def _limited(child: subprocess.Popen[bytes], seconds: float, over: threading.Event) -> Iterator[None]:
    """End a process that takes longer, and note it."""

    def end() -> None:
        over.set()
        child.kill()

    timer = threading.Timer(seconds, end)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


@contextlib.contextmanager
def _ended(child: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """A process that does not outlive the block, whatever it is at."""
    try:
        yield child
    finally:
        child.kill()
        with contextlib.suppress(OSError):  # what was still to be written to it
            child.communicate()


def serve() -> None:
    """What the process does until its input ends. What a library prints goes where errors go."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the command in front, which ends this process
    importlib.import_module(sys.argv[1])
    with os.fdopen(os.dup(1), "wb") as back, contextlib.suppress(EOFError, OSError):
        os.dup2(2, 1)
        while True:
            question = pickle.load(sys.stdin.buffer)
            pickle.dump(None if question is None else question[0](question[1]), back)
            back.flush()


if __name__ == "__main__":
    serve()
