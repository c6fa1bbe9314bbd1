"""``cablebend paper``: the paper's virtual experiments as ``paper.json``, figures and a page beside its statements.

Everything of the paper that needs no real cable, computed by `rod.paper` when the command runs. The numbers are exact
to the tolerance of the solver: nothing here was measured. Figures: Fig. 3 shapes, Fig. 4 control points and
characteristic over the iterations of the fit, Fig. 5 its forces and curvatures, Fig. 6 the fits with K0 forced to zero,
Fig. 7 the graphs of the three photos beside the inverse problem, cause by cause. Axes carry their units;
f_EI is printed in the reading that each curve has.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from pipeline.diagnosis.rediscovery import Discovery, papers_test, rediscover
from pipeline.messages import Message
from pipeline.report.canvas import Area, Drawing, drawing, page_colours
from pipeline.report.files import write_atomic
from pipeline.report.page import asset, environment, palette_css
from pipeline.report.paper_figures import draw_difference, draw_evolution, draw_responses, draw_shapes, draw_straight
from pipeline.report.words import Words
from rod.bending_test import TABLE_1, TABLE_1_ORDINATES
from rod.characteristic import Reading
from rod.paper import (
    POSITION_NOISE,
    READINGS,
    VARYING,
    WINDOW,
    Difference,
    IterationCost,
    TableOne,
    disagreement,
    forced_straight,
    iteration_costs,
    table_one,
    virtual_inverse,
)
from rod.paper_fit import PaperFit

REACHED = 1e-3  # relative error at which the paper's fit counts as converged: three digits of Table 1


@dataclass(frozen=True)
class Paper:
    """Everything computed: experiments by (reading, from_length), fits, causes of the disagreement, the iteration.

    ``discoveries`` are what the diagnosis adds to a straight cable of one stiffness on the same experiment.
    """

    experiments: dict[tuple[Reading, bool], TableOne]
    inverse: PaperFit
    straight: PaperFit
    straight_by_forces: PaperFit
    causes: tuple[Difference, ...]
    iteration: tuple[IterationCost, ...]
    discoveries: tuple[Discovery, ...]


def compute() -> Paper:
    """Run every virtual experiment; a few seconds."""
    experiments = {(r, zero): table_one(r, from_length=zero) for r in READINGS for zero in (False, True)}
    return Paper(
        experiments,
        virtual_inverse(),
        forced_straight(),
        forced_straight(curvatures=False),
        disagreement(),
        iteration_costs(),
        tuple(rediscover(papers_test())),
    )


def write_paper(folder: Path, words: Words | None = None) -> Paper:
    """Compute the paper, and write ``paper.json``, ``paper.html`` and one SVG a figure into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    paper, words = compute(), words or Words()
    figures = draw(paper, words)
    for _, figure in figures:
        write_atomic(folder / f"{figure.name}.svg", standalone(figure))
    write_atomic(folder / "paper.json", json.dumps(numbers(paper), indent=1) + "\n")
    look = {"palette": palette_css(page_colours()), "css": asset("page.css")}
    page = environment().get_template("paper.html")
    text = page.render(**look, words=words, statements=statements(paper, words), figures=figures)
    write_atomic(folder / "paper.html", text)
    return paper


def numbers(paper: Paper) -> dict[str, Any]:
    """The contract's ``paper.json``, with more beside it."""
    table: dict[str, Any] = {reading: _row(paper.experiments[reading, False]) for reading in READINGS}
    table |= {f"{reading}_from_length": _row(paper.experiments[reading, True]) for reading in READINGS}
    *causes, together = paper.causes
    shares = [*((d, d.share) for d in causes), (together, None)]
    return {
        "table1": table,
        "inverse": {
            "iterations": paper.inverse.iterations,
            "iterations_to_1e-3": iterations_to_convergence(paper.inverse),
            "ordinates_Nm2": paper.inverse.characteristic.ordinates.tolist(),
            "pre_curvature_per_m": paper.inverse.pre_curvature,
            "history": [
                {
                    "ordinates_Nm2": state.ordinates.tolist(),
                    "pre_curvature_per_m": state.pre_curvature,
                    "objective_N2": state.objective,
                }
                for state in paper.inverse.history
            ],
        },
        "forced_straight": {
            "ordinates_Nm2": paper.straight.characteristic.ordinates.tolist(),
            "force_error_N": force_errors(paper).tolist(),
            "converged": paper.straight.converged,
            "by_forces_alone_Nm2": paper.straight_by_forces.characteristic.ordinates.tolist(),
        },
        "disagreement": [{"cause": d.cause, "share": share, "rms_relative": d.rms} for d, share in shares],
        "iteration": [asdict(cost) for cost in paper.iteration],
        "rediscovery": [_discovery(found) for found in paper.discoveries],
    }


