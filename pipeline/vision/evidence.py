"""How much a strip that was measured looks like a cable, in units of its photo's own noise.

``picture along the measured midline -> steps of both edges against the steps that the ground makes -> Evidence``

Two edges along the seen length, a width as constant as the edges' own scatter lets it be, and nothing of the cable's
look that leaves it (`pipeline.vision.search.crosscut.crossed_at`). No figure needs a threshold that knows the photo:
steps count in standard deviations of the same sums taken beside the cable, where there is no edge, so noise, texture
and weave of the ground are in them.

Lengths in px and in *widths* of the cable; a block is a piece of the cable one width long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.messages import Message
from pipeline.records import Array
from pipeline.vision.median import SURE_SIGMAS, median, scatter
from pipeline.vision.photo import Closeup, straightened
from pipeline.vision.polyline import step_lengths

_NULL = (1.15, 1.4, 1.65)  # widths from the midline where there is no edge; the window along a cable reaches to 2.25
_FIRM = 4.0  # standard deviations; of the median block of a strip that leaves no doubt
_LEAST_LIKENESS = 0.45  # cables on webcam photos reach 0.6 and more; with paper on a third of a cable 0.4 is left
_STEADY = 0.1  # of what camera and edges explain: a width as constant as that is as good as any
_LEVEL = 1.0 / 512.0  # of full range; half a level of 8 bits: no photo is calmer than its rounding
_CALM_PX, _CALM = 0.5, 0.04  # width's scatter that every camera makes: px of halo, JPEG and grid; share of the width
_ALONG = 5  # sections pooled for the width's constancy, unless its waves are longer


@dataclass(frozen=True)
class Evidence:
    """What speaks for a strip.

    Attributes
    ----------
    length : px
        Measured.
    seen : share
        Of the blocks, those with both edges three standard deviations above the ground's own steps; of a strip as
        wide as the cable is known to be, or half of the usual one.
    edges : ratio
        Median over the blocks of the weaker edge's step in standard deviations of the ground's.
    unsteady : ratio
        Scatter of the width, waves averaged, over what camera and edges explain; about 1 or less on a cable. Infinite
        where nothing was weighed.
    crossed : (u, v) px or None
        Where something that looks like the strip leaves it.
    """

    length: float = 0.0
    seen: float = 0.0
    edges: float = 0.0
    unsteady: float = np.inf
    crossed: tuple[float, float] | None = None

    @property
    def figures(self) -> dict[str, float]:
        """The numbers that a refusal tells; none of a strip too short to be weighed."""
        figures = {"edges_over_noise": self.edges, "seen": self.seen, "width_unsteady": self.unsteady}
        return figures if np.isfinite(self.unsteady) else {}

    @property
    def likeness(self) -> float:
        """From 0 to 1: a cable has two edges all along, of one width, that stand out."""
        return self.seen * min(1.0, 1.0 / max(self.unsteady, 1e-9)) * min(1.0, self.edges / 6.0)

    @property
    def value(self) -> float:
        """Rank among the strips of one photo: length in px times likeness to a cable."""
        return self.length * self.likeness

    @property
    def firmness(self) -> float:
        """Step of the edges over the scatter of the width: of two readings of one strip the larger is the better."""
        return self.edges / max(self.unsteady, _STEADY)

    @property
    def clear(self) -> bool:
        """True if this is so surely a cable that no other reading of the photo need be looked at."""
        return self.seen >= 0.9 and self.edges >= _FIRM and self.unsteady <= 1.0 and self.crossed is None

    @property
    def enough(self) -> bool:
        """True if more speaks for a cable than against it; how well it is known, its band says."""
        return self.likeness >= _LEAST_LIKENESS and self.edges >= SURE_SIGMAS


def weigh(
    closeup: Closeup,
    middle: Array,
    across: Array,
    widths: Array,
    *,
    std: float,
    share: float = 1.0,
    crossed: tuple[float, float] | None = None,
    known: bool = False,
) -> Evidence:
    """The evidence for a strip.

    Parameters
    ----------
    closeup : Closeup
        The picture.
    middle : (n, 2) px
        Points about evenly along the strip, at most a quarter of its width apart or so.
    across : (n, 2)
        Unit vectors from its one edge to the other.
    widths : (m,) px
        Of the strip along it.
    std : px
        Of a width, by what scatter its edges have.
    share : float
        Of the length asked for, on which widths were found.
    crossed : (u, v) px or None
        Where something leaves the strip.
    known : bool
        That the cable is so wide: no flank of it passes then, and above half of the usual step an edge is likelier
        there than not, however faint it is.
    """
    width, gap = median(widths), median(step_lengths(middle))
    each = max(1, round(width / max(gap, 1e-9)))
    length = gap * (len(middle) - 1)
    if len(middle) < 4 * each:
        return Evidence(length)
    spacing = max(1.0, width / 10.0)
    columns = np.ceil(2.1 * width / spacing)
    offset = np.arange(-columns, columns + 1.0) * spacing
    picture = straightened(closeup.grey, middle - closeup.origin_px, across, offset)
    count = len(picture) // each
    blocks = picture[: count * each].reshape(count, each, -1).mean(axis=1, dtype=np.float64)
    reach = max(1, round(0.25 * width / spacing))
    ground = _steps(blocks, offset, np.concatenate([np.array(_NULL), -np.array(_NULL)]) * width, reach)
    noise = float(np.hypot(scatter(ground - np.median(ground, axis=0), 0.0), _LEVEL))
    weaker = np.min(_steps(blocks, offset, np.array([-0.5, 0.5]) * width, reach), axis=1) / noise
    edges = median(weaker)
    along = _wave(widths)
    calm = np.convolve(widths, np.ones(along) / along, mode="valid") if len(widths) > along else widths
    return Evidence(
        length=length,
        seen=float(np.mean(weaker > (min(SURE_SIGMAS, 0.5 * edges) if known else SURE_SIGMAS))) * share,
        edges=edges,
        unsteady=scatter(calm) / max(_CALM_PX, _CALM * width, 1.5 * std),
        crossed=crossed,
    )


def _steps(blocks: Array, offset: Array, places: Array, reach: int) -> Array:
    """Step ``(k, p)`` of each block at each place: the ``reach`` columns outward of it less those inward."""
    total = np.cumsum(np.pad(blocks, ((0, 0), (1, 0))), axis=1)
    column = np.rint(np.interp(places, offset, np.arange(len(offset)))).astype(int)
    right = (total[:, column + reach + 1] - total[:, column + 1]) / reach
    left = (total[:, column] - total[:, column - reach]) / reach
    return np.asarray((right - left) * np.sign(places))


def _wave(widths: Array) -> int:
    """Sections over which an outline's waves average: those of a wave that repeats itself all along, as of a twist.

    That is six times or more, with a correlation of one half: fewer may be anything, and other widths have less.
    """
    off = widths - median(widths)
    alike = np.correlate(off, off, mode="full")[len(off) - 1 :][: len(off) // 6]
    if not (alike < 0.0).any():
        return _ALONG
    down = int(np.argmax(alike < 0.0))
    length = down + int(np.argmax(alike[down:]))
    return max(_ALONG, length) if alike[length] > 0.5 * alike[0] else _ALONG


def unlike_a_cable(evidence: Evidence) -> Message:
    """Why a strip is refused: the figure that is farthest from that of a cable."""
    edges, steady = evidence.edges / 6.0, 1.0 / max(evidence.unsteady, 1.0)
    if not evidence.figures:
        key = "photo/contrast.no-edges"
    elif evidence.edges < _FIRM or edges <= min(evidence.seen, steady):
        key = "photo/contrast.weak-edge"
    else:
        key = "photo/outline.one-edge" if evidence.seen <= steady else "photo/outline.unsteady"
    return Message(key, **evidence.figures)
