"""Frozen records that travel between the rooms of the pipeline; right once made. SI units, unless the name says px.

folder -> `Specimen` -> photos -> `Centerline` (or `Rejected`, a value); force log -> `LoadStep`.
Pixel coordinates: (0, 0) is the centre of the top-left pixel of the photo as displayed (after EXIF orientation).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.messages import Message
from rod.measurement import MeasuredShape

Array = NDArray[np.float64]
Level = Literal["info", "warning", "error"]
Branch = Literal["mounted", "loading", "unloading"]
Side = Literal["left", "right"]


@dataclass(frozen=True)
class Finding:
    """Something a reader of the report must know: a stable code, a level, and what is said."""

    code: str
    level: Level
    said: Message

    @property
    def message(self) -> str:
        """The sentence in English."""
        return str(self.said)

    @property
    def document(self) -> dict[str, Any]:
        """The finding as plain values for JSON."""
        return {"code": self.code, "level": self.level, "message": self.message, **self.said.stored()}


def inferred(key: str, /, **values: object) -> Finding:
    """Something that nobody said and that was concluded; ``key`` and values as of a `Message`."""
    said = Message(key, **values)
    return Finding(said.code, "info", said)


def doubtful(key: str, /, **values: object) -> Finding:
    """A contradiction or a loss: measured all the same, but a person should look."""
    said = Message(key, **values)
    return Finding(said.code, "warning", said)


def failed(key: str, /, **values: object) -> Finding:
    """Something that makes the numbers none of the cable's, or without which there are none."""
    return replace(doubtful(key, **values), level="error")


def said_once(noticed: Iterable[tuple[str, Finding]]) -> list[Finding]:
    """What was noticed on photos, each beside the photo's name; what is the same on several is one sentence."""
    groups: dict[str, list[tuple[str, Finding]]] = {}
    for image, finding in noticed:
        groups.setdefault(finding.said.key, []).append((image, finding))
    return [_of_photos(group) for group in groups.values()]


def _of_photos(group: list[tuple[str, Finding]]) -> Finding:
    image, first = group[0]
    names = list(dict.fromkeys(name for name, _ in group))
    if len(names) == 1:
        return replace(first, said=Message("photos.one", image=image, said=first.said))
    alike = len({finding.message for _, finding in group}) == 1
    key = "photos.several" if alike else "photos.several-on"  # the numbers are those of one photo
    return replace(first, said=Message(key, count=len(names), names=names, image=image, said=first.said))


@dataclass(frozen=True)
class Board:
    """Chessboard of a calibration photo: inner corners per row and column, side of a square in m (measured)."""

    columns: int
    rows: int
    square_m: float
    charuco: bool = False
    marker_m: float | None = None


@dataclass(frozen=True)
class CameraSpec:
    """Where the scale comes from; the first that is given counts. All None: bearings and log, or markers."""

    scale_px_per_m: float | None = None
    calibration: Path | None = None
    board: Board | None = None
    distance_m: float | None = None  # camera to calibration plane, for the height of the cable axis


@dataclass(frozen=True)
class RigSpec:
    """The bending machine: which bearing moves, how its axes are found, which sign of force is compression."""

    moving_bearing: Side = "left"
    marker_diameter_m: float | None = None
    bearings_px: tuple[tuple[float, float], tuple[float, float]] | None = None
    force_sign: Literal["compression", "tension"] = "compression"


@dataclass(frozen=True)
class PhotoHints:
    """What a person says about one photo; all in px of the photo as displayed.

    Attributes
    ----------
    use : bool
        False leaves the photo out; its step keeps its force.
    ends_px : pair of (u, v) or None
        Where the cable's axis meets the two bearing axes, or ends.
    path_px : tuple of (u, v)
        Rough clicks along the cable, from one end to the other.
    region_px : (u0, v0, u1, v1) or None
        Only there is the cable looked for.
    exclude_px : tuple of polygons
        Things that hide or touch the cable.
    """

    use: bool = True
    ends_px: tuple[tuple[float, float], tuple[float, float]] | None = None
    path_px: tuple[tuple[float, float], ...] = ()
    region_px: tuple[float, float, float, float] | None = None
    exclude_px: tuple[tuple[tuple[float, float], ...], ...] = ()


@dataclass(frozen=True)
class LoadStep:
    """One displacement step of the force log: a hold with its force samples and the photo taken in it.

    ``force_N`` is the force at the time of the photo (compression positive), ``force_std_N`` its standard deviation
    from the samples of the hold. ``times_s`` may be empty where the log has no time. ``displacement_std_m`` is the
    scatter of the displacement by those samples; None where they tell none.
    """

    step: int
    branch: Branch
    displacement_m: float
    force_N: float
    force_std_N: float
    photo_time_s: float | None
    times_s: Array
    forces_N: Array
    image: str | None
    line: int | None = None
    displacement_std_m: float | None = None


