"""Repeat specimens of one cable type on the index: which of them cannot be, and a sentence and a figure a type.

Only specimens that are usable are pooled. A specimen whose stiffness is a thirtieth or thirty times that of most others
of its type is not: that is a wrong unit of the force, which no specimen shows on its own if its cable is soft.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from pipeline.report.pooling import Pooled, outlying, pool
from pipeline.report.row import IndexRow, RowCurve
from pipeline.report.words import Words
from pipeline.settings.report import ReportSettings
from pipeline.units import Unit

LINES = 40  # single curves of a figure: more are a blot


@dataclass(frozen=True)
class Repeats:
    """Repeat specimens of one type.

    Attributes
    ----------
    type, text : str
        Of the cable; mean, scatter and whether they differ.
    pooled : Pooled
    members : tuple of int
        Numbers of the rows, the first of them.
    alt : str
        The figure in words; empty if none is to be drawn.
    """

    type: str
    text: str
    pooled: Pooled
    members: tuple[int, ...]
    alt: str


def by_type(rows: list[IndexRow]) -> list[tuple[str, list[tuple[int, RowCurve]]]]:
    """Usable rows with a type and a curve, with their numbers: type by type, most specimens first."""
    curves = [(row.type, i, row.curve) for i, row in enumerate(rows) if row.usable and row.type and row.curve]
    ordered = sorted(curves, key=lambda entry: entry[:2])
    groups = [(name, [(i, curve) for _, i, curve in group]) for name, group in groupby(ordered, key=lambda e: e[0])]
    return sorted(groups, key=lambda group: -len(group[1]))


def without_outlying(rows: list[IndexRow]) -> list[IndexRow]:
    """The rows, those that cannot be specimens of their type as not usable."""
    judged = list(rows)
    for name, group in by_type(rows):
        means = np.array([float(np.mean(curve.tangent)) for _, curve in group])
        for (number, _), mean, wrong in zip(group, means, outlying(means), strict=True):
            if not wrong:
                continue
            from pipeline.result import none_of_its_type  # loads what results are made of: for the few that need it

            times = mean / float(np.median(means[means != mean]))
            fault = none_of_its_type(times, others=len(group) - 1, kind=name)
            judged[number] = replace(rows[number], usable=False, fault=fault, outlying=True)
    return judged


def repeats(rows: list[IndexRow], unit: Unit, words: Words, settings: ReportSettings) -> Iterable[Repeats]:
    """Repeat specimens by type, most specimens first; ``unit`` is that of bending stiffness for all of an index."""
    drawn = 0
    for name, group in by_type(rows):
        together = pool([curve for _, curve in group])
        if together is None:
            continue
        drawn += 1
        shown = drawn <= settings.pooled_types_drawn
        yield Repeats(
            type=name,
            text=_text(together, len(group), unit, words, settings),
            pooled=together,
            members=tuple(number for number, _ in group[:LINES]),
            alt=words("pooled_alt", count=len(group), type=name) if shown else "",
        )


def _text(pooled: Pooled, count: int, unit: Unit, words: Words, settings: ReportSettings) -> str:
    """Mean, scatter against own errors, and whether the specimens differ."""
    differ = pooled.p_value < settings.pooled_p_value
    return words(
        "index_pooled_text",
        count=count,
        low=words.curvature(pooled.kappa[0]),
        high=words.curvature(pooled.kappa[-1]),
        mean=unit.text(pooled.stiffness, pooled.stiffness_std),
        scatter=words.number(100.0 * pooled.scatter_relative, 2),
        own=words.number(100.0 * pooled.error_relative, 2),
        verdict=words("pooled_differ" if differ else "pooled_same", p=words.probability(pooled.p_value, name="p")),
    )
