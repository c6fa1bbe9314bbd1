"""``cablebend predict``: forces and shapes of a new experiment by the model that a result holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, settings_options

if TYPE_CHECKING:
    from pipeline.predict import Prediction

MISSING = 3


def millimetres(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[float]:
    """Numbers between commas, of every time the option is given."""
    try:
        return [float(number) for text in texts for number in text.split(",")]
    except ValueError as error:
        raise click.BadParameter(f"{' '.join(texts)!r} is no list of numbers such as 5,10,15.") from error


@click.command(short_help="Forces and shapes of a new experiment.")
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--displacement-mm", "displacements_mm", required=True, multiple=True, callback=millimetres,
    metavar="MM[,MM...]", help="Displacement of each step; repeatable.",
)  # fmt: skip
@click.option("--length-mm", type=POSITIVE, help="Cable length; that of the specimen.")
@click.option(
    "--zero", default="natural", show_default=True, type=click.Choice(["natural", "length"]),
    help="Displacement is counted from the mounted, force-free cable, or from the chord that equals the length.",
)  # fmt: skip
@click.option("--extrapolate", is_flag=True, help="Compute steps beyond the visited curvatures too, and mark them.")
@click.option("--json", "as_json", is_flag=True, help="Everything as JSON on stdout.")
@click.option(
    "-o", "--out", type=click.Path(path_type=Path, dir_okay=False), help="CSV of forces and shapes with bands."
)
@settings_options
@click.pass_context
def predict(
    ctx: click.Context,
    result: Path,
    displacements_mm: list[float],
    length_mm: float | None,
    zero: Any,
    extrapolate: bool,
    as_json: bool,
    out: Path | None,
    settings_file: Path | None,
    assignments: tuple[str, ...],
) -> None:
    """Predict forces and shapes of a new experiment by the model identified in RESULT.

    RESULT is a result.json or its folder. Steps that bend the cable more than it was ever bent are refused.

    A result that is not usable is refused: its numbers are none of the cable's.

    Exit codes: 0 all steps predicted; 1 some were refused; 3 nothing could be predicted.
    """
    from pipeline.cli.configuration import read_settings
    from pipeline.predict import predict as predicted
    from pipeline.result import read_result

    settings = read_settings(settings_file, assignments)
    measured = read_result(result)
    told = measured.answer
    if told.method is not None and not told.usable:
        click.echo(f"cablebend: {measured.specimen.id} is not usable: {told.reason.rstrip('.')}.", err=True)
        ctx.exit(MISSING)
    if length_mm is None and measured.specimen.length_m is None:
        raise click.UsageError("the result tells no length: give --length-mm")
    try:
        prediction = predicted(
            measured,
            [1e-3 * d for d in displacements_mm],
            length_m=None if length_mm is None else 1e-3 * length_mm,
            zero=zero,
            extrapolate=extrapolate,
            settings=settings.predict,
        )
    except ValueError as error:
        raise click.UsageError(f"{error}.") from error
    except ArithmeticError as error:
        raise click.UsageError(f"the numbers of {result} are none of a cable ({error}).") from error
    if prediction is None:
        click.echo(f"cablebend: {measured.specimen.id} holds no characteristic to predict with", err=True)
        ctx.exit(MISSING)
    if out is not None:
        from pipeline.report.frames import prediction_frame
        from pipeline.report.tables import write_csv

        write_csv(prediction_frame(prediction), out)
    if as_json:
        from dataclasses import asdict

        click.echo(json.dumps(asdict(prediction), indent=1))
    else:
        echo_prediction(prediction)
    done = sum(step.force_N is not None for step in prediction.steps)
    ctx.exit(0 if done == len(prediction.steps) else 1 if done else MISSING)


def echo_prediction(prediction: Prediction) -> None:
    """One line a step, below it what limits the prediction."""
    from pipeline.rounding import plain, rounded

    low, high = prediction.visited_per_m
    start = rounded(prediction.pre_curvature_per_m, prediction.pre_curvature_std_per_m)
    click.echo(
        f"{prediction.specimen} ({prediction.method}), {plain(1e3 * prediction.length_m, 4)} mm long, "
        f"K0 {start} 1/m, f_EI known from {plain(low, zeros=True)} to {plain(high, zeros=True)} 1/m"
    )
    for step in prediction.steps:
        shown = f"{plain(1e3 * step.displacement_m, 4):>8} mm  "
        if step.force_N is None:
            click.echo(f"{shown}{step.status}: {step.reason}")
            continue
        top = max(range(len(step.y_m)), key=lambda i: step.y_m[i])
        rise = rounded(1e3 * step.y_m[top], 1e3 * step.y_std_m[top])
        bend = rounded(step.kappa_max_per_m, max(step.kappa_std_per_m))
        note = f"  {step.status}: {step.reason}" if step.reason else ""
        click.echo(f"{shown}P {rounded(step.force_N, step.force_std_N)} N, rise {rise} mm, kappa to {bend} 1/m{note}")
    if prediction.reachable_m is not None:
        click.echo(f"within the visited range up to {plain(1e3 * prediction.reachable_m, 4)} mm", err=True)
    for finding in prediction.findings:
        click.echo(f"{finding.level}: {finding.message} [{finding.code}]", err=True)
