"""Work on specimens in processes of this machine, each at the end of a pipe of its own.

A pipe has no name and no port: nobody but this process and its worker can write into it, and what is pickled there
(work and specimens on the way out, outcomes on the way back) was made by the program itself. A worker takes one
specimen at a time, and ends when this process does, however that ends. One that dies costs its specimen alone.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection, resource_tracker
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import TypeVar

import cloudpickle
import psutil

from pipeline.settings.batch import BatchSettings
from pipeline.threads import ONE_THREAD

LOOK_S = 0.2  # between two looks at Ctrl-C and at the memory of the workers while nothing ended
SHARED = 0.95  # of the memory of this machine, by the workers; the rest is for this process
# Where Linux tells a container its limit of memory, in control groups of the second and the first version
CONTAINER = tuple(Path("/sys/fs/cgroup") / name for name in ("memory.max", "memory/memory.limit_in_bytes"))
# A worker is begun anew, not forked: a fork would take over locks that threads of libraries hold at that moment.
SPAWN = multiprocessing.get_context("spawn")
Pipe = connection.Connection
Item = TypeVar("Item")
Done = TypeVar("Done")
OVER = 124
"""Exit code of a worker that took longer than it may, as `timeout` has it."""


@dataclass(frozen=True)
class _Worker:
    """A process and this end of the pipe to it."""

    process: SpawnProcess
    pipe: Pipe

    def fatter_than(self, limit: float) -> bool:
        """Whether it holds more bytes of memory."""
        try:
            return bool(psutil.Process(self.process.pid).memory_info().rss > limit)
        except psutil.NoSuchProcess:
            return False

    def end(self) -> None:
        """End it at once: what it has not stored it would lose anyway, and what is stored is stored whole."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


def in_processes(
    work: Callable[[Item, Callable[[str], None]], Done],
    items: Sequence[Item],
    settings: BatchSettings,
    *,
    lost: Callable[[Item, int | None, float], Done],
    attempts: int,
    interrupted: threading.Event,
    doing_now: Callable[[Item, str], None] = lambda item, stage: None,
) -> Iterator[Done]:
    """Work on items in processes of this machine; outcomes in the order in which they end.

    Parameters
    ----------
    work : callable
        Takes an item and a callable to be told the stage that begins; never raises. What it gives is no str.
    settings : BatchSettings
        Number of processes, and their memory.
    lost : callable
        What is given for an item whose processes died: the item, the last one's exit code (`OVER` where its time was
        over) and when that began (s, `time.monotonic`).
    attempts : int
        Times that an item whose process died is tried again.
    doing_now : callable
        Told the item and the stage that begins.

    Raises
    ------
    KeyboardInterrupt
        Once ``interrupted`` is set.
    """
    count = min(settings.workers or _cores(), len(items))
    limit, by_value = _bytes_per_worker(settings, count), cloudpickle.dumps(work)
    waiting, deaths = deque(enumerate(items)), Counter[int]()
    idle: list[_Worker] = []
    doing: dict[Pipe, tuple[_Worker, int, Item, float]] = {}
    try:
        while waiting or doing:
            while waiting and len(doing) < count:
                worker, (number, item) = idle.pop() if idle else _begun(by_value), waiting.popleft()
                doing[worker.pipe] = worker, number, item, time.monotonic()
                with contextlib.suppress(OSError):  # it died while it had nothing to do: seen at once below
                    worker.pipe.send(item)
            ended = connection.wait(list(doing), LOOK_S)
            if interrupted.is_set():
                raise KeyboardInterrupt
            for worker, *_ in doing.values():
                if worker.fatter_than(limit):
                    worker.process.kill()
            for pipe in [pipe for pipe in doing if pipe in ended]:
                worker, number, item, started = doing[pipe]
                try:
                    outcome = worker.pipe.recv()
                    if isinstance(outcome, str):
                        doing_now(item, outcome)
                        continue
                    del doing[pipe]
                except (EOFError, OSError):
                    del doing[pipe]
                    worker.end()
                    deaths[number] += 1
                    if deaths[number] <= attempts:
                        waiting.appendleft((number, item))  # whether it is to blame the notes of its attempts tell
                    else:
                        yield lost(item, worker.process.exitcode, started)
                else:
                    idle.append(worker)
                    yield outcome
    finally:
        for worker in (*idle, *(busy for busy, *_ in doing.values())):
            worker.end()


def _cores() -> int:
    """Number of cores that this process may use; control groups counted."""
    from dask.system import CPU_COUNT  # takes a fifth of a second, which no worker needs

    return int(CPU_COUNT)


def _bytes_per_worker(settings: BatchSettings, count: int) -> float:
    """Bytes of memory beyond which a worker is ended, before the system ends something else.

    Of this machine, or of the container it is: as `distributed.system` tells it, which takes half a second and 17 MB of
    this process to load.
    """
    if settings.memory_per_worker_gb:
        return 1e9 * settings.memory_per_worker_gb
    limits = [int(psutil.virtual_memory().total)]
    for path in CONTAINER:
        with contextlib.suppress(OSError, ValueError):  # not there; "max", which is none
            limits.append(int(path.read_text()))
    return SHARED * min(limits) / count


def _begun(by_value: bytes) -> _Worker:
    """A new worker."""
    here, there = SPAWN.Pipe()
    process = SPAWN.Process(target=_work, args=(there, by_value), daemon=True)
    with _inherited():
        process.start()
    there.close()  # the worker has its own; were this one open, its death would not end the pipe
    return _Worker(process, here)


@contextlib.contextmanager
def _inherited() -> Iterator[None]:
    """What a worker has from its first line on: one thread a library, and no Ctrl-C, which its parent acts on."""
    unset = ONE_THREAD.keys() - os.environ.keys()
    os.environ.update({name: ONE_THREAD[name] for name in unset})
    masks = hasattr(signal, "pthread_sigmask")  # not on Windows
    if masks:
        resource_tracker.ensure_running()  # started by the first worker, it would unblock what is blocked here
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for name in unset:
            del os.environ[name]


def _work(pipe: Pipe, by_value: bytes) -> None:
    """Work on what comes through the pipe, one after the other. What a library prints goes where errors go."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    work = pickle.loads(by_value)
    with contextlib.suppress(EOFError, OSError):  # the parent closed its end
        while True:
            pipe.send(work(pipe.recv(), partial(_tell, pipe)))


def _tell(pipe: Pipe, stage: str) -> None:
    """Name the stage that begins; nobody listens where the parent closed its end, which ends this worker anyway."""
    with contextlib.suppress(OSError):
        pipe.send(stage)


@contextlib.contextmanager
def deadline(seconds: float, note: Callable[[], object] = lambda: None) -> Iterator[None]:
    """End this process when the time is over, after ``note``: code in a library that hangs cannot be asked to stop."""

    def end() -> None:
        with contextlib.suppress(OSError):
            note()
        os._exit(OVER)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _end_with_parent() -> None:
    """End this process at once when the one that started it is gone: nobody would take the outcome."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
