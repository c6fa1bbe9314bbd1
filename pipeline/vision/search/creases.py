"""A cable as bright as its ground, seen by the two dark lines of its rims.

A sheath darkens towards its rim, the ground beneath it towards the same line. So both edges are creases, whatever each
of them divides: dark from bright, bright from dark, or two that are alike. Shades and shadows are soft, and no creases.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np

from pipeline.vision.photo import Photo, Pixels

_CREASE_WIDTHS = 0.4  # widths; rims are darker than what lies so near on both sides, a shadow is not
_GRAIN_WIDTHS = 0.04  # widths; a tenth of what makes a crease, so that a rim is left of it


def by_creases(photo: Photo, width_px: float) -> Iterator[Photo]:
    """The photo as its creases: as sharp as they are, then without the grain of a weave or a brushed ground."""
    yield creased(photo, width_px)
    smooth = np.asarray(cv2.GaussianBlur(photo.pixels, (0, 0), _GRAIN_WIDTHS * width_px), photo.pixels.dtype)
    yield creased(replace(photo, pixels=smooth, taken=photo.taken or photo), width_px)


def creased(photo: Photo, width_px: float) -> Photo:
    """The photo as the depth of its creases, in which what lies between two of them up to a width apart is one strip.

    What is left of a bottom hat is closed, so that the shallower of both rims tells how bright the strip is, and a line
    alone stays a line.
    """
    grey = photo.pixels if photo.channels == 1 else cv2.cvtColor(photo.pixels, cv2.COLOR_BGR2GRAY)
    depth = cv2.morphologyEx(grey, cv2.MORPH_BLACKHAT, _disc(_CREASE_WIDTHS * width_px))
    filled: Pixels = np.asarray(cv2.morphologyEx(depth, cv2.MORPH_CLOSE, _disc(width_px)), grey.dtype)
    return Photo(photo.name, filled, photo.bit_depth, photo.taken or photo)


def _disc(diameter: float) -> Pixels:
    size = max(1, round(diameter)) | 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
