"""``cablebend compare``: whether two results differ beyond their bands."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli.options import language_option
from pipeline.cli.predict import MISSING, echo_findings
from pipeline.cli.speech import entry, say, told
from pipeline.cli.spoken import Spoken

if TYPE_CHECKING:
    from pipeline.compare import Comparison


@click.command(cls=Spoken)
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True)
@click.option("-o", "--out", type=click.Path(path_type=Path, dir_okay=False))
@language_option
@click.pass_context
def compare(ctx: click.Context, a: Path, b: Path, as_json: bool, out: Path | None) -> None:
    """Say whether the results A and B differ beyond their bands."""
    from pipeline.compare import compare as compared
    from pipeline.result import read_result

    comparison = compared(read_result(a), read_result(b))
    if out is not None:
        from pipeline.report.frames import comparison_frame
        from pipeline.report.tables import write_csv

        write_csv(comparison_frame(comparison), out)
    if as_json:
        click.echo(json.dumps(as_document(comparison), indent=1, default=lambda array: array.tolist()))
    else:
        echo_comparison(comparison)
    ctx.exit(MISSING if comparison.verdict == "not comparable" else 0)


def as_document(comparison: Comparison) -> dict[str, object]:
    """The comparison as plain values and arrays."""
    document = {name: value for name, value in asdict(comparison).items() if name != "said"}
    findings = [finding.document for finding in comparison.findings]
    return document | {"statement": comparison.statement, "findings": findings}


def echo_comparison(comparison: Comparison) -> None:
    """The statement, the numbers behind it, and what makes it doubtful."""
    click.echo(entry("", told(comparison.said)))
    if comparison.range_per_m is not None:
        low, high = comparison.range_per_m
        say("comparison.compared", a=comparison.methods[0], b=comparison.methods[1], low_per_m=low, high_per_m=high)
    mean, rest = comparison.mean_stiffness, comparison.pre_curvature
    if mean is not None:
        change = (mean.difference / mean.a, mean.std / mean.a)
        say("comparison.mean", a_mNm2=1e3 * mean.a, b_mNm2=1e3 * mean.b, change=change)
    if rest is not None:
        say("comparison.pre-curvature", difference_per_m=(rest.difference, rest.std), p=rest.p_value)
    if comparison.p_characteristic is not None:
        say("comparison.level", p=comparison.p_characteristic, level=comparison.level)
    echo_findings(comparison.findings)
