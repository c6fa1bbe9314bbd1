"""Forces that changed their factor, zero or sign during the test: a range switched, a tare, a plug turned round.

Shapes fix what the forces must be up to one common factor (f -> c f leaves them as they are), so the base model is
fitted to photos and displacements alone, and its forces p_i are held against the measured ones F_i. To first order in
the parameters v of the model, with all that the photos know of them, each of these is fitted:

    nothing      F_i = c p_i
    factor       F_i = c p_i before a step, g c p_i from it on
    zero         F_i = c p_i before a step, c p_i + a from it on
    sign         F_i = +-c p_i with the signs as measured
    one force    F_i = c p_i but for one step

A break is a fault of the data if it brings all forces to their noise, where one bad force does not nearly as well, nor
a cause, nor a pair of causes (`pipeline.diagnosis.diagnose`). One step before or after it would be one bad force. A
factor of nearly nothing is a load cell that died: its forces are left out, they are no measurement that could be
corrected. Friction, relaxation and drift change forces step by step and differ with the bow: none of them keeps one
factor, or one offset, on each side.

Codes: ``force/factor``, ``force/zero-moved``, ``force/sign``, ``force/dead``.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.faults import Faults, ForceCorrection
from pipeline.messages import Message
from pipeline.records import Array, Finding, Level, doubtful
from rod.inverse.fit import fit
from rod.measurement import MeasuredTest

FAULT = 6.0
"""Standard deviations: what is this far from what all other data say is a fault, and no chance."""

SWITCHED = 0.03
"""Factor less 1, or share of the largest force: a smaller change of all forces from one step on is no switch of a range
or lost zero; what slips or creeps changes as much at once."""

EXPLAINED = 0.10
"""Share of the excess misfit that a fault of the data may leave."""

DEAD = 0.05
"""Share of its force below which a load cell measures nothing: noise of 0.3 % of its range would be 6 % of a force that
is corrected, and what a broken channel still shows (an offset, crosstalk) is of this size."""

SHOWN = 4.0
"""Standard deviations: a factor nearer to zero than that, or its inverse, may be none at all; a force-free step that
reads less shows that the load cell was zeroed before the break."""

UNTOLD = 9.0
"""Chi-square: three standard deviations. A factor and an offset nearer than that are not told apart."""


class Break(NamedTuple):
    """What forces do from one step on, or at some steps, as fitted.

    Attributes
    ----------
    kind : str
        ``factor``, ``zero`` or ``sign``; ``one`` for a single bad force, ``none``.
    steps : tuple of int
        Indices of the steps that differ from the others.
    rest : float
        Chi-square it leaves.
    amount, std : float
        Factor (-), or offset (N).
    """

    kind: str
    steps: tuple[int, ...]
    rest: float
    amount: float = -1.0
    std: float = 0.0

    @property
    def dead(self) -> bool:
        """Whether the forces on one side of the break are none at all."""
        return self.kind == "factor" and (abs(self.amount) < max(DEAD, SHOWN * self.std))


def force_break(bench: Workbench) -> tuple[Faults, float] | None:
    """The break in the forces that explains what the base model misfits, with the forces corrected; None without one.

    Second: the chi-square it leaves.
    """
    told = _Told.by_photos(bench)
    if told is None:
        return None
    whole, rest = told.fitted("none"), attrgetter("rest")
    single = min((told.fitted("one", k) for k in range(len(told.step))), key=rest)
    breaks, sign = told.breaks(), told.turned()
    best = min(breaks, key=rest, default=None)
    if sign is not None and (best is None or sign.rest < best.rest + FAULT**2):
        best, breaks = sign, []
    elif best is None or best.rest + 1.0 > single.rest - FAULT**2:
        return None
    freedom = len(told.residual) + len(told.force) - told.photos.shape[1] - (best is not sign)
    if best.rest > freedom + 4.0 * np.sqrt(2.0 * freedom) + EXPLAINED * (whole.rest - best.rest):
        return None
    others = (one for one in breaks if one.steps == best.steps and one.kind != best.kind)
    other = next((one for one in others if one.rest < best.rest + UNTOLD), None)
    dead = next((one for one in (best, other) if one is not None and one.dead), None)
    return (_as_fault(bench.test, best, other) if dead is None else _without_dead(bench.test, dead)), best.rest


@dataclass(frozen=True, eq=False)
class _Told:
    """Forces that follow from the photos, and as measured; n steps with a force, p parameters, m rows without forces.

    Attributes
    ----------
    step : (n,)
        Indices of the steps.
    force, std, model : (n,) N
        Means over the holds; the model's up to one factor.
    slopes : (n, p) N
        Of the model's forces.
    residual, photos : (m,), (m, p)
        Whitened rows of photos and priors at the fit to them, and their sensitivities.
    loaded : (n,) bool
    """

    step: NDArray[np.int_]
    force: Array
    std: Array
    model: Array
    slopes: Array
    residual: Array
    photos: Array
    loaded: NDArray[np.bool_]

    @classmethod
    def by_photos(cls, bench: Workbench) -> _Told | None:
        """Fit the base model to all but the forces; None where that does not converge.

        Photos leave the factor of the forces open: one force, the nearest to the base model's, sets it.
        """
        observation, base = bench.observation, bench.base
        assert base.run.prediction is not None
        steps = [i for i, samples in enumerate(observation.forces) if samples.size]
        force = np.array([observation.forces[i].mean() for i in steps])
        model = np.array([base.run.steps[i].force for i in steps])
        alike = np.minimum(force * model, 0.0) + np.minimum(force**2, model**2)  # of the same sign, and not zero
        ratio = np.divide(force, model, out=np.full(len(steps), np.inf), where=alike > 0.0)
        nearest = steps[int(np.argmin(np.abs(np.log(ratio))))]
        priors = len(base.residual) - observation.rows.count
        is_force = np.r_[observation.rows.force, np.zeros(priors, dtype=bool)]
        kept = ~is_force | np.r_[observation.rows.step == nearest, np.ones(priors, dtype=bool)]
        # a base model bent to wrong forces may be too far from what the photos ask for: then from its first guess; what
        # its errors of the rig took of them are none
        bent = base.vector.copy()
        bent[base.extension.base.rig_at] = 0.0
        for vector in (bent, base.extension.base.neutral()):
            found = fit(observation, base.extension, vector, near=base.run, kept=kept)
            if found.converged:
                break
        if not found.converged or found.run.prediction is None:
            return None
        rows = [np.flatnonzero(observation.rows.force & (observation.rows.step == i)) for i in steps]
        std = observation.force_std[steps]
        samples = found.run.prediction.samples
        branch = bench.facts.branch
        return cls(
            np.array(steps),
            force,
            std / np.sqrt([len(own) for own in rows]),
            np.array([samples[i].mean() for i in steps]),
            np.array([found.jacobian[own].mean(axis=0) for own in rows]) * std[:, None],
            found.residual[~is_force],
            found.jacobian[~is_force],
            np.array([branch[i] != "mounted" for i in steps]),
        )

    def turned(self) -> Break | None:
        """Forces with the signs as measured, if some under load are negative: those that pull are the wrong ones.

        A cable that is pushed together pushes back, be the wrong ones many or few.
        """
        turned = self.loaded & (self.force * self.model < 0.0)
        return self.fitted("sign", turned) if turned.any() and turned.sum() < self.loaded.sum() else None

    def breaks(self) -> list[Break]:
        """A factor or an offset from each step on that leaves two forces after it, and two before it.

        At rest there is nothing to tare: what all forces under load have in common is a cause, and no break.
        """
        found = []
        for k in range(2, len(self.step) - 1):
            after = np.arange(len(self.step)) >= k
            if (self.loaded & after).sum() > 1:
                found.append(self.fitted("zero", after))
                if (self.loaded & ~after).sum() > 1:
                    found.append(self.fitted("factor", after))
        least = SWITCHED * np.max(np.abs(self.force))
        return [b for b in found if (abs(b.amount) > least if b.kind == "zero" else abs(b.amount - 1.0) > SWITCHED)]

    def fitted(self, kind: str, at: NDArray[np.bool_] | int | None = None) -> Break:
        """One kind of break ``at`` some forces, fitted: F = (model + slopes v) (c + a there), or with a beside it.

        The model's own level is the scale of its forces, so c stays where the forces alone bring it.
        """
        there = np.zeros(len(self.force))
        there[slice(0) if at is None else at] = 1.0
        force = np.where(there, -self.force, self.force) if kind == "sign" else self.force
        extra = {"factor": there * self.model, "zero": there, "one": there}.get(kind, np.zeros(len(there)))
        columns = np.column_stack([self.model, extra]) / self.std[:, None]
        c, a = np.linalg.lstsq(columns, force / self.std, rcond=None)[0]
        course = c + a * there if kind == "factor" else np.full(len(there), c)
        rows = np.column_stack([course[:, None] * self.slopes, extra]) / self.std[:, None]
        matrix = np.vstack([np.column_stack([self.photos, np.zeros(len(self.photos))]), rows])
        data = np.r_[self.residual, force / self.std - columns @ (c, a)]
        size = np.linalg.norm(matrix, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        left, weights, right = np.linalg.svd(matrix / size, full_matrices=False)
        seen = weights > 1e-9 * weights[0]
        along = left[:, seen].T @ data
        root = right[seen].T / weights[seen]
        amount, std = a + root[-1] @ along / size[-1], np.linalg.norm(root[-1]) / size[-1]
        if kind == "factor":
            amount, std = 1.0 + amount / c, std / abs(c)
        steps, rest = tuple(self.step[there > 0.0].tolist()), float(data @ data - along @ along)
        return Break(kind, steps, rest) if kind == "sign" else Break(kind, steps, rest, float(amount), float(std))


def _as_fault(test: MeasuredTest, found: Break, other: Break | None) -> Faults:
    """The test with its forces corrected, and the sentence that says so; ``other``: what it may be as well."""
    factor, offset = (1.0, found.amount) if found.kind == "zero" else (found.amount, 0.0)
    steps = tuple(test.steps[i].step for i in found.steps)
    correction = ForceCorrection(steps, factor, offset, _errors(test, found, other))
    if found.kind == "sign":
        finding = doubtful("force/sign.turned", steps=correction.steps)
        return Faults(correction.applied(test), (finding,), corrections=(correction,))
    first, size = test.steps[found.steps[0]].step, _size(found)
    size = size if other is None else Message("break.either", one=size, other=_size(other))
    more = Message("break.later", factor=found.amount) if found.kind == "factor" else ""
    said = Message("break.found", step=first, size=size, more=more)
    code = "force/factor" if found.kind == "factor" else "force/zero-moved"
    level: Level = "error" if found.kind == "factor" or other or not _zeroed(test, found) else "warning"
    return Faults(correction.applied(test), (Finding(code, level, said),), corrections=(correction,))


def _errors(test: MeasuredTest, found: Break, other: Break | None) -> tuple[tuple[float, ...], ...]:
    """What corrected forces may be off by, N: size of the break, and that it may be the other kind as well."""
    if found.kind == "sign":
        return ()
    shown = np.array([test.steps[i].force for i in found.steps])
    rows = [_corrected(shown, found) / found.amount if found.kind == "factor" else np.ones(len(shown))]
    rows[0] *= found.std
    if other is not None:
        # the data do not tell the two kinds apart: each is as likely
        rows.append(np.sqrt(0.5) * (_corrected(shown, other) - _corrected(shown, found)))
    return tuple(tuple(row.tolist()) for row in rows)


def _corrected(shown: Array, found: Break) -> Array:
    return shown / found.amount if found.kind == "factor" else shown - found.amount


def _without_dead(test: MeasuredTest, found: Break) -> Faults:
    """The forces of a load cell that measured nothing from a step on, or up to it, left out."""
    after, share, std = abs(found.amount) < 1.0, found.amount, found.std
    if not after:
        share, std = 1.0 / found.amount, found.std / found.amount**2
    first = test.steps[found.steps[0]].step
    finding = doubtful("force/dead" if after else "force/dead.before", step=first, share=(share, std))
    # the force-free step tells no stiffness, and its photo is not to be lost
    loaded = (i for i, step in enumerate(test.steps) if step.branch != "mounted")
    dead = frozenset(i for i in loaded if (i in found.steps) == after)
    return Faults(test, (finding,), forces=dead)


def _size(found: Break) -> Message:
    size = (found.amount, found.std)
    return Message("break.factor", factor=size) if found.kind == "factor" else Message("break.zero", force_N=size)


def _zeroed(test: MeasuredTest, found: Break) -> bool:
    """Whether a force-free step before the break shows that the load cell read zero then."""
    before = (step for i, step in enumerate(test.steps) if i not in found.steps and step.branch == "mounted")
    return any(abs(step.force) < SHOWN * step.force_std for step in before)
