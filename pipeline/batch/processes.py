"""Orders -> outcomes by processes of this machine, each at the end of a pipe of its own.

A pipe has no name and no port: nobody but this process and its worker can write into it, and what is pickled there
(orders and stages on the way out, outcomes on the way back) was made by the program itself. A worker takes one specimen
at a time, and ends when this process does, however that ends.
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

import cloudpickle
import psutil

from pipeline.batch.orders import Order
from pipeline.batch.specimen import Outcome, Stages, measure_order, store_death
from pipeline.settings.batch import BatchSettings
from pipeline.threads import ONE_THREAD

LOOK_S = 0.2  # between two looks at Ctrl-C and at the memory of the workers while nothing ended
SHARED = 0.95  # of the memory of this machine, by the workers; the rest is for this process
# Where Linux tells a container its limit of memory, in control groups of the second and the first version
CONTAINER = tuple(Path("/sys/fs/cgroup") / name for name in ("memory.max", "memory/memory.limit_in_bytes"))
# A worker is begun anew, not forked: a fork would take over locks that threads of libraries hold at that moment.
SPAWN = multiprocessing.get_context("spawn")
Pipe = connection.Connection


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


def measure_in_processes(
    orders: Sequence[Order],
    settings: BatchSettings,
    stages: Stages,
    interrupted: threading.Event,
    doing_now: Callable[[str, str], None],
) -> Iterator[Outcome]:
    """Measure orders in processes of this machine; outcomes in the order in which they end.

    Raises
    ------
    KeyboardInterrupt
        Once ``interrupted`` is set.
    """
    count = min(settings.workers or _cores(), len(orders))
    limit, by_value = _bytes_per_worker(settings, count), cloudpickle.dumps(stages)
    waiting, deaths = deque(orders), Counter[str]()
    idle: list[_Worker] = []
    doing: dict[Pipe, tuple[_Worker, Order, float]] = {}
    try:
        while waiting or doing:
            while waiting and len(doing) < count:
                worker, order = idle.pop() if idle else _begun(by_value), waiting.popleft()
                doing[worker.pipe] = worker, order, time.monotonic()
                with contextlib.suppress(OSError):  # it died while it had nothing to do: seen at once below
                    worker.pipe.send(order)
            ended = connection.wait(list(doing), LOOK_S)
            if interrupted.is_set():
                raise KeyboardInterrupt
            for worker, *_ in doing.values():
                if worker.fatter_than(limit):
                    worker.process.kill()
            for pipe in [pipe for pipe in doing if pipe in ended]:
                worker, order, started = doing[pipe]
                try:
                    outcome = worker.pipe.recv()
                    if isinstance(outcome, str):
                        doing_now(order.name, outcome)
                        continue
                    del doing[pipe]
                except (EOFError, OSError):
                    del doing[pipe]
                    worker.end()
                    deaths[order.name] += 1
                    if deaths[order.name] <= settings.attempts:
                        waiting.appendleft(order)  # whether it is to blame it knows itself, by the notes of attempts
                    else:
                        yield store_death(order, f"exit {worker.process.exitcode}", started)
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
    """Bytes of memory beyond which a worker is ended, before the system ends something else."""
    if settings.memory_per_worker_gb:
        return 1e9 * settings.memory_per_worker_gb
    return SHARED * _memory() / count


def _memory() -> int:
    """Bytes of memory of this machine, or of the container it is.

    As `distributed.system` tells it, which takes half a second and 17 MB of this process to load.
    """
    limits = [int(psutil.virtual_memory().total)]
    for path in CONTAINER:
        with contextlib.suppress(OSError, ValueError):  # not there; "max", which is none
            limits.append(int(path.read_text()))
    return min(limits)


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
    """What a worker has from its first line on: one thread a library, and no Ctrl-C.

    A terminal sends the interrupt to all processes of a command: the one in front ends the batch in order, and a worker
    that took it too would say so at length.
    """
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
    """Measure what comes through the pipe, one after the other."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    stages = pickle.loads(by_value)
    with contextlib.suppress(EOFError, OSError):  # the parent closed its end
        while True:
            pipe.send(measure_order(pipe.recv(), stages, doing=partial(_tell, pipe)))


def _tell(pipe: Pipe, stage: str) -> None:
    """Name the stage that begins; nobody listens where the parent closed its end, which ends this worker anyway."""
    with contextlib.suppress(OSError):
        pipe.send(stage)


def _end_with_parent() -> None:
    """End this process at once when the one that started it is gone: nobody would take the outcome."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
