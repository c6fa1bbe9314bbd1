"""A diagnosis by a few causes of the catalogue: the rivals of a case, where another one has asked all causes."""

from __future__ import annotations

from functools import partial
from unittest import mock

from pipeline.diagnosis import diagnose
from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.diagnose import Diagnosed
from pipeline.diagnosis.fits.workbench import prepare
from pipeline.faults import faults_of_input
from pipeline.identify import Identification
from rod.measurement import MeasuredTest


def among(test: MeasuredTest, names: str, found: Identification | None = None) -> Diagnosed:
    """The diagnosis where only the causes of these names may be at work; any of them where none is given."""
    causes = [cause for cause in SUSPECTS if cause.name in names.split() or not names]
    assert not names or len(causes) == len(names.split())
    with mock.patch.dict(diagnose.__globals__, prepare=partial(prepare, causes=causes)):
        return diagnose(faults_of_input(test), found)
