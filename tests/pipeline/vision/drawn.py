"""Pictures of scenes, each drawn once: several tests look at the same one, with other knowledge or in another file."""

import pickle
from functools import lru_cache

from pipeline.vision.render import Picture, Scene, render


def drawn(scene: Scene) -> Picture:
    """The picture of a scene; its pixels are not to be changed."""
    return _drawn(pickle.dumps(scene))


@lru_cache(maxsize=16)
def _drawn(scene: bytes) -> Picture:
    picture = render(pickle.loads(scene))
    picture.pixels.flags.writeable = False
    return picture
