"""One specimen of a batch, in whichever process: an order -> a stored result and a short outcome.

The only place where every error is caught: a specimen that fails, for whatever reason, is stored with its reason and
costs the batch nothing. A worker that dies cannot say so; the note it made before it began (`Store.begin`) does, and
after the second death, or once the time was over, the specimen is reported instead of tried again.
"""

from __future__ import annotations

import contextlib
import json
import time
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pipeline.batch.orders import Order, fingerprint
from pipeline.batch.processes import deadline
from pipeline.batch.store import Store, write_entry
from pipeline.errors import InputError
from pipeline.intake.folder import read_specimen
from pipeline.messages import Message, by_system, free_text
from pipeline.result import FindingPart, Result, SpecimenPart, read_result, schema, to_json
from pipeline.result.row import as_entry, index_row
from pipeline.settings import Settings
from pipeline.threads import keep_memory, one_thread

Doing = Callable[[str], None]
ATTEMPTS = 2
"""Times that a specimen may lose its worker; once may be bad luck with memory, not twice."""
ENTRY_SCHEMA = "cablebend/entry/1"


# The pipeline is imported where it is needed: in the worker, when the first specimen is measured.


def _pipeline_measure(folder: Path, settings: Settings, *, command: str, on_stage: Doing) -> Result:
    from pipeline.run import measure

    return measure(folder, settings, command=command, on_stage=on_stage)


def _pipeline_write(result: Result, folder: Path, settings: Settings) -> None:
    from pipeline.run import write

    write(result, folder, settings)


def _pipeline_write_index(out: Path, settings: Settings) -> Iterable[Message]:
    from pipeline.report.files import write_atomic
    from pipeline.report.index import index_rows, write_rows

    rows = index_rows(out, settings.report)
    write_rows(rows, out, settings.report)
    write_atomic(out / "result.schema.json", json.dumps(schema(), indent=1) + "\n")
    return [Message("cli.outlying", name=row.id, said=row.fault) for row in rows if row.outlying]


@dataclass(frozen=True)
class Stages:
    """What is done with a specimen; the pipeline itself unless a test or a notebook says otherwise.

    ``write_index`` gives what is to be said on specimens that contradict each other.
    """

    measure: Callable[..., Result] = _pipeline_measure
    write: Callable[..., None] = _pipeline_write
    write_index: Callable[[Path, Settings], Iterable[Message]] = _pipeline_write_index


@dataclass(frozen=True)
class Outcome:
    """What became of an order. ``entry`` is None if it is stored, else what could not be stored.

    ``usable`` is false where a fault of the data makes what was measured none of the cable's; ``said`` is why a
    specimen failed, as data.
    """

    name: str
    status: Literal["measured", "partial", "failed"]
    headline: str
    reused: bool = False
    seconds: float = 0.0
    entry: dict[str, Any] | None = None
    usable: bool = True
    said: Message | None = None

    @property
    def failed(self) -> bool:
        """True if nothing was measured."""
        return self.status == "failed"


def measure_order(order: Order, stages: Stages, *, guarded: bool = True, doing: Doing = lambda stage: None) -> Outcome:
    """Measure a specimen and store it; never raises but for an interrupt.

    Parameters
    ----------
    guarded : bool
        Note attempts and end the process when the time is over: in a worker of its own only.
    doing : callable
        Told the name of each stage that begins.
    """
    started, store, timeout_s = time.monotonic(), Store(order.out), order.settings.batch.timeout_s
    try:
        refused = _earlier_attempts(store, order, timeout_s) if guarded else None
        if refused is not None:
            outcome = store_failure(order, [refused])
        else:
            limit = deadline(timeout_s, store.overdue(order.name).touch) if guarded else contextlib.nullcontext()
            with limit:
                outcome = _measured(store, order, stages, doing)
            if guarded:
                store.end(order.name)
    except Exception as error:  # the one place: whatever breaks on a specimen is its finding and never costs the batch
        trace = None if isinstance(error, InputError) else traceback.format_exc()
        outcome = store_failure(order, refusals(error), trace=trace)
    return replace(outcome, seconds=time.monotonic() - started)


def refusals(error: Exception) -> list[FindingPart]:
    """What is told about an error that costs a specimen: all that is wrong in its files, or what nobody foresaw."""
    if isinstance(error, InputError):
        return [FindingPart.of("error", one.placed, code=one.code) for one in (error, *error.others)]
    if isinstance(error, MemoryError):
        said = Message("specimen/memory")
    elif isinstance(error, OSError):
        said = Message("specimen/file-system", why=by_system(error))
    else:
        told = " ".join(str(error).split())[:300]
        said = Message("specimen/program-error", error=type(error).__name__, told=told)
    return [FindingPart.of("error", said)]


