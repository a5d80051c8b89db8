"""A ray marcher as a first WebGL program has it, for whole images: what the study holds `render` against.

R rays.  Float32 throughout, a slab test with products by 1 / direction, directions normalised in voxel
space, positions by repeated addition, a step of half a voxel that counts as half the spacing along x, and
rays that end below a transmittance of 1e-3.  Beyond that it is a good one: midpoint samples, exponential
opacities, a shortened last step.  Meshes are not drawn.
"""

import numpy as np

from volref.arrays import Booleans, Floats, Numbers
from volref.scene import Scene, TransferFunction, Volume
from volref.stages.rays import pixel_rays
from volref.studies.stability.textbook import F4

STEP, MOST_STEPS, END_BELOW = 0.5, 4096, 1e-3


def shader_image(
    scene: Scene,
    *,
    step: float = STEP,
    most_steps: int = MOST_STEPS,
    values: Numbers | None = None,
    riemann: bool = False,
) -> Floats:
    """Return the image (H * W, 4) of the volume of `scene`, `step` in voxels; NaN where it comes to that.

    `values` take the place of the volume's, for samples that a volume refuses.  `riemann` takes
    extinction x length for the opacity.
    """
    samples = scene.gridded[0].values if values is None else values
    with np.errstate(all="ignore"):
        pixels = _march(scene, samples.astype(F4), F4(step), most_steps, riemann=riemann)
        return pixels.astype(np.float64)


def _march(scene: Scene, values: Numbers, step: np.float32, most_steps: int, *, riemann: bool) -> Numbers:
    volume, transfer = scene.gridded
    rays = pixel_rays(scene.camera, scene.width, scene.height, np.arange(scene.width * scene.height))
    spacing = np.array(volume.spacing, F4)
    origin = (rays.origins.astype(F4) - np.array(volume.origin, F4)) / spacing
    direction = rays.directions.astype(F4) / spacing
    direction /= np.sqrt((direction**2).sum(axis=1, keepdims=True))
    t, t_far = _slabs(origin, direction, volume)
    position = origin + t[:, None] * direction
    color, transmittance = np.zeros((len(t), 3), F4), np.ones(len(t), F4)
    for _ in range(most_steps):
        ahead = np.minimum(step, t_far - t)
        live = (ahead > 0) & ~(transmittance < END_BELOW)
        if not live.any():
            break
        value = _sample(values, position + direction * (ahead / 2)[:, None])
        shade, opacity = _classify(transfer, value, ahead * spacing[0], riemann=riemann)
        weight = np.where(live, transmittance * opacity, F4(0))
        color += weight[:, None] * shade
        transmittance = np.where(live, transmittance * (1 - opacity), transmittance)
        position += direction * step
        t = t + step
    behind = np.array(scene.background, F4)
    rgb = color + transmittance[:, None] * behind[:3]
    return np.column_stack([rgb, 1 - transmittance + transmittance * behind[3]])


def _slabs(origin: Numbers, direction: Numbers, volume: Volume) -> tuple[Numbers, Numbers]:
    low, high = (bound.astype(F4) for bound in volume.index_bounds)
    inverse = 1 / direction
    first, second = (low - origin) * inverse, (high - origin) * inverse
    t_near = np.maximum(np.minimum(first, second).max(axis=1), 0)
    t_far = np.maximum(first, second).min(axis=1)
    missed: Booleans = ~(t_near < t_far)  # NaN too: a comparison with it is false
    return np.where(missed, F4(0), t_near), np.where(missed, F4(0), t_far)


def _sample(values: Numbers, index: Numbers) -> Numbers:
    last = np.array(values.shape[::-1]) - 1
    place = np.clip(index, 0, last.astype(F4))
    low = np.nan_to_num(place).astype(int)
    high = np.minimum(low + 1, last)
    f = place - low.astype(F4)
    (x0, y0, z0), (x1, y1, z1) = low.T, high.T

    def along_x(y: Numbers, z: Numbers) -> Numbers:
        return np.asarray(values[z, y, x0] + f[:, 0] * (values[z, y, x1] - values[z, y, x0]))

    near, far = along_x(y0, z0), along_x(y0, z1)
    near = near + f[:, 1] * (along_x(y1, z0) - near)
    far = far + f[:, 1] * (along_x(y1, z1) - far)
    return np.asarray(near + f[:, 2] * (far - near))


def _classify(
    transfer: TransferFunction, value: Numbers, length: Numbers, *, riemann: bool
) -> tuple[Numbers, Numbers]:
    knots = transfer.values
    shade = np.stack([np.interp(value, knots, channel) for channel in transfer.colors.T], axis=1).astype(F4)
    if transfer.extinction is not None:
        extinction = np.interp(value, knots, transfer.extinction).astype(F4)
        return shade, extinction * length if riemann else 1 - np.exp(-extinction * length)
    opacity = np.interp(value, knots, np.asarray(transfer.opacity)).astype(F4)
    ratio = (length / F4(transfer.unit_distance)).astype(F4)
    return shade, 1 - np.exp(ratio * np.log(1 - opacity))
