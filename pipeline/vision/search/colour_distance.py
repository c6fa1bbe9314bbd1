"""A photo as the distance in colour from its ground: a cable of several colours is one strip on it.

A green and yellow wire has no colour projection in which both stand out alike: its yellow is as bright as paper, its
green as grey as a shadow. But a pixel that the cable covers by a part is as far from the ground's colour as that part
of the sheath's, whichever colour that is, so on this picture edges lie where they are. Brightness counts for less than
colour, for that is all that shadows have.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from pipeline.vision.photo import Photo
from pipeline.vision.search.backdrop import Standout

_BRIGHTNESS = 0.4
"""Weight of brightness against colour: a shadow of 0.15 of full range then counts 0.06, a dark green sheath 0.3."""


def as_colour_distance(photo: Photo, standout: Standout) -> Photo | None:
    """The photo as one grey value, 16 bits: brighter, the farther from the ground's colour; None of a grey photo.

    Parameters
    ----------
    photo : Photo
    standout : Standout
        Of the whole photo: tells its ground.
    """
    if photo.pixels.ndim == 2 or photo.pixels.shape[2] != 3:
        return None
    ground = np.asarray(standout.picture - standout.residual, np.float32)
    away = photo.pixels.astype(np.float32)
    away *= np.float32(1.0 / photo.full_scale)
    away -= cv2.resize(ground, photo.size, interpolation=cv2.INTER_LINEAR)
    # of the mean over three channels both parts count alike: the root of three takes it to the length of a colour
    brightness = away.mean(axis=2)
    away -= brightness[..., None]
    squared = np.einsum("ijc,ijc->ij", away, away) + 3.0 * (_BRIGHTNESS * brightness) ** 2
    coded = np.clip(np.sqrt(squared) * 65535.0, 0.0, 65535.0)
    return replace(photo, pixels=coded.astype(np.uint16), bit_depth=16)
