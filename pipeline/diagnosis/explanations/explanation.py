"""Explanations: causes put into the model and fitted in full.

Score tests are local; what is suspected is refitted from the linear estimate, with the form tuned where it has a free
place or time, and with further forms of the same cause where several may add up (a profile along the cable).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import spot_between
from pipeline.diagnosis.fits.extension import Extension, Term
from pipeline.diagnosis.fits.fit import Fit, fit
from pipeline.diagnosis.fits.search import Suspicion, suspect
from pipeline.diagnosis.fits.sensitivities import whole_residual
from pipeline.diagnosis.observations.observation import Observation
from pipeline.diagnosis.observations.simulation import run
from pipeline.diagnosis.statistics.pairs import pair_gains
from pipeline.diagnosis.statistics.twins import cosines
from pipeline.diagnosis.statistics.verdict import Weighed, scan_share
from pipeline.settings.diagnosis import DiagnosisSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Explanation:
    """One or two causes in the model, fitted.

    Attributes
    ----------
    causes : tuple of int
        Indices into the catalogue, the stronger first.
    fitted : Fit
    gain : float
        Chi-square removed from the base model.
    weighed : Weighed
    """

    causes: tuple[int, ...]
    fitted: Fit
    gain: float
    weighed: Weighed

    def amount(self, cause: Cause) -> tuple[float, float]:
        """Size of a cause and its standard deviation: the sum of its forms where they add up, else the largest."""
        own = self.fitted.extension.terms_of(cause)
        if not cause.additive:
            return max((self.fitted.amount(i) for i in own), key=lambda pair: abs(pair[0]))
        at = [self.fitted.extension.amounts_at[i] for i in own]
        variance = float(self.fitted.covariance[np.ix_(at, at)].sum())
        return float(self.fitted.vector[at].sum()), float(np.sqrt(max(variance, 0.0)))

    def impossible(self, catalogue: Sequence[Cause], most: float) -> Cause | None:
        """A cause that would have to be larger, by two standard deviations, than ``most`` plausible sizes; or None."""
        for cause in (catalogue[k] for k in self.causes):
            amount, std = self.amount(cause)
            if cause.limited and abs(amount) - 2.0 * std > most * cause.plausible(self.fitted.extension.facts):
                return cause
        return None


def candidates(suspicion: Suspicion, settings: DiagnosisSettings, *, any_sign: bool = False) -> list[int]:
    """Causes worth a refit: by linear chi-square gain, within a margin of the best.

    A cause whose forms may act together counts with its best two: a load at an angle to the chord scores little along
    it and across it. The margin is that of single forms, else many forms of one cause would push out the others.

    ``any_sign``: scores of an inadmissible sign count too. About a base model in a false valley of K0 the sign of a
    score says nothing: friction of the bearings on loading alone asks for a negative amount there.
    """
    gains = np.zeros(len(suspicion.causes))
    np.maximum.at(gains, suspicion.owner, (suspicion.scores.z if any_sign else suspicion.statistic) ** 2)
    best = gains.max(initial=0.0)
    needed = best - max(settings.refit_least, settings.refit_margin * best)
    for k, cause in enumerate(suspicion.causes):
        if cause.combines:
            gains[k] = max(gains[k], _best_two_forms(suspicion, k, settings))
    order = np.argsort(-gains, kind="stable")
    return [int(k) for k in order[: settings.refit_most] if gains[k] > max(needed, 0.0)]


def _best_two_forms(suspicion: Suspicion, cause: int, settings: DiagnosisSettings) -> float:
    """Linear chi-square gain of the best two forms of a cause together."""
    own = suspicion.of(cause)
    gains = pair_gains(
        suspicion.scores.z[own],
        cosines(suspicion.scores.unit[:, own]),
        suspicion.sign[own],
        np.arange(own.size),
        collinear=settings.pair_collinear,
    )
    return float(gains.max(initial=0.0))


def refit_one(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    cause: int,
    settings: DiagnosisSettings,
    *,
    rival: float = np.inf,
) -> Explanation | None:
    """Fit the model with one cause in it; None where it cannot be simulated or has no admissible amount.

    ``rival`` is the chi-square another cause has reached: one that stays far above it after its first fit is not tried
    from other starts and with further forms.
    """
    hopeless = rival + settings.refit_least + settings.hopeless * base.chi2
    enough = settings.fits * (len(base.residual) - base.extension.size)
    best: dict[str, Fit] = {}
    for direction in _first_forms(suspicion, cause):
        if any(one.converged and one.chi2 < enough for one in best.values()):
            break
        found = fit_terms(observation, base, suspicion, (direction,), settings, hopeless=hopeless)
        if found is not None and not found.converged and suspicion.terms[direction].variant.tuned:
            # where the trace has kinks (slip), a form that is tuned along may stall: the form as it is scored does not
            held = fit_terms(observation, base, suspicion, (direction,), settings, hopeless=hopeless, tuned=False)
            found = held if held is not None and _cost(held) < _cost(found) else found
        setting = suspicion.terms[direction].variant.setting
        if found is not None and (setting not in best or _cost(found) < _cost(best[setting])):
            best[setting] = found
        if found is not None and found.chi2 >= hopeless and _are_starts_only(suspicion, cause):
            break
    if not best:
        return None
    if suspicion.causes[cause].combines:
        for setting, one in best.items():
            best[setting] = _with_more_forms(observation, one, setting, suspicion, settings, hopeless)
            best[setting] = _as_one_spot(observation, best[setting], settings)
    return explanation_of((cause,), base, min(best.values(), key=_cost), suspicion)


def _are_starts_only(suspicion: Suspicion, cause: int) -> bool:
    """Whether the forms of a cause differ by nothing but a number that a refit tunes, and of them one acts alone."""
    variants = [suspicion.terms[k].variant for k in suspicion.of(cause)]
    return not suspicion.causes[cause].combines and all(v.tuned and v.setting == variants[0].setting for v in variants)


def _cost(fitted: Fit) -> float:
    """Chi-square plus two for every parameter."""
    return fitted.chi2 + 2.0 * fitted.extension.size


def _first_forms(suspicion: Suspicion, cause: int) -> list[int]:
    """Forms to start a refit with: up to four nearly as loud as the loudest, and the loudest of the other kinds.

    A soft spot on one side sounds like a stiff one on the other until it has found its place, and like smooth forms.
    Which setting is right may show only when further forms act beside.
    """
    own = suspicion.of(cause)
    ranked = [int(k) for k in own[np.argsort(-suspicion.statistic[own], kind="stable")]]
    least = NEARLY_AS_LOUD * suspicion.statistic[ranked[0]]
    loud = [k for k in ranked[:4] if suspicion.statistic[k] >= least]
    first = suspicion.terms[ranked[0]].variant
    other = [k for k in ranked if suspicion.terms[k].variant.tuned != first.tuned]
    elsewhere = [k for k in ranked if suspicion.terms[k].variant.setting != first.setting]
    return list(dict.fromkeys([*loud, *other[:1], *elsewhere[:1]]))


NEARLY_AS_LOUD = 0.75
"""Share of the loudest score; a misplaced spot keeps that much of the score it would have at its place."""


def fit_terms(
    observation: Observation,
    base: Fit,
    suspicion: Suspicion,
    directions: tuple[int, ...],
    settings: DiagnosisSettings,
    *,
    amounts: tuple[float, ...] | None = None,
    hopeless: float = np.inf,
    tuned: bool = True,
) -> Fit | None:
    """Fit with the given directions as terms, from the linear estimate, or from less of it where that fails.

    Unless ``tuned``, places and times stay as scored.
    """
    terms = tuple(suspicion.terms[k] for k in directions)
    if not tuned:
        terms = tuple(Term(term.cause, replace(term.variant, tuned=())) for term in terms)
    extension = Extension(base.extension.base, base.extension.facts, (*base.extension.terms, *terms))
    if amounts is None:
        amounts = tuple(float(suspicion.scores.estimate[k]) for k in directions)
    starts = [_linear_start(observation, base, extension, suspicion.columns[:, list(directions)], terms, amounts)]
    if "mounted" not in base.extension.facts.branch:
        # Without a photo of the force-free cable K0 has a second, false valley, as deep as the true one but for some
        # sigma: further starts lie on both sides of it.
        shift = 0.1 * base.extension.facts.curvature_scale
        guesses = [base.extension.base.neutral(bend=bend) for bend in (shift, -shift)]
        starts += [_start(extension, guess, terms, amounts, 1.0) for guess in guesses if len(guess) == len(base.vector)]
    best: Fit | None = None
    for count, start in enumerate(starts):
        # beside a base model that has not settled the first start proves nothing
        if count > (not base.converged) and best is not None and best.converged and best.chi2 >= hopeless:
            break
        found = _fit_from(observation, extension, start, base, settings, hopeless=hopeless)
        if found.run.prediction is not None and (best is None or found.chi2 < best.chi2):
            best = found
    return best


def _fit_from(
    observation: Observation,
    extension: Extension,
    start: Array,
    near: Fit,
    settings: DiagnosisSettings,
    *,
    hopeless: float = np.inf,
) -> Fit:
    """A refit as the settings ask for it, its equilibria sought from those of a fitted neighbour."""
    return fit(
        observation,
        extension,
        start,
        iterations=settings.iterations,
        tolerance=settings.tolerance,
        near=near.run,
        hopeless=hopeless,
    )


def _linear_start(
    observation: Observation,
    base: Fit,
    extension: Extension,
    columns: Array,
    added: tuple[Term, ...],
    amounts: tuple[float, ...],
) -> Array:
    """The linear estimate of amounts and of what they leave to the other parameters, or the share of it that fits best.

    A cause put beside parameters that stay where they were starts far from its valley: they had taken its place.
    """
    size = np.linalg.norm(base.jacobian, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    left = base.residual - columns @ np.asarray(amounts)
    move = np.linalg.lstsq(base.jacobian / size, left, rcond=1e-7)[0] / size
    trials = [_start(extension, base.vector + share * move, added, amounts, share) for share in SHARES]
    trials.append(_start(extension, base.vector, added, amounts, SHARES[-1]))
    costs = []
    for trial in trials:
        value = None
        if extension.admissible(trial):
            shown = run(extension.model(trial), extension.facts, near=base.run, patient=False)
            value = whole_residual(observation, shown.prediction, trial, extension.prior)
        costs.append(np.inf if value is None else float(value @ value))
    # where none has an equilibrium, the last one is at least a possible cable: whole moves may leave every range
    return trials[int(np.argmin(costs)) if np.isfinite(min(costs)) else -1]


SHARES = (1.0, 0.3, 0.1)
"""Of a linear estimate, tried before a refit."""


def _start(
    extension: Extension, vector: Array, added: tuple[Term, ...], amounts: tuple[float, ...], share: float
) -> Array:
    """Start vector: the fitted model's, then the added terms with a share of their amounts, held to sane sizes."""
    parts = [vector]
    for term, amount in zip(added, amounts, strict=True):
        limit = 5.0 * term.cause.plausible(extension.facts)
        value = float(np.clip(share * amount, -limit, limit))
        value = max(value, 0.0) if term.cause.sign > 0 else value
        parts.append(np.r_[value, [getattr(term.variant, name) for name in term.variant.tuned]])
    return np.concatenate(parts)


