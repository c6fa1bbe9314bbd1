"""Photos of one series have one size; a photo of another was cropped, or it was scaled and has a scale of its own.

A photo that was cropped shows the cable as long, in px, as the others do, and is used. Turned by a quarter it has the
same size.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from pipeline.messages import Message
from pipeline.records import Finding, Rejected, inferred
from pipeline.vision.rough import RoughCable
from pipeline.vision.shots import Shot

_CROPPED_LENGTH = 0.03
"""Relative; of the cable's length in px on a photo of another size: it is found within a third of that, and nobody
scales a photo by less.
"""


def of_one_size(shots: list[Shot]) -> tuple[list[Shot], tuple[Finding, ...]]:
    """Refuse photos of another size than most that were not merely cropped.

    Parameters
    ----------
    shots : list of Shot

    Returns
    -------
    list of Shot
        Where no size is that of more than half of the photos, or none of those shows the cable, as they came.
    tuple of Finding
        ``photo/size`` of each photo that was cropped.
    """
    sizes = [tuple(sorted(shot.size)) for shot in shots if shot.size is not None]
    usual, count = Counter(sizes).most_common(1)[0] if sizes else ((), 0)
    lengths = [
        shot.found.length_px
        for shot in shots
        if shot.size is not None and tuple(sorted(shot.size)) == usual and isinstance(shot.found, RoughCable)
    ]
    if 2 * count <= len(sizes) or not lengths:
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
