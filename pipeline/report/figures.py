"""The figures of mechanics: characteristic, moment curve, pointwise graph, forces, curvature of all photos.

Each function fills a matplotlib figure (or a part of one) and returns the axes with the data. Axes: curvature kappa in
1/m, tangent bending stiffness f_EI = dm/dkappa in N m^2 with a prefix, moment m in N m, force P in N (compression
positive), displacement in mm. Bands hold the share of normal errors named in the settings.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.report.canvas import DASHES, LIGHT, NOISE, ONE_ROW, Area, finish, noise_band, plot_area, step_colours
from pipeline.report.maps import extended_map
from pipeline.report.ruling import Ruling
from pipeline.report.words import Words
from pipeline.result import Result, StepPart, Visited, curves, set_aside, trusted, visited
from pipeline.units import Unit

MARKERS = {"mounted": "D", "loading": "o", "unloading": "s"}
# Pointwise ratios are 0/0 at mid-span and at the ends; beyond twice the curve they only squeeze what can be read.
POINTWISE_HEADROOM = 2.0
SET_ASIDE = "set-aside"
"""Mark of what a reader switches on; `canvas` makes it a class of the page."""


def stiffness_unit(result: Result, words: Words) -> Unit:
    """Unit of bending stiffness for all of a report: that of what is drawn in full."""
    return words.unit("N m²", *(v for curve in _drawn(result) for v in curve.tangent))


def _drawn(result: Result) -> list[Visited]:
    """The curves but those that are set aside, which may be of any size."""
    return [curve for method, curve in trusted(result).items() if method not in set_aside(result)]


def force_unit(result: Result, words: Words) -> Unit:
    """Unit of force for all of a report."""
    return words.unit("N", *(step.force_N for step in result.steps))


def draw_characteristic(figure: Area, result: Result, words: Words) -> Axes:
    """Draw f_EI: the answer with its band in front, others behind, those that are set aside faint and without a band.

    What was never visited is shaded.
    """
    axes, unit, aside = plot_area(figure), stiffness_unit(result, words), set_aside(result)
    answering = result.answer.method
    parts = dict(sorted(curves(result).items(), key=lambda item: item[0] != answering))  # the answer leads the legend
    counted = [curve for method, curve in parts.items() if method not in aside]
    low, high = min(c.kappa[0] for c in counted), max(c.kappa[-1] for c in counted)
    margin = 0.14 * (high - low)
    left = min(0.0, low) if abs(low) < 0.5 * (high - low) else low - margin
    left = min(left, low - 0.04 * (high - low))
    shade: dict[str, Any] = {"facecolor": LIGHT["unvisited"], "alpha": 0.14, "linewidth": 0.0}
    axes.axvspan(left, low, label=words("unvisited"), **shade)
    axes.axvspan(high, high + margin, **shade)
    for method, curve in parts.items():
        if method in aside:
            _faint(axes, curve.kappa, unit.factor * curve.tangent, method, words, gid=SET_ASIDE)
        else:
            _banded(axes, curve, unit, words, front=1.0 if method == answering else 0.0)
    if result.inverse and "inverse" in parts and "inverse" not in aside:
        knots = [k for k in result.inverse.knots if low <= k.kappa_per_m <= high]
        places, values = [k.kappa_per_m for k in knots], [unit.factor * k.tangent_Nm2 for k in knots]
        axes.plot(places, values, ls="none", marker="o", ms=4.5, mfc=LIGHT["paper"], mec=LIGHT["inverse"])
    axes.set_xlim(left, high + margin)
    _limit(axes, counted, unit, words)
    _over_kappa(axes, "axis_stiffness", unit, words)
    _mark_legend(axes)
    return axes


def _over_kappa(axes: Axes, quantity: str, unit: Unit, words: Words) -> Axes:
    """Rule and name the axes of a figure over the curvature, its legend above."""
    name = words(quantity, unit=unit.symbol)
    return finish(axes, words, x=words("axis_kappa"), y=name, legend=2)


def _mark_legend(axes: Axes) -> None:
    """Entries of the legend that go with curves set aside get their mark."""
    legend = axes.get_legend()
    aside = {line.get_label() for line in axes.get_lines() if line.get_gid() == SET_ASIDE}
    for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True) if legend else ():
        if text.get_text() in aside and handle is not None:
            handle.set_gid(SET_ASIDE)
            text.set_gid(SET_ASIDE)


def _limit(axes: Axes, parts: Collection[Visited], unit: Unit, words: Words) -> None:
    """Limits of f_EI: all curves that count fit; one that is set aside may leave the picture."""
    half = words.half_band
    top = max(float(np.max(c.tangent + np.minimum(half * c.tangent_std, np.abs(c.tangent)))) for c in parts)
    lowest = min(0.0, *(float(np.min(curve.tangent)) for curve in parts))
    axes.set_ylim(unit.factor * max(1.1 * lowest, -0.25 * top), unit.factor * (1.08 * top))


def _banded(
    axes: Axes,
    curve: Visited,
    unit: Unit,
    words: Words,
    *,
    quantity: str = "tangent",
    role: str = "",
    front: float = 0.0,
    label: str = "",
) -> None:
    """A curve with its band, in colour and dash of its way or ``role``; one with a larger ``front`` covers others."""
    role = role or curve.method
    value, half = getattr(curve, quantity), words.half_band * getattr(curve, f"{quantity}_std")
    low, high = unit.factor * (value - half), unit.factor * (value + half)
    axes.fill_between(curve.kappa, low, high, color=LIGHT[role], alpha=0.2, lw=0.0, zorder=1.0 + front)
    look: dict[str, Any] = {"color": LIGHT[role], "ls": DASHES[role], "zorder": 2.0 + front}
    look |= {"lw": 3.0} if role == "extended" else {}
    axes.plot(curve.kappa, unit.factor * value, label=label or words(f"way_{role}"), **look)


def _faint(axes: Axes, kappa: np.ndarray, values: np.ndarray, method: str, words: Words, **mark: str) -> None:
    """A curve that is set aside: thin, pale and without a band."""
    look: dict[str, Any] = {"color": LIGHT[method], "ls": DASHES[method], "lw": 1.2, "alpha": 0.45, **mark}
    axes.plot(kappa, values, label=words(f"way_{method}"), **look)


def draw_moment(figure: Area, result: Result, words: Words) -> Axes:
    """Draw m(kappa) by every way, with the points m = P y of the balance equations; what is set aside faint."""
    axes, parts = plot_area(figure), trusted(result)
    unit = words.unit("N m", *(v for curve in _drawn(result) for v in curve.moment))
    if result.balance and result.balance.points_kappa_per_m:
        places, moments = result.balance.points_kappa_per_m, result.balance.points_moment_Nm
        chosen = slice(None, None, max(1, len(places) // 300))  # more points than that only fill the picture
        dots: dict[str, Any] = {"ls": "none", "marker": ".", "ms": 3.0, "color": LIGHT["muted"], "alpha": 0.7}
        axes.plot(places[chosen], [unit.factor * m for m in moments[chosen]], label=words("points_balance"), **dots)
    for method, curve in parts.items():
        if method in set_aside(result):
            _faint(axes, curve.kappa, unit.factor * curve.moment, method, words)
        else:
            _banded(axes, curve, unit, words, quantity="moment")
    ends = [end for curve in parts.values() for end in (curve.kappa[0], curve.kappa[-1])]
    if ends:  # single points of a photo may lie anywhere
        margin = 0.08 * (max(ends) - min(ends))
        axes.set_xlim(min(ends) - margin, max(ends) + margin)
    axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)
    return _over_kappa(axes, "axis_moment", unit, words)


def draw_pointwise(figure: Area, result: Result, words: Words) -> Axes:
    """Draw the paper's (kappa, f_EI)-graph, Eq. (14) point by point and photo by photo, under the balance curve."""
    axes, unit = plot_area(figure), stiffness_unit(result, words)
    pointwise = result.balance.pointwise if result.balance else []
    for colour, part in zip(step_colours(len(pointwise)), pointwise, strict=True):
        values = [unit.factor * v for v in part.tangent_Nm2]
        label = f"{words('step')} {part.step}" if len(pointwise) <= 3 else None
        axes.plot(part.kappa_per_m, values, ls="none", marker=".", ms=3.5, color=colour, label=label)
    curve = curves(result).get("balance")
    if curve is not None:
        _banded(axes, curve, unit, words)
        lowest, highest = (unit.factor * float(value) for value in (curve.tangent.min(), curve.tangent.max()))
        axes.set_ylim(min(0.0, lowest), POINTWISE_HEADROOM * highest)
    return _over_kappa(axes, "axis_stiffness", unit, words)