def _earlier_attempts(store: Store, order: Order, timeout_s: float) -> FindingPart | None:
    """Why a specimen is not tried (again); None if it may be."""
    if store.overdue(order.name).exists():
        return overdue(timeout_s)
    if store.begin(order.name) >= ATTEMPTS:
        return FindingPart.of("error", Message("specimen/worker-died", attempts=ATTEMPTS))
    return None


def overdue(timeout_s: float) -> FindingPart:
    """What is told of a specimen that took longer than it may."""
    return FindingPart.of("error", Message("specimen/timeout", seconds=timeout_s))


def _measured(store: Store, order: Order, stages: Stages, doing: Doing) -> Outcome:
    """Read, compare with what is stored, measure, store."""
    one_thread()  # for workers that were started by others
    keep_memory()
    store.place(order.name)  # refuses before the work, not after it
    specimen = read_specimen(order.folder, order.settings.intake)
    mark = fingerprint(specimen, order)
    stored = store.entry(order.name)
    if stored is not None and stored.get("fingerprint") == mark:
        with contextlib.suppress(OSError, ValueError, InputError):  # a stored result that is none is measured anew
            if order.settings.batch.reports and stored.get("reports") != order.settings.report.language:
                draw_again(store, order.name, read_result(store.out / order.name), stages, order.settings)
            told, usable = str(stored.get("headline", "")), stored.get("state") != "unusable"
            return Outcome(order.name, stored["status"], told, reused=True, usable=usable)
    own = {"on_stage": doing} if stages.measure is _pipeline_measure else {}  # of a notebook it takes no such thing
    result = stages.measure(order.folder, order.settings, command=order.command, **own)
    entry = _entry(order, result, mark)
    doing("reports")
    with store.staging() as staged:
        stages.write(result, staged, order.settings)
        write_entry(entry, staged)
        store.install(staged, order.name)
    return Outcome(order.name, result.status, entry["headline"], usable=entry["state"] != "unusable")


def draw_again(store: Store, name: str, result: Result, stages: Stages, settings: Settings) -> None:
    """Write tables and reports of a stored result again, without measuring."""
    with store.staging() as staged:
        stages.write(result, staged, settings)
        write_entry((store.entry(name) or {}) | _drawn(result, settings), staged)
        store.install(staged, name)


def _drawn(result: Result, settings: Settings) -> dict[str, Any]:
    """What the index reads in place of a result, and the language of the reports; empty where none are drawn."""
    row, language = index_row(result), settings.report.language if settings.batch.reports else ""
    return {"state": row.state, "row": as_entry(row), "reports": language}


def _entry(order: Order, result: Result, mark: str) -> dict[str, Any]:
    reasons = [finding for finding in result.findings if finding.level == "error"]
    return {
        "schema": ENTRY_SCHEMA,
        "name": order.name,
        "id": result.specimen.id,
        "folder": result.specimen.folder,
        "status": result.status,
        "headline": result.headline or (reasons[0].message if reasons else ""),
        "said": _said(result),
        "code": reasons[0].code if reasons else None,
        **_drawn(result, order.settings),
        "fingerprint": mark,  # empty where the measurement did not come to an end: the next run tries again
    }


def _said(result: Result) -> dict[str, Any]:
    """The headline as data; of what was never measured, that of its finding."""
    from pipeline.result.headline import headline

    if result.steps:
        return headline(result).stored()
    return (result.findings[0].said if result.findings else free_text(result.headline)).stored()


def store_failure(order: Order, findings: list[FindingPart], *, trace: str | None = None) -> Outcome:
    """Store a specimen that could not be measured, with its reason; if even that fails the outcome carries it.

    ``trace``: where in the program it failed, for the provenance.
    """
    store = Store(order.out)
    provenance = {"command": order.command, "version": order.version}
    result = Result(
        status="failed",
        headline=findings[0].message,
        specimen=SpecimenPart(id=order.name, folder=str(order.folder).encode("utf-8", "replace").decode()),
        findings=findings,
        provenance=provenance if trace is None else provenance | {"traceback": trace},
    )
    entry = _entry(order, result, "")
    unstored: dict[str, Any] | None = entry
    with contextlib.suppress(OSError, InputError), store.staging() as staged:
        (staged / "result.json").write_text(to_json(result) + "\n", encoding="utf-8")
        write_entry(entry, staged)
        store.install(staged, order.name)
        store.end(order.name)
        unstored = None
    return Outcome(order.name, "failed", findings[0].message, entry=unstored, said=findings[0].said)


def store_death(order: Order, told: str, started: float) -> Outcome:
    """Store a specimen whose worker ended without an outcome, as far as its notes tell not by its own fault.

    ``started``: `time.monotonic` at its begin, s.
    """
    outcome = store_failure(order, [FindingPart.of("error", Message("specimen/worker-died.told", told=told))])
    return replace(outcome, seconds=time.monotonic() - started)
