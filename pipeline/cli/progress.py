"""Progress of a batch on stderr: a bar with rate, remaining time and failures; without a terminal a line a specimen."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

from pipeline.batch import Outcome, Tally

Show = Callable[[Outcome, Tally], None]


@contextlib.contextmanager
def progress(total: int) -> Iterator[Show]:
    """Show a batch of ``total`` specimens; the function it gives is called with each outcome."""
    console = Console(file=sys.stderr, soft_wrap=True)
    if not console.is_terminal:
        yield lambda outcome, tally: console.print(line(outcome, tally, total), markup=False, highlight=False)
        return
    columns = (
        SpinnerColumn(),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failures]}"),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=total, rate="", failures="")

        def show(outcome: Outcome, tally: Tally) -> None:
            elapsed = bar.tasks[0].elapsed or 0.0
            rate = f"{60.0 * tally.done / elapsed:.1f}/min" if elapsed > 0.0 else ""
            bar.update(task, completed=tally.done, rate=rate, failures=f"{tally.failed} failed" if tally.failed else "")
            if outcome.failed:
                bar.console.print(f"[red]failed[/red] {escape(outcome.name)}: {escape(outcome.headline)}")

        yield show


def line(outcome: Outcome, tally: Tally, total: int) -> str:
    """One specimen in one line."""
    how = "kept" if outcome.reused else outcome.status
    text = f"[{tally.done}/{total}] {outcome.name}: {how} in {outcome.seconds:.1f} s"
    return f"{text}: {outcome.headline}" if outcome.failed else text
