"""The result of one specimen as a whole: its parts, and the one answer they give."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from pipeline.result.answer import Answer, answer_of
from pipeline.result.diagnosed import DiagnosisPart
from pipeline.result.parts import (
    AgreementPart,
    AnswerPart,
    BalancePart,
    FindingPart,
    InversePart,
    Part,
    PhotoPart,
    ScalePart,
    SpecimenPart,
    StepPart,
)
from pipeline.result.visited import html_table

SCHEMA: Literal["cablebend/result/1"] = "cablebend/result/1"


class Result(Part):
    """Everything measured on one specimen."""

    schema_: Annotated[Literal["cablebend/result/1"], Field(alias="schema", description="what this file is")] = SCHEMA
    status: Literal["measured", "partial", "failed"] = Field(
        description="measured: the simulation was fitted; partial: only the balance equations answer; failed: none does"
    )
    headline: str = Field("", description="the answer in a sentence")
    specimen: SpecimenPart = Field(description="the cable and the rig, as given; lengths in m")
    answer_: Annotated[AnswerPart | None, Field(alias="answer", description="none in the earliest results")] = None
    scale: ScalePart | None = Field(None, description="of the photos, px/mm; null where no photo has one")
    photos: list[PhotoPart] = Field([], description="every photo that the force log names")
    steps: list[StepPart] = Field([], description="every displacement step")
    inverse: InversePart | None = Field(None, description="f_EI by simulation and fit, N m^2; null where none ran")
    balance: BalancePart | None = Field(None, description="f_EI by the balance equations, N m^2; null if none")
    agreement: AgreementPart | None = Field(None, description="of both ways, relative; null without both")
    diagnosis: DiagnosisPart | None = Field(None, description="what the simulation gets wrong; null without it")
    findings: list[FindingPart] = Field([], description="everything that a reader must know, in order of the stages")
    provenance: dict[str, Any] = Field({}, description="programs, libraries, inputs, settings and command")

    @property
    def answer(self) -> Answer:
        """Which curve is the result, with its band and K0, whether it may be used, and why."""
        return answer_of(self)

    def _repr_html_(self) -> str:
        """Show the result in a notebook: the answer and what was found, each number with its standard deviation."""
        rows = [*self.answer.told()]
        if self.diagnosis is not None:
            rows.append((f"diagnosis: {self.diagnosis.verdict}", self.diagnosis.headline))
        rows += [(finding.level, finding.message) for finding in self.findings if finding.level != "info"]
        return html_table(f"{self.specimen.id}: {self.status}", rows)
