"""Photos of one series have one size and one top; a photo of another was cropped, scaled or turned.

A photo that was cropped shows the cable as long, in px, as the others do, and is used. One that was scaled has a scale
of its own. On one that was turned by a quarter left and right are told by what was up and down: its bearings may
change places, and everything along the cable with them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from pipeline.messages import Message
from pipeline.records import Finding, Rejected, doubtful, inferred
from pipeline.vision.rough import RoughCable
from pipeline.vision.shots import Shot

_CROPPED_LENGTH = 0.03
"""Relative; of the cable's length in px on a photo of another size: it is found within a third of that, and nobody
scales a photo by less.
"""


def of_one_size(shots: list[Shot]) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Refuse photos of another size than most that were not merely cropped, and those turned by a quarter.

    Parameters
    ----------
    shots : list of Shot

    Returns
    -------
    list of Shot
        Where no size is that of more than half of the photos, or none of those shows the cable, none is refused for
        its size.
    tuple of Finding
        ``photo/size`` of each photo that was cropped; of all, where they have no usual size.
    """
    shots = _without_turned(shots)
    sizes = [tuple(sorted(shot.size)) for shot in shots if shot.size is not None]
    usual, count = Counter(sizes).most_common(1)[0] if sizes else ((), 0)
    lengths = [
        shot.found.length_px
        for shot in shots
        if shot.size is not None and tuple(sorted(shot.size)) == usual and isinstance(shot.found, RoughCable)
    ]
    if sizes and 2 * count <= len(sizes):
        each = [f"{shot.found.image} {shot.size[0]} x {shot.size[1]} px" for shot in shots if shot.size is not None]
        return shots, (doubtful("photo/size.several", sizes=each),)
    if not lengths:
        return shots, ()
    settled, findings = [], []
    for shot in shots:
        if shot.size is None or tuple(sorted(shot.size)) == usual:
            settled.append(shot)
            continue
        name = shot.found.image
        both = {"size": f"{shot.size[0]} x {shot.size[1]} px", "most": f"{usual[1]} x {usual[0]} px"}
        ratio = shot.found.length_px / float(np.median(lengths)) if isinstance(shot.found, RoughCable) else np.nan
        if abs(ratio - 1.0) <= _CROPPED_LENGTH:
            findings.append(inferred("photo/size.cropped", image=name, **both))
            settled.append(shot)
            continue
        settled.append(replace(shot, found=Rejected(name, Message("photo/size", **both))))
    return settled, tuple(findings)


def _without_turned(shots: list[Shot]) -> list[Shot]:
    """Refuse photos on which the line between the bearings runs across that of most others."""
    steep = [_is_steep(shot.found) if isinstance(shot.found, RoughCable) else None for shot in shots]
    counted = Counter(way for way in steep if way is not None)
    usual, count = counted.most_common(1)[0] if counted else (None, 0)
    if 2 * count <= counted.total():
        return shots
    return [
        shot if way in (usual, None) else replace(shot, found=Rejected(shot.found.image, Message("photo/turned")))
        for shot, way in zip(shots, steep, strict=True)
    ]


def _is_steep(cable: RoughCable) -> bool:
    (u0, v0), (u1, v1) = cable.left.center_px, cable.right.center_px
    return abs(v1 - v0) > abs(u1 - u0)
