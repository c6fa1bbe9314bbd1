"""What identification noticed: contradictions between photos, log and model, each with its figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtrc, ndtri

from pipeline.identify.identification import Identification
from pipeline.messages import Message, ended
from pipeline.records import Finding, Level, doubtful
from pipeline.settings.identify import IdentifySettings
from rod.balance import BalanceOutcome
from rod.inverse import InverseOutcome
from rod.measurement import MeasuredTest

CHANCE = 1e-4
"""Of noise alone that one comparison is told as a contradiction: rare over the twenty of a test, and over many."""

SIGMA = float(ndtri(1.0 - 0.5 * CHANCE))
"""Standard deviations that correspond."""

BRANCH_LEVEL = 0.01
"""Level of the test whether loading and unloading show the same characteristic."""


def identification_findings(found: Identification, settings: IdentifySettings) -> tuple[Finding, ...]:
    """All findings of an identification, in the order a reader needs them."""
    return (
        *_outcomes(found),
        *force_findings(found.test),
        *chord_findings(found.test, settings),
        *_pre_curvature(found),
        *_nuisances(found),
        *_misfit(found),
        *_comparisons(found),
    )


def _outcomes(found: Identification) -> Iterator[Finding]:
    inverse, graph = found.inverse.outcome, found.balance.outcome
    if inverse is not InverseOutcome.CONVERGED:
        level: Level = "warning" if inverse is InverseOutcome.NOT_VISIBLE else "error"
        open_ = [_open(*one) for one in found.inverse.invisible]
        said = Message("way.inverse-open" if open_ else "way.inverse", outcome=ended(inverse), open=open_)
        yield Finding(f"identify/inverse-{inverse.name.lower().replace('_', '-')}", level, said)
    if graph is not BalanceOutcome.MEASURED:
        said = Message("way.balance", outcome=ended(graph))
        yield Finding(f"identify/balance-{graph.name.lower().replace('_', '-')}", "warning", said)


def _open(kappa: float | None, std: float) -> Message:
    """What the data leave open, as of `rod.inverse.estimate.invisible_combinations`."""
    if kappa is None:
        return Message("open.rest", std_per_m=std)
    return Message("open.stiffness", at_per_m=kappa, std=std)


def force_findings(test: MeasuredTest) -> Iterator[Finding]:
    """The load cell's zero in the force-free step."""
    for step in test.steps:
        if step.branch == "mounted" and abs(step.force) > SIGMA * step.force_std:
            z = abs(step.force) / step.force_std
            yield doubtful("identify/force-zero", force_N=(step.force, step.force_std), step=step.step, z=z)


def chord_findings(test: MeasuredTest, settings: IdentifySettings) -> Iterator[Finding]:
    """Chord change on the photos against displacement in the log."""
    both = [s for s in test.steps if s.chord is not None and s.displacement is not None]
    if len(both) < 2:
        return
    chord = np.array([s.chord for s in both], dtype=float)
    moved = np.array([s.displacement for s in both], dtype=float)
    logged = np.hypot([s.displacement_std or 0.0 for s in both], settings.displacement_std_m)
    std = np.hypot([s.chord_std or 0.0 for s in both], logged)
    zero = np.average(chord + moved, weights=1.0 / std**2)
    off = chord + moved - zero
    worst = int(np.argmax(np.abs(off) / std))
    # The scale of the photos may be off by its own standard deviation; its part grows with the way.
    allowed = SIGMA * np.hypot(std[worst], test.scale_std * np.ptp(moved))
    if abs(off[worst]) > allowed:
        if np.ptp(moved) == 0.0:
            yield doubtful("identify/chord-displacement.one", spread_m=np.ptp(chord))
            return
        slope = -np.polyfit(moved, chord, 1)[0]
        way = "apart" if slope < 0.0 else "approach"
        yield doubtful(
            "identify/chord-displacement",
            off_m=abs(off[worst]),
            step=both[worst].step,
            z=abs(off[worst]) / std[worst],
            approach=Message(f"identify/chord-displacement.{way}", share=slope),
        )


def _pre_curvature(found: Identification) -> Iterator[Finding]:
    sources = pre_curvature_sources(found)
    if "photo" not in sources:
        return
    photo, photo_std = sources["photo"]
    for name, (value, std) in sources.items():
        z = abs(value - photo) / np.hypot(std, photo_std)
        if name != "photo" and z > SIGMA:
            seen = {"photo_per_m": photo, "photo_std_per_m": photo_std, "value_per_m": value, "std_per_m": std}
            yield doubtful(f"identify/pre-curvature-{name}", **seen, z=z)


def pre_curvature_sources(found: Identification) -> dict[str, tuple[float, float]]:
    """K0 and its std by independent sources, 1/m: force-free photo, balance and inverse without that photo."""
    sources = {} if found.rest is None else {"photo": found.rest}
    for name, law in (("balance", found.balance.law), ("inverse", found.inverse.law)):
        if law is not None and np.isfinite(law.loaded_pre_curvature) and np.isfinite(law.loaded_pre_curvature_std):
            sources[name] = (law.loaded_pre_curvature, law.loaded_pre_curvature_std)
    return sources


def _nuisances(found: Identification) -> Iterator[Finding]:
    for name, (value, _, before) in found.inverse.nuisances.items():
        z, given = abs(value) / before, found.test.length
        if z > SIGMA and name == "length":
            yield doubtful("identify/length", fitted_m=given + value, given_m=given, z=z)
        elif z > SIGMA and name == "scale":
            yield doubtful("identify/scale", change=value, z=z)


def _misfit(found: Identification) -> Iterator[Finding]:
    for kind in ("shape", "force"):
        chi2, count = found.inverse.chi2(kind)
        if count and chdtrc(count, chi2) < CHANCE:
            yield doubtful(f"identify/misfit-{kind}", rms=np.sqrt(chi2 / count))


def _comparisons(found: Identification) -> Iterator[Finding]:
    laws = [branch.law for branch in found.branches.values() if branch.law is not None]
    if found.branches_p is not None and found.branches_p < BRANCH_LEVEL:
        one, two = ((law.pre_curvature, law.pre_curvature_std) for law in laws)  # loading, unloading
        told = {"one_per_m": one[0], "one_std_per_m": one[1], "two_per_m": two[0], "two_std_per_m": two[1]}
        yield doubtful("identify/branches", **told, p=found.branches_p)
    agreement = found.agreement
    if agreement is not None and not agreement.compatible:
        figures = {"rms": agreement.rms_relative, "p": agreement.p_value}
        yield doubtful("identify/agreement", **figures, hints=agreement.hints)