def _with_more_forms(
    observation: Observation,
    best: Fit,
    setting: str,
    suspicion: Suspicion,
    settings: DiagnosisSettings,
    hopeless: float,
) -> Fit:
    """Add further forms of the same cause while each removes ``shape_gain``, and may get below ``hopeless``."""
    own = [best.extension.terms[-1].cause]
    while len(best.extension.terms) < settings.shapes_most:
        more = suspect(observation, best, own, visible=settings.visible, trace=settings.trace)
        # a form that is there already, put beside itself, starts on the ridge where neither knows its amount
        fresh = np.array([term not in best.extension.terms for term in more.terms], dtype=bool)
        fitting = np.array([term.variant.setting == setting for term in more.terms], dtype=bool) * more.statistic
        if best.chi2 - fitting.max(initial=0.0) ** 2 >= hopeless:
            break
        added: Fit | None = None
        for statistic in (np.where(fresh, fitting, 0.0), fitting):
            if statistic.max(initial=0.0) ** 2 >= settings.shape_gain:
                added = fit_terms(observation, best, more, (int(np.argmax(statistic)),), settings)
            if added is not None and best.chi2 - added.chi2 >= settings.shape_gain:
                break
        if added is None or best.chi2 - added.chi2 < settings.shape_gain:
            break
        best = _without_needless_forms(observation, added, settings)
    return best


