"""Both ways side by side: the inverse problem and the balance equations, branches apart and together.

Loading and unloading are never merged silently: where a test has both, the inverse problem is solved for each alone and
for all steps together, and a test says whether the two show the same characteristic.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from pipeline.faults import Faults
from pipeline.identify.agreement import compare, log_curve, rest_curvature
from pipeline.identify.contrast import chi_square, parts_difference
from pipeline.identify.findings import identification_findings
from pipeline.identify.identification import Identification
from pipeline.settings.identify import IdentifySettings
from rod.balance import balance
from rod.inverse import Estimate, estimate
from rod.measurement import MeasuredTest


def identify(faults: Faults, images: Mapping[int, str], settings: IdentifySettings) -> Identification:
    """Characteristic by both ways from what may be used of a test; its record keeps the whole test.

    Whatever the data refuse is an outcome in it, with advice, and a finding. ``images``: names of photos by step.
    """
    return replace(identify_test(faults.used(), settings), test=faults.test, images=dict(images))


def identify_test(test: MeasuredTest, settings: IdentifySettings) -> Identification:
    """`identify` of all of a test."""
    graph = balance(test)
    inverse = estimate(test)
    branches = _branches(test)
    found = Identification(
        test=test,
        inverse=inverse,
        balance=graph,
        branches=branches,
        branches_p=_branches_p(branches),
        rest=rest_curvature(test),
    )
    found = replace(found, agreement=compare(test, inverse, graph))
    return replace(found, findings=identification_findings(found, settings))


def _branches(test: MeasuredTest) -> dict[str, Estimate]:
    groups = {"loading": ("mounted", "loading"), "unloading": ("unloading",)}
    halves = {name: tuple(s for s in test.steps if s.branch in members) for name, members in groups.items()}
    photos = [sum(s.shape is not None and s.branch != "mounted" for s in steps) for steps in halves.values()]
    if min(photos) < 2:  # of loaded steps, for a branch to be fitted on its own
        return {}
    apart = {name: estimate(replace(test, steps=steps)) for name, steps in halves.items()}
    return apart if all(e.law is not None for e in apart.values()) else {}


def _branches_p(branches: dict[str, Estimate]) -> float | None:
    """Test of equal characteristic and K0; the branches share no photo and no force: their errors are independent."""
    laws = [branch.law for branch in branches.values() if branch.law is not None]
    if len(laws) < 2:
        return None
    one, two = laws
    z = (one.pre_curvature - two.pre_curvature) / np.hypot(one.pre_curvature_std, two.pre_curvature_std)
    chi2, free = float(z**2), 1
    first, second = log_curve(one), log_curve(two)
    common = first.common_grid(second)
    if common is not None:
        difference = parts_difference(first, second, common)
        chi2 += chi_square(difference, first.parts_covariance(common) + second.parts_covariance(common))
        free += difference.size
    return float(chdtrc(free, chi2))
