"""Progress of a batch on stderr: a bar with rate, remaining time and failures; without a terminal a line a specimen."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

from pipeline.batch import Outcome, Tally
from pipeline.cli.speech import told
from pipeline.messages import Message


@dataclass(frozen=True)
class Show:
    """What shows a batch: called with each outcome, and with the stage that begins on a specimen."""

    ended: Callable[[Outcome, Tally], None]
    doing: Callable[[str, str], None] = lambda name, stage: None


@contextlib.contextmanager
def progress(total: int) -> Iterator[Show]:
    """Show a batch of ``total`` specimens: which one is at which stage, how many are done, how long the rest takes."""
    console = Console(file=sys.stderr, soft_wrap=True)
    if not console.is_terminal:
        yield Show(lambda outcome, tally: console.print(line(outcome, tally, total), markup=False, highlight=False))
        return
    now, rate, failed = (TextColumn(f"{{task.fields[{name}]}}", markup=False) for name in ("now", "rate", "failures"))
    bars = (BarColumn(16), MofNCompleteColumn(), TimeRemainingColumn()) if total > 1 else ()
    with Progress(SpinnerColumn(), *bars, now, rate, failed, console=console, transient=True) as bar:
        task = bar.add_task("", total=total, now="", rate="", failures="")

        def doing(name: str, stage: str) -> None:
            bar.update(task, now=f"{name[-24:]}: {told(Message(f'word.{stage}'))}")

        def ended(outcome: Outcome, tally: Tally) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = f"{60.0 * tally.done / elapsed:.1f}/min" if elapsed > 0.0 else ""
            failures = told(Message("cli.failures", count=tally.failed)) if tally.failed else ""
            bar.update(task, completed=tally.done, rate=rate, failures=failures)
            if outcome.failed:
                bar.console.print(line(outcome, tally, total), markup=False, highlight=False, style="red")

        yield Show(ended, doing)


def line(outcome: Outcome, tally: Tally, total: int) -> str:
    """One specimen in one line."""
    how = "kept" if outcome.reused else outcome.status
    text = told(Message("cli.ended", name=outcome.name, how=how, seconds=outcome.seconds))
    text = f"[{tally.done}/{total}] {text}"
    return f"{text}: {told(outcome.said or outcome.headline)}" if outcome.failed else text