def force_errors(paper: Paper) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Forces of the fit with K0 = 0 less those of Table 1's cable, (3,) N."""
    both = zip(paper.straight.steps, paper.inverse.steps, strict=True)
    return np.array([forced.force - free.force for forced, free in both])


def iterations_to_convergence(fit: PaperFit) -> int | None:
    """First iteration from which on all parameters are within `REACHED` of Table 1; None if never."""
    truth = np.array([*TABLE_1_ORDINATES, TABLE_1["pre_curvature"]])
    errors = [np.max(np.abs(np.array([*s.ordinates, s.pre_curvature]) / truth - 1.0)) for s in fit.history]
    beyond = [i for i, error in enumerate(errors) if error > REACHED]
    first = beyond[-1] + 1 if beyond else 0
    return first if first < len(errors) else None


def statements(paper: Paper, words: Words) -> list[tuple[str, ...]]:
    """Statements of the paper: where it stands, what the paper says, what came out here."""
    inverse, low, (*causes, together) = paper.inverse, paper.straight.characteristic.ordinates[0], paper.causes
    errors = force_errors(paper)
    off = ", ".join(f"{1e3 * error:+.0f}" for error in errors).replace("-", "−")
    largest = float(np.max(np.abs(errors / [step.force for step in inverse.steps])))
    forces = {r: "; ".join(words.fixed(f, 4) for f in paper.experiments[r, False].forces) for r in READINGS}
    counts = [Message("paper.count", step=step, **asdict(cost)) for step, cost in enumerate(paper.iteration, start=1)]
    shares = [Message("paper.share", cause=_named(cause), share=cause.share, rms=cause.rms) for cause in causes]
    conditions = {"varying_per_m": VARYING, "noise_m": POSITION_NOISE, "window_m": WINDOW}
    said = (
        Message("paper.table", **forces),
        Message("paper.needs", found=[_found(discovery) for discovery in paper.discoveries]),
        Message("paper.converged", reached=iterations_to_convergence(inverse), rest=inverse.iterations),
        Message("paper.straight", stiffness=words.fixed(1e3 * low, 2), nodes=paper.straight.steps[0].kappa.size),
        Message("paper.forces", off=off, largest=largest),
        Message("paper.ways", shares=shares, together=together.rms, **conditions),
        Message("paper.iteration", counts=counts),
    )
    return [message.parts(words.language) for message in said]


def _named(cause: Difference) -> Message:
    return Message(f"paper.{cause.cause.replace(' ', '-')}")


def _found(step: Discovery) -> Message:
    """One step from a poorer model to a richer one, in words."""
    data = Message(f"paper.by-{step.data.replace(' ', '-')}")
    found = Message("paper.found", name=step.name, data=data, before=step.chi2[0], after=step.chi2[1])
    if step.gain is None:
        return found
    return Message("paper.found-gain", found=found, removed=min(step.gain.heldout_excess_removed, 1.0))


def _discovery(step: Discovery) -> dict[str, Any]:
    return {
        "cause": step.name,
        "data": step.data,
        "chi2": list(step.chi2),
        "chi2_of_others": step.rivals,
        "heldout_excess_removed": None if step.gain is None else step.gain.heldout_excess_removed,
    }


def draw(paper: Paper, words: Words) -> list[tuple[str, Drawing]]:
    """Title and figure, in the paper's order."""

    def drawn(name: str, fill: Callable[[Area], Axes], height: float, title: str) -> tuple[str, Drawing]:
        told = {"title": title, "description": words("paper_numbers", title=title)}
        return title, drawing(name, fill, size=(400.0, height), **told)

    straight = partial(draw_straight, paper.straight_by_forces, paper.straight, paper.inverse, words)
    figures = [  # two halves stand one above the other, and a cable is longer than it is high
        drawn("fig3", partial(draw_shapes, paper.experiments["secant", False], words), 150.0, words("paper_fig3")),
        drawn("fig4", partial(draw_evolution, paper.inverse, words), 560.0, words("paper_fig4")),
        drawn("fig5", partial(draw_responses, paper.inverse, words), 560.0, words("paper_fig5")),
        drawn("fig6", straight, 560.0, words("paper_fig6")),
    ]
    for letter, cause in zip("abcd", paper.causes, strict=True):
        title = words("paper_fig7", cause=_named(cause).said(words.language))
        figures.append(drawn(f"fig7{letter}", partial(draw_difference, cause, words), 300.0, title))
    return figures


def standalone(figure: Drawing) -> str:
    """The figure as a file of its own: the colours that a page would set are set in it."""
    head, rest = figure.svg.split(">", 1)
    return f"{head}><style>{palette_css(page_colours())}</style>{rest}\n"


def _row(experiment: TableOne) -> dict[str, list[float]]:
    return {
        "force_N": experiment.forces.tolist(),
        "kappa_min_per_m": [float(np.min(step.kappa)) for step in experiment.steps],
        "kappa_max_per_m": experiment.largest_curvatures.tolist(),
    }
