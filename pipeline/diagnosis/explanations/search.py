"""The search: which causes, and which pairs of them, are fitted in full, and what each is worth.

base model and scores -> causes weighed by the linear model -> those that matter, or come near the best score, refitted
-> what has no name, beside the likeliest four -> what is likely beside these -> causes exchanged while a
pair that shares one with the likeliest is likelier -> pairs pruned of what they do not need -> where something else is
likelier still, the nearest cause with all others that show beside it -> probabilities of all.

A pair is fitted as far as chi-square may fall to where it were worth a hundredth of what is likeliest.

Two causes may hide each other, each below its threshold: where no single one is likely, or something else is likelier,
the pair that removes most by the linear scores is fitted from both at once (`together`).

A refit may miss its minimum where another one, from beside it, finds it: so a pair whose weaker member lies within 2.5
standard deviations of zero is fitted again without it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from operator import attrgetter

import numpy as np

from pipeline.diagnosis.causes.begun import BEGUN
from pipeline.diagnosis.causes.lever import LEVER
from pipeline.diagnosis.causes.unnamed import (
    SIZES,
    UNKNOWN,
    Unknown,
    carried_over,
    of_size,
    size_told,
)
from pipeline.diagnosis.explanations.candidates import LEAST, candidates, far_behind, hidden_pair
from pipeline.diagnosis.explanations.forms import SHAPE_GAIN
from pipeline.diagnosis.explanations.pair_fits import by_step, in_any_form, pairs_beside, together, with_all_forms
from pipeline.diagnosis.explanations.refit import fit_term
from pipeline.diagnosis.explanations.single_cause import ALSO, Refits, known_refits
from pipeline.diagnosis.fits.search import Suspicion, beside_usual, suspect
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.error_grid import ErrorGrid, error_grid
from pipeline.diagnosis.posterior.explanation import Explanation, explanation_of
from pipeline.diagnosis.posterior.hypotheses import ALIKE, SHARES, Hypothesis, Posterior, posterior
from pipeline.diagnosis.posterior.weigh import Weighed, refitted, weighed
from rod.inverse.base_fit import settled
from rod.inverse.extension import Term
from rod.inverse.fit import FITS, Fit, evaluated, fit, shown

LIKELIEST = 4
"""Refits, the likeliest first, that are weighed with something else besides; single causes that pairs begin with."""

BEYOND = 2.0
"""Times what the linear model promises of forces without a name, in log evidence: no fit is trusted to gain more. Of
58 kinds of them in 15 tests one that was of weight gained 1.2 times its promise, and none more than 1.6 times."""

NEEDED = 2.5
"""Standard deviations from nothing that each member of a pair must have to be left in it."""

Forms = tuple[int, frozenset[str]]
"""A cause and the labels of its forms."""


class Search:
    """Hypotheses about one specimen as they are found, and their probabilities."""

    def __init__(self, bench: Workbench, known: Refits | None = None) -> None:
        self.bench, self.known = bench, known or {}
        self.grid: ErrorGrid = error_grid(bench.observation, bench.facts)
        self._about: dict[Explanation, Suspicion] = {}
        self._beside: dict[Explanation, Weighed] = {}
        self.causes = [cause for k, cause in enumerate(bench.suspicion.causes) if bench.suspicion.of(k).size]
        first = weighed(self.grid, bench.base, bench.suspicion)
        self.hypotheses = [Hypothesis((), first.own.plain, first.own.rest)]
        self.hypotheses += [Hypothesis((cause,), *values) for cause, values in first.further.items()]

    @property
    def posterior(self) -> Posterior:
        """Of all that was found so far."""
        return posterior(self.hypotheses, self.causes)

    def add(self, found: Sequence[Explanation]) -> list[Explanation]:
        """Weigh refits and return them; what is among the likeliest is fitted to the end, and with something else."""
        new = [(refitted(self.grid.plain, one, self.bench.facts).plain, one) for one in found]
        new.sort(key=lambda pair: -pair[0])
        known = [one.plain for one in self.hypotheses if one.found is not None]
        least = min(sorted([*known, *(plain for plain, _ in new)])[-LIKELIEST:], default=0.0)
        rest, hopeless = self.hypotheses[0].rest, far_behind(self._least(found))
        best = [self._settled(one, hopeless) for plain, one in new if plain >= least]
        others = [Hypothesis(one.causes, plain, rest, one) for plain, one in new if plain < least]
        self.hypotheses += [*(refitted(self.grid, one, self.bench.facts) for one in best), *others]
        return [*best, *(one for plain, one in new if plain < least)]

    def _least(self, new: Sequence[Explanation] = ()) -> float:
        """Smallest chi-square of all refits of named causes; infinite without any."""
        known = (one.found for one in self.hypotheses if one.found is not None and not one.found.unnamed)
        return min((one.fitted.chi2 for one in (*known, *new)), default=np.inf)

    def _settled(self, one: Explanation, hopeless: float) -> Explanation:
        fitted = settled(self.bench.observation, one.fitted, hopeless=hopeless)
        return one if fitted is one.fitted else explanation_of(one.causes, self.bench.base, fitted)

    def singles(self) -> list[Explanation]:
        """Refit causes that matter or score near the best one; all that show where something else is likelier."""
        linear = {one.causes[0] for one in self.posterior.believed if len(one.causes) == 1 and one.probability > ALSO}
        near = candidates(self.bench.suspicion, any_sign="mounted" not in self.bench.facts.branch)
        tried = [*near, *sorted(linear - set(near))]
        found = self.add(list(self._each(tried)))
        if self.posterior.word == "rest":
            others = set(range(len(self.bench.suspicion.causes))) - set(tried)
            found += self.add(list(self._each([k for k in sorted(others) if self._shows(self.bench.suspicion, k)])))
        return found

    def _each(self, causes: Sequence[int]) -> Iterator[Explanation]:
        bench = self.bench
        rival = min((one.fitted.chi2 for _, found in self.known.values() for one in found), default=np.inf)
        for cause in (cause for cause in causes if bench.suspicion.of(cause).size):
            for one in known_refits(bench, cause, self.known, rival=rival):
                if one.gain > 0.0:
                    rival = min(rival, one.fitted.chi2)
                    yield from (one, *by_step(bench, one, hopeless=rival + LEAST))

    def likeliest(self) -> list[Explanation]:
        """The likeliest single causes, and what is nearly as likely as the first one in another form of it."""
        best = [one.found for one in self.posterior.explanations(count=1) if one.found is not None][:LIKELIEST]
        plain = {one.found: one.plain for one in self.hypotheses if one.found is not None}
        others = (one for one in plain if best and one.causes == best[0].causes and one is not best[0])
        return [*best, *(one for one in others if plain[one] > plain[best[0]] + np.log(ALSO))]

    def beside(self, one: Explanation) -> Suspicion:
        """Scores of all causes about a single cause."""
        if one not in self._about:
            self._about[one] = suspect(self.bench.observation, one.fitted, self.bench.suspicion.causes)
        return self._about[one]

    def pairs(self, singles: Sequence[Explanation], found: list[Explanation]) -> None:
        """Refit pairs besides those ``found``: single causes with what scores most beside each.

        Until no pair that shares a cause with the likeliest one is likelier: one of two causes that act together may
        alone look like a third, and what scores most beside that third is neither.
        """
        bench, begun = self.bench, {self._forms(one, one.causes[0]) for one in singles}
        found += [pair for one in singles for pair in self._with_others(one)]
        # what the linear model promised of two causes counts no more: they were fitted
        self.hypotheses = [one for one in self.hypotheses if len(one.causes) < 2 or one.found]
        found = self.add(found)
        for member in self._members_alone(begun):
            (member,) = self.add([member])
            found += self.add(self._with_others(member))
        self.add(list(self._pruned(found)))
        believed = self.posterior
        # before something is called unexplained, every other cause is tried in its place beside the nearest one
        if believed.word == "rest":
            alone = (one.found for one in believed.beside_something_else() if len(one.causes) == 1)
            best = next((one for one in alone if one is not None and not one.unnamed), singles[0])
            second = self.beside(best)
            every = candidates(second, margin=1.0, most=len(second.causes))
            others = [cause for cause in every if not any({*best.causes, cause} == {*pair.causes} for pair in found)]
            found += self.add(self._pairs_beside(best, others))
        elif believed.total(count=2) < sum(SHARES[2]):
            return
        forms = with_all_forms(bench, found, hopeless=far_behind(self._least()))
        new = [one for one in forms if one not in found]
        new += in_any_form(bench, forms)
        new = self.add(new)
        self.add(list(self._pruned(new)))

    def _with_others(self, one: Explanation) -> list[Explanation]:
        """A single cause with each of the two that score most beside it, and of those that are likely by the scores."""
        promised, known = self._promised(one), [known.plain for known in self.hypotheses if known.found is not None]
        enough = np.logaddexp.reduce([*promised.values(), *known, self._top]) + np.log(ALSO)
        likely = [cause for cause, plain in promised.items() if plain > enough]
        return self._pairs_beside(one, [*dict.fromkeys([*candidates(self.beside(one))[:2], *likely])])

    def _promised(self, one: Explanation) -> dict[int, float]:
        """Log evidence that the linear model promises of a single cause with every other one beside it."""
        if one not in self._beside:
            self._beside[one] = weighed(self.grid.plain, one.fitted, self.beside(one))
        beside = self._beside[one]
        mine = self._plain(one) - beside.own.plain
        return {cause: plain + mine for cause, (plain, _) in beside.further.items()}

    def _plain(self, one: Explanation) -> float:
        return next(known.plain for known in self.hypotheses if known.found is one)

    @property
    def _top(self) -> float:
        """Log evidence of what is most probable."""
        return self.hypotheses[0].plain + self.posterior.believed[0].gain

    def _pairs_beside(self, one: Explanation, causes: Sequence[int]) -> list[Explanation]:
        """A single cause with those of some others that show beside it, as far as that may come near the likeliest."""
        # log evidence rises by at most half of what chi-square falls by
        hopeless = one.fitted.chi2 - 2.0 * (self._top + np.log(ALSO) - self._plain(one))
        second, hopeless = self.beside(one), min(hopeless, self._least() + LEAST)
        seen = [cause for cause in causes if self._shows(second, cause)]
        return pairs_beside(self.bench, one, second, seen, hopeless=hopeless)

    def _shows(self, about: Suspicion, cause: int) -> bool:
        """Whether a cause scores as each member of a pair must; without a photo of the cable at rest, with any sign."""
        score = about.statistic if "mounted" in self.bench.facts.branch else np.abs(about.scores.z)
        return bool(score[about.of(cause)].max(initial=0.0) > NEEDED)

    def _members_alone(self, begun: set[Forms]) -> Iterator[Explanation]:
        """Causes of the likeliest pair, each fitted alone in the form that it has there, if that is new."""
        while True:
            likeliest = next(iter(self.posterior.explanations(count=2)), None)
            pair = None if likeliest is None else likeliest.found
            left = [cause for cause in pair.causes if self._forms(pair, cause) not in begun] if pair is not None else []
            if pair is None or not left:
                return
            begun.add(self._forms(pair, left[0]))
            rest = self._without(pair, next(cause for cause in pair.causes if cause != left[0]))
            if rest is not None:
                yield rest

    def _forms(self, one: Explanation, cause: int) -> Forms:
        """A cause and the labels of its forms in an explanation."""
        extension = one.fitted.extension
        own = extension.terms_of(self.bench.suspicion.causes[cause])
        return cause, frozenset(extension.terms[k].variant.label for k in own)

    def _without(self, pair: Explanation, gone: int) -> Explanation | None:
        """A pair without one of its causes, the rest fitted again; None where that is no better than the base."""
        kind, left = self.bench.suspicion.causes[gone], tuple(cause for cause in pair.causes if cause != gone)
        extension, vector = pair.fitted.extension.without(pair.fitted.vector, pair.fitted.extension.terms_of(kind))
        rest = fit(self.bench.observation, extension, vector, near=pair.fitted.run)
        if rest.run.prediction is None or rest.chi2 >= self.bench.base.chi2:
            return None
        return explanation_of(left, self.bench.base, rest)

    def _pruned(self, pairs: Sequence[Explanation]) -> Iterator[Explanation]:
        """Pairs without a member that they do not need, the rest fitted again where no single refit is as good."""
        reached = {one.causes: one.found.fitted.chi2 for one in self.posterior.explanations(count=1) if one.found}
        for pair in pairs:
            weak = min(pair.causes, key=lambda k: pair.sigma(self.bench.suspicion.causes[k]))
            left = tuple(k for k in pair.causes if k != weak)
            known = reached.get(left, np.inf) < pair.fitted.chi2 + NEEDED**2
            if known or pair.sigma(self.bench.suspicion.causes[weak]) > NEEDED:
                continue
            rest = self._without(pair, weak)
            if rest is not None:
                reached[left] = min(rest.fitted.chi2, reached.get(left, np.inf))
                yield rest

    def unnamed(self) -> None:
        """What has no name in the catalogue: moments beside the base model, what begins beside the likeliest causes."""
        base, bench = explanation_of((), self.bench.base, self.bench.base), self.bench
        known = [base, *(found.found for found in self.posterior.explanations()[:LIKELIEST] if found.found)]
        hopeless = min(one.fitted.chi2 for one in known) + LEAST
        for one in known:
            about = suspect(bench.observation, one.fitted, (*BEGUN, LEVER))
            loud = (about.best(number) for number in range(len(about.causes)))
            least = max(SHAPE_GAIN, one.fitted.chi2 - hopeless)
            since = [k for k in loud if k is not None and about.statistic[k] ** 2 > least]
            fits = (fit_term(bench.observation, one.fitted, about, k, hopeless=hopeless) for k in since)
            # what the linear model promised is worth going on for
            usable = (found for found in fits if found is not None and found.run.prediction is not None)
            whole = (found if found.converged else settled(bench.observation, found) for found in usable)
            self._weigh_unnamed(one.causes, whole)
        for unknown in UNKNOWN:
            self._weigh_unknown(unknown, hopeless)

    def _weigh_unknown(self, unknown: Unknown, hopeless: float) -> None:
        """Forces or moments where they promise most, then of the size that they say themselves, with more, and begins.

        From a large size down: of a small one a fit stays beside the small forces that a wrong model is content with.
        """
        facts, base = self.bench.facts, self.bench.base

        def tried(every: Iterable[tuple[Term, ...]], near: Fit, hopeless: float = np.inf) -> list[Hypothesis]:
            return self._weigh_unnamed((), self._with(every, near, hopeless))

        def sized(best: Hypothesis) -> Hypothesis:
            known, size = best.terms, SIZES[-1]
            while (told := size_told(_fit_of(best))) < size:
                size = told
                best = max([best, *tried([of_size(known, size)], _fit_of(best))], key=attrgetter("rest"))
            return best

        ways = (unknown.ways(facts, at, SIZES[-1]) for at in unknown.places.values())
        promised = {terms: self._linear_gain(terms) for terms in ways}
        most = max(promised, key=promised.__getitem__)
        needed = self._top + np.log(ALSO) - self.hypotheses[0].plain
        found = tried([most], base, hopeless) if BEYOND * promised[most] > needed else []
        if not found:
            return
        best = sized(found[0])
        more = tried((of_size(terms, SIZES[-1]) for terms in unknown.freer(best.terms)), _fit_of(best))
        best = max([best, *map(sized, more)], key=attrgetter("rest"))
        if any(one.found is best.found and one.probability > ALSO for one in self.posterior.beside_something_else()):
            tried(unknown.since(best.terms, facts), _fit_of(best), hopeless)

    def _linear_gain(self, terms: tuple[Term, ...]) -> float:
        """Log evidence that the linear model promises of forces or moments, of the size that they say themselves."""
        bench, base = self.bench, self.bench.base
        extension = replace(base.extension, terms=terms)
        here = shown(bench.observation, extension, extension.start(base.vector, (0.0,) * len(terms)), base.run)
        begin = evaluated(bench.observation, extension, here)
        if here.run.prediction is None:
            return -np.inf
        move = np.linalg.lstsq(begin.jacobian, begin.residual, rcond=None)[0]
        size = size_told(replace(begin, vector=begin.vector + move))
        own = replace(extension, terms=of_size(terms, size))
        table = np.vstack([begin.jacobian[: bench.observation.rows.count], own.prior])
        promised = explanation_of((), base, replace(begin, extension=own, jacobian=table))
        return refitted(self.grid.plain, promised, bench.facts).rest - self.hypotheses[0].plain

    def _with(self, every: Iterable[tuple[Term, ...]], near: Fit, hopeless: float) -> Iterator[Fit]:
        """The base model with terms, fitted from a fit ``near`` and from what these terms make alike in it."""
        base, known = self.bench.base.extension, near.extension
        for terms in every:
            start = carried_over(terms, known.terms, near.vector[[*known.amounts_at]], base.facts)
            start = np.r_[near.vector[: len(base.base.names)], start]
            yield fit(self.bench.observation, replace(base, terms=terms), start, near=near.run, hopeless=hopeless)

    def _weigh_unnamed(self, causes: tuple[int, ...], fits: Iterable[Fit | None]) -> list[Hypothesis]:
        known = (fitted for fitted in fits if fitted is not None and fitted.run.prediction is not None)
        # a fit that went astray leaves more than nothing at all does, up to what no arithmetic bears
        seen = (fitted for fitted in known if fitted.chi2 < self.bench.base.chi2)
        found = (explanation_of(causes, self.bench.base, fitted) for fitted in seen)
        new = [refitted(self.grid.plain, one, self.bench.facts) for one in found]
        self.hypotheses += new
        return new

    def pairs_speak(self, best: Explanation) -> bool:
        """Whether the data make, or may make, two causes or something else likelier than they were beforehand."""
        rest = self.hypotheses[0].rest
        for cause, plain in self._promised(best).items():
            if cause not in best.causes and self._shows(self.beside(best), cause):
                self.hypotheses.append(Hypothesis((*best.causes, cause), plain, rest))
        believed = self.posterior
        beforehand = sum(SHARES[2]) + sum(something_else for _, something_else in SHARES.values())
        return believed.total(count=2) + believed.total(something_else=True) > beforehand


def _fit_of(one: Hypothesis) -> Fit:
    assert one.found is not None
    return one.found.fitted


def searched(bench: Workbench, known: Refits | None = None) -> Search:
    """All hypotheses about a specimen that are worth it, weighed; ``known`` causes are not refitted again."""
    search = Search(bench, known)
    nothing, *causes = search.hypotheses
    # the linear model has each form alone; what it makes no likelier than nothing is none with all its forms either
    sound = search.posterior.word == "base"
    silent = sound and all(one.plain < nothing.plain + ALIKE for one in causes)
    about = beside_usual(bench.base, bench.suspicion)
    hidden = hidden_pair(about) if sound else ()
    # a law that is pulled far from what is known of laws hides a cause to first order, and leaves more than noise
    fits = bench.base.reduced_chi2 < FITS
    if silent and fits and not hidden:
        return search
    search.singles()
    search.unnamed()
    singles = search.likeliest()
    # beside a base model that stays the likeliest no pair is sought, unless two causes hide each other
    if singles and (hidden or (search.posterior.word != "base" and search.pairs_speak(singles[0]))):
        if not hidden and search.posterior.word == "rest":
            hidden = hidden_pair(about)
        search.pairs(singles, together(bench, hidden) if hidden else [])
    return search
