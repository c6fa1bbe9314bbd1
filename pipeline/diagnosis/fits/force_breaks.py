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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.faults import Faults, ForceCorrection
from pipeline.messages import Message
from pipeline.records import Finding, Level, doubtful
from rod.inverse.fit import fit
from rod.measurement import MeasuredTest

Array = NDArray[np.float64]

FAULT = 6.0
"""Standard deviations: what is this far from what all other data say is a fault, and no chance."""

SWITCHED = 0.03
"""Factor less 1, or share of the largest force: a smaller change of all forces from one step on is no switch of a range
or lost zero; what slips or creeps changes as much at once."""

EXPLAINED = 0.10
"""Share of the excess misfit that a fault of the data may leave."""

ZEROED = 4.0
"""Standard deviations: a force-free step that reads less shows that the load cell was zeroed before the break."""

DEAD = 0.05
"""Share of its force below which a load cell measures nothing: noise of 0.3 % of its range would be 6 % of a force that
is corrected, and what a broken channel still shows (an offset, crosstalk) is of this size."""

NO_FACTOR = 4.0
"""Standard deviations: a factor nearer to zero than that, or its inverse, may be none at all."""

UNTOLD = 9.0
"""Chi-square: three standard deviations. A factor and an offset nearer than that are not told apart."""


@dataclass(frozen=True)
class Break:
    """What forces do from one step on, or at some steps.

    Attributes
    ----------
    kind : str
        ``factor``, ``zero`` or ``sign``.
    steps : tuple of int
        Indices of the steps that differ from the others.
    amount, std : float
        Factor (-), or offset (N).
    gain : float
        Chi-square it removes beyond its own parameter.
    rest, freedom : float
        Chi-square it leaves, and what noise would.
    """

    kind: str
    steps: tuple[int, ...]
    amount: float
    std: float
    gain: float
    rest: float
    freedom: int

    @property
    def dead(self) -> bool:
        """Whether the forces on one side of the break are none at all."""
        return self.kind == "factor" and (abs(self.amount) < max(DEAD, NO_FACTOR * self.std))


def force_break(bench: Workbench) -> tuple[Faults, float] | None:
    """The break in the forces that explains what the base model misfits, with the forces corrected; None without one.

    Second: the chi-square it leaves.
    """
    told = _Told.by_photos(bench)
    if told is None:
        return None
    whole, single = told.whole(), told.without_one()
    found = [_break(told, trial, whole) for trial in (*told.signs(), *told.breaks())]
    fault = FAULT**2
    best = max(found, key=lambda one: one.gain, default=None)
    if best is None:
        return None
    turned = next((one for one in found if one.kind == "sign" and one.gain > best.gain - fault), None)
    if turned is None and best.gain < whole.rest - single.rest + fault:
        return None
    best = turned or best
    noise = best.freedom + 4.0 * np.sqrt(2.0 * best.freedom) + EXPLAINED * best.gain
    if best.rest > noise:
        return None
    others = (one for one in found if one.steps == best.steps and one.kind not in ("sign", best.kind))
    other = None if turned else next((one for one in others if one.rest < best.rest + UNTOLD), None)
    dead = next((one for one in (best, other) if one is not None and one.dead), None)
    return (_as_fault(bench.test, best, other) if dead is None else _without_dead(bench.test, dead)), best.rest


class _Trial(NamedTuple):
    """A hypothesis fitted: what it leaves, the size of its break and how well that is known."""

    kind: str
    steps: tuple[int, ...]
    rest: float
    amount: float = 1.0
    std: float = 0.0


