"""Repeat specimens of one cable type on the index: which must be wrong, and whether the others may be the same cable.

Only specimens that are usable are pooled. A specimen whose stiffness is a thirtieth or thirty times that of most others
of its type is not: that is a wrong unit of the force, which no specimen shows on its own if its cable is soft.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from pipeline.messages import Message
from pipeline.report.page import unbroken
from pipeline.report.pooling import Pooled, Scatter, outlying, pool, scattered
from pipeline.report.words import Words
from pipeline.result.row import IndexRow, RowCurve
from pipeline.units import Unit

DIFFERENT = 0.05
"""p value below which repeat specimens differ; the usual one in twenty."""

LINES = 40  # single curves of a figure: more are a blot


@dataclass(frozen=True)
class Repeats:
    """Repeat specimens of one type.

    Attributes
    ----------
    type, text : str
        Of the cable; whether the specimens may be the same cable.
    table : tuple of columns
        Of mean f_EI and K0: name, mean, scatter between the specimens, what their bands allow, p value.
    pooled : Pooled
    members : tuple of int
        Numbers of the rows, the first of them.
    alt : str
        The figure in words; empty if none is to be drawn.
    """

    type: str
    text: str
    table: tuple[tuple[str, ...], ...]
    pooled: Pooled
    members: tuple[int, ...]
    alt: str


def by_type(rows: list[IndexRow]) -> list[tuple[str, list[tuple[int, RowCurve]]]]:
    """Usable rows with a type and a curve, with their numbers: type by type, most specimens first."""
    groups: dict[str, list[tuple[int, RowCurve]]] = {}
    for number, row in enumerate(rows):
        if row.usable and row.type and row.curve:
            groups.setdefault(row.type, []).append((number, row.curve))
    return sorted(groups.items(), key=lambda group: (-len(group[1]), group[0]))


def without_outlying(rows: list[IndexRow]) -> list[IndexRow]:
    """The rows; a specimen whose stiffness cannot be that of its type is marked as not usable."""
    judged = list(rows)
    for name, group in by_type(rows):
        means = np.array([float(np.mean(curve.tangent)) for _, curve in group])
        for (number, _), mean, wrong in zip(group, means, outlying(means), strict=True):
            if not wrong:
                continue
            times = mean / float(np.median(means[means != mean]))
            fault = Message("fault.none-of-its-type", times=times, others=len(group) - 1, type=name)
            judged[number] = replace(rows[number], usable=False, fault=fault, outlying=True)
    return judged


DRAWN = 24
"""Types of cable with a figure in the index; more would make it slow to open."""


def repeats(rows: list[IndexRow], unit: Unit, words: Words) -> Iterable[Repeats]:
    """Repeat specimens by type, most specimens first; ``unit`` is that of bending stiffness for all of an index."""
    pools = ((name, group, pool([curve for _, curve in group])) for name, group in by_type(rows))
    poolable = ((name, group, pooled) for name, group, pooled in pools if pooled is not None)
    for place, (name, group, together) in enumerate(poolable):
        rests = [rows[number].pre_curvature for number, _ in group]
        known = [rest for rest in rests if rest is not None and rest[1] > 0.0]
        scatters = {"f_EI": together.stiffness} | ({"K0": scattered(known)} if len(known) == len(rests) else {})
        yield Repeats(
            type=name,
            text=_text(together, scatters, [rows[number].id for number, _ in group], words),
            table=tuple(_cells(name, s, unit if name == "f_EI" else PER_M, words) for name, s in scatters.items()),
            pooled=together,
            members=tuple(number for number, _ in group[:LINES]),
            alt=words("pooled_alt", count=len(group), type=name) if place < DRAWN else "",
        )


PER_M = Unit(1.0, "1/m")


def _text(pooled: Pooled, scatters: dict[str, Scatter], names: list[str], words: Words) -> str:
    """Whether the specimens may be the same cable, and which of them is farthest off."""
    level = DIFFERENT / len(scatters)  # Bonferroni: all tests together have the level
    wide = [name for name, scatter in scatters.items() if scatter.p_value < level]
    text = words(
        "index_pooled_text",
        count=len(names),
        low=words.curvature(pooled.kappa[0]),
        high=words.curvature(pooled.kappa[-1]),
        verdict=words("pooled_differ" if wide else "pooled_same", what=f" {words('and')} ".join(wide or scatters)),
    )
    return f"{text} {words('pooled_farthest', name=names[scatters[wide[0]].farthest])}" if wide else text


def _cells(name: str, scatter: Scatter, unit: Unit, words: Words) -> tuple[str, ...]:
    """Column of the table."""
    unit = replace(unit, decimal=words.decimal, symbol=unbroken(unit.symbol))
    p_value = words.probability(scatter.p_value)
    seen = unit.text(scatter.seen, scatter.seen_std) if scatter.seen > 0.0 else unit.plain(0.0)
    numbers = (unit.text(scatter.mean, scatter.mean_std), seen)
    return (name, *numbers, unit.plain(scatter.own, 2), p_value)
