"""The search on one photo of a series: what specimen, scale and the photo before tell of its cable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from pipeline.records import LoadStep, Preview, Rejected, Specimen
from pipeline.settings.vision import VisionSettings
from pipeline.vision.bearings.covers import BearingHints
from pipeline.vision.bearings.steady import moved_axes
from pipeline.vision.centerline.measurement import Followed, follow_cable
from pipeline.vision.guard import guarded
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.preview import reduce_photo
from pipeline.vision.rough import RoughCable
from pipeline.vision.scale.calibration import Calibration
from pipeline.vision.search.creases import by_creases
from pipeline.vision.segmentation import find_cable


@dataclass(frozen=True)
class Shot:
    """One photo of the series: its step, the cable found on it or the reason why not, and its size if it has one."""

    step: LoadStep
    found: RoughCable | Rejected
    preview: Preview | None
    size: tuple[int, int] | None = None

    @property
    def sides(self) -> tuple[int, ...] | None:
        """Short and long side in px: the same for a photo turned by a quarter."""
        return None if self.size is None else tuple(sorted(self.size))


@dataclass(frozen=True)
class Search:
    """The search on the photos of a specimen.

    Attributes
    ----------
    cover_px : px or None
        Diameter of covers that were seen where nobody gave it.
    """

    specimen: Specimen
    settings: VisionSettings
    calibration: Calibration | None
    cover_px: float | None = None

    @cached_property
    def steps(self) -> list[LoadStep]:
        """Steps whose photos exist."""
        return [step for step in self.specimen.steps if step.image in self.specimen.images]

    def load(self, step: LoadStep) -> Photo | Rejected:
        """The photo of a step."""
        name = str(step.image)
        return guarded(name, partial(load_photo, self.specimen.images[name], self.settings.photo, name=name))

    def find_as(self, photo: Photo, cable: Cable, near: RoughCable | None = None) -> RoughCable | Rejected:
        """The cable of which something is known."""
        hints = self.specimen.hints.get(photo.name)
        return guarded(photo.name, partial(find_cable, photo, cable=cable, near=near, hints=hints))

    def find(self, photo: Photo, step: LoadStep, near: RoughCable | None) -> RoughCable | Rejected:
        """The cable by what specimen and scale tell, near where a neighbour photo shows it; else by its dark rims."""
        cable = self.expected(step)
        found = self.find_as(photo, cable, near)
        if cable.diameter_px is None or self.calibration is None:
            return found
        followed = self._followed(found, self.calibration)
        for creased in () if isinstance(followed, Followed) else by_creases(photo, cable.diameter_px):
            other = self.find_as(creased, cable, near)
            if isinstance(other, RoughCable):
                followed = self._followed(replace(other, by_rims=True), self.calibration)
            if isinstance(followed, Followed):
                break
        return followed.on_midline() if isinstance(followed, Followed) else found

    def _followed(self, found: RoughCable | Rejected, known: Calibration) -> Followed | Rejected:
        """The cable as it is measured by the scale that is known so far."""
        if isinstance(found, Rejected):
            return found
        work = partial(follow_cable, found, plane=known.plane, diameter_m=self.specimen.diameter_m)
        return guarded(found.image, work)

    def find_all(self) -> list[Shot]:
        """All photos, each searched near where the cable was on the one before."""
        shots: list[Shot] = []
        near: RoughCable | None = None
        for step in self.steps:
            photo = self.load(step)
            if isinstance(photo, Rejected):
                shots.append(Shot(step, photo, None))
                continue
            found = self.find(photo, step, near)
            shown = guarded(photo.name, partial(reduce_photo, photo, self.settings.preview))
            shots.append(Shot(step, found, None if isinstance(shown, Rejected) else shown, photo.size))
            near = found if isinstance(found, RoughCable) else near
        return shots

    def expected(self, step: LoadStep) -> Cable:
        """What is known of the cable on the photo of a step."""
        specimen, rig = self.specimen, self.specimen.rig
        travel = step.displacement_m - self.steps[0].displacement_m
        covered = rig.marker_diameter_m is not None
        if self.calibration is None:
            # Without a scale the travel in px is unknown: the user's axes hold for the first photo only.
            given = rig.bearings_px if travel == 0.0 and not covered else None
            widths = None if rig.marker_diameter_m is None else rig.marker_diameter_m / specimen.diameter_m
            hints = BearingHints(cover_widths=widths, given_px=given)
            cable = Cable(bearings=hints, slenderness=specimen.length_m / specimen.diameter_m)
        else:
            scale, given = self.calibration.scale.px_per_m, None
            if rig.bearings_px is not None and not covered:
                given = moved_axes(rig.bearings_px, rig.moving_bearing, travel, self.calibration.plane)
            cover = None if rig.marker_diameter_m is None else rig.marker_diameter_m * scale
            hints = BearingHints(cover_px=cover, given_px=given)
            cable = Cable(specimen.diameter_m * scale, specimen.length_m * scale, hints)
        return cable if self.cover_px is None else replace(cable, bearings=BearingHints(cover_px=self.cover_px))


def count_alike(shots: Sequence[Shot], most: float, length_px: float | None = None) -> int:
    """Number of photos whose cable has a length, or that of the median photo, to a relative deviation."""
    lengths = np.array([shot.found.length_px for shot in shots if isinstance(shot.found, RoughCable)])
    usual = float(np.median(lengths)) if length_px is None and len(lengths) else length_px
    return 0 if usual is None else int(np.count_nonzero(np.abs(lengths / usual - 1.0) <= most))
