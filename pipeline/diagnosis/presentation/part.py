"""From a conclusion to the part of the result: what is named, what it is worth, what stays open, what to do next.

gain on steps held out -> table of all causes -> f_EI identified again -> causes named, with their classes -> verdict ->
the sentence on top -> the part of the result.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes.begun import BEGUN
from pipeline.diagnosis.causes.lever import LEVER
from pipeline.diagnosis.causes.load_cell import Relaxation, lost_unseen
from pipeline.diagnosis.causes.unnamed import UnknownForces, UnknownMoments, UnknownReadings
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.extended import curve
from pipeline.diagnosis.fits.heldout import measured_gain
from pipeline.diagnosis.fits.identified_again import identified_again
from pipeline.diagnosis.fits.maps import residual_map
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.plans.next_experiment import next_experiment
from pipeline.diagnosis.presentation.leftover import described
from pipeline.diagnosis.presentation.named import (
    all_believed,
    change_of_stiffness,
    hypotheses,
    known_to,
    named_causes,
)
from pipeline.diagnosis.presentation.table import blind_spots, confusable, seen_at_plausible_size, table
from pipeline.diagnosis.words import could_have_been_seen, headline, verdict
from pipeline.messages import Message
from pipeline.result import BlindSpot, Curve, DiagnosisPart, NextExperiment
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.fit import Fit

AFTER = {"left.astray": "next.repeat", LEVER.name: "next.axis", UnknownReadings.name: "next.empty"}
AFTER |= dict.fromkeys((cause.name for cause in BEGUN), "next.repeat")
AFTER |= dict.fromkeys((UnknownForces.name, UnknownMoments.name), "next.look")
"""What to do about what is left: what may have come by chance need not come again, what acts at a place is there."""


def present(
    bench: Workbench,
    conclusion: Conclusion,
    settings: DiagnosisSettings,
    *,
    identified: Curve | None = None,
    shown: Fit | None = None,
) -> DiagnosisPart:
    """Fill the part of the result.

    ``identified`` is f_EI before the diagnosis, which people compare with; ``shown`` what was concluded, beside a rig
    as far off as every rig is, whose residuals are shown.
    """
    accepted = conclusion.accepted
    gain = None if accepted is None else measured_gain(bench, accepted.fitted, settings)
    rows = table(bench, conclusion, settings, gain=gain)
    seen = seen_at_plausible_size(bench, rows)
    again = None
    if accepted is not None:
        errors = [
            np.array([error.get(step.step, 0.0) for step in bench.test.steps])
            for error in bench.test.common_force_errors
        ]
        errors += _begun_unseen(accepted.fitted)
        again = identified_again(bench.observation, shown or accepted.fitted, force_errors=errors)
    extended = None if again is None else curve(again.fitted, covariance=again.covariance, other=again.other)
    causes = named_causes(bench, conclusion, again, extended)
    word = verdict(
        found=accepted is not None,
        unmodelled=conclusion.unmodelled,
        classes=conclusion.classes,
        powerless=len(seen) < settings.powerless * len(rows),
    )
    told = identified is not None and sum(identified.supported) > 1
    plain = identified if identified is not None and told else curve(bench.base)
    # the answer is the curve that all that is believed leaves the narrower band, with that band
    wider = None if extended is not None and word != "unexplained" else all_believed(bench, conclusion, plain)
    refuted = False
    if extended is not None and accepted is not None and again is not None:
        own = accepted.fitted, again.fitted
        extended = all_believed(bench, conclusion, extended, own).of(extended)
        refuted = wider is not None and known_to(wider.of(plain)) < known_to(extended)
    leftover = described(bench, conclusion)
    believed, none = hypotheses(bench, conclusion)
    sentence = headline(
        word,
        causes=causes,
        explained=None if gain is None else gain.heldout_excess_removed,
        beside=conclusion.posterior.total(something_else=True),
        change=change_of_stiffness(bench, accepted, extended, identified),
        seen=could_have_been_seen(seen, len(rows)),
        left=leftover.said,
    )
    photos, forces = left_out(bench)
    before = bench.base if shown is None or accepted else shown
    spots = blind_spots(bench, seen, settings)
    return DiagnosisPart(
        verdict=word,
        **DiagnosisPart.told(sentence),
        hypotheses=believed,
        none_of_these=none,
        causes=causes,
        table=rows,
        gain=gain,
        blind_spots=spots,
        next_experiment=what_next(
            bench, conclusion, settings, spots=spots, left=leftover.key if word == "unexplained" else None
        ),
        extended=extended,
        extended_refuted=refuted,
        widening=wider if extended is None or refuted else None,
        leftover=leftover,
        residuals_before=residual_map(bench.test, bench.observation, before),
        residuals_after=residual_map(bench.test, bench.observation, shown or accepted.fitted) if accepted else None,
        twins=confusable(bench, conclusion),
        left_out_photos=photos,
        left_out_forces=forces,
    )


def _begun_unseen(fitted: Fit) -> list[NDArray[np.float64]]:
    """What forces (n,) N may have lost before the first sample of their holds, where the cable relaxes."""
    extension, forces = fitted.extension, np.array([step.force for step in fitted.run.steps])
    terms = [extension.formed(fitted.vector, k) for k in range(len(extension.terms))]
    lost = [
        lost_unseen(fitted.amount(k)[0], term.variant, extension.facts)
        for k, term in enumerate(terms)
        if isinstance(term.cause, Relaxation)
    ]
    return [sum(lost) * forces] if lost else []


def left_out(bench: Workbench) -> tuple[list[int], list[int]]:
    """Steps whose photo, and steps whose force, the data at fault took out of the diagnosis."""
    used = {photo.step for photo in bench.observation.photos}
    steps = list(enumerate(bench.test.steps))
    return (
        [step.step for k, step in steps if step.shape is not None and k not in used],
        [step.step for k, step in steps if bench.observation.forces[k].size == 0],
    )


def what_next(
    bench: Workbench,
    conclusion: Conclusion,
    settings: DiagnosisSettings,
    *,
    spots: list[BlindSpot],
    left: str | None,
) -> NextExperiment | None:
    """What separates the names that are confused; without any, what tells most about what these data cannot show.

    In this order: a class can be settled, a misfit without a name needs a second look at the same cable, a test without
    unloading hides whole causes, and the force calibration is never seen. ``left`` is the key of what is unexplained:
    what came by chance need not come again, and what acts at a place is looked for there.
    """
    if conclusion.accepted is not None and conclusion.rivals and left is None:
        return next_experiment(bench, conclusion.accepted, conclusion.rivals, settings)
    if left is not None:
        turn = "next.turn" if bench.facts.returns else "next.turn-unload"
        return NextExperiment(**NextExperiment.told(Message(AFTER.get(left, turn))), separates=[])
    if not bench.facts.returns:
        hidden = ["bearing_friction", "hysteresis", "plastic_set"]
        return NextExperiment(**NextExperiment.told(Message("next.unload")), separates=hidden)
    gain = next((spot.stiffness_bias_at_plausible_size for spot in spots if spot.name == "force_gain"), None)
    if gain is None:
        return None
    return NextExperiment(**NextExperiment.told(Message("next.weights", change=gain)), separates=["force_gain"])
