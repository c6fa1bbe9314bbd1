"""Results of every kind a report must show, made once a session."""

from __future__ import annotations

import pytest

from pipeline.result import FindingPart, PhotoPart, Result, SpecimenPart
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_result import measured_result


@pytest.fixture(scope="session")
def full_result():
    """Seven photos, loading and unloading, both ways, nothing wrong with the model: no diagnosis yet."""
    return measured_result()


@pytest.fixture(scope="session")
def diagnosed(full_result):
    """The full result with a diagnosis of the verdict asked for."""
    few = full_result.model_copy(update={"photos": full_result.photos[2:4]})
    return lambda verdict: few.model_copy(update={"diagnosis": diagnosis_of(verdict, full_result.photos)})


@pytest.fixture(scope="session")
def partial_result(full_result):
    """One photo rejected, one missing; names and texts as hostile as a file system allows."""
    bad = full_result.photos[1].model_copy(
        update={
            "status": "rejected",
            "reason": "the contrast is 3.1 of 5 needed <script>alert(1)</script>",
            "code": "photo/contrast",
            **{name: [] for name in ("s_m", "x_m", "y_m", "u_px", "v_px", "theta_rad", "kappa_per_m")},
            **{name: [] for name in ("kappa_std_per_m", "seen", "kappa_fit_per_m", "shape_residual_m")},
        }
    )
    missing = PhotoPart(image="images/step_02.png", step=2, status="missing", reason="the file does not exist")
    photos = [full_result.photos[0], bad, missing, *full_result.photos[3:]]
    return full_result.model_copy(
        update={
            "status": "partial",
            "photos": photos,
            "specimen": full_result.specimen.model_copy(
                update={
                    "id": '=cmd|"/c calc"<img src=x onerror=alert(1)>',
                    "description": {"type": "$x_{1}$ \u4e2d </script>"},
                }
            ),
            "findings": [FindingPart(code="photo/contrast", level="warning", message="<b>step_01</b> was rejected.")],
        }
    )


@pytest.fixture(scope="session")
def failed_result():
    """A specimen of which nothing could be measured."""
    return Result(
        status="failed",
        specimen=SpecimenPart(id="cable-13", folder="b/cable-13"),
        findings=[
            FindingPart(code="log/empty", level="error", message="force.csv: the log is empty; export it again.")
        ],
        provenance={"version": "0.1.0"},
    )
