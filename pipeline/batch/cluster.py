"""Orders -> outcomes on a dask cluster that is there already, given by the address of its scheduler.

Who may reach that cluster can run code in it: it is secured by whoever set it up (see dask's documentation on TLS). The
client in this process only calls out and listens nowhere.
"""

from __future__ import annotations

import itertools
import queue
import threading
import time
import uuid
from collections.abc import Iterator, Sequence

from distributed import Client, Future, KilledWorker

from pipeline.batch.orders import Order
from pipeline.batch.specimen import ATTEMPTS, Outcome, Stages, measure_order, store_death
from pipeline.errors import InputError
from pipeline.messages import Message

LOOK_S = 0.2  # between two looks whether Ctrl-C was pressed while nothing ended
AT_ONCE = 2  # specimens handed out a worker: one is measured, the next waits, memory stays flat
CONNECT_S = 5.0  # to a scheduler given by its address; those that answer do so within a second


def measure_on_cluster(
    scheduler: str, orders: Sequence[Order], stages: Stages, interrupted: threading.Event
) -> Iterator[Outcome]:
    """Measure orders on a dask cluster; outcomes in the order in which they end.

    Raises
    ------
    InputError
        ``batch/no-scheduler`` if nobody answers at the address.
    KeyboardInterrupt
        Once ``interrupted`` is set.
    """
    try:
        client = Client(scheduler, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(Message("batch/no-scheduler", address=repr(scheduler))) from error
    with client:
        yield from _stream(client, orders, stages, interrupted)


def _stream(client: Client, orders: Sequence[Order], stages: Stages, interrupted: threading.Event) -> Iterator[Outcome]:
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
    for order in itertools.islice(waiting, workers * AT_ONCE):
        hand_out(order)
    while doing:
        if interrupted.is_set():
            raise KeyboardInterrupt
        try:
            future = ended.get(timeout=LOOK_S)
        except queue.Empty:
            continue
        _, order, started, again = doing.pop(str(future.key))
        trouble = None if future.status == "finished" else future.exception()
        if isinstance(trouble, KilledWorker) and again < ATTEMPTS:
            hand_out(order, again + 1)
            continue
        following = next(waiting, None)
        if following is not None:
            hand_out(following)
        if trouble is None:
            yield future.result()
        else:
            yield store_death(order, f"{type(trouble).__name__}: {' '.join(str(trouble).split())[:300]}", started)
