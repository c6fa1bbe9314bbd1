"""One specimen: the whole pipeline spelled out on one screen.

folder -> `Specimen` -> photos -> `Traces` -> `Faults` -> `Identification` -> diagnosis -> `Result` -> files.
`measure` is what the command line, the batch and the Python API all call; `write` puts what people and programs read
beside ``result.json``. A bad file of the user raises `InputError`; nature's refusals are values in the result.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from pipeline.assembly import assemble
from pipeline.diagnosis import diagnose
from pipeline.faults import Faults, faults_of_input
from pipeline.identify import Identification, identify, measured_test
from pipeline.intake.folder import read_specimen
from pipeline.messages import Message
from pipeline.records import Finding, Specimen
from pipeline.report.tables import write_result, write_tables
from pipeline.result import DiagnosisPart, Result
from pipeline.result.answer import OF_NO_CABLE
from pipeline.settings import Settings
from pipeline.vision.series import trace_series


def measure(
    folder: Path | str,
    settings: Settings | None = None,
    *,
    command: str = "",
    on_stage: Callable[[str], None] = lambda stage: None,
) -> Result:
    """Measure one specimen folder.

    Where a fault of the data makes the numbers none of the cable's, nothing is concluded from them: no diagnosis.

    Parameters
    ----------
    folder : Path or str
        Holds ``specimen.toml``, the force log and the photos.
    settings : Settings, optional
    command : str
        The command that reproduces the result, kept in its provenance.
    on_stage : callable
        Told the name of each stage that begins: ``photos``, ``identification``, ``diagnosis``.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If a file cannot be used.
    """
    settings = settings or Settings()
    specimen = read_specimen(Path(folder), settings.intake)
    on_stage("photos")
    traces = trace_series(specimen, settings.vision)
    on_stage("identification")
    faults = faults_of_input(measured_test(specimen, traces, settings.identify))
    specimen = in_order(specimen, faults)
    images = {step.step: step.image for step in specimen.steps if step.image is not None}
    identification = identify(faults, images, settings.identify)
    told = partial(assemble, specimen, traces, settings=settings, command=command)
    if any(finding.code in OF_NO_CABLE for finding in (*specimen.findings, *faults.findings)):
        return told(identification, None, findings=faults.findings)
    on_stage("diagnosis")
    diagnosis, findings, found = _diagnosed(faults, identification, settings)
    if found is not faults:
        identification = identify(found, images, settings.identify)
    result = told(identification, diagnosis, findings=findings)
    measured, usable = result.answer.curve is not None, result.answer.usable
    return told(identification, None, findings=findings) if measured and not usable else result


def in_order(specimen: Specimen, faults: Faults) -> Specimen:
    """The specimen with its photos named at the steps to which they belong."""
    images = {step.step: step.image for step in specimen.steps}
    steps = (replace(step, image=images[faults.moved.get(step.step, step.step)]) for step in specimen.steps)
    return replace(specimen, steps=tuple(steps))


def _diagnosed(
    faults: Faults, identification: Identification, settings: Settings
) -> tuple[DiagnosisPart | None, tuple[Finding, ...], Faults]:
    """The diagnosis; where numbers nobody foresaw break it, both ways still stand and the reader is told."""
    try:
        return diagnose(faults, identification, settings.diagnosis)
    except (ArithmeticError, LookupError, MemoryError, ValueError) as error:
        told = " ".join(str(error).split())[:200]
        said = Message("diagnosis/program-error", error=type(error).__name__, told=told)
        return None, (*faults.findings, Finding(said.code, "error", said)), faults


def write(result: Result, folder: Path, settings: Settings | None = None) -> None:
    """Write ``result.json``, the tables and, unless ``batch.reports`` is off, the reports into an existing folder."""
    settings = settings or Settings()
    write_result(result, folder)
    write_tables(result, folder, settings.report)
    if settings.batch.reports:
        from pipeline.report.document import write_report  # matplotlib: half a second that a run without does not need
        from pipeline.report.pdf import write_pdf

        write_report(result, folder, settings.report)
        write_pdf(result, folder, settings.report)
