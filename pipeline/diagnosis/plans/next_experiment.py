"""The cheapest further measurement that separates what these data confuse.

For each protocol that was not made yet the most probable explanation is simulated without noise, each rival is fitted
to that to first order, and what remains of the rival's misfit (in sigma) says how far the protocol takes the two apart:
photograph the force-free cable; unload in the same steps; come back to displacement zero; turn the cable end for end.
Every protocol is held against plain repetition, whose twice as many data give the square root of two by themselves.
Where none is expected to separate the rivals better than that, one of them may be settled by itself (a spirit level,
dead weights); else the same test once more is proposed, or it is said that nothing here separates them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.plans.plan import more_steps, planned_test, precision_of
from pipeline.diagnosis.posterior.explanation import Explanation
from pipeline.messages import Message, entry
from pipeline.records import Array
from pipeline.result import NextExperiment
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.cause import Cause
from rod.inverse.fit import Fit
from rod.inverse.observation import Observation, observe
from rod.inverse.prediction import Facts
from rod.inverse.sensitivities import sensitivities, whole_residual
from rod.inverse.simulation import run


@dataclass(frozen=True, eq=False)
class Protocol:
    """A further measurement: key of what to do, circumstances, whether the test is made again, turned end for end."""

    what: str
    facts: Facts
    again: bool = False
    turned: bool = False


def protocols(facts: Facts) -> list[Protocol]:
    """What was not made yet, the cheapest first."""
    found = []
    if "mounted" not in facts.branch:
        found.append(Protocol("next.free-photo", more_steps(facts, [0.0], ["mounted"])))
    if not facts.returns:
        back = sorted({float(d) for d in facts.displacement if d > 0.0}, reverse=True)[1:] or [
            0.5 * float(facts.displacement.max())
        ]
        found.append(Protocol("next.unload", more_steps(facts, back, ["unloading"] * len(back))))
    elif facts.displacement[-1] > 0.0:
        there = more_steps(facts, [0.0], ["unloading"])
        found.append(Protocol("next.back", there))
    found.append(Protocol("next.repeat", facts, again=True))
    found.append(Protocol("next.turn", facts, again=True, turned=True))
    return found


def still_open(cause: Cause, bench: Workbench) -> bool:
    """Whether what settles a cause was not made yet: there is no use in asking for a branch that the test has."""
    if cause.name in BY_UNLOADING:
        return not bench.facts.returns
    if cause.name in BY_FREE_PHOTO:
        return all(bench.facts.branch[photo.step] != "mounted" for photo in bench.observation.photos)
    return True


BY_UNLOADING = {"bearing_friction", "hysteresis"}
BY_FREE_PHOTO = {"pre_curvature_varying", "displacement_offset"}
"""Causes that are settled by a branch of the test itself."""


def next_experiment(
    bench: Workbench, probable: Explanation, rivals: Sequence[Explanation], settings: DiagnosisSettings
) -> NextExperiment | None:
    """The cheapest protocol that takes the most probable explanation apart from all rivals; None without rivals."""
    if not rivals:
        return None
    causes = bench.suspicion.causes
    every = (probable, *rivals)
    common = set(probable.causes).intersection(*(rival.causes for rival in rivals))
    differing = list(dict.fromkeys(cause for e in every for cause in e.causes if cause not in common))
    names = [causes[cause].name for cause in differing]
    planned = _Planned(bench, probable.fitted)
    apart = {
        protocol.what: min(planned.separation(rival.fitted, protocol) for rival in rivals)
        for protocol in protocols(bench.facts)
    }
    repeated = apart["next.repeat"]
    # what is no better than the same once more is no experiment of its own
    better = {what: sigma for what, sigma in apart.items() if sigma > repeated + BETTER}
    enough = [what for what, sigma in better.items() if sigma >= settings.separated]
    differ = (causes[cause] for cause in differing if causes[cause].seat != "cable")
    outside = [cause.name for cause in differ if still_open(cause, bench)]
    if not enough and outside:
        said = Message("next.settled", by=entry("settled", outside[0]))
        return NextExperiment(**NextExperiment.told(said), separates=names, repeated_sigma=repeated)
    what = enough[0] if enough else max(better, key=lambda name: better[name], default="next.repeat")
    sigma = apart[what]
    if sigma < TELLS:
        what, names = "next.nothing", []
    return NextExperiment(**NextExperiment.told(Message(what)), separates=names, sigma=sigma, repeated_sigma=repeated)


BETTER, TELLS = 1.0, 2.0
"""Sigma: a protocol counts as better than repetition if it takes the rivals apart by one more, and as telling anything
from two on."""


class _Planned:
    """What the most probable explanation would show, and each rival misfit of it; nothing is simulated twice."""

    def __init__(self, bench: Workbench, probable: Fit) -> None:
        self.bench, self.probable = bench, probable
        self.precision = precision_of(bench.test, bench.observation.force_std)
        self.shown, self.held = cache(self._shown), cache(self._held)

    def separation(self, rival: Fit, protocol: Protocol) -> float:
        """Sigma between two explanations if the protocol were made and the rival refitted, to first order."""
        blocks = [(self.bench.facts, False)] if protocol.again else []
        held = [self.held(rival, *block) for block in (*blocks, (protocol.facts, protocol.turned))]
        seen = [block for block in held if block is not None]
        if len(seen) < len(held):
            return 0.0
        value, jacobian = (np.concatenate(parts) for parts in zip(*seen, strict=True))
        size = np.linalg.norm(jacobian, axis=0)
        scaled = jacobian / np.where(size > 0.0, size, 1.0)
        return float(np.linalg.norm(value - scaled @ np.linalg.lstsq(scaled, value, rcond=1e-8)[0]))

    def _shown(self, facts: Facts, turned: bool) -> Observation | None:
        truth = replace(self.probable.extension, facts=facts, turned=turned)
        made = run(truth.model(self.probable.vector), facts)
        return None if made.prediction is None else observe(planned_test(made, facts, self.precision))

    def _held(self, rival: Fit, facts: Facts, turned: bool) -> tuple[Array, Array] | None:
        """Residual and sensitivities of a rival."""
        observation, other = self.shown(facts, turned), replace(rival.extension, facts=facts, turned=turned)
        if observation is None:
            return None
        base_model = other.base_model(rival.vector)
        here = run(other.model(rival.vector, of=base_model), facts)
        value = whole_residual(observation, here.prediction, rival.vector, other.prior)
        return None if value is None else (value, sensitivities(observation, other, rival.vector, base_model, here))
