"""Figures of the paper's virtual experiments: shapes, evolution of the fit, K0 forced to zero, the disagreement.

Axes: chord frame in mm for shapes; curvature kappa in 1/m and f_EI in mN m^2 for characteristics; K0 in 1/m.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from pipeline.report.canvas import LIGHT, ONE_ROW, TWO_ROWS, Area, finish, plot_area, step_colours
from pipeline.report.ruling import Ruling
from rod.bending_test import TABLE_1, TABLE_1_KNOTS, TABLE_1_ORDINATES
from rod.characteristic import Characteristic
from rod.paper import Difference, TableOne
from rod.paper_fit import PaperFit

KAPPA = np.linspace(0.0, 10.0, 101)  # 1/m, the range of Table 1
CURVATURE, STIFFNESS = "curvature κ [1/m]", "f_EI [mN m²]"


def draw_shapes(experiment: TableOne, figure: Area) -> Axes:
    """Fig. 3: the cable at the three steps, in the chord frame with the same scale on both axes."""
    axes = plot_area(figure, top=ONE_ROW)
    for number, (step, colour) in enumerate(zip(experiment.steps, step_colours(3), strict=True), start=1):
        axes.plot(1e3 * step.x, 1e3 * step.y, color=colour, label=f"{number}: {step.force:.4f} N")
    axes.set_aspect("equal", adjustable="datalim")
    return finish(axes, x="x [mm]", y="y [mm]", decimal=".", legend=3)


def draw_evolution(fit: PaperFit, figure: Area) -> Axes:
    """Fig. 4: control points and K0 relative to Table 1."""
    axes = plot_area(figure)
    count = np.arange(len(fit.history))
    values = np.array([[*state.ordinates, state.pre_curvature] for state in fit.history])
    truth = np.array([*TABLE_1_ORDINATES, TABLE_1["pre_curvature"]])
    names = [*(f"f_EI({knot:g} 1/m)" for knot in TABLE_1_KNOTS), "K0"]
    for column, (name, colour, mark) in enumerate(zip(names, step_colours(4), "osD^", strict=True)):
        axes.plot(count, values[:, column] / truth[column], color=colour, marker=mark, ms=4, label=name)
    return finish(axes, x=Ruling("iteration", whole=True), y="relative to Table 1", decimal=".", legend=2)


def draw_iterates(fit: PaperFit, figure: Area) -> Axes:
    """Fig. 5: the characteristic after each iteration, from dark to bright, and the truth."""
    axes = plot_area(figure)
    for state, colour in zip(fit.history, step_colours(len(fit.history)), strict=True):
        law = Characteristic.from_ordinates(TABLE_1_KNOTS, state.ordinates)
        axes.plot(KAPPA, 1e3 * law.f(KAPPA), color=colour, lw=1.4)
    _truth(axes)
    return finish(axes, x=CURVATURE, y=STIFFNESS, decimal=".", legend=1)


def draw_straight(fit: PaperFit, figure: Area) -> Axes:
    """Fig. 6: the fit with K0 = 0 beside the truth."""
    axes = plot_area(figure)
    axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)
    axes.plot(KAPPA, 1e3 * fit.characteristic.f(KAPPA), color=LIGHT["alarm"], label="fit with K0 = 0")
    _truth(axes)
    return finish(axes, x=CURVATURE, y=STIFFNESS, decimal=".", legend=2)


def draw_difference(cause: Difference, figure: Area) -> Axes:
    """Fig. 7: both ways with one cause of disagreement, and the rms of their difference."""
    axes = plot_area(figure, top=TWO_ROWS)
    axes.plot(cause.kappa, 1e3 * cause.inverse, color=LIGHT["inverse"], label="inverse problem")
    label = f"balance equations ({100 * cause.rms:.0f} % rms)"
    axes.plot(cause.kappa, 1e3 * cause.balance, color=LIGHT["balance"], ls="--", marker="o", ms=4, label=label)
    axes.set_ylim(bottom=0.0)
    return finish(axes, x=CURVATURE, y=STIFFNESS, decimal=".", legend=1)


def _truth(axes: Axes) -> None:
    law = Characteristic.from_ordinates(TABLE_1_KNOTS, TABLE_1_ORDINATES)
    axes.plot(KAPPA, 1e3 * law.f(KAPPA), color=LIGHT["measured"], ls=":", label="Table 1")
