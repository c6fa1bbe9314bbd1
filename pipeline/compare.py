"""Two results beside each other, such as before and after a change, and whether they differ beyond their bands.

Two results -> f_EI (tangent reading) on the curvatures that both visited, with both covariances, and K0. The two share
no photo and no force, so the covariance of the difference is the sum of both; `pipeline.identify.contrast` tests the
mean log ratio over each third of the common range. K0 is tested on its own. Both p-values are doubled (Bonferroni), so
that the verdict as a whole has the level that is told. Nothing is compared outside the common range.

What no test on two results can see is said as a finding: an error of the scale that both have in common, and what
else makes a difference, or its absence, doubtful. Lengths too large by e make f_EI too large by up to 2 e: f is a
moment P y over a curvature, the one grows with the scale and the other falls.

Curvature in 1/m, f in N m^2; ratios are f_B / f_A, above one where B is stiffer. Tests are made on the logarithm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.special import ndtr

from pipeline.identify.contrast import LogCurve, p_value, parts_difference
from pipeline.messages import Message
from pipeline.records import Array, Finding, doubtful, inferred
from pipeline.result import Result, Visited, leading
from pipeline.result.visited import html_table

# Findings of a measurement that make its scale, length or fit doubtful, and so a comparison with it; besides them the
# one that comes before all its numbers.
DOUBTS = ("identify/scale", "identify/length", "identify/misfit-shape", "identify/misfit-force", "length/traced")
TESTS = 2

LEAST_OVERLAP = 0.5
"""Share of the larger visited range; below it most of a curve is not compared."""

OTHER_LENGTH = 0.02
"""Relative; lengths that differ by more are another set-up: covers and rigid ends then weigh differently."""


@dataclass(frozen=True)
class Difference:
    """A number in both results: B minus A with its standard deviation, and the p-value of no difference."""

    a: float
    b: float
    difference: float
    std: float
    p_value: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """What two results say about each other.

    Attributes
    ----------
    a, b : str
        Names of the specimens.
    methods : (str, str)
        Way that each answers with.
    verdict : {"differ", "no difference seen", "not comparable"}
    said : Message
        The outcome in plain words; `statement` in English.
    range_per_m : (low, high) or None
        Curvatures that both visited.
    kappa_per_m, ratio, ratio_std : (n,)
        f_B / f_A along the range, with its pointwise standard deviation.
    rms_relative, max_relative : float or None
        Of f_B / f_A - 1.
    mean_stiffness : Difference or None
        Geometric mean of f over the range, N m^2.
    p_characteristic : float or None
        Of a difference as large as this where both have one characteristic; None without covariances.
    pre_curvature : Difference or None
        1/m.
    level : float
        Of the verdict: both tests together.
    findings : tuple of Finding
    """

    a: str
    b: str
    methods: tuple[str, str]
    verdict: str
    said: Message
    level: float
    range_per_m: tuple[float, float] | None = None
    kappa_per_m: Array = field(default_factory=lambda: np.empty(0))
    ratio: Array = field(default_factory=lambda: np.empty(0))
    ratio_std: Array = field(default_factory=lambda: np.empty(0))
    rms_relative: float | None = None
    max_relative: float | None = None
    mean_stiffness: Difference | None = None
    p_characteristic: float | None = None
    pre_curvature: Difference | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def statement(self) -> str:
        """The outcome in plain words."""
        return str(self.said)

    def _repr_html_(self) -> str:
        """Show the comparison in a notebook."""
        rows = [(self.verdict, self.statement), *((finding.level, str(finding.said)) for finding in self.findings)]
        return html_table(f"{self.a} and {self.b}", rows)


def compare(a: Result, b: Result, *, level: float = 0.05) -> Comparison:
    """Compare two results that were measured apart.

    Parameters
    ----------
    a, b : Result
    level : float
        Of both tests together, of f_EI and of K0: one false difference in twenty.

    Returns
    -------
    Comparison
        ``not comparable`` where a characteristic is missing or not usable, or no curvature was visited by both.
    """
    one, two = a.answer.curve, b.answer.curve
    names = (a.specimen.id, b.specimen.id)
    nothing = partial(Comparison, *names, verdict="not comparable", level=level)
    if one is None or two is None:
        lacking = [r.specimen.id for r, curve in ((a, one), (b, two)) if curve is None]
        return nothing(methods=("", ""), said=Message("comparison.no-curve", names=lacking))
    methods = (one.method, two.method)
    unusable = [r for r in (a, b) if not r.answer.usable]
    faults = [Message("comparison.unusable", name=r.specimen.id, reason=r.answer.said) for r in unusable]
    negative = [r.specimen.id for r, c in ((a, one), (b, two)) if np.any(c.tangent <= 0.0)]
    faults += [Message("comparison.not-positive", name=name) for name in negative]
    if faults:
        return nothing(methods=methods, said=Message("sentences", sentences=faults))
    first, second = _log_curve(one), _log_curve(two)
    grid = first.common_grid(second)
    if grid is None:
        ranges = [Message("comparison.range", low_per_m=c.kappa[0], high_per_m=c.kappa[-1]) for c in (one, two)]
        return nothing(methods=methods, said=Message("comparison.no-range", ranges=ranges))
    ratio = np.exp(second.log_on(grid) - first.log_on(grid))
    bands = first.onto(grid) @ first.log_covariance @ first.onto(grid).T
    bands += second.onto(grid) @ second.log_covariance @ second.onto(grid).T
    known = one.factor.shape[1] > 0 and two.factor.shape[1] > 0
    covariance = first.parts_covariance(grid) + second.parts_covariance(grid)
    p = p_value(parts_difference(first, second, grid), covariance) if known else None
    apart = float(np.hypot(one.pre_curvature_std, two.pre_curvature_std))
    rest = _difference(one.pre_curvature, two.pre_curvature, apart)
    mean = _mean(first, second, grid, bands)
    verdict, said = _verdict(names, p, rest, mean, ratio, level)
    return Comparison(
        *names,
        methods=methods,
        verdict=verdict,
        said=said,
        range_per_m=(float(grid[0]), float(grid[-1])),
        kappa_per_m=grid,
        ratio=ratio,
        ratio_std=ratio * np.sqrt(np.maximum(np.diag(bands), 0.0)),
        rms_relative=float(np.sqrt(np.mean((ratio - 1.0) ** 2))),
        max_relative=float(np.max(np.abs(ratio - 1.0))),
        mean_stiffness=mean,
        p_characteristic=p,
        pre_curvature=rest,
        level=level,
        findings=tuple(_findings(a, b, (one, two), mean)),
    )


def _log_curve(curve: Visited) -> LogCurve:
    """The curve with the covariance of log f; without a factor all errors have one sign: the widest band of a mean."""
    factor = curve.factor if curve.factor.shape[1] else curve.tangent_std[:, None]
    relative = factor / curve.tangent[:, None]
    return LogCurve(curve.kappa, curve.tangent, relative @ relative.T)


def _mean(first: LogCurve, second: LogCurve, grid: Array, bands: Array) -> Difference:
    """Geometric mean stiffness over the range; the test is that of the logarithms."""
    log_a, log_b = float(np.mean(first.log_on(grid))), float(np.mean(second.log_on(grid)))
    tested = _difference(log_a, log_b, float(np.sqrt(max(float(np.mean(bands)), 0.0))))
    a, b = float(np.exp(log_a)), float(np.exp(log_b))
    return Difference(a, b, b - a, tested.std * float(np.sqrt(a * b)), tested.p_value)


def _difference(a: float, b: float, std: float) -> Difference:
    z = abs(b - a) / std if std > 0.0 else (0.0 if a == b else float("inf"))
    return Difference(a, b, b - a, std, float(2.0 * ndtr(-float(z))))


def _verdict(
    names: tuple[str, str], p: float | None, rest: Difference, mean: Difference, ratio: Array, level: float
) -> tuple[str, Message]:
    """Verdict and statement, by the p of the whole curves (None where it is not known), K0 and the mean stiffness."""
    sizes = {"rms": np.sqrt(np.mean((ratio - 1.0) ** 2)), "most": np.max(np.abs(ratio - 1.0))}
    if p is None:
        return "not comparable", Message("comparison.no-covariance", **sizes)
    seen = []
    if min(1.0, TESTS * p) < level:
        seen.append(Message("comparison.curve", p=p, stiffer=names[mean.difference > 0.0]))
    if min(1.0, TESTS * rest.p_value) < level:
        seen.append(Message("comparison.rest", by_per_m=(rest.difference, rest.std), p=rest.p_value))
    if seen:
        return "differ", Message("comparison.differ", seen=seen, a=names[0], b=names[1], **sizes)
    least = 2.0 * mean.std / mean.a
    return "no difference seen", Message("comparison.alike", p=p, least=least, a=names[0], b=names[1], **sizes)


def _findings(a: Result, b: Result, curves: tuple[Visited, Visited], mean: Difference) -> Iterator[Finding]:
    """What makes the comparison doubtful."""
    yield from _scale_findings(a, b, mean)
    lengths = [r.specimen.length_m for r in (a, b) if r.specimen.length_m is not None]
    if len(lengths) == len(curves) and max(lengths) > (1.0 + OTHER_LENGTH) * min(lengths):
        yield doubtful("compare/length", lengths_m=[Message("length", value_m=length) for length in lengths])
    spans = [float(c.kappa[-1] - c.kappa[0]) for c in curves]
    common = min(float(c.kappa[-1]) for c in curves) - max(float(c.kappa[0]) for c in curves)
    if common < LEAST_OVERLAP * max(spans):
        yield doubtful("compare/range", share=common / max(spans))
    if curves[0].method != curves[1].method:
        yield doubtful("compare/method", a=curves[0].method, b=curves[1].method)
    for result in (a, b):
        fault = leading(result.findings)
        doubts = [f.said for f in result.findings if f is fault or (f.code in DOUBTS and f.level != "info")]
        if result.diagnosis is not None and result.diagnosis.verdict == "unexplained":
            doubts.append(Message("compare/doubt.unexplained"))
        if doubts:
            yield doubtful("compare/doubt", name=result.specimen.id, doubts=doubts)


def _scale_findings(a: Result, b: Result, mean: Difference) -> Iterator[Finding]:
    """Scales: an error in common cannot show, one of a single result passes for a difference."""
    if a.scale is None or b.scale is None:
        return
    if (a.scale.source, a.scale.px_per_mm) == (b.scale.source, b.scale.px_per_mm):
        yield inferred("compare/scale-shared", px_per_mm=a.scale.px_per_mm, source=a.scale.said)
        return
    share = 2.0 * float(np.hypot(a.scale.std_relative, b.scale.std_relative))
    size, std = abs(float(np.log(mean.b / mean.a))), mean.std / mean.a
    sources = {"a": a.scale.said, "b": b.scale.said}
    if size < 3.0 * share:
        level = doubtful if size > 2.0 * std else inferred
        yield level("compare/scale", share=share, size=size, half=0.5 * size, **sources)
