"""Settings of the room ``diagnosis``: unit in the name or the description, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class DiagnosisSettings(BaseModel):
    """Thresholds of ``diagnosis``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # noise
    force_floor: float = Field(
        5e-4,
        description="share of the largest force; repeatability of a class 0.05 load cell; below it digits repeat",
    )
    hold_noise_level: float = Field(
        1e-3, description="probability; holds have noise levels of their own only if equality is refuted at this level"
    )
    chord_std: float = Field(
        3e-5,
        description="relative; std of a photographed chord where the photo states none (0.05 px of 1700)",
    )
    displacement_std: float = Field(
        2e-6,
        description="m; of one displacement of the log against the chord: spindle and last digit of a log in 0.001 mm",
    )
    section_blocks: int = Field(
        96, description="block means a photo; four per shape function, so that noise and misfit are measured apart"
    )
    shape_functions: int = Field(
        20, description="Legendre polynomials a photo; resolves a kink to L / 20, and 7 photos stay a 150-row problem"
    )
    noise_stretches: tuple[float, ...] = Field(
        (0.35, 0.5, 0.64, 0.8, 1.0, 1.25, 1.6, 2.1, 2.8, 3.6, 4.5),
        description="trial factors of the stated correlation length; a grid of ratio 1.7 chose 0.6 where 0.8 was"
        " likeliest and put the slow noise a third too low",
    )
    noise_stretch_spread: float = Field(
        0.5,
        gt=0,
        description="log of the factor; a photo's own estimate of its correlation length scatters by half, and a"
        " stretch chosen by chance made one null in fifty look like a cause",
    )
    noise_prior_weight: float = Field(
        20.0, description="samples; what the noise level stated by the photos counts for against the level seen"
    )

    # detection
    false_alarm: float = Field(0.01, description="probability of naming anything on a specimen without effect")
    null_draws: int = Field(20000, description="draws of N(0, U^T U); the 1 % point is then known to 0.02 sigma")
    power: float = Field(0.9, description="probability at which the minimal detectable effect is stated")
    visible: float = Field(1e-3, description="surviving fraction below which a cause counts as invisible here")
    trace: float = Field(
        0.2, description="share of its plausible size at which a cause's trace is computed; see diagnosis/search.py"
    )
    seed: int = Field(20240229, description="of every simulated distribution, so that a report repeats to the digit")

    # naming
    twin_cosine: float = Field(0.95, description="|cos| above which two causes that remove as much are one class")
    refit_margin: float = Field(
        0.35, description="share of the best linear chi-square gain a cause may fall short of and still be refitted"
    )
    refit_least: float = Field(
        30.0, description="chi-square a cause may always fall short of the best and still be refitted"
    )
    refit_most: int = Field(8, description="causes refitted at most, best linear scores first; time")
    hopeless: float = Field(
        0.02, description="share of the base chi-square a refit may lie above the best one and still be worked on; time"
    )
    shapes_most: int = Field(3, description="directions of one cause that are combined in a refit at most")
    shape_gain: float = Field(
        16.0, description="chi-square by which a further direction of the same cause must pay (4 sigma)"
    )
    pair_collinear: float = Field(0.985, description="|cos| above which the split between two causes is noise")
    pairs_refitted: int = Field(6, description="best pairs of the exhaustive linear search that are refitted; time")
    exchange_margin: float = Field(
        0.15,
        description="share of the score beside the other cause that a rival may fall short of and still be refitted in"
        " the place of one of two",
    )
    exchange_most: int = Field(4, description="rivals refitted in the place of one of two causes at most; time")
    search_newton_steps: int = Field(
        40_000,
        gt=0,
        description="Newton steps after which the search for two causes begins nothing further; 1,000 to 3,000 a"
        " second; searches that found their pair took 5,000 to 30,000",
    )
    masked_least: float = Field(
        20.0,
        description="chi-square that the best pair must remove beyond the best single score for pairs to be refitted"
        " where no cause is likely by itself; time",
    )
    explained_share: float = Field(
        0.10, description="share of the excess misfit a named model may leave; more is `unexplained`"
    )

    same_level: float = Field(
        0.01, description="share of the travel; loading and unloading steps closer than this are left out together"
    )
    gain_draws: int = Field(2000, description="draws behind the interval of the gain; its ends are then known to 2 %")
    gain_iterations: int = Field(
        4, description="Gauss-Newton steps of a refit without one level, from the fit with it; two settle it usually"
    )
    powerless: float = Field(
        0.34, description="share of the causes; `underpowered` if fewer would have shown at a plausible size"
    )
    separated: float = Field(4.0, description="sigma; two explanations this far apart are told apart")

    # base model
    knot_gain: float = Field(
        16.0,
        description="chi-square that another control point must remove, beyond what any cause removes, to be taken",
    )
    grid: int = Field(120, description="elements of the simulated cable; force to 1e-4, a tenth of its noise")
    fits: float = Field(
        1.4,
        description="reduced chi-square; a refit above it is tried from a second start, a law of constant stiffness",
    )
    iterations: int = Field(15, description="Gauss-Newton steps at most; three to five are usual")
    tolerance: float = Field(1e-3, description="change of chi-square at which a fit is done; 1 is one sigma")

    # data faults
    fault_sigma: float = Field(6.0, description="sigma; a photo or force this far from what the others say is a fault")
    chord_mismatch: float = Field(
        0.15,
        description="share of the travel; mean mismatch of chord and displacement from which order or unit is doubted",
    )
    displacement_mismatch: float = Field(
        0.02,
        gt=0,
        description="share of the travel; mismatch of a single chord and its displacement from which that displacement "
        "is doubted, in place of a photo or a cause: a fifth of a step of ten",
    )
    doubled_share: float = Field(
        0.03,
        description="share of the scatter of the sections; two photos that differ by less are one photo; light and "
        "ground that stay make two photos of one shape alike to an eighth",
    )
    force_break: float = Field(
        0.03,
        gt=0,
        description="factor less 1, or share of the largest force; a smaller change of all forces from one step on is "
        "no switch of a range or lost zero, and what slips or creeps changes as much at once",
    )
    stiffness_range: tuple[float, float] = Field(
        (1e-7, 100.0), description="N m^2; EI of cables spans 1e-5 to 1, two decades beyond that is a wrong unit"
    )
    length_mismatch: float = Field(
        0.01, description="relative; traced against stated length from which length_mm is doubted"
    )

    # presentation
    curve_points: int = Field(61, description="points of the extended characteristic; smooth at any figure's width")
    twins_shown: int = Field(8, description="causes in the table of cosines; more cannot be read")

    # blind spots
    harm: float = Field(0.005, description="relative change of f_EI from which an invisible cause is worth a warning")
