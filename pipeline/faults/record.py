"""What is wrong with the data of a test, as a value: the test put right where that is certain, the rest left out.

``Faults`` goes to both ways and to the diagnosis alike, so that a fault is told once and nothing is made of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from pipeline.records import Finding
from rod.measurement import MeasuredStep, MeasuredTest


@dataclass(frozen=True)
class ForceCorrection:
    """What was wrong with the forces of some steps: shown = factor * force + offset (N); steps by their numbers.

    ``errors``: what the correction may be off by, N for each of the steps, rows of one standard deviation each.
    """

    steps: tuple[int, ...]
    factor: float
    offset: float
    errors: tuple[tuple[float, ...], ...] = ()

    def applied(self, test: MeasuredTest) -> MeasuredTest:
        """The test with these forces as they should have been, and with what they may be off by together."""
        steps = tuple(self._corrected(s) if s.step in self.steps else s for s in test.steps)
        errors = tuple(dict(zip(self.steps, row, strict=True)) for row in self.errors)
        return replace(test, steps=steps, common_force_errors=(*test.common_force_errors, *errors))

    def _corrected(self, step: MeasuredStep) -> MeasuredStep:
        return replace(
            step,
            force=(step.force - self.offset) / self.factor,
            force_std=step.force_std / abs(self.factor),
            hold_forces=None if step.hold_forces is None else (step.hold_forces - self.offset) / self.factor,
        )


@dataclass(frozen=True)
class Faults:
    """What is wrong with the data.

    Attributes
    ----------
    test : MeasuredTest
        Put right: photos in their order, displacements in their unit, forces corrected.
    findings : tuple of Finding
    photos, forces : frozenset of int
        Indices of steps whose photo, or force, is not to be used.
    corrections : tuple of ForceCorrection
        Those that ``test`` has got.
    moved : mapping of step number -> step number
        Steps that have got the photo that was taken for another step's.
    doubted : mapping of index -> m
        Displacements of the log that ``test`` does not hold any more: their photos contradict them.
    """

    test: MeasuredTest
    findings: tuple[Finding, ...] = ()
    photos: frozenset[int] = frozenset()
    forces: frozenset[int] = frozenset()
    corrections: tuple[ForceCorrection, ...] = ()
    moved: Mapping[int, int] = field(default_factory=dict)
    doubted: Mapping[int, float] = field(default_factory=dict)

    def used(self) -> MeasuredTest:
        """The test without what is left out.

        A shape without its force tells no way the scale of f_EI: a step without force is left out as a whole.
        """
        steps = (
            replace(step, shape=None, chord=None, chord_std=None) if i in self.photos else step
            for i, step in enumerate(self.test.steps)
            if i not in self.forces
        )
        return replace(self.test, steps=tuple(steps))

    def loaded_photos(self) -> list[int]:
        """Indices of the steps under load whose photo may be used."""
        steps = enumerate(self.test.steps)
        return [i for i, step in steps if step.branch != "mounted" and step.shape and i not in self.photos]

    def loaded_forces(self) -> list[int]:
        """Indices of the steps under load whose force may be used; without any, stiffness has no scale."""
        steps = enumerate(self.test.steps)
        return [i for i, step in steps if step.branch != "mounted" and step.force and i not in self.forces]

    def joined(self, other: Faults) -> Faults:
        """The faults of both."""
        return Faults(
            other.test,
            (*self.findings, *other.findings),
            self.photos | other.photos,
            self.forces | other.forces,
            (*self.corrections, *other.corrections),
            {**self.moved, **other.moved},
            {**self.doubted, **other.doubted},
        )
