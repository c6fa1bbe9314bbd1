"""Where what no cause explains sits, in words and numbers."""

from __future__ import annotations

from pipeline.diagnosis.causes.begun import BEGUN
from pipeline.diagnosis.explanations.conclusion import Conclusion
from pipeline.diagnosis.fits.maps import whereabouts
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.posterior.evidence import something_else
from pipeline.messages import Message
from pipeline.result import LeftoverPart
from rod.inverse.fit import Fit


def described(bench: Workbench, conclusion: Conclusion) -> LeftoverPart:
    """Say where in the data that is which is likeliest to be something else."""
    observation, fitted = bench.observation, conclusion.fitted(bench)
    field, astray = something_else(conclusion.grid, fitted)
    begun = _begun(bench, fitted)
    found = whereabouts(observation, field)
    step = bench.test.steps[found.step]
    loudest = max(found.share, key=lambda kind: found.share[kind])
    placed = found.place is not None and loudest == "shape"
    place = Message("left.place", at_m=found.place) if placed else ""
    said = begun or Message("left.over", where=f"{loudest}s", step=step.step, branch=step.branch, place=place)
    if astray and not begun:
        said = Message("left.astray", size_m=astray, step=step.step, branch=step.branch)
    return LeftoverPart(
        **LeftoverPart.told(said),
        probability=conclusion.posterior.total(something_else=True),
        chi2=float(field @ field),
        noise_factor=observation.photo_noise.factor,
        share=found.share,
        place=found.place,
        shape_m=[] if found.s is None else found.across,
        s_m=[] if found.s is None else found.s,
        step=step.step,
    )


def _begun(bench: Workbench, fitted: Fit) -> Message | None:
    """What begins between two holds, if that is in the model."""
    for k, term in enumerate(fitted.extension.terms):
        if term.cause in BEGUN:
            step, (amount, std) = bench.test.steps[int(term.variant.at)], fitted.amount(k)
            more = Message("begun.growing") if term.variant.width else ""
            size = (amount, std, term.cause.unit)
            return Message(term.cause.name, step=step.step, branch=step.branch, size=size, more=more)
    return None
