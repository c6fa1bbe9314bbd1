"""The diagnosis in plain words: headline, name of a cause, and the page of `cablebend explain`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pipeline.diagnosis.causes import CATALOGUE, Cause
from pipeline.diagnosis.posterior.words import Verdict
from pipeline.result import CausePart, CauseRow
from pipeline.rounding import plain
from pipeline.units import amount_unit

# Names that English says in another order or with a hyphen; the others as they are, with blanks.
SPOKEN = {
    "pre_curvature": "pre-curvature",
    "pre_curvature_varying": "varying pre-curvature",
    "stiffness_varying": "varying stiffness",
    "in_plane_load": "in-plane load",
}


def spoken(name: str) -> str:
    """Name of a cause as one says it in English: the one place that terminal, findings and reports take it from."""
    return SPOKEN.get(name, name.replace("_", " "))


def listed(names: list[str], *, last: str = "or") -> str:
    """Names in a sentence."""
    said = [spoken(name) for name in names]
    return said[0] if len(said) == 1 else f"{', '.join(said[:-1])} {last} {said[-1]}"


def headline(
    verdict: Verdict,
    *,
    causes: Sequence[CausePart],
    explained: float | None,
    change: float | None,
    weakest: str,
    leftover: str,
) -> str:
    """One sentence.

    Parameters
    ----------
    verdict : Verdict
    causes : sequence of CausePart
        What was found, each with its class of names.
    explained : share or None
        Of the held-out excess misfit.
    change : relative or None
        Root mean square change of f_EI.
    weakest : str
        What could have been seen, for ``adequate`` and ``underpowered``.
    leftover : str
        Where the unexplained misfit sits.
    """
    if verdict == "adequate":
        return f"Nothing beyond noise: the simulation explains forces and photos; {weakest}."
    if verdict == "underpowered":
        return f"Nothing was found, but these data could hardly have shown it; {weakest}."
    if verdict == "unexplained":
        return (
            f"The simulation misfits the data beyond noise and no cause in the catalogue removes it: {leftover}; "
            "f_EI and K0 are not to be relied on before that is settled."
        )
    names = [cause.class_ for cause in causes]
    sizes = [amount_unit(c.unit, c.estimate, c.std).text(c.estimate, c.std) for c in causes]
    gain = (
        ""
        if explained is None
        else f"; on steps it had not seen it removes {100.0 * min(explained, 1.0):.0f} % of the misfit"
    )
    shift = "" if change is None else f", and f_EI changes by {plain(100.0 * change, 2)} % rms"
    if verdict == "two_causes":
        both = " and ".join(f"{listed(group)} ({size})" for group, size in zip(names, sizes, strict=True))
        return f"Two causes act together: {both}{gain}{shift}."
    if verdict == "class":
        return (
            f"One cause that these data cannot name for certain: {listed(names[0])} (as {spoken(names[0][0])}: "
            f"{sizes[0]}){gain}{shift}."
        )
    return f"The simulation lacks {listed(names[0])} ({sizes[0]}){gain}{shift}."


def could_have_been_seen(seen: Sequence[CauseRow], total: int) -> str:
    """What the data could have shown: the first three of the causes ``seen`` at a plausible size, of ``total``."""
    if not seen:
        return f"none of {total} causes would have shown at a plausible size"
    least = [(row, row.minimal_detectable or 0.0) for row in seen[:3]]
    sizes = ((spoken(row.name), amount_unit(row.unit, size).plain(size, 2)) for row, size in least)
    clearest = ", ".join(f"{name} from {size}" for name, size in sizes)
    return f"{len(seen)} of {total} causes would have shown at a plausible size, such as {clearest}"


def cause_by_name(name: str) -> Cause:
    """The class of a cause.

    Raises
    ------
    ValueError
        For an unknown name; the message lists the known ones.
    """
    for cause in CATALOGUE:
        if cause.name == name:
            return cause
    raise ValueError(f"unknown cause {name!r}; known are {', '.join(cause.name for cause in CATALOGUE)}")


class Described(NamedTuple):
    """What is said of a cause; attributes as of `pipeline.diagnosis.causes.Cause`."""

    name: str
    unit: str
    sign: int
    seat: str
    summary: str
    sign_means: str
    needs: str
    apart: str
    remedy: str
    settled_by: str


PRE_CURVATURE = Described(
    name="pre_curvature",
    unit="1/m",
    sign=0,
    seat="cable",
    summary=(
        "The cable is uniformly bent at rest. Its curvature K0 is part of the base model and fitted on every specimen: "
        "only a simulation that starts from a straight cable has to find it."
    ),
    sign_means="K0, positive toward the side to which the cable is bent most",
    needs="a photo of the force-free cable, or several loading steps",
    apart=(
        "A uniform K0 bends the force-free cable to an arc of a circle. A load in the plane and a varying "
        "pre-curvature give it another shape, and friction in the bearings shows in the loaded photos only."
    ),
    remedy=(
        "Photograph the mounted, force-free cable, and push it to the side to which it bows by itself: pushed the "
        "other way, it may snap through."
    ),
    settled_by="a photo of the mounted, force-free cable",
)
"""Part of the base model, so no class of the catalogue, but a name of the contract like the others."""


def explain(name: str) -> str:
    """Page on one cause: what it is, what shows it, what it is confused with, what to do at the rig."""
    cause = PRE_CURVATURE if name == PRE_CURVATURE.name else cause_by_name(name)
    sign = "not negative" if cause.sign else "either sign"
    lines = [
        f"{cause.name} ({cause.unit}, {sign})",
        "",
        cause.summary,
        "",
        f"Amount:        {cause.sign_means}",
        f"Sits in:       the {cause.seat}",
        f"Shows with:    {cause.needs}",
        f"Told apart by: {cause.apart}",
        f"At the rig:    {cause.remedy}",
        f"Settled by:    {cause.settled_by}",
        "",
    ]
    return "\n".join(lines)
