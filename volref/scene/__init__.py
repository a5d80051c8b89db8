"""The scene model: frozen records that check themselves when built."""

from volref.scene.camera import Camera
from volref.scene.lights import Light, Material
from volref.scene.mesh import Mesh
from volref.scene.plane import Plane, clip_box
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.series import Series
from volref.scene.sweep import Sweep
from volref.scene.transfer import TransferFunction
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume

__all__ = [
    "Camera",
    "Light",
    "Material",
    "Mesh",
    "Plane",
    "RadarVolume",
    "Scene",
    "Series",
    "Sweep",
    "TransferFunction",
    "TransferFunction2D",
    "Volume",
    "clip_box",
]
