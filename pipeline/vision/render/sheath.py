"""Looks of a cable's outside: colour, gloss, printed text, stripe, strands.

A marking is a small picture on the unrolled sheath: columns along the arc length, rows across the seen half from
-1 to 1 radius, repeated with a pitch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Colour = tuple[float, float, float]

BLACK: Colour = (0.17, 0.17, 0.17)
WHITE: Colour = (0.92, 0.92, 0.90)
LUMINANCE = np.array([0.299, 0.587, 0.114])

_ROWS = 64  # of the marking's picture: half a pixel on a cable of 32 px, finer than any lens in use


@dataclass(frozen=True)
class Sheath:
    """Colour, gloss and print of a cable.

    Attributes
    ----------
    colour : (r, g, b)
        Reflectance, 0 to 1.
    gloss, shininess : float
        Highlight; see `pipeline.vision.render.lighting.cylinder`. Rubber 0.05 and 5, PVC 0.4 and 60.
    text : str
        Printed along the cable; empty for none.
    text_colour : (r, g, b)
    text_size : float
        Height of the letters in radii of the cable.
    text_across : float
        Middle of the letters, in radii from the axis.
    text_pitch : float
        Distance of repetitions in radii.
    stripe : float
        Half width of a second colour's stripe along the axis, in radii; 0 for none. It lies at ``stripe_across``.
    stripe_across : float
    stripe_colour : (r, g, b)
    strands : float
        Contrast of helical strands (a bare rope or braid), 0 to 1.
    lay : float
        Length of one strand's repetition along the cable, in radii.
    """

    colour: Colour = BLACK
    gloss: float = 0.0
    shininess: float = 60.0
    text: str = ""
    text_colour: Colour = WHITE
    text_size: float = 0.7
    text_across: float = 0.1
    text_pitch: float = 24.0
    stripe: float = 0.0
    stripe_across: float = 0.0
    stripe_colour: Colour = (0.85, 0.80, 0.10)
    strands: float = 0.0
    lay: float = 3.0

    @property
    def plain(self) -> bool:
        """True if the colour does not change over the sheath."""
        return not (self.text or self.stripe or self.strands)


def ink(colour: Colour, channels: int) -> Array:
    """Colour as (channels,): itself, or its luminance for a grey picture."""
    rgb = np.asarray(colour, dtype=float)
    return rgb if channels == 3 else np.array([float(rgb @ LUMINANCE)])


def albedo(sheath: Sheath, along: Array, across: Array, channels: int) -> Array:
    """Colour (n, channels) of the sheath.

    Parameters
    ----------
    sheath : Sheath
    along, across : (n,)
        Arc length and signed distance from the axis, both in radii.
    channels : 1 or 3
    """
    colour = np.broadcast_to(ink(sheath.colour, channels), (along.size, channels))
    if sheath.strands:
        around = np.arcsin(np.clip(across, -1.0, 1.0))
        wave = np.cos(2 * np.pi * along / sheath.lay + 3.0 * around)
        colour = colour * (1.0 + sheath.strands * wave)[:, None]
    if sheath.stripe:
        inside = np.clip((sheath.stripe - np.abs(across - sheath.stripe_across)) * 20.0 + 0.5, 0.0, 1.0)[:, None]
        colour = colour * (1.0 - inside) + inside * ink(sheath.stripe_colour, channels)
    if sheath.text:
        printed = _printed(sheath, along, across)[:, None]
        colour = colour * (1.0 - printed) + printed * ink(sheath.text_colour, channels)
    return colour


def _printed(sheath: Sheath, along: Array, across: Array) -> Array:
    picture = _text(sheath.text)
    rows, columns = picture.shape
    per_row = sheath.text_size / rows
    column = (along % sheath.text_pitch) / per_row
    row = (across - sheath.text_across) / per_row + 0.5 * rows
    inside = (column < columns) & (row >= 0) & (row < rows)
    value = np.zeros(along.size)
    value[inside] = picture[row[inside].astype(int), column[inside].astype(int)]
    return value


@lru_cache(maxsize=32)
def _text(text: str) -> NDArray[np.float32]:
    font, size = cv2.FONT_HERSHEY_DUPLEX, _ROWS / 30.0
    (w, h), base = cv2.getTextSize(text, font, size, 3)
    picture = np.zeros((h + base + 6, w + 6), np.uint8)
    cv2.putText(picture, text, (3, h + 3), font, size, 255, 3, cv2.LINE_AA)
    return (picture / np.float32(255)).astype(np.float32)
