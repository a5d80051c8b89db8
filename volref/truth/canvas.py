"""The image while it is being filled in.

R pixels of a part; H, W the image.  Images are kept flat, and whatever is needed beside the result is made by
parts: a 4096 x 4096 image of four channels takes 512 MiB.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.records import Layers, Surface
from volref.scene.lights import Material
from volref.scene.scene import Scene
from volref.stages.lighting import brightest_lit
from volref.truth.integration import Integrated, Integration
from volref.truth.meshes.layered import integrate_layered
from volref.truth.meshes.layers import visible_layers
from volref.truth.parts import Parts, runs

# Pixels that are filled with what lies behind the volume, or with what it could be, at a time.
PIXELS_AT_ONCE = 1 << 14


class Canvas:
    """Pixels being filled in: rgba (H W, 4), bound (H W,), distance (H W,), and the work spent so far.

    A pixel that nothing is known of has an infinite bound.  `layers` are those of all pixels, None if no mesh
    is transparent.
    """

    def __init__(self, scene: Scene, surface: Surface | None) -> None:
        pixels = scene.width * scene.height
        self.scene, self.surface = scene, surface
        self.layers = None
        if surface is not None and any(mesh.transparent for mesh in scene.meshes):
            self.layers = visible_layers(scene, surface)
        self.distance = np.full(pixels, np.inf) if surface is None else surface.distance.reshape(-1)
        self.rgba, self.bound = np.zeros((pixels, 4)), np.full(pixels, np.inf)
        self.hit = np.full(pixels, np.inf) if scene.mode == "isosurface" else None
        self.samples = 0

    def behind(self, pixels: Indices) -> Floats:
        """Return what lies behind the volume, (R, 4)."""
        return light_behind(self.scene, self.surface, pixels)

    def layers_of(self, pixels: Indices) -> Layers | None:
        """Return the layers of some pixels, None if the scene has none."""
        return None if self.layers is None else self.layers.of_pixels(pixels)

    def integrated(self, integration: Integration | None, pixels: Indices, tolerance: float) -> Integrated:
        """Return what the scene shows at some pixels, all layers laid over each other; None: no volume."""
        layers, distance = self.layers_of(pixels), self.distance[pixels]
        return integrate_layered(integration, layers, pixels, distance, self.behind(pixels), tolerance)

    def all_behind(self) -> Floats:
        """Return what lies behind the volume at every pixel, (H W, 4), read-only."""
        pixels = len(self.bound)
        if self.surface is None:
            return np.broadcast_to(np.array(self.scene.background), (pixels, 4))
        return self.behind(np.arange(pixels))

    def show_what_lies_behind(self) -> None:
        """Finish the image of a scene in which the volume does not show."""
        self.bound[:] = 0.0
        if self.surface is None:
            self.rgba[:] = self.scene.background
            return
        parts = runs(len(self.bound), PIXELS_AT_ONCE)
        for pixels in map(parts.pixels, range(parts.count)):
            shown = self.integrated(None, pixels, 0.0)
            self.rgba[pixels], self.bound[pixels] = shown.rgba, shown.bound

    def show_anything(self, parts: Parts) -> None:
        """Set each pixel of `parts` midway between all that it could be, and the bound to half of that."""
        for pixels in map(parts.pixels, range(parts.count)):
            anything = _anything(self.scene, self.behind(pixels), self.layers_of(pixels))
            self.rgba[pixels], self.bound[pixels] = anything

    def put(self, pixels: Indices, done: Integrated, *, only_better: bool = False) -> None:
        """Fill in `pixels`, or those of them that were not known better."""
        self.samples += done.samples
        kept = done.bound <= self.bound[pixels] if only_better else np.ones(len(pixels), np.bool_)
        pixels = pixels[kept]
        self.rgba[pixels], self.bound[pixels] = done.rgba[kept], done.bound[kept]
        if self.hit is not None and done.hit is not None:
            self.hit[pixels] = done.hit[kept]

    def distances(self) -> Floats:
        """Return the distance (H W,) of the first opaque surface or isosurface."""
        return self.distance if self.hit is None else np.minimum(self.distance, self.hit)


def light_behind(scene: Scene, surface: Surface | None, pixels: Indices) -> Floats:
    """Return the premultiplied RGBA (R, 4) behind the volume at `pixels`: the surface, or the background."""
    behind = np.tile(np.array(scene.background), (len(pixels), 1))
    if surface is not None:
        hit = surface.mesh.reshape(-1)[pixels] >= 0
        behind[hit, :3] = surface.color.reshape(-1, 3)[pixels[hit]]
        behind[hit, 3] = 1.0
    return behind


def _anything(scene: Scene, behind: Floats, layers: Layers | None) -> tuple[Floats, Floats]:
    """Return pixels (R, 4) midway between all that volume and layers could show, and their bound (R,)."""
    if scene.volume is None or scene.transfer is None:
        return behind.copy(), np.zeros(len(behind))
    brightest = scene.envelope.colors.max(axis=0)
    if scene.lights_volume:
        material = scene.material or Material()
        brightest = np.array([brightest_lit(scene.lights, material, color) for color in brightest.tolist()])
    most = np.maximum(behind, np.append(brightest, 1.0))
    if layers is not None:
        np.maximum.at(most[:, :3], np.repeat(np.arange(len(most)), layers.counts), layers.color)
    least = np.append(np.zeros((len(behind), 3)), behind[:, 3:], axis=1)
    return (most + least) / 2, (most - least).max(axis=1) / 2