def _break(told: _Told, trial: _Trial, whole: _Trial) -> Break:
    own = 0 if trial.kind == "sign" else 1
    freedom = len(told.residual) + len(told.force) - told.photos.shape[1] - own
    gain = whole.rest - trial.rest - own
    return Break(trial.kind, trial.steps, trial.amount, trial.std, gain, trial.rest, freedom)


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

    def whole(self) -> _Trial:
        """No break at all."""
        return _Trial("none", (), self._rest(np.ones(len(self.force)))[0])

    def without_one(self) -> _Trial:
        """All but the force that fits worst."""
        trials = []
        for i, step in enumerate(self.step.tolist()):
            weight = np.ones(len(self.force))
            weight[i] = 0.0
            trials.append(_Trial("one", (step,), self._rest(np.ones(len(self.force)), weight=weight)[0]))
        return min(trials, key=lambda trial: trial.rest)

    def signs(self) -> list[_Trial]:
        """Forces with the signs as measured, if some under load are negative."""
        turned = self.loaded & (self.force * self.model < 0.0)
        if not turned.any() or turned.sum() == self.loaded.sum():
            return []
        sign = np.where(turned, -1.0, 1.0)
        # a cable that is pushed together pushes back: those that pull are the wrong ones, be they many or few
        return [_Trial("sign", tuple(self.step[turned].tolist()), self._rest(sign)[0], -1.0)]

    def breaks(self) -> list[_Trial]:
        """A factor or an offset from each step on that leaves two forces after it, and two before it.

        At rest there is nothing to tare: what all forces under load have in common is a cause, and no break.
        """
        found = []
        for k in range(2, len(self.step) - 1):
            after = np.arange(len(self.step)) >= k
            if (self.loaded & after).sum() < 2:
                continue
            steps = tuple(self.step[after].tolist())
            if (self.loaded & ~after).sum() > 1:
                rest, factor, std = self._factor(after)
                if abs(factor - 1.0) > SWITCHED:
                    found.append(_Trial("factor", steps, rest, factor, std))
            rest, offset, std = self._offset(after)
            if abs(offset) > SWITCHED * np.max(np.abs(self.force)):
                found.append(_Trial("zero", steps, rest, offset, std))
        return found

    def _factor(self, after: NDArray[np.bool_]) -> tuple[float, float, float]:
        """Chi-square left by a factor after a break, the factor and its standard deviation."""
        before = self._scale(~after)
        factor = self._scale(after) / before if before else 1.0
        rest = std = np.inf
        for _ in range(3):  # the product of factor and model is linear in either alone
            course = np.where(after, factor, 1.0)
            rest, change, std = self._rest(course, np.where(after, before * self.model, 0.0), scale=before)
            factor += change
        return rest, factor, std

    def _offset(self, after: NDArray[np.bool_]) -> tuple[float, float, float]:
        """Chi-square left by an offset after a break, the offset and its standard deviation, N."""
        columns = np.column_stack([self.model, after.astype(float)]) / self.std[:, None]
        scale = float(np.linalg.lstsq(columns, self.force / self.std, rcond=None)[0][0])
        return self._rest(np.ones(len(self.force)), after.astype(float), scale=scale)

    def _scale(self, where: NDArray[np.bool_], course: Array | float = 1.0) -> float:
        """Factor of the model's forces that fits the measured ones best, without a look at the photos."""
        weight = np.where(where, 1.0 / self.std, 0.0)
        model = weight * course * self.model
        return float(model @ (weight * self.force) / max(float(model @ model), 1e-300))

    def _rest(
        self, course: Array, column: Array | None = None, *, scale: float | None = None, weight: Array | float = 1.0
    ) -> tuple[float, float, float]:
        """Chi-square left by ``F = scale course model`` plus a free amount of ``column``; amount and std."""
        if scale is None:
            scale = self._scale(np.broadcast_to(np.asarray(weight) > 0.0, self.force.shape), course)
        whiten = weight / self.std
        own = (whiten * (self.force - scale * course * self.model), (whiten * scale * course)[:, None] * self.slopes)
        extra = np.zeros(len(self.force)) if column is None else whiten * column
        matrix = np.block([[self.photos, np.zeros((len(self.photos), 1))], [own[1], extra[:, None]]])
        data = np.r_[self.residual, own[0]]
        size = np.linalg.norm(matrix, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        left, weights, right = np.linalg.svd(matrix / size, full_matrices=False)
        seen = weights > 1e-9 * weights[0]
        along = left[:, seen].T @ data
        root = right[seen].T / weights[seen]
        rest = float(data @ data - along @ along)
        return rest, float(root[-1] @ along / size[-1]), float(np.linalg.norm(root[-1]) / size[-1])


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
        rows.append(np.sqrt(EITHER) * (_corrected(shown, other) - _corrected(shown, found)))
    return tuple(tuple(row.tolist()) for row in rows)


EITHER = 0.5
"""Probability of each of two kinds of a break that the data do not tell apart."""


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
    return any(abs(step.force) < ZEROED * step.force_std for step in before)
