"""A highlight or the lit half of a cable is no cable: where no width is known, its border is sought beside it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.records import Rejected
from pipeline.vision.centerline.measurement import follow_cable
from pipeline.vision.photo import Closeup
from pipeline.vision.render import Ground, Light, Sensor
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.search.border import border_width, soft_beside_sharp
from pipeline.vision.segmentation import find_cable
from tests.pipeline.vision.drawn import drawn
from tests.pipeline.vision.test_segmentation import DIAMETER, SCALE, UNKNOWN, photo_of, scene, strand
from tests.pipeline.vision.test_speckles import GRANITE, GREEN

LAMP = Light(elevation_rad=0.8, ambient=0.45, shadow=0.25)
PLAIN = Ground(colour=(0.45,) * 3)


@pytest.mark.parametrize("gloss", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("grey", [0.12, 0.25, 0.6, 0.82])
@pytest.mark.parametrize("ground", [PLAIN, GRANITE], ids=["plain", "granite"])
def test_a_part_of_a_lit_cable_is_not_taken_for_it(ground: Ground, grey: float, gloss: float) -> None:
    sensor = Sensor(mode="colour", noise=0.01)
    picture = drawn(
        scene(cable=strand((grey,) * 3, gloss=gloss), ground=ground, covers=(GREEN, GREEN), light=LAMP, sensor=sensor)
    )
    rough = find_cable(photo_of(picture), cable=UNKNOWN)
    if isinstance(rough, Rejected):
        return
    followed = follow_cable(rough, plane=PlaneMap.from_scale(SCALE), diameter_m=None)
    if isinstance(followed, Rejected):
        return
    middle = 0.5 * (followed.sections.first + followed.sections.second)
    off = float(cKDTree(np.column_stack([picture.u_px, picture.v_px])).query(middle)[0].max())
    # 5 to 11 px before, with 0.3 to 1 px stated
    assert off < 0.1 * DIAMETER * SCALE or off < 3.0 * followed.sections.systematic_std


def test_a_soft_shadow_is_no_border() -> None:
    light = Light(elevation_rad=0.95, ambient=0.45, shadow=0.35)
    photo = photo_of(drawn(scene(light=light)))
    found = find_cable(photo, cable=UNKNOWN)
    assert not isinstance(found, Rejected)
    assert border_width(photo, found) is None


@pytest.mark.parametrize("width", [1.0, 2.5, 5.0, 20.0])
@pytest.mark.parametrize("sections", [3, 12, 200])
def test_strips_of_any_size_are_judged(width: float, sections: int) -> None:
    picture = np.random.default_rng(1).random((80, 260)).astype(np.float32)
    middle = np.column_stack([30.0 + np.arange(sections), np.full(sections, 40.0)])
    across = np.tile([0.0, 1.0], (sections, 1))
    assert soft_beside_sharp(Closeup(picture, (0, 0)), middle, across, width) in (True, False)