def fitted_branches(result: Result) -> dict[str, Visited]:
    """Visited parts of f_EI fitted to loading and to unloading apart, by the name of the branch."""
    fitted = result.inverse.branches if result.inverse else {}
    return {name: part for name in fitted if (part := visited("inverse", fitted[name])) is not None}


def draw_branches(figure: Area, result: Result, words: Words) -> Axes:
    """Draw f_EI fitted to loading and to unloading apart; at least one of them has a visited part."""
    axes, unit, parts = plot_area(figure, top=ONE_ROW), stiffness_unit(result, words), fitted_branches(result)
    for role, (name, curve) in zip(("inverse", "balance"), parts.items(), strict=False):
        _banded(axes, curve, unit, words, role=role, label=words.known(f"branch_{name}", name))
    _limit(axes, parts.values(), unit, words)
    return _over_kappa(axes, "axis_stiffness", unit, words)


def steps_of_answer(result: Result) -> list[StepPart]:
    """The steps with the force of the model that answers: the extended one, else the fitted simulation."""
    extended = extended_map(result)
    left = dict(zip(extended.steps, extended.force_N, strict=False)) if extended else {}
    return [
        step if (rest := left.get(step.step)) is None else step.model_copy(update={"force_fit_N": step.force_N - rest})
        for step in result.steps
    ]


