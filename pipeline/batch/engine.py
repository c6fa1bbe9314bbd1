"""Orders -> outcomes through dask: processes of this machine, or any scheduler by its address, with the same code.

Specimens are handed out a few at a time and only short outcomes come back, so the memory of this process does not
depend on the size of the batch. A worker that dies is replaced and its specimen tried once more (see `specimen`).
A single specimen is measured in this process, unless its time is limited: starting another takes 1.5 s.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import queue
import signal
import threading
import time
import uuid
from collections.abc import Generator, Iterator, Sequence

import dask
from dask.system import CPU_COUNT
from distributed import Client, Future, KilledWorker, LocalCluster

from pipeline.batch.orders import Order
from pipeline.batch.specimen import ONE_THREAD, Outcome, Stages, measure_order, store_failure
from pipeline.errors import InputError
from pipeline.result import FindingPart
from pipeline.settings.batch import BatchSettings

# One specimen at a time in a worker, the next one waits in the scheduler and not in a process that may die with it;
# spilling and pausing are for data in workers, and there is none. A worker that died is started again by its nanny,
# however long that takes on a busy machine: dask gives it up after 15 s, and a batch without workers waits forever.
# dask looks after itself 50 times a second in every process, which cost this one 7 % of a core: a few times do, for
# what is done here lasts seconds. A worker's memory is looked at twice a second.
LOCAL = {
    "distributed.nanny.pre-spawn-environ": ONE_THREAD,
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.allowed-failures": 3,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.preload": ["pipeline.batch.worker"],
    "distributed.admin.low-level-log-length": 0,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.worker.memory.monitor-interval": "500ms",
    "distributed.deploy.lost-worker-timeout": "7 days",
}
LOOK_S = 0.2  # between two looks whether Ctrl-C was pressed while nothing ended
CONNECT_S = 5.0  # to a scheduler given by its address; those that answer do so within a second


def measure_all(
    orders: Sequence[Order], settings: BatchSettings, *, scheduler: str | None = None, stages: Stages
) -> Generator[Outcome]:
    """Measure all orders; outcomes in the order in which they end.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running dask scheduler whose workers see the same files; else processes of this machine.
    stages : Stages
        What is done with a specimen, see `specimen`.

    Raises
    ------
    InputError
        ``batch/no-scheduler`` if nobody answers at the address.
    """
    alone = len(orders) == 1 and "timeout_s" not in settings.model_fields_set
    if scheduler is None and (alone or settings.in_process):
        for order in orders:
            yield measure_order(order, stages, guarded=False)
        return
    with _client(len(orders), settings, scheduler) as client, _interrupts() as interrupted:
        yield from _stream(client, orders, settings, stages, interrupted)


@contextlib.contextmanager
def _client(count: int, settings: BatchSettings, scheduler: str | None) -> Iterator[Client]:
    """A client of a given scheduler, or of workers on this machine that end with it."""
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"no dask scheduler answers at {scheduler!r}",
                code="batch/no-scheduler",
                remedy="start one with `dask scheduler`, or leave --scheduler out to use this machine",
            ) from error
        with client:
            yield client
        return
    workers = min(settings.workers or CPU_COUNT, count)
    limit = f"{settings.memory_per_worker_gb}GB" if settings.memory_per_worker_gb else "auto"
    with (
        dask.config.set(LOCAL),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=limit,
            dashboard_address="127.0.0.1:0",  # any free port: two batches may run, and nobody else looks in
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield client


@contextlib.contextmanager
def _interrupts() -> Iterator[threading.Event]:
    """Ctrl-C as an event, a second one as ever.

    Raised wherever this thread happens to be, KeyboardInterrupt is lost where that is a finalizer of a library, and the
    batch would run on; so it is noted, and raised between two outcomes.
    """
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked  # signals reach the main thread alone
        return
    before = signal.getsignal(signal.SIGINT)

    def note(*_: object) -> None:
        asked.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)


def _next(ended: queue.SimpleQueue[Future[Outcome]], interrupted: threading.Event) -> Future[Outcome]:
    """The next future that ended, or KeyboardInterrupt."""
    while True:
        if interrupted.is_set():
            raise KeyboardInterrupt
        with contextlib.suppress(queue.Empty):
            return ended.get(timeout=LOOK_S)


def _stream(
    client: Client, orders: Sequence[Order], settings: BatchSettings, stages: Stages, interrupted: threading.Event
) -> Iterator[Outcome]:
    """Keep a few orders per worker under way.

    Where the scheduler blames an order for workers that died around it, it is handed out again: whether it is to blame
    the order itself knows, by the notes of its attempts.
    """
    # The futures are kept: dask drops the work of those that nobody holds.
    doing: dict[str, tuple[Future[Outcome], Order, float, int]] = {}
    ended: queue.SimpleQueue[Future[Outcome]] = queue.SimpleQueue()

    def hand_out(order: Order, again: int = 0) -> None:
        future = client.submit(measure_order, order, stages, key=f"specimen-{uuid.uuid4().hex}", pure=False)
        doing[str(future.key)] = future, order, time.monotonic(), again
        future.add_done_callback(ended.put)

    workers = max(1, sum(client.ncores().values()))
    waiting = iter(orders)
    for order in itertools.islice(waiting, workers * settings.waiting_per_worker):
        hand_out(order)
    while doing:
        future = _next(ended, interrupted)
        _, order, started, again = doing.pop(str(future.key))
        trouble = None if future.status == "finished" else future.exception()
        if isinstance(trouble, KilledWorker) and again < settings.attempts:
            hand_out(order, again + 1)
            continue
        following = next(waiting, None)
        if following is not None:
            hand_out(following)
        if trouble is None:
            yield future.result()
        else:
            told = f"its worker failed ({type(trouble).__name__}: {' '.join(str(trouble).split())[:300]})"
            yield store_failure(order, FindingPart(code="specimen/worker-died", level="error", message=told), started)
