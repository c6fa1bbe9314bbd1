"""Which causes are worth a refit: those whose linear scores come near the best one."""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.fits.search import Suspicion
from pipeline.diagnosis.statistics.pairs import pair_gains
from pipeline.diagnosis.statistics.score import descending
from pipeline.diagnosis.statistics.twins import cosines
from rod.inverse.extension import Term

LEAST, MARGIN = 30.0, 0.35
"""Chi-square, and share of the best linear gain, that a cause may fall short of the best and still be refitted."""

MOST = 8
"""Causes refitted at most, best linear scores first; time."""


def far_behind(best: float) -> float:
    """Chi-square above which no fit is gone on with beside one that leaves ``best``: twice that, and noise.

    What lies nearer may gain by what else is weighed beside it, something else or fewer numbers.
    """
    return 2.0 * best + LEAST


def candidates(suspicion: Suspicion, *, any_sign: bool = False, margin: float = MARGIN, most: int = MOST) -> list[int]:
    """Causes worth a refit: those whose linear chi-square gain lies within a margin of the best.

    ``any_sign``: scores of an inadmissible sign count too; about a base model in a false minimum of K0 the sign of a
    score says nothing.
    """
    gains = np.zeros(len(suspicion.causes))
    np.maximum.at(gains, suspicion.owner, (suspicion.scores.z if any_sign else suspicion.statistic) ** 2)
    best = gains.max(initial=0.0)
    needed = best - max(LEAST, margin * best)
    order = np.argsort(-gains, kind="stable")
    return [int(k) for k in order[:most] if gains[k] > max(needed, 0.0)]


NEARLY_AS_LOUD = 0.75
"""Share of the loudest score; a misplaced spot keeps that much of the score it would have at its place."""


def hidden_pair(suspicion: Suspicion) -> tuple[int, ...]:
    """Directions of two causes that remove far more together than any one alone: each hides the other."""
    gains = pair_gains(suspicion.scores.z, cosines(suspicion.scores.unit), suspicion.sign, suspicion.owner)
    if gains.max(initial=0.0) < suspicion.statistic.max(initial=0.0) ** 2 + MASKED:
        return ()
    return tuple(int(k) for k in np.unravel_index(int(np.argmax(gains)), gains.shape))


MASKED = 20.0
"""Chi-square that a pair must remove beyond the best single score to be sought where no cause is likely by itself."""


def kinds(suspicion: Suspicion, cause: int) -> list[int]:
    """The best form of each kind of a cause: of `kind_of`, and of the same tuned numbers."""
    own, found = suspicion.of(cause), dict[tuple[object, ...], int]()
    for k in (int(k) for k in own[descending(suspicion.statistic[own])]):
        term = suspicion.terms[k]
        found.setdefault((kind_of(term), term.variant.tuned), k)
    return list(found.values())


def kind_of(term: Term) -> tuple[str, ...]:
    """Setting, label and tuned numbers of a form; forms that add up and components of one thing share their setting."""
    form = term.variant
    return (form.setting,) if term.cause.combines or form.component else (form.setting, form.label, *form.tuned)
