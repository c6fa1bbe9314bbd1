"""What the load cell gets wrong, and what the force does while a step is held.

    force_offset  shown = F + a
    force_gain    shown = F (1 + a)
    force_drift   shown = F + a T g(t / T)                   t: since the first hold began, T: until the last one did
    relaxation    shown = F (1 - a (1 - exp(-t / tau)))      t: since this hold began; sums of such forms, or
                  shown = F (1 + t / tau)^-n                 a = 1 - (1 + T / tau)^-n, T: the longest hold

What drifts does so steadily, g(u) = u, or settles like a warm-up or speeds up, g(u) = (1 - exp(-w u)) / (1 - exp(-w)).
A zero that wanders has another rate in each hold, and between them.
Relaxation belongs to the cable, but as it scales moments everywhere alike it changes forces only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pipeline.records import Array
from rod.inverse.cause import Cause, Variant
from rod.inverse.prediction import Facts, Model, Observer, Prediction


def shown(reading: Callable[[Array, Array, float], Array]) -> Observer:
    """Observer whose load cell shows ``reading(force, time in the hold, time at which the hold began)``."""

    def observer(prediction: Prediction, facts: Facts) -> Prediction:
        samples = tuple(
            reading(force, times, float(clock))
            for force, times, clock in zip(prediction.samples, facts.hold_times, facts.clock, strict=True)
        )
        times = zip(facts.photo_time, facts.clock, strict=True)
        photo = [reading(prediction.force[..., i], time, float(begin)) for i, (time, begin) in enumerate(times)]
        return replace(prediction, force=np.stack(photo, axis=-1), samples=samples)

    return observer


SETTLING = Variant(tuned=("width",), width_range=(-4.0, 4.0))
"""Of what drifts: from a change that comes in the last quarter of the test to one that goes in the first."""


def passed(share: Array, settling: float) -> Array:
    """Share of the whole drift reached after a share of the test: in proportion, or like 1 - exp(-settling share)."""
    if abs(settling) < 1e-6:
        return share
    return np.asarray(np.expm1(-settling * share) / np.expm1(-settling))


class ForceOffset(Cause):
    """``force_offset``: the load cell was not zeroed."""

    name = "force_offset"
    unit = "N"
    seat = "load cell"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the largest force."""
        return 0.02 * facts.force_scale

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount`` to every reading."""
        return model.observed(shown(lambda force, time, begin: force + amount))


class ForceGain(Cause):
    """``force_gain``: the load cell's calibration is off."""

    name = "force_gain"
    unit = "-"
    seat = "load cell"

    def plausible(self, facts: Facts) -> float:
        """One percent: a load cell a few years after its calibration."""
        return 0.01

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Multiply every reading by ``1 + amount``."""
        return model.observed(shown(lambda force, time, begin: force * (1.0 + amount)))


class ForceDrift(Cause):
    """``force_drift``: the load cell drifts with time."""

    name = "force_drift"
    unit = "N/s"
    limited = True
    seat = "load cell"

    def plausible(self, facts: Facts) -> float:
        """Two percent of the largest force over the test."""
        span = float(np.max(facts.clock)) if facts.timed else 0.0
        return 0.02 * facts.force_scale / span if span > 0.0 else 0.02 * facts.force_scale

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Steady, settling or speeding up, if the log has times."""
        return (SETTLING,) if facts.timed else ()

    def by_step(self, amount: float, facts: Facts) -> tuple[tuple[Variant, ...], ...]:
        """A zero that wanders: a rate for each hold and for each time between, a random walk as large as the drift.

        Between two holds the rate is the mean of theirs, give or take a part of the plausible rate.
        """
        if not (facts.timed and np.max(facts.clock) > 0.0):
            return ()
        passing = np.diff(_moments(facts)) / float(np.max(facts.clock))
        most = max(1.0, abs(amount) / self.plausible(facts)) * np.where(np.arange(passing.size) % 2, BETWEEN, 1.0)
        parts = np.flatnonzero(passing > 0.0)
        return (tuple(Variant(WANDERING, at=float(k), known=most[k] / np.sqrt(passing[k])) for k in parts),)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Add ``amount``, the mean rate, times the time since the first hold began.

        A form of `by_step` adds ``amount`` to the rate in part ``at`` of the test and takes away so much of the mean.
        """
        span = float(np.max(facts.clock)) or 1.0
        if variant.label == WANDERING:
            rates = amount * np.eye(2 * facts.clock.size - 1)[int(variant.at)]
            kept = tuple(one for one in model.observers if not isinstance(one, _Wandering))
            rates = sum((one.rates for one in model.observers if isinstance(one, _Wandering)), rates)
            return replace(model, observers=(*kept, _Wandering(rates)))

        def reading(force: Array, time: Array, begin: float) -> Array:
            return np.asarray(force + amount * span * passed((begin + time) / span, variant.width))

        return model.observed(shown(reading))

    def together(self, forms: Sequence[Variant], facts: Facts) -> tuple[str, Array] | None:
        """How far a zero that wanders has gone, N, when holds begin and end."""
        if all(form.label != WANDERING for form in forms):
            return None
        span, parts = float(np.max(facts.clock)) or 1.0, np.eye(2 * facts.clock.size - 1)
        rows = [
            _path(parts[int(form.at)], facts)
            if form.label == WANDERING
            else span * passed(_moments(facts) / span, form.width)
            for form in forms
        ]
        return "N", np.column_stack(rows)


WANDERING, BETWEEN = "wandering", 0.3
"""Label of a drift whose rate changes, and how far (share of the rates, standard deviation) it changes unseen: what
stands still in the holds and jumps between them is no drift."""


@dataclass(frozen=True, eq=False)
class _Wandering:
    """Observer whose zero wanders: ``rates`` (2 n - 1,) N/s in n holds and in the times between, beside a mean rate."""

    rates: Array

    def __call__(self, prediction: Prediction, facts: Facts) -> Prediction:
        moments, path = _moments(facts), _path(self.rates, facts)
        zero = shown(lambda force, time, begin: np.asarray(force + np.interp(begin + time, moments, path)))
        return zero(prediction, facts)


def _path(rates: Array, facts: Facts) -> Array:
    """Where a zero that wanders is at `_moments`, N, beside its mean rate."""
    moments, span = _moments(facts), float(np.max(facts.clock)) or 1.0
    rates = rates.copy()
    rates[1::2] += 0.5 * (rates[:-1:2] + rates[2::2])
    path = np.append(0.0, np.cumsum(rates * np.diff(moments)))
    return np.asarray(path - moments / span * np.interp(span, moments, path))


def _moments(facts: Facts) -> Array:
    """Begin and end of each hold, one after the other, s; never back in time."""
    ends = [begin + np.max(times, initial=0.0) for begin, times in zip(facts.clock, facts.hold_times, strict=True)]
    return np.asarray(np.maximum.accumulate(np.column_stack([facts.clock, ends]).ravel()))


SLOWLY = "by a power of the time", "by a power of the time, since every change of the bow"
"""Labels and settings of a relaxation that has no time constant, without and with a memory."""


def lost_unseen(fitted_amount: float, variant: Variant, facts: Facts) -> float:
    """Share of a force that may be lost before the first sample: a hold began at most one interval of the log earlier.

    A power of the time that began a time b before the first sample, and is counted from there, has tau + b for its tau:
    any b below that leaves the same samples. What is lost in b is then a share n log(1 - b / tau); root mean square
    over b from 0 to the interval, or tau.
    """
    interval = float(np.median(np.concatenate([np.diff(times) for times in facts.hold_times])))
    if variant.label not in SLOWLY:
        return fitted_amount * float(_lost(variant, facts, np.array(interval)))
    left = 1.0 - min(interval / variant.at, 1.0 - 1e-9)
    square = (2.0 - left * (np.log(left) ** 2 - 2.0 * np.log(left) + 2.0)) / (1.0 - left)
    return -_log_left(fitted_amount) / _log_span(variant, facts) * float(np.sqrt(square))


def _lost(variant: Variant, facts: Facts, since: Array) -> Array:
    """Share of a moment that is lost a time after it came, per unit of amount; of a power of the time see `_taken`."""
    if variant.label in SLOWLY:
        return np.asarray(np.log1p(since / variant.at) / _log_span(variant, facts))
    return np.asarray(-np.expm1(-since / variant.at))


def _log_span(variant: Variant, facts: Facts) -> float:
    """log(1 + T / tau), T the longest hold."""
    return float(np.log1p(max(float(np.ptp(times)) for times in facts.hold_times) / variant.at))


def _taken(variant: Variant, amount: float, lost: Array) -> Array:
    """Share of a moment that is lost: ``amount`` times `_lost`, or by a power of the time, (1 - amount)^lost left."""
    return np.asarray(-np.expm1(lost * _log_left(amount)) if variant.label in SLOWLY else amount * lost)


def _log_left(amount: float) -> float:
    """Logarithm of the share of a force that is left after the longest hold: something always is."""
    return float(np.log(max(1.0 - amount, 1e-9)))


@lru_cache(maxsize=64)
def _lost_by_hold(variant: Variant, facts: Facts) -> tuple[Array, ...]:
    """The same for each hold: of what came with each hold up to it (k + 1, n + 1), at its n samples and at its photo.

    Without a memory only of what the hold itself carries, (1, n + 1). Kept: one form is simulated a hundred times.
    """
    table = []
    for k, times in enumerate(facts.hold_times):
        own = np.append(times, facts.photo_time[k])
        since = facts.clock[k] + own - facts.clock[: k + 1, None] if variant.width else own[None]
        table.append(_lost(variant, facts, since))
    return tuple(table)


class Relaxation(Cause):
    """``relaxation``: the force decays while a step is held."""

    name = "relaxation"
    unit = "-"
    sign = 1
    combines = True
    additive = True
    limited = True
    seat = "cable"

    def plausible(self, facts: Facts) -> float:
        """Five percent."""
        return 0.05

    def variants(self, facts: Facts) -> tuple[Variant, ...]:
        """Relaxation times from a tenth of a hold to three holds, each hold by itself or with a memory of earlier ones.

        A cable of several materials has several times: its relaxation is a sum of forms. A log without times is taken
        as sampled evenly.
        """
        span = max((float(np.ptp(times)) for times in facts.hold_times), default=0.0)
        if span <= 0.0:
            return ()
        reach = (0.02 * span, 10.0 * span)
        forms = (
            Variant("decaying in every hold"),
            Variant("decaying since every change of the bow", width=1.0, setting="memory"),
        )
        decays = tuple(
            replace(form, at=share * span, tuned=("at",), at_range=reach, by_factors=True)
            for form in forms
            for share in (0.1, 0.3, 1.0, 3.0)
        )
        slowly = tuple(
            Variant(kind, 0.03 * span, memory, ("at",), (1e-3 * span, span), by_factors=True, setting=kind)
            for kind, memory in zip(SLOWLY, (0.0, 1.0), strict=True)
        )
        return (*decays, *slowly)

    def apply(self, model: Model, amount: float, variant: Variant, facts: Facts) -> Model:
        """Multiply readings by ``1 - amount (1 - exp(-t / at))``, ``at`` the relaxation time, t since the hold began.

        Plastics relax by a power of the time (Findley, Lai and Onaran 1976), from about ``at`` on.

        With a memory (``width`` 1) it is the changes of the moment, force times bow, from hold to hold that decay so,
        each since its own hold began: a standard linear solid, by Boltzmann's superposition.
        """
        lost = [_taken(variant, amount, share) for share in _lost_by_hold(variant, facts)]

        def observer(prediction: Prediction, facts: Facts) -> Prediction:
            at_once = prediction.force if prediction.at_once is None else prediction.at_once
            bow = np.maximum(np.max(np.abs(prediction.y), axis=-1), 1e-9 * facts.length)
            change = np.diff(at_once * bow, prepend=0.0, axis=-1)

            def taken(k: int) -> Array:
                if not variant.width:
                    return np.asarray(at_once[..., k, None] * lost[k][0])
                return np.asarray(change[..., : k + 1] @ lost[k] / bow[..., k, None])

            gone = [taken(k) for k in range(len(lost))]
            samples = tuple(held - one[..., :-1] for held, one in zip(prediction.samples, gone, strict=True))
            force = prediction.force - np.stack([one[..., -1] for one in gone], axis=-1)
            return replace(prediction, force=force, samples=samples, at_once=at_once)

        return model.observed(observer)
