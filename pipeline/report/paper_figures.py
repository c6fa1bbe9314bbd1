"""Figures of the paper's virtual experiments: shapes, evolution of the fit, K0 forced to zero, the disagreement.

Axes: chord frame in mm for shapes; curvature kappa in 1/m and f_EI in mN m^2 for characteristics; K0 in 1/m.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from pipeline.records import Array
from pipeline.report.canvas import LIGHT, ONE_ROW, TWO_ROWS, Area, finish, plot_area, step_colours
from pipeline.report.ruling import Ruling
from pipeline.report.words import Words
from rod.bending_test import TABLE_1, TABLE_1_KNOTS, TABLE_1_ORDINATES
from rod.characteristic import Characteristic
from rod.paper import Difference, TableOne
from rod.paper_fit import PaperFit

KAPPA = np.linspace(0.0, 10.0, 101)  # 1/m, the range of Table 1
STIFFNESS = "f_EI [mN m²]"


def draw_shapes(experiment: TableOne, words: Words, figure: Area) -> Axes:
    """Fig. 3: the initial rod and the cable at the three steps, in the chord frame, same scale on both axes."""
    axes = plot_area(figure, top=TWO_ROWS)
    initial = experiment.initial
    axes.plot(1e3 * initial.x, 1e3 * initial.y, color=LIGHT["muted"], ls=":", label=words("paper_initial"))
    for number, (step, colour) in enumerate(zip(experiment.steps, step_colours(3), strict=True), start=1):
        label = f"{words('step')} {number}: {words.fixed(step.force, 4)} N"
        axes.plot(1e3 * step.x, 1e3 * step.y, color=colour, label=label)
    axes.set_aspect("equal", adjustable="datalim")
    return finish(axes, words, x="x [mm]", y="y [mm]", legend=2)


def draw_evolution(fit: PaperFit, words: Words, figure: Area) -> Axes:
    """Fig. 4: above, control points and K0 relative to Table 1; below, the characteristic, from dark to bright."""
    above, below = _halves(figure)
    axes = plot_area(above)
    count = np.arange(len(fit.history))
    values = np.array([[*state.ordinates, state.pre_curvature] for state in fit.history])
    truth = np.array([*TABLE_1_ORDINATES, TABLE_1["pre_curvature"]])
    names = [*(f"f_EI({knot:g} 1/m)" for knot in TABLE_1_KNOTS), "K0"]
    for column, (name, colour, mark) in enumerate(zip(names, step_colours(4), "osD^", strict=True)):
        axes.plot(count, values[:, column] / truth[column], color=colour, marker=mark, ms=4, label=name)
    finish(axes, words, x=Ruling(words("paper_count"), whole=True), y=words("paper_relative"), legend=2)
    laws = plot_area(below, top=ONE_ROW)
    found = [Characteristic.from_ordinates(TABLE_1_KNOTS, state.ordinates) for state in fit.history]
    _iterations(laws, KAPPA, [1e3 * law.f(KAPPA) for law in found], words)
    _truth(laws, words)
    return finish(laws, words, x=words("axis_kappa"), y=STIFFNESS, legend=3)


def draw_responses(fit: PaperFit, words: Words, figure: Area) -> Axes:
    """Fig. 5: above, the forces over the iterations and their data; below, the curvatures of step 3."""
    above, below = _halves(figure)
    axes = plot_area(above, top=ONE_ROW)
    count = np.arange(len(fit.history))
    forces = np.array([[step.force for step in state.steps] for state in fit.history])
    for number, (values, colour, mark) in enumerate(zip(forces.T, step_colours(3), "osD", strict=True), start=1):
        axes.plot(count, values, color=colour, marker=mark, ms=4, label=f"{words('step')} {number}")
    axes.hlines(forces[-1], 0, count[-1], color=LIGHT["measured"], lw=1.2, ls=":", label=words("paper_table"))
    finish(axes, words, x=Ruling(words("paper_count"), whole=True), y=words("axis_force", unit="N"), legend=4)
    bends = plot_area(below, top=ONE_ROW)
    s = 1e3 * fit.steps[-1].s
    _iterations(bends, s, [state.steps[-1].kappa for state in fit.history], words)
    bends.plot(s, fit.steps[-1].kappa, color=LIGHT["measured"], ls=":", label=words("paper_table"))
    return finish(bends, words, x=words("axis_s"), y=words("paper_bend"), legend=3)


def draw_straight(forces_alone: PaperFit, fit: PaperFit, free: PaperFit, words: Words, figure: Area) -> Axes:
    """Fig. 6: fits with K0 = 0 by the forces alone (above) and with the curvatures (below), beside that of free K0."""
    named = ((forces_alone, "paper_by_forces"), (fit, "paper_by_both"))
    for part, (forced, name) in zip(_halves(figure), named, strict=True):
        axes = plot_area(part)
        axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)
        axes.plot(KAPPA, 1e3 * forced.characteristic.f(KAPPA), color=LIGHT["alarm"], label=words(name))
        axes.plot(KAPPA, 1e3 * free.characteristic.f(KAPPA), color=LIGHT["inverse"], ls="--", label=words("paper_free"))
        _truth(axes, words)
        finish(axes, words, x=words("axis_kappa"), y=STIFFNESS, legend=2)
    return axes


def draw_difference(cause: Difference, words: Words, figure: Area) -> Axes:
    """Fig. 7: both ways with one cause of disagreement: the graph of each of the three photos, and their median."""
    axes = plot_area(figure, top=TWO_ROWS)
    for number, ((kappa, ratio), colour) in enumerate(zip(cause.graphs, step_colours(3), strict=True), start=1):
        axes.plot(kappa, 1e3 * ratio, ".", color=colour, ms=2.5)
        axes.plot([], [], ".", color=colour, label=f"{words('paper_photo')} {number}")  # large enough for a legend
    axes.plot(cause.kappa, 1e3 * cause.inverse, color=LIGHT["inverse"], label=words("paper_inverse"))
    label = words("paper_median", rms=f"{100 * cause.rms:.0f}")
    axes.plot(cause.kappa, 1e3 * cause.balance, color=LIGHT["balance"], ls="--", marker="o", ms=4, label=label)
    axes.set_ylim(0.0, 2e3 * float(max(cause.inverse.max(), cause.balance.max())))
    return finish(axes, words, x=words("axis_kappa"), y=STIFFNESS, legend=3)


def _iterations(axes: Axes, x: Array, curves: list[Array], words: Words) -> None:
    """A curve an iteration, from dark to bright; the first and the last have a name in the legend."""
    names = {0: words("paper_start"), len(curves) - 1: words("paper_end")}
    for number, (curve, colour) in enumerate(zip(curves, step_colours(len(curves)), strict=True)):
        axes.plot(x, curve, color=colour, lw=1.4, label=names.get(number))


def _halves(figure: Area) -> list[Area]:
    """Upper and lower half of a figure."""
    return list(np.atleast_1d(np.asarray(figure.subfigures(2, 1))))


def _truth(axes: Axes, words: Words) -> None:
    law = Characteristic.from_ordinates(TABLE_1_KNOTS, TABLE_1_ORDINATES)
    axes.plot(KAPPA, 1e3 * law.f(KAPPA), color=LIGHT["measured"], ls=":", label=words("paper_table"))
