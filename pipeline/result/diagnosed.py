"""The diagnosis as ``result.json`` holds it: causes, what they explain, what is left."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from pipeline.messages import Message, catalogue
from pipeline.result.parts import Curve, Floats, Number, Part, SaidPart, Widening

CAUSES_NAMED = ("named", "class", "two_causes")
"""Verdicts that name causes."""


class CauseForm(Part):
    """One form of a cause as it stands in the extended model: what a prediction needs of it."""

    label: str = Field("", description="in words, as it completes the cause's name")
    amount: Number = Field(description="in the cause's unit")
    std: Number = Field(description="of the amount, in the cause's unit")
    at: Number = Field(0.0, description="place in shares of the length, curvature in 1/m, time in s, direction in rad")
    width: Number = Field(
        0.0,
        description="of a spot, in shares of the length; of a steep tilt the square of the camera's distance, m^2, "
        "negative where the rig is cut from the side of its picture",
    )
    tuned: list[str] = Field([], description="which of `at` and `width` were fitted")
    factor: list[Floats] = Field(
        [],
        description="G (1 + tuned, r): with F of the extended curve, G F^T is the covariance of amount and form with f",
    )


class TwinPart(Part):
    """Another cause that may act in place of the one named: less probable, or not to be told from it."""

    name: str = Field(description="of the cause")
    probability: Number = Field(description="of the cause, given the data")
    settled_by: str = Field(description="measurement that would show it")


class CausePart(Part):
    """A named cause with its class of twins, probability and estimate."""

    name: str = Field(description="of the cause, as `cablebend explain` knows it")
    class_: Annotated[list[str], Field(alias="class")] = Field(
        [], description="names that these data cannot tell from it, itself included"
    )
    probability: Number = Field(description="of the cause, given the data")
    estimate: Number = Field(description="its amount, in its unit")
    std: Number = Field(description="of the amount, in its unit")
    unit: str = Field(description="of the amount; - is a plain number")
    size: tuple[Number, Number, str] | None = Field(
        None, description="what its forms make up where that says more than the amount: value, std and unit"
    )
    forms: list[CauseForm] = Field([], description="of the extended model; several may act together")
    twins: list[TwinPart] = Field([], description="other causes that leave no more than noise, whether likely or not")

    @property
    def stated(self) -> tuple[float, float, str]:
        """What a reader is told of its size: value, standard deviation and unit."""
        return self.size or (self.estimate, self.std, self.unit)

    def in_what_form(self, language: str) -> list[str]:
        """The forms that the cause has in the extended model, in words; with figures where these were fitted.

        Each with its amount where none has a place and they make up nothing else: the components of a load.
        """
        known, said = catalogue("en"), []
        apart = len(self.forms) > 1 and self.size is None and not any(form.tuned for form in self.forms)
        for form in self.forms:
            message = Message(f"form.{self.name}.{form.label}", at=form.at, width=form.width)
            if message.key in known:
                parts = message.parts(language)  # the more was fitted, the more is told
                amount = Message("amount.of-form", amount=(form.amount, form.std, self.unit)).said(language)
                said.append(parts[min(len(form.tuned), len(parts) - 1)] + (amount if apart else ""))
        return list(dict.fromkeys(said))


class HypothesisPart(Part):
    """One hypothesis of the posterior."""

    causes: list[str] = Field(description="names; empty for the simulation as it is")
    something_else: bool = Field(description="whether something acts besides that no cause of the catalogue makes")
    probability: Number = Field(description="given the data")


class CauseRow(Part):
    """One row of the table of causes; see `pipeline.diagnosis`."""

    name: str = Field(description="of the cause")
    z: Number = Field(description="score: amount over its standard deviation")
    p_adjusted: Number = Field(description="probability of such a score by chance among all causes tried")
    estimate: Number = Field(description="amount that fits best, in its unit")
    std: Number = Field(description="of the amount, in its unit")
    unit: str = Field(description="of the amount; - is a plain number")
    minimal_detectable: Number | None = Field(
        None, description="smallest amount that these data would show in its clearest form, in its unit; null if never"
    )
    detectable_in_any_form: Number | None = Field(
        None, description="smallest amount that they would show whatever form it has; null if some form never shows"
    )
    surviving_fraction: Number = Field(description="share of its trace that f_EI, K0, scale and length cannot take up")
    nearest_twin: str = Field("", description="cause with the most similar trace")
    twin_cosine: Number = Field(0.0, description="cosine between both traces; 1: never told apart by such a test")
    delta_chi2: Number | None = Field(None, description="chi2 less with this cause; null if it was not fitted")
    heldout_excess_removed: Number | None = Field(
        None, description="share of the misfit of held-out steps that it removes"
    )
    stiffness_shift: Number | None = Field(
        None, description="relative change of f_EI with this cause, root mean square"
    )


class GainPart(Part):
    """How much of the misfit the extended model removes, on steps it had not seen."""

    heldout_excess_removed: Number = Field(
        description="share of the misfit beyond noise that the extension removes, on steps it had not seen"
    )
    ci95: tuple[Number, Number] = Field(description="95 % interval of that share")
    force_rmse_N: tuple[Number, Number] = Field(description="before and after, N")
    shape_rmse_m: tuple[Number, Number] = Field(description="before and after, m")


class BlindSpot(Part):
    """A cause that these data could not have shown although it would change f_EI."""

    name: str = Field(description="of the cause")
    stiffness_bias_at_plausible_size: Number = Field(
        description="relative error of f_EI if it acts at a plausible size"
    )
    settled_by: str = Field(description="measurement that would show it")


class NextExperiment(SaidPart):
    """The cheapest measurement that tells apart causes which these data cannot."""

    TEXT = "what"

    what: str = Field(description="to do, in words")
    separates: list[str] = Field(description="causes that it tells apart")
    sigma: Number | None = Field(
        None, description="how far it is expected to take them apart, standard deviations; null if not computed"
    )
    repeated_sigma: Number | None = Field(None, description="the same for plain repetition of the test")


class ResidualMap(Part):
    """Residuals over arc length and step, in standard deviations; null where there is no photo or no force."""

    s_m: Floats = Field(description="arc length, m")
    steps: list[int] = Field(description="numbers in the log")
    branches: list[str] = Field([], description="of the steps")
    shape_sigma: list[list[Number | None]] = Field(
        description="measured minus simulated position along the normal over its standard deviation, by step and place"
    )
    force_sigma: list[Number | None] = Field(
        [], description="measured minus simulated force over its standard deviation, by step"
    )
    shape_m: list[list[Number | None]] = Field([], description="measured minus simulated position along the normal, m")
    force_N: list[Number | None] = Field([], description="measured minus simulated force, N")
    chord_m: list[Number | None] = Field([], description="measured minus simulated chord, m")
    chord_sigma: list[Number | None] = Field([], description="the same over its standard deviation")
    displacement_m: list[Number | None] = Field([], description="of the steps, m")
    chi2: dict[str, Number] = Field({}, description="by kind of data: force, chord, shape")
    data: dict[str, int] = Field({}, description="number of data by kind")


# a simulation that found no equilibrium leaves an empty one
MapOrNone = Annotated[ResidualMap | None, BeforeValidator(lambda given: given or None)]


class ForceCorrectionPart(Part):
    """Forces of some steps that were wrong together: shown = factor * force + offset; a finding says why."""

    steps: list[int] = Field(description="numbers in the log")
    factor: Number = Field(description="a plain number")
    offset_N: Number = Field(description="N")
    errors_N: list[list[Number]] = Field(
        [], description="what the correction may be off by at each of the steps, N; a row is one std"
    )


class LeftoverPart(SaidPart):
    """What no cause explains: how much of it there is, where it sits, and its pattern."""

    message: str = Field(description="where it sits, in words")
    probability: Number = Field(1.0, description="that something acts that is no cause of the catalogue")
    chi2: Number | None = Field(None, description="of its pattern")
    noise_factor: Number = Field(1.0, description="scatter of the sections of the photos over the stated one")
    share: dict[str, Number] = Field({}, description="of its chi-square by kind of data: force, chord, shape")
    place: Number | None = Field(None, description="arc length where it is strongest, m")
    step: int | None = Field(None, description="step where it is strongest, number in the log")
    s_m: Floats = Field([], description="arc length of its pattern on the photo of that step, m")
    shape_m: Floats = Field([], description="its pattern: displacement along the normal, m")


class DiagnosisPart(SaidPart):
    """What the simulation gets wrong, and why."""

    TEXT = "headline"

    verdict: Literal["adequate", "named", "class", "two_causes", "unexplained", "underpowered"] = Field(
        description=(
            "adequate: nothing beyond noise; named: one cause; class: one cause of several names; "
            "two_causes; unexplained: no known cause suffices; underpowered: the data cannot tell"
        )
    )
    headline: str = Field(description="one sentence in plain words")
    hypotheses: list[HypothesisPart] = Field([], description="the whole posterior, most probable first")
    none_of_these: Number = Field(0.0, description="probability that something acts that is no cause of the catalogue")
    causes: list[CausePart] = Field([], description="those that were named")
    table: list[CauseRow] = Field([], description="every cause tried, with what the data say of it")
    gain: GainPart | None = Field(None, description="what the extension bought")
    blind_spots: list[BlindSpot] = Field([], description="causes that would hurt and cannot be seen here")
    next_experiment: NextExperiment | None = Field(None, description="the cheapest measurement that tells more")
    extended: Curve | None = Field(None, description="f_EI identified again with the extended model")
    extended_refuted: bool = Field(
        False,
        description="whether the extended model leaves a misfit, too, and knows f_EI less well: its curve is no answer",
    )
    widening: Widening | None = Field(
        None, description="what weak effects and something else add to the band of the curve that answers"
    )
    leftover: LeftoverPart | None = Field(None, description="what no cause explains")
    residuals_before: MapOrNone = Field(None, description="of the fitted simulation")
    residuals_after: MapOrNone = Field(None, description="of the model extended by the causes")
    twins: dict[str, dict[str, Number]] = Field({}, description="cosines of confusable causes")
    left_out_photos: list[int] = Field([], description="steps whose photo contradicts all else; a finding says why")
    left_out_forces: list[int] = Field([], description="steps whose force contradicts all else")
    corrected_forces: list[ForceCorrectionPart] = Field([], description="forces that both ways use as corrected")

    @property
    def could_hide(self) -> list[BlindSpot]:
        """Blind spots but for causes that were found: those are in the answer."""
        found = {name for cause in self.causes for name in cause.class_}
        return [spot for spot in self.blind_spots if self.verdict == "unexplained" or spot.name not in found]
