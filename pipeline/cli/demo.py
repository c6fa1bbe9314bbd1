"""``cablebend demo``: a simulated specimen is measured as any other and compared with its truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import chosen_options, chosen_settings, language_option, settings_options
from pipeline.cli.speech import entry, table, told
from pipeline.messages import Message

if TYPE_CHECKING:
    from pipeline.result import Curve, Result

COMPARED = 5  # places along the visited range at which f_EI is laid beside the truth


@click.command(short_help="Measure a simulated specimen of known truth.")
@click.option(
    "-o", "--out", default="cablebend-demo", type=click.Path(path_type=Path, file_okay=False), show_default=True,
    help="Folder for the specimen, its truth and the results.",
)  # fmt: skip
@click.option("--seed", default=0, show_default=True, help="Chooses the cable, the camera and the noise.")
@language_option
@settings_options
@click.pass_context
def demo(
    ctx: click.Context,
    out: Path,
    seed: int,
) -> None:
    """Simulate and photograph a specimen, measure it, and print the result beside the truth."""
    from pipeline.assembly import headline
    from pipeline.batch import run_batch
    from pipeline.cli.progress import progress
    from pipeline.cli.run import exit_code
    from pipeline.result import from_json
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
    rows = [(label, *_shown(value, std, true)) for label, value, std, true in compared(result, truth)]
    click.echo("\n".join(table([heads, *rows])))


def compared(result: Result, truth: dict[str, Any]) -> list[tuple[str, float, float, float]]:
    """Label, measured value, standard deviation and truth of everything the demo knows."""
    rows: list[tuple[str, float, float, float]] = []
    inverse, balance = result.inverse, result.balance
    ways = {"inverse": inverse.curve if inverse else None, "balance": balance.curve if balance else None}
    for way, curve in ways.items():
        if curve is not None:
            rows += _stiffness(way, curve, truth)
    for way, part in (("inverse", inverse), ("balance", balance)):
        if part is not None and part.pre_curvature_per_m is not None and part.pre_curvature_std_per_m is not None:
            rows.append((f"K0, {way} [1/m]", part.pre_curvature_per_m, part.pre_curvature_std_per_m, truth["K0"]))
    for step, true in zip(result.steps, truth["steps"], strict=True):
        at = f"{step.displacement_m * 1e3:.2f} mm"
        rows.append((f"force, {at} [N]", step.force_N, step.force_std_N, true["F"]))
    return rows


def _stiffness(way: str, curve: Curve, truth: dict[str, Any]) -> list[tuple[str, float, float, float]]:
    """f_EI (tangent) at a few curvatures of the visited range."""
    import numpy as np

    seen = np.flatnonzero(curve.supported)
    law = truth["law"]
    rows = []
    for place in np.unique(np.linspace(0, len(seen) - 1, COMPARED).round().astype(int)):
        at = int(seen[place])
        kappa = curve.kappa_per_m[at]
        true = float(np.interp(kappa - truth["K0"], law["excess_per_m"], law["tangent_Nm2"]))
        label = f"f_EI({kappa:.2f} 1/m), {way} [mN m²]"
        rows.append((label, 1e3 * curve.tangent_Nm2[at], 1e3 * curve.tangent_std_Nm2[at], 1e3 * true))
    return rows


def _shown(value: float, std: float, true: float) -> tuple[str, str, str]:
    """Cells of a row: the measured value with its uncertainty, the truth to the same place, the difference in std."""
    from pipeline.rounding import fixed, rounded

    text = rounded(value, std)
    places = len(text.partition(" ")[0].partition(".")[2])
    return text, fixed(true, places), f"{fixed((value - true) / std, 1)} σ" if std > 0.0 else ""