def _as_one_spot(observation: Observation, best: Fit, settings: DiagnosisSettings) -> Fit:
    """One spot in the place of several forms along the cable, where it explains the data as well.

    A loud spot that is sought from beside its place ends in a valley of its own, which further forms leave and steps do
    not: what they add up to tells where the spot is.
    """
    terms, extension = best.extension.terms, best.extension
    if len(terms) < 2 or any(term.cause is not terms[0].cause for term in terms):
        return best
    whole = spot_between(extension.base_model(best.vector), extension.model(best.vector))
    if whole is None:
        return best
    variant, amount, stiffer = whole
    extension = Extension(extension.base, extension.facts, (Term(terms[0].cause, variant),))
    start = extension.start(best.vector, (amount,))
    start[: len(extension.base.knots)] += np.log1p(stiffer)
    one = _fit_from(observation, extension, start, best, settings)
    dropped = len(terms) - 1
    return one if one.run.prediction is not None and one.chi2 < best.chi2 + settings.shape_gain * dropped else best


def _without_needless_forms(observation: Observation, best: Fit, settings: DiagnosisSettings) -> Fit:
    """Drop the forms of the last cause that later ones have made needless: each removes less than ``shape_gain``.

    A form that is only there because it came first shares its amount with the law, and f_EI pays for it.
    """
    while len(own := _forms_of_last_cause(best)) > 1:
        shorter = [
            _fit_from(
                observation,
                replace(best.extension, terms=tuple(t for k, t in enumerate(best.extension.terms) if k != dropped)),
                np.delete(best.vector, range(at, at + 1 + len(best.extension.terms[dropped].variant.tuned))),
                best,
                settings,
            )
            for dropped, at in enumerate(best.extension.amounts_at)
            if dropped in own
        ]
        simplest = min(shorter, key=lambda fitted: fitted.chi2 if fitted.run.prediction is not None else np.inf)
        if simplest.run.prediction is None or simplest.chi2 - best.chi2 > settings.shape_gain:
            break
        best = simplest
    return best


def _forms_of_last_cause(fitted: Fit) -> list[int]:
    terms = fitted.extension.terms
    return [k for k, term in enumerate(terms) if term.cause is terms[-1].cause]


def explanation_of(causes: tuple[int, ...], base: Fit, fitted: Fit, suspicion: Suspicion) -> Explanation:
    """A fitted model as the explanation by the causes in it, with what decides about it."""
    terms = fitted.extension.terms
    kinds = [suspicion.causes[cause] for cause in causes]
    gain = base.chi2 - fitted.chi2
    weighed = Weighed(
        gain=gain,
        tuned=sum(len(term.variant.tuned) for term in terms) + len(terms) - 1,
        scan=sum(scan_share(suspicion.statistic[suspicion.of(cause)]) for cause in causes),
        signs=int(np.prod([1 if kind.sign else 2 for kind in kinds])),
    )
    found = Explanation(causes, fitted, gain, weighed)
    excess = max(abs(found.amount(kind)[0]) / kind.plausible(fitted.extension.facts) for kind in kinds)
    return replace(found, weighed=replace(weighed, excess=excess))