@dataclass(frozen=True)
class Specimen:
    """A specimen folder, read and checked; nothing measured yet.

    ``images`` maps the name relative to the folder (as in the log) to the path of an existing file; a photo named in
    the log whose file is missing stays out of it and is a finding. ``hashes`` are SHA-256 by relative name. ``hints``
    are what a person says about single photos, by the same names.
    """

    id: str
    folder: Path
    length_m: float
    diameter_m: float
    camera: CameraSpec
    rig: RigSpec
    steps: tuple[LoadStep, ...]
    images: dict[str, Path]
    description: dict[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    hashes: dict[str, str] = field(default_factory=dict)
    hints: dict[str, PhotoHints] = field(default_factory=dict)


@dataclass(frozen=True)
class Scale:
    """Pixels to metres on the plane of the cable axis, and where that came from."""

    px_per_m: float
    std_relative: float
    source: Message


@dataclass(frozen=True)
class Preview:
    """A reduced picture of the photo for people: JPEG bytes, and displayed px = preview px * ``reduction``.

    ``strip``: JPEG of the cable straightened along its centerline (arc length to the right), magnified across.
    """

    jpeg: bytes
    width: int
    height: int
    reduction: float
    strip: bytes | None = None


@dataclass(frozen=True)
class Rejected:
    """A photo that was not measured, and why; the values of what is said are the figures that show it."""

    image: str
    said: Message
    preview: Preview | None = None

    @property
    def code(self) -> str:
        """Stable code of the reason."""
        return self.said.code

    @property
    def finding(self) -> Finding:
        """The reason as something that a reader must know."""
        return Finding(self.code, "warning", self.said)

    @property
    def reason(self) -> str:
        """Why, in an English sentence."""
        return str(self.said)


@dataclass(frozen=True)
class Centerline:
    """The cable on one photo: curve in the chord frame with covariance, and where it lies on the photo.

    Attributes
    ----------
    image : str
        Name relative to the specimen folder.
    shape : MeasuredShape
        Chord frame, metres; see there. ``n`` points from the left to the right bearing axis.
    u_px, v_px : (n,) px
        The same points on the photo as displayed.
    kappa_std : (n,) 1/m
        With what scale, tilt and lens leave open once the series is measured; ``shape`` holds the photo's own errors.
    position_std : (n,) m
        Along the normal.
    chord_m, chord_std_m : m
        Distance of the bearing axes, std without what all photos share: scale and `Traces.axis_parallax_std`.
    traced_length_m, traced_length_std_m : m
        Arc length from axis to axis.
    left_px, right_px : (u, v) px
        Bearing axes; ``axis_std_px`` the standard deviation of each coordinate.
    width_m, width_std_m : m
        Measured width of the cable and its scatter along s, to be held against the diameter.
    mirrored : bool
        True if y of the chord frame points up on the photo, against the v axis.
    quality : dict
        Figures a person may want: contrast_to_noise, blur_px, section_std_px, systematic_px, width_over_diameter.
    findings : tuple of Finding
    preview : Preview or None
    """

    image: str
    shape: MeasuredShape
    u_px: Array
    v_px: Array
    kappa_std: Array
    position_std: Array
    chord_m: float
    chord_std_m: float
    traced_length_m: float
    traced_length_std_m: float
    left_px: tuple[float, float]
    right_px: tuple[float, float]
    axis_std_px: float
    width_m: float
    width_std_m: float
    mirrored: bool
    quality: dict[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    preview: Preview | None = None

    @property
    def side(self) -> int:
        """Side of the chord to which y points on the photo: 1 on the right hand from left axis to right axis, else -1.

        By all points together, so that it holds for a cable however straight.
        """
        left, right = np.array(self.left_px), np.array(self.right_px)
        across = np.array([left[1] - right[1], right[0] - left[0]])
        offsets = (np.column_stack([self.u_px, self.v_px]) - left) @ across
        return 1 if float(offsets @ self.shape.y) >= 0.0 else -1


@dataclass(frozen=True)
class Traces:
    """What the vision stage makes of a specimen.

    Attributes
    ----------
    photos : tuple of Centerline or Rejected
        One outcome per photo, in the order of the steps.
    scale : Scale
    findings : tuple of Finding
    axis_parallax_std : relative
        Of the way from the camera's foot to a bearing axis, common to all photos: by so much the axes may be seen too
        far out and so too far apart, because the covers that mark them lie higher than the cable's axis.
    """

    photos: tuple[Centerline | Rejected, ...]
    scale: Scale
    findings: tuple[Finding, ...] = ()
    axis_parallax_std: float = 0.0
