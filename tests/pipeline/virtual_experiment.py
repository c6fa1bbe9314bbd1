"""Results of random virtual cables: exact equilibria by quadrature, photographed and weighed with errors, identified.

`identified` is the inverse problem of the project; what it is given, and what is held back to check it by, are made by
`tests.rod.virtual_cable`, which shares no code with the simulated rod.
"""

from dataclasses import replace

from pipeline.identify.parts import curve
from pipeline.result import InversePart, Result, ScalePart, SpecimenPart
from rod.inverse import estimate
from rod.inverse.problem import InverseOptions

QUICK = InverseOptions(elements=80, blocks=80)


def without(test, step):
    """The same test without one step, whose photo and force nobody then sees."""
    return replace(test, steps=tuple(s for s in test.steps if s.step != step))


def identified(test, *, name="virtual", way=None):
    """Result with the inverse part alone."""
    way = way or estimate(test, options=QUICK)
    return Result(
        status="measured",
        specimen=SpecimenPart(id=name, length_m=test.length, diameter_m=0.005, folder=name, moving_bearing="left"),
        scale=ScalePart(px_per_mm=11.0, std_relative=test.scale_std, source="number given in specimen.toml"),
        inverse=InversePart(
            outcome=way.outcome.name.lower(),
            converged=way.converged,
            pre_curvature_per_m=way.law.pre_curvature,
            pre_curvature_std_per_m=way.law.pre_curvature_std,
            curve=curve(way),
        ),
    )
