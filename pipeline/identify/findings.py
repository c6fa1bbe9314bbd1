"""What identification noticed: contradictions between photos, log and model, each as one sentence with its figures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtrc

from pipeline.identify.identification import Identification
from pipeline.records import Finding, Level
from pipeline.rounding import p_value
from pipeline.settings.identify import IdentifySettings
from pipeline.units import quantity
from rod.balance import BalanceOutcome
from rod.inverse import InverseOutcome
from rod.measurement import MeasuredTest


def identification_findings(found: Identification, settings: IdentifySettings) -> tuple[Finding, ...]:
    """All findings of an identification, in the order a reader needs them."""
    return (
        *_outcomes(found),
        *force_findings(found.test, settings),
        *chord_findings(found.test, settings),
        *_pre_curvature(found, settings),
        *_nuisances(found, settings),
        *_misfit(found, settings),
        *_comparisons(found, settings),
    )


def _outcomes(found: Identification) -> Iterator[Finding]:
    inverse, graph = found.inverse.outcome, found.balance.outcome
    if inverse is not InverseOutcome.CONVERGED:
        level: Level = "warning" if inverse is InverseOutcome.NOT_VISIBLE else "error"
        named = f"; open: {'; '.join(found.inverse.invisible)}" if found.inverse.invisible else ""
        yield Finding(f"identify/inverse-{_code(inverse.name)}", level, f"inverse problem: {inverse.value}{named}")
    if graph is not BalanceOutcome.MEASURED:
        yield Finding(f"identify/balance-{_code(graph.name)}", "warning", f"balance equations: {graph.value}")


def _code(name: str) -> str:
    return name.lower().replace("_", "-")


def force_findings(test: MeasuredTest, settings: IdentifySettings) -> Iterator[Finding]:
    """Sign of the forces, and the load cell's zero in the force-free step."""
    loaded = [step.force for step in test.steps if step.branch != "mounted"]
    if loaded and np.median(loaded) < 0.0:
        yield Finding(
            "identify/force-sign",
            "warning",
            f"the forces of the loaded steps are tension (median {quantity(float(np.median(loaded)), 'N')}), but a "
            "cable pushed together is compressed; if the log counts compression as negative, set "
            'rig.force_sign = "tension"',
        )
    for step in test.steps:
        if step.branch == "mounted" and abs(step.force) > settings.force_zero_sigma * step.force_std:
            yield Finding(
                "identify/force-zero",
                "warning",
                f"the load cell reads {quantity(step.force, 'N', step.force_std)} in the force-free step {step.step}, "
                f"{abs(step.force) / step.force_std:.1f} standard deviations from zero",
            )


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
    allowed = settings.chord_sigma * np.hypot(std[worst], test.scale_std * np.ptp(moved))
    if abs(off[worst]) > allowed:
        if np.ptp(moved) == 0.0:
            yield Finding(
                "identify/chord-displacement",
                "warning",
                f"the chords on the photos differ by {1e3 * np.ptp(chord):.3f} mm, but the log has one displacement "
                "for all steps",
            )
            return
        slope = -np.polyfit(moved, chord, 1)[0]
        approach = f"on the photos the bearings approach by {100.0 * slope:.1f} % of what the log says"
        if slope < 0.0:
            approach = (
                "on the photos the bearings move apart where the log pushes them together: is their order reversed?"
            )
        yield Finding(
            "identify/chord-displacement",
            "warning",
            f"chord on the photos and displacement in the log disagree by up to {1e3 * abs(off[worst]):.3f} mm (step "
            f"{both[worst].step}, {abs(off[worst]) / std[worst]:.0f} standard deviations); {approach}",
        )


def _pre_curvature(found: Identification, settings: IdentifySettings) -> Iterator[Finding]:
    sources = pre_curvature_sources(found)
    if "photo" not in sources:
        return
    photo, photo_std = sources["photo"]
    for name, what in (("inverse", "the fit"), ("balance", "the zero of the moment")):
        if name not in sources:
            continue
        value, std = sources[name]
        z = (value - photo) / np.hypot(std, photo_std)
        if abs(z) > settings.pre_curvature_sigma:
            yield Finding(
                f"identify/pre-curvature-{name}",
                "warning",
                f"the force-free photo shows a pre-curvature of {photo:.3f} +- {photo_std:.3f} 1/m, {what} of the "
                f"loaded photos says {value:.3f} +- {std:.3f} 1/m ({abs(z):.1f} standard deviations apart)",
            )


def pre_curvature_sources(found: Identification) -> dict[str, tuple[float, float]]:
    """K0 and its std by independent sources, 1/m: force-free photo, balance and inverse without that photo."""
    sources = {} if found.rest is None else {"photo": found.rest}
    for name, law in (("balance", found.balance.law), ("inverse", found.inverse.law)):
        if law is not None and np.isfinite(law.loaded_pre_curvature) and np.isfinite(law.loaded_pre_curvature_std):
            sources[name] = (law.loaded_pre_curvature, law.loaded_pre_curvature_std)
    return sources


def _nuisances(found: Identification, settings: IdentifySettings) -> Iterator[Finding]:
    model, u = found.inverse.model, found.inverse.unknowns
    if model is None:
        return
    pulls = {name: float(u[model.index(name)]) for name in ("length", "scale")}
    texts = {
        "length": f"the fitted length is {1e3 * model.cable_length(u):.2f} mm, {1e3 * model.length:.2f} mm were given",
        "scale": f"the photos fit better at a scale changed by {100 * model.nuisance(u, 'scale'):.2f} %",
    }
    for name, pull in pulls.items():
        if abs(pull) > settings.nuisance_sigma:
            yield Finding(
                f"identify/{name}", "warning", f"{texts[name]} ({abs(pull):.1f} of its standard deviations away)"
            )


def _misfit(found: Identification, settings: IdentifySettings) -> Iterator[Finding]:
    evaluation = found.inverse.evaluation
    if evaluation is None:
        return
    for kind, what in (("shape", "shapes"), ("force", "forces")):
        chi2, count = evaluation.chi2(kind)
        if count and chdtrc(count, chi2) < settings.misfit_level:
            yield Finding(
                f"identify/misfit-{kind}",
                "warning",
                f"the simulation leaves residuals in the {what} beyond their noise, "
                f"{np.sqrt(chi2 / count):.1f} standard deviations rms; the diagnosis looks for the cause",
            )


def _comparisons(found: Identification, settings: IdentifySettings) -> Iterator[Finding]:
    laws = [branch.law for branch in found.branches.values() if branch.law is not None]
    if found.branches_p is not None and found.branches_p < settings.branch_level:
        one, two = laws  # loading, unloading
        yield Finding(
            "identify/branches",
            "warning",
            "loading and unloading show different characteristics: pre-curvature "
            f"{one.pre_curvature:.3f} +- {one.pre_curvature_std:.3f} against "
            f"{two.pre_curvature:.3f} +- {two.pre_curvature_std:.3f} 1/m ({p_value(found.branches_p)}); "
            "the common fit is a mean of both",
        )
    agreement = found.agreement
    if agreement is not None and not agreement.compatible:
        yield Finding(
            "identify/agreement",
            "warning",
            f"inverse and balance differ by {100.0 * agreement.rms_relative:.1f} % rms, more than their joint "
            f"uncertainty ({p_value(agreement.p_value)}); " + "; ".join(agreement.hints),
        )
