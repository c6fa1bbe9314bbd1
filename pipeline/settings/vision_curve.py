"""Settings of the sub-pixel measurement of the centerline: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class CurveSettings(BaseModel):
    """Edges of the cable, midline, curvature spline and the figures that forbid a measurement."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    search_radii: float = Field(
        0.35,
        gt=0,
        lt=1,
        description="of the radius; how far from its expected place an edge is sought: a path misled by"
        " a shadow is off by less, the next false edge (highlight, text) is mostly farther",
    )
    width_tolerance: float = Field(
        0.15, gt=0, description="relative; prior of the width in the search when the diameter is known, else twice that"
    )
    inside_radii: float = Field(
        0.25,
        gt=0,
        description="of the radius; part of the sheath used for an edge: leaves out highlight and text, and the farther"
        " from the edge, the more shading bends away from the ramp (0.35 moved the midline by a third more)",
    )
    outside_radii: float = Field(
        0.18,
        gt=0,
        description="of the radius; part of the ground used for an edge: more brings more of the ground's texture"
        " (0.45 raised the error of kappa on brushed metal by half), less only more pixel noise",
    )
    longest_side_px: float = Field(
        12.0, gt=3, description="px; more sheath or ground than this adds texture, not knowledge of the edge"
    )
    small_radius_px: float = Field(
        15.0, gt=0, description="px; thinner cables leave no room for shading: plain error function without ramps"
    )
    profile_windows: int = Field(
        16, ge=1, description="along the cable; in each, blur and shading of the edges are found: light turns slowly"
    )
    sections: int = Field(
        240,
        ge=60,
        description="sections after averaging; their errors are nearly independent at this spacing, and"
        " kappa's resolution (a tenth of the length) is spanned by twenty",
    )
    knot_spacing_diameters: float = Field(
        1.5, gt=0, description="diameters; a cable cannot bend more sharply than over its own width"
    )
    min_intervals: int = Field(16, ge=4, description="knot intervals; fewer bias kappa at mid-span above 0.05 %")
    max_intervals: int = Field(36, ge=4, description="knot intervals; more only cost time, the penalty decides")
    penalty_order: int = Field(
        3,
        ge=1,
        le=3,
        description="derivative of kappa that is penalised: 3 leaves a parabola free, the bow's first shape;"
        " 2 was 30 % worse inside the span",
    )
    longest_correlation: float = Field(
        0.05, gt=0, le=0.2, description="of the length; longer errors cannot be told from curvature"
    )
    points: int = Field(201, ge=20, description="points of the centerline: 1 mm for a cable of 0.2 m")
    max_blur_radii: float = Field(
        0.4, gt=0, description="of the radius; with more blur the two edges run into each other and move inward"
    )
    max_width_error: float = Field(
        0.15,
        gt=0,
        description="relative; a strip split off along a highlight is 30 % or more too narrow, scales and"
        " diameters are known to some percent",
    )
    max_width_scatter: float = Field(
        0.08, gt=0, description="relative, robust, along s; a cable's width is constant within 5 %"
    )
    min_contrast_to_noise: float = Field(
        5.0, gt=0, description="ratio; below it false edges win and the errors are not Gaussian"
    )
    min_measured_share: float = Field(
        0.6, gt=0, le=1, description="of the visible sections; with fewer both edges were not found on a cable"
    )
    axis_distance_radii: float = Field(
        1.0, gt=0, description="of the radius; a centerline that misses the bearing axis by more is not on that bearing"
    )
