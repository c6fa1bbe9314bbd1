"""``cablebend predict``: forces and shapes of a new experiment by the model that a result holds."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli.options import POSITIVE, language_option
from pipeline.cli.speech import complaint, entry, note, told
from pipeline.cli.spoken import Spoken, wrong_use
from pipeline.messages import Message

if TYPE_CHECKING:
    from pipeline.predict import Prediction
    from pipeline.records import Finding

MISSING = 3


def metres(ctx: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[float]:
    """Millimetres between commas, of every time the option is given, in metres."""
    try:
        return [1e-3 * float(number) for text in texts for number in text.split(",")]
    except ValueError as error:
        raise wrong_use("cli.no-list", text=" ".join(texts)) from error


@click.command(cls=Spoken)
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--displacement-mm", "displacements_m", required=True, multiple=True, callback=metres, metavar="MM[,MM...]"
)
@click.option("--length-mm", type=POSITIVE)
@click.option("--zero", default="natural", show_default=True, type=click.Choice(["natural", "length"]))
@click.option("--extrapolate", is_flag=True)
@click.option("--json", "as_json", is_flag=True)
@click.option("-o", "--out", type=click.Path(path_type=Path, dir_okay=False))
@language_option
@click.pass_context
def predict(
    ctx: click.Context, /, result: Path, length_mm: float | None, as_json: bool, out: Path | None, **asked: Any
) -> None:
    """Predict forces and shapes of a new experiment by the model identified in RESULT."""
    from pipeline.predict import predict as predicted
    from pipeline.result import read_result

    measured = read_result(result)
    name, answer = measured.specimen.id, measured.answer
    if answer.method is not None and not answer.usable:
        unusable = Message("comparison.unusable", name=name, reason=answer.said)
        note(Message("sentences", sentences=[unusable]))
        ctx.exit(MISSING)
    try:
        prediction = predicted(measured, length_m=None if length_mm is None else 1e-3 * length_mm, **asked)
    except ValueError as error:
        raise click.UsageError(complaint(error)) from error
    except ArithmeticError as error:
        raise wrong_use("cli.no-cable", path=result, why=str(error)) from error
    if prediction is None:
        note(Message("prediction.no-curve", name=name))
        ctx.exit(MISSING)
    if out is not None:
        from pipeline.report.frames import prediction_frame
        from pipeline.report.tables import write_csv

        write_csv(prediction_frame(prediction), out)
    if as_json:
        click.echo(json.dumps(as_document(prediction), indent=1))
    else:
        echo_prediction(prediction)
    done = sum(step.force_N is not None for step in prediction.steps)
    ctx.exit(0 if done == len(prediction.steps) else 1 if done else MISSING)


def as_document(prediction: Prediction) -> dict[str, object]:
    """The prediction as plain values."""
    steps = [asdict(step) | {"reason": step.reason} for step in prediction.steps]
    for step in steps:
        del step["said"]
    return asdict(prediction) | {"steps": steps, "findings": [finding.document for finding in prediction.findings]}


def echo_prediction(prediction: Prediction) -> None:
    """One line a step, below it what limits the prediction."""
    low, high = prediction.visited_per_m
    known = {"length_mm": 1e3 * prediction.length_m, "low_per_m": low, "high_per_m": high}
    rest = (prediction.pre_curvature_per_m, prediction.pre_curvature_std_per_m)
    model = Message("prediction.model", name=prediction.specimen, method=prediction.method, K0_per_m=rest, **known)
    click.echo(entry("", told(model)))
    for step in prediction.steps:
        values: dict[str, object] = {}
        if step.force_N is not None and step.force_std_N is not None:
            top = max(range(len(step.y_m)), key=lambda i: step.y_m[i])
            values["force_N"] = (step.force_N, step.force_std_N)
            values["rise_m"] = (step.y_m[top], step.y_std_m[top])
            values["bend_per_m"] = (step.kappa_max_per_m, max(step.kappa_std_per_m))
        shown = told(Message("prediction.step", **values)) if values else ""
        status = Message("prediction.status", status=step.status.replace(" ", "-"), said=step.said)
        why = told(status) if step.said else ""
        at = told(Message("prediction.at", displacement_mm=1e3 * step.displacement_m))
        click.echo(entry(f"{at:>12}  ", "  ".join(filter(None, (shown, why)))))
    if prediction.reachable_m is not None:
        click.echo(told(Message("prediction.reachable", reach_mm=1e3 * prediction.reachable_m)), err=True)
    echo_findings(prediction.findings)


def echo_findings(findings: Iterable[Finding]) -> None:
    """What a reader must know besides, on stderr."""
    for finding in findings:
        level = told(Message("word." + finding.level))
        click.echo(entry(f"{level}: ", f"{told(finding.said)} [{finding.code}]"), err=True)
