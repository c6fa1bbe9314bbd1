"""A whole batch: specimens are handed out, results collected, log and index written; an interrupt loses nothing."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.batch.orders import Order, make_orders
from pipeline.batch.specimen import ATTEMPTS, Outcome, Stages, draw_again, measure_order, store_death
from pipeline.batch.store import Store
from pipeline.errors import InputError
from pipeline.messages import Message
from pipeline.result import read_result
from pipeline.settings import Settings
from pipeline.settings.batch import BatchSettings

LOG_NAME = "cablebend.log"
PIPELINE = Stages()


@dataclass(frozen=True)
class Tally:
    """Counts of a batch; what is not usable was measured all the same.

    ``unstored`` holds the entries, by name, of failures that could not be written; ``trouble`` is what else to say.
    """

    total: int
    names: tuple[str, ...]
    measured: int = 0
    failed: int = 0
    unusable: int = 0
    reused: int = 0
    interrupted: bool = False
    unstored: dict[str, dict[str, Any]] = field(default_factory=dict)
    trouble: tuple[Message, ...] = ()

    @property
    def done(self) -> int:
        """Specimens that came to an end."""
        return self.measured + self.failed

    def plus(self, outcome: Outcome) -> Tally:
        """The tally with one more outcome."""
        unstored = self.unstored if outcome.entry is None else self.unstored | {outcome.name: outcome.entry}
        return replace(
            self,
            measured=self.measured + (not outcome.failed),
            failed=self.failed + outcome.failed,
            unusable=self.unusable + (not outcome.failed and not outcome.usable),
            reused=self.reused + outcome.reused,
            unstored=unstored,
        )


def run_batch(
    folders: Sequence[Path],
    out: Path,
    settings: Settings,
    *,
    scheduler: str | None = None,
    options: str = "",
    on_outcome: Callable[[Outcome, Tally], None] = lambda outcome, tally: None,
    on_stage: Callable[[str, str], None] = lambda name, stage: None,
    stages: Stages | None = None,
) -> Tally:
    """Measure many specimen folders into a folder of results, which is made if needed.

    What is there already and depends on the same inputs, settings and program is kept; the index covers everything in
    the folder. Ctrl-C ends the batch, keeps what is finished and still writes the index.

    Parameters
    ----------
    scheduler : str, optional
        Address of a dask scheduler.
    options : str
        Options for the command that reproduces a result.
    on_outcome : callable
        Called with each outcome and the tally so far.
    on_stage : callable
        Called with the name of a result and the stage its measurement begins, where this machine measures.
    stages : Stages, optional
        What is done with a specimen; the pipeline by default.

    Raises
    ------
    InputError
        ``out/busy``, ``out/unwritable``, ``batch/no-scheduler``.
    """
    store, stages = Store(out.absolute()), stages or PIPELINE
    with store.locked(), _log(store) as log:
        orders = make_orders(folders, out, settings, options=options)
        tally = Tally(len(orders), tuple(order.name for order in orders))
        log.info("begin: %d specimens", len(orders))
        outcomes = measure_all(orders, settings.batch, scheduler=scheduler, stages=stages, doing=on_stage)
        try:
            for outcome in outcomes:
                tally = tally.plus(outcome)
                how = "kept" if outcome.reused else outcome.status
                log.info("%s: %s, %.1f s, %s", outcome.name, how, outcome.seconds, outcome.headline)
                on_outcome(outcome, tally)
        except KeyboardInterrupt:
            tally = replace(tally, interrupted=True)
        finally:
            outcomes.close()
        try:
            trouble: tuple[Message, ...] = tuple(stages.write_index(store.out, settings))
        except OSError as error:  # a folder that takes no more files
            trouble = (store.unwritable(error).placed,)
        tally = replace(tally, trouble=trouble)
        log.info("end: %d measured, %d failed, %d of them kept", tally.measured, tally.failed, tally.reused)
    return tally


def redraw(out: Path, settings: Settings) -> Iterator[tuple[str, Message | None]]:
    """Write tables, reports and index of stored results again, without measuring.

    Yields
    ------
    str, Message or None
        Name of a result, and why it could not be drawn.

    Raises
    ------
    InputError
        ``out/busy``, ``out/unwritable``.
    """
    store = Store(out.absolute())
    with store.locked():
        for name in store.names():
            try:
                draw_again(store, name, read_result(store.out / name), PIPELINE, settings)
            except InputError as error:
                store.forget_row(name)
                yield name, Message("cli.unreadable", why=error.said)
            except (ArithmeticError, LookupError, TypeError, ValueError) as error:  # values that no measurement gives
                yield name, Message("cli.undrawable", error=type(error).__name__, why=str(error))
            else:
                yield name, None
        PIPELINE.write_index(store.out, settings)


class _LogFile(logging.FileHandler):
    """A log on a disk that may be full."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Leave the line out: the default prints a traceback for each."""


@contextmanager
def _log(store: Store) -> Iterator[logging.Logger]:
    """A log file beside the results, one line a specimen, appended to by each run."""
    log = logging.Logger("cablebend.batch")  # not registered: no other logger of the process is touched
    try:
        handler = _LogFile(store.out / LOG_NAME, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise store.unwritable(error) from error
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    log.addHandler(handler)
    try:
        yield log
    finally:
        with suppress(OSError):
            handler.close()


def measure_all(
    orders: Sequence[Order],
    settings: BatchSettings,
    *,
    scheduler: str | None,
    stages: Stages,
    doing: Callable[[str, str], None],
) -> Generator[Outcome]:
    """Measure all orders; outcomes in the order in which they end.

    Specimens are handed out a few at a time and only short outcomes come back, so the memory of this process does not
    depend on the size of the batch. A worker that dies is replaced and its specimen tried once more (see `specimen`).
    A single specimen is measured in this process, unless its time is limited: starting another takes 1.5 s.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running dask scheduler whose workers see the same files; else processes of this machine.
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


@contextmanager
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
