"""``cablebend demo``: a simulated specimen is measured as any other and compared with its truth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import chosen_options, chosen_settings, settings_options
from pipeline.cli.speech import entry, language, table, told
from pipeline.cli.spoken import Spoken
from pipeline.messages import DECIMAL, Message

if TYPE_CHECKING:
    from pipeline.result import Result, Visited

COMPARED = 5  # places along the visited range at which f_EI is laid beside the truth


@click.command(cls=Spoken)
@click.option(
    "-o", "--out", default="cablebend-demo", type=click.Path(path_type=Path, file_okay=False), show_default=True
)
@click.option("--seed", default=0, show_default=True)
@settings_options
@click.pass_context
def demo(ctx: click.Context, out: Path, seed: int) -> None:
    """Simulate and photograph a specimen, measure it, and print the result beside the truth."""
    from pipeline.batch import run_batch
    from pipeline.cli.progress import progress
    from pipeline.cli.run import exit_code
    from pipeline.result import from_json
    from pipeline.result.headline import headline
    from pipeline.simulate import demo_specimen

    settings = chosen_settings()
    specimen = out / "specimen" / f"demo-{seed}"
    specimen.mkdir(parents=True, exist_ok=True)
    click.echo(told(Message("cli.simulating")), err=True)
    truth = demo_specimen(specimen, seed, truth_file=out / f"demo-{seed}.truth.json").truth
    click.echo(told(Message("cli.measuring")), err=True)
    results = out / "results"
    with progress(1) as show:
        options = chosen_options()
        tally = run_batch([specimen], results, settings, options=options, on_outcome=show.ended, on_stage=show.doing)
    if tally.measured:
        (name,) = tally.names
        result = from_json((results / name / "result.json").read_text(encoding="utf-8"))
        echo_comparison(result, truth)
        click.echo(f"\n{entry('', told(headline(result)))}\n{results / name / 'report.html'}")
    ctx.exit(exit_code(tally))


def echo_comparison(result: Result, truth: dict[str, Any]) -> None:
    """Print f_EI, K0 and forces, measured and true, with standard deviations and the difference in these."""
    heads = [told(Message(f"cli.demo-{name}")) for name in ("quantity", "measured", "truth", "off")]
    rows = [(told(label), *_shown(value, std, true)) for label, value, std, true in compared(result, truth)]
    click.echo("\n".join(table([heads, *rows])))


def compared(result: Result, truth: dict[str, Any]) -> list[tuple[Message, float, float, float]]:
    """Label, measured value, standard deviation and truth of everything the demo knows."""
    from pipeline.result import curves

    ways = [way for way in curves(result).values() if way.method != "extended"]
    rows = [row for way in ways for row in _stiffness(way, truth)]
    for way in ways:
        label = Message("cli.demo-K0", way=way.method)
        rows.append((label, way.pre_curvature, way.pre_curvature_std, truth["K0"]))
    for step, true in zip(result.steps, truth["steps"], strict=True):
        label = Message("cli.demo-force", displacement_m=step.displacement_m)
        rows.append((label, step.force_N, step.force_std_N, true["F"]))
    return rows


def _stiffness(way: Visited, truth: dict[str, Any]) -> Iterator[tuple[Message, float, float, float]]:
    """f_EI (tangent) at a few curvatures of the visited range."""
    import numpy as np

    law = truth["law"]
    for at in np.unique(np.linspace(0, way.kappa.size - 1, COMPARED).round().astype(int)):
        kappa = way.kappa[at]
        true = float(np.interp(kappa - truth["K0"], law["excess_per_m"], law["tangent_Nm2"]))
        label = Message("cli.demo-stiffness", at_per_m=kappa, way=way.method)
        yield label, 1e3 * float(way.tangent[at]), 1e3 * float(way.tangent_std[at]), 1e3 * true


def _shown(value: float, std: float, true: float) -> tuple[str, str, str]:
    """Cells of a row: the measured value with its uncertainty, the truth to the same place, the difference in std."""
    from pipeline.rounding import alike, fixed, rounded

    sign = DECIMAL[language()]
    off = f"{fixed((value - true) / std, 1, sign)} σ" if std > 0.0 else ""
    return rounded(value, std, decimal=sign), alike(true, std, decimal=sign), off
