"""The box that a program draws: the unit cube of texture space, where the scene has its volume."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from volref.arrays import Floats, Integers
from volref.emulation.textures.radar_image import reach
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transform import affine, invert_affine

# The corners of the unit cube, x fastest, and its faces as triangles, counter-clockwise from outside.
CORNERS = np.array([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], dtype=np.float64)
TRIANGLES = np.array(
    [
        *((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6)),  # z = 0, z = 1
        *((0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3)),  # y = 0, y = 1
        *((0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)),  # x = 0, x = 1
    ]
)


@dataclass(frozen=True, eq=False)
class Box:
    """Where texture space lies: world_from_texture and clip_from_texture, both 4x4."""

    world_from_texture: Floats
    clip_from_texture: Floats

    @cached_property
    def texture_from_world(self) -> Floats:
        """4x4 matrix from the world to texture space."""
        return invert_affine("volume.direction", self.world_from_texture)

    @cached_property
    def sides(self) -> Floats:
        """World lengths (3,) of the box along the axes of texture space."""
        return np.asarray(np.linalg.norm(self.world_from_texture[:3, :3], axis=0))

    @property
    def triangles(self) -> Integers:
        """The faces, counter-clockwise in the world when seen from outside."""
        mirrored = np.linalg.det(self.world_from_texture[:3, :3]) < 0
        return TRIANGLES[:, ::-1] if mirrored else TRIANGLES

    @property
    def clip_corners(self) -> Floats:
        """Clip positions (8, 4) of the corners."""
        return np.asarray(CORNERS @ self.clip_from_texture[:, :3].T + self.clip_from_texture[:, 3])


def box_of(scene: Scene) -> Box:
    """Return where the texture space of a scene's volume lies.

    That of a radar is the cube around it that its farthest gates touch, the antenna in the middle.
    """
    assert scene.volume is not None
    if isinstance(scene.volume, RadarVolume):
        side = 2 * reach(scene.volume)
        world_from_texture = affine(side * np.eye(3), np.array(scene.volume.origin) - side / 2)
    else:
        low, high = scene.volume.index_bounds
        world_from_texture = scene.volume.world_from_index @ affine(np.diag(high - low), low)
    camera = scene.camera
    clip_from_world = camera.clip_from_view(scene.width, scene.height) @ camera.view_from_world
    return Box(world_from_texture, clip_from_world @ world_from_texture)