def draw_forces(figure: Area, result: Result, words: Words) -> Axes:
    """Draw measured and simulated force over the displacement, and what is left between them in sigma."""
    height, unit, given = figure.bbox.height, force_unit(result, words), steps_of_answer(result)
    fitted = [step for step in given if step.force_fit_N is not None]
    by_branch = {branch: [step for step in given if step.branch == branch] for branch in MARKERS}
    axes = plot_area(figure, bottom=0.38 * height) if fitted else plot_area(figure)
    for branch, steps in by_branch.items():
        if steps:
            axes.errorbar(
                [1e3 * step.displacement_m for step in steps],
                [unit.factor * step.force_N for step in steps],
                yerr=[unit.factor * words.half_band * step.force_std_N for step in steps],
                capsize=3.0,
                elinewidth=1.2,
                label=words.known(f"branch_{branch}", branch),
                **_marks(branch),
            )
    under = Ruling(labelled=False) if fitted else Ruling(words("axis_displacement"))
    if fitted:
        role = "extended" if result.answer.method == "extended" else "inverse"
        _simulated(axes, fitted, unit, LIGHT[role], words)
        rest = plot_area(figure, top=0.68 * height)
        rest.set_xlim(axes.get_xlim())
        _force_rest(rest, by_branch, words)
    return finish(axes, words, x=under, y=words("axis_force", unit=unit.symbol), legend=2)


def _simulated(axes: Axes, fitted: list[StepPart], unit: Unit, colour: str, words: Words) -> None:
    """Simulated forces: a line of loading, and one of unloading that starts where loading ended."""
    ordered = sorted(fitted, key=lambda step: step.displacement_m)
    loading = [step for step in ordered if step.branch != "unloading"]
    turning = loading[-1:] if len(loading) < len(ordered) else []
    unloading = [step for step in ordered if step.branch == "unloading" or step in turning]
    look: dict[str, Any] = {"color": colour, "marker": "_", "ms": 14.0, "mew": 2.0, "lw": 0.8}
    for line, dash, label in ((loading, "-", words("simulated")), (unloading, (0, (4, 2)), None)):
        places = [1e3 * step.displacement_m for step in line]
        forces = [unit.factor * (step.force_fit_N or 0.0) for step in line]
        axes.plot(places, forces, ls=dash, label=label, **look)


def _force_rest(rest: Axes, by_branch: dict[str, list[StepPart]], words: Words) -> None:
    """Measured minus simulated force in standard deviations."""
    limit = 1.5 * NOISE
    for branch, steps in by_branch.items():
        left = [(1e3 * step.displacement_m, sigma) for step in steps if (sigma := force_residual(step)) is not None]
        rest.plot([d for d, _ in left], [sigma for _, sigma in left], **_marks(branch))
        limit = max(limit, *(1.15 * abs(sigma) for _, sigma in left), 0.0)
    noise_band(rest)
    rest.set_ylim(-limit, limit)
    finish(rest, words, x=words("axis_displacement"), y=Ruling(words("axis_sigma"), most=4, whole=True))


def _marks(branch: str) -> dict[str, Any]:
    """How the points of a branch look."""
    return {
        "ls": "none",
        "marker": MARKERS[branch],
        "ms": 5.5,
        "color": LIGHT["measured"],
        "mfc": LIGHT["paper"] if branch == "unloading" else LIGHT["measured"],
    }


def force_residual(step: StepPart) -> float | None:
    """Measured minus simulated force in standard deviations; None without a simulated force or a known noise."""
    if step.force_fit_N is None or step.force_std_N <= 0.0:
        return None
    return (step.force_N - step.force_fit_N) / step.force_std_N


def draw_curvatures(figure: Area, result: Result, words: Words) -> Axes:
    """Draw kappa(s) of the visible cable on all photos in one picture; later steps are brighter."""
    axes = plot_area(figure, top=ONE_ROW)
    traced = [photo for photo in result.photos if photo.kappa_per_m]
    for colour, photo in zip(step_colours(len(traced)), traced, strict=True):
        kappa = np.where(photo.seen, photo.kappa_per_m, np.nan)
        label = f"{photo.step}" if len(traced) <= 10 else None
        axes.plot(1e3 * np.asarray(photo.s_m), kappa, color=colour, lw=1.6, label=label)
    if len(traced) > 10:
        axes.set_title(words("steps_dark_to_bright"), loc="left")
    return finish(axes, words, x=words("axis_s"), y=words("axis_kappa"), legend=10 if len(traced) <= 10 else 0)
