"""Photos drawn by the project itself, with their exact truth: a described `Scene` in, a `Picture` out."""

from pipeline.vision.render.clutter import ChessBoard, Cover
from pipeline.vision.render.ground import Ground
from pipeline.vision.render.lens import Camera
from pipeline.vision.render.lighting import Light
from pipeline.vision.render.scene import Picture, Scene, Thing, render, render_board
from pipeline.vision.render.sensor import Sensor
from pipeline.vision.render.strand import Curve, Strand

__all__ = [
    "Camera",
    "ChessBoard",
    "Cover",
    "Curve",
    "Ground",
    "Light",
    "Picture",
    "Scene",
    "Sensor",
    "Strand",
    "Thing",
    "render",
    "render_board",
]
