"""Orders -> outcomes: in this process, in processes of this machine, or on a dask cluster, with the same result.

Specimens are handed out a few at a time and only short outcomes come back, so the memory of this process does not
depend on the size of the batch. A worker that dies is replaced and its specimen tried once more (see `specimen`).
A single specimen is measured in this process, unless its time is limited: starting another takes 1.5 s.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial

from pipeline.batch.orders import Order
from pipeline.batch.specimen import ATTEMPTS, Outcome, Stages, measure_order, store_death
from pipeline.settings.batch import BatchSettings


def measure_all(
    orders: Sequence[Order],
    settings: BatchSettings,
    *,
    scheduler: str | None = None,
    stages: Stages,
    doing: Callable[[str, str], None] = lambda name, stage: None,
) -> Generator[Outcome]:
    """Measure all orders; outcomes in the order in which they end.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running dask scheduler whose workers see the same files; else processes of this machine.
    stages : Stages
        What is done with a specimen, see `specimen`.
    doing : callable
        Told the name of a result and the stage that begins.

    Raises
    ------
    InputError
        ``batch/no-scheduler`` if nobody answers at the address.
    """
    alone = len(orders) == 1 and "timeout_s" not in settings.model_fields_set
    if scheduler is None and (alone or settings.in_process):
        for order in orders:
            yield measure_order(order, stages, guarded=False, doing=partial(doing, order.name))
        return
    with _interrupts() as interrupted:
        if scheduler is None:
            from pipeline.batch.processes import in_processes

            yield from in_processes(
                lambda order, tell: measure_order(order, stages, doing=tell),
                orders,
                settings,
                lost=lambda order, code, started: store_death(order, f"exit {code}", started),
                attempts=ATTEMPTS,
                interrupted=interrupted,
                doing_now=lambda order, stage: doing(order.name, stage),
            )
        else:
            from pipeline.batch.cluster import measure_on_cluster  # dask takes half a second to load

            yield from measure_on_cluster(scheduler, orders, stages, interrupted)


@contextlib.contextmanager
def _interrupts() -> Iterator[threading.Event]:
    """Note Ctrl-C and SIGTERM as an event; a second one ends the program as usual.

    Raised wherever this thread happens to be, KeyboardInterrupt is lost where that is a finalizer of a library, and the
    batch would run on; so it is noted, and raised between two outcomes.
    """
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked  # signals reach the main thread alone
        return

    def note(*_: object) -> None:
        asked.set()
        restore()

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, note)
    try:
        yield asked
    finally:
        restore()
