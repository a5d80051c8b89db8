"""The scenes, as plain numbers that every renderer can take.

A volume ends at its outer samples (VTK point data, volref's "node"), is trilinear between them, and is axis
aligned, so that index = (world - origin) / spacing.  Extinction per world unit and colour are those of a
transfer function with a few knots.  Light is emitted and absorbed,

    dC = T sigma c dt,   dT = -T sigma dt,

over a black, clear background.  A mesh is opaque, unlit, of one colour.  Images are (height, width, 4),
premultiplied, row 0 on top.  P pixels; values are (nz, ny, nx), points (x, y, z).
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

import volref as vr
from volref.arrays import Floats, Indices, Numbers, Vector
from volref.phantoms.meshes import sphere_mesh

CT_FILE = Path(__file__).parents[2] / "data" / "real_ct.json"

# One pixel of each block of this side is judged.
BLOCK_SIDE = 8

# Pixels nearer to the outline of a mesh than this are not: there a rasteriser may decide either way.
OUTLINE = 1.5

# Triangles of a mesh by the name that stands behind the "+", as halvings of an icosahedron's edges.
MESHES = {"mesh1k": 3, "mesh20k": 5, "mesh330k": 7}
MESH_CENTER, MESH_RADIUS, MESH_COLOR = (0.15, -0.1, 0.2), 0.55, (0.8, 0.75, 0.7)

# Knots: value * 255, colour, extinction.  "soft" leaves half of the box clear, "dense" ends most rays that
# hit something, "peak" is a thin layer about the level 1/2.
SOFT = (
    (0, 0.0, 0.0, 0.0, 0.0), (20, 0.1, 0.1, 0.5, 0.0), (64, 0.1, 0.3, 0.9, 2.0), (110, 0.2, 0.8, 0.4, 5.0),
    (150, 0.9, 0.8, 0.2, 10.0), (200, 1.0, 0.4, 0.1, 20.0), (255, 1.0, 1.0, 1.0, 40.0),
)  # fmt: skip
DENSE = tuple((*knot[:4], sigma) for knot, sigma in zip(SOFT, (0, 0, 8, 30, 60, 120, 200), strict=True))
PEAK = (
    (0, 0.1, 0.1, 0.5, 0.0), (90, 0.1, 0.3, 0.9, 0.05), (115, 0.2, 0.8, 0.9, 0.2),
    (128, 1.0, 0.9, 0.3, 6.0), (141, 0.9, 0.3, 0.1, 0.2), (255, 0.6, 0.1, 0.1, 0.4),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene to render.

    Parameters
    ----------
    name
        As `problem_of` takes it.
    values
        Samples (nz, ny, nx) in float32.
    spacing, origin
        Of the samples, (x, y, z); the origin is that of the first.
    knots, colors, strengths
        Transfer function: values (K,), colours (K, 3), and extinctions (K,), or opacities per
        `unit_distance` if that is given; linear in between.
    unit_distance
        The length for which opacities are meant, or None.
    entries
        Entries of a table over knots[0]..knots[-1] that is linear between them and exact, or nearly so.
    eye, target, up, fov_y
        The camera; the vertical opening is in degrees.
    width, height
        Of the image.
    mesh
        An opaque sphere of triangles, or None.
    """

    name: str
    values: Numbers
    spacing: Vector
    origin: Vector
    knots: Floats
    colors: Floats
    strengths: Floats
    unit_distance: float | None
    entries: int
    eye: Vector
    target: Vector
    up: Vector
    fov_y: float
    width: int
    height: int
    mesh: vr.Mesh | None = None

    @cached_property
    def scene(self) -> vr.Scene:
        """The scene as volref's own record."""
        volume = vr.Volume(self.values, self.spacing, self.origin, centering="node")
        transfer = (
            vr.TransferFunction(self.knots, self.colors, self.strengths)
            if self.unit_distance is None
            else vr.TransferFunction.from_opacity(self.knots, self.colors, self.strengths, self.unit_distance)
        )
        reach = 10 * float(np.linalg.norm(np.subtract(self.target, self.eye)))
        camera = vr.Camera.look_at(self.eye, self.target, self.up, self.fov_y, reach * 1e-3, reach)
        meshes = () if self.mesh is None else (self.mesh,)
        return vr.Scene(volume, transfer, camera, self.width, self.height, meshes=meshes)

    @property
    def voxel(self) -> float:
        """The least spacing: steps are stated in it."""
        return min(self.spacing)

    @cached_property
    def size(self) -> Floats:
        """Number of samples (x, y, z)."""
        return np.array(self.values.shape[::-1], np.float64)

    def extinction(self, values: Floats) -> Floats:
        """Extinction per world unit at `values`."""
        found = np.interp(values, self.knots, self.strengths)
        return found if self.unit_distance is None else -np.log1p(-found) / self.unit_distance

    def color(self, values: Floats) -> Floats:
        """Colours (3, ...) at `values`."""
        return np.stack([np.interp(values, self.knots, channel) for channel in self.colors.T])

    def table(self, entries: int) -> Floats:
        """Colour and extinction (entries, 4) at equal distances from the first knot to the last."""
        values = np.linspace(self.knots[0], self.knots[-1], entries)
        return np.vstack([self.color(values), self.extinction(values)]).T

    @cached_property
    def directions(self) -> Floats:
        """Unit directions (height width, 3) through the pixel centres."""
        forward, right, up = self._axes
        y, x = np.divmod(np.arange(self.width * self.height), self.width)
        reach = np.tan(np.radians(self.fov_y) / 2)
        across = ((x + 0.5) / self.width * 2 - 1) * reach * self.width / self.height
        above = (1 - (y + 0.5) / self.height * 2) * reach
        through = forward + across[:, None] * right + above[:, None] * up
        return np.asarray(through / np.linalg.norm(through, axis=1, keepdims=True))

    @property
    def _axes(self) -> tuple[Floats, Floats, Floats]:
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return forward, right, np.cross(right, forward)

    @cached_property
    def spans(self) -> tuple[Floats, Floats]:
        """Distances (height width,) at which rays enter the box and leave it; a miss leaves no later."""
        low = np.subtract(self.origin, self.eye)
        high = low + (self.size - 1) * self.spacing
        with np.errstate(divide="ignore"):
            one, other = low / self.directions, high / self.directions
        return np.maximum(np.minimum(one, other).max(axis=1), 0.0), np.maximum(one, other).min(axis=1)

    @property
    def index_eye(self) -> Floats:
        """The eye in index space."""
        return np.subtract(self.eye, self.origin) / self.spacing

    @cached_property
    def index_directions(self) -> Floats:
        """Index (height width, 3) that a ray moves per world unit."""
        return self.directions / self.spacing

    def samples(self, step: float) -> float:
        """Segments of `step` voxels in all spans together, nothing skipped, no surface in the way."""
        entering, leaving = self.spans
        return float(np.maximum(leaving - entering, 0.0).sum() / (step * self.voxel))

    @cached_property
    def judged(self) -> Indices:
        """The pixels (P,) whose error counts: one at random in each block, none at the mesh's outline."""
        rng = np.random.default_rng(42)
        y, x = np.mgrid[0 : self.height // BLOCK_SIDE, 0 : self.width // BLOCK_SIDE] * BLOCK_SIDE
        y, x = (start + rng.integers(0, BLOCK_SIDE, start.shape) for start in (y, x))
        pixels = np.asarray(y * self.width + x).ravel()
        return pixels if self.mesh is None else pixels[~self._at_outline(pixels)]

    def _at_outline(self, pixels: Indices) -> np.ndarray:
        """Tell which rays pass within a few pixels of the sphere's outline."""
        to_center = np.subtract(MESH_CENTER, self.eye)
        along = self.directions[pixels] @ to_center
        beside = np.sqrt(np.maximum(to_center @ to_center - along**2, 0.0))
        pixel = 2 * np.tan(np.radians(self.fov_y) / 2) / self.height * np.linalg.norm(to_center)
        return np.asarray(np.abs(beside - MESH_RADIUS) < OUTLINE * pixel)


def problem_of(name: str, side: int = 512) -> Problem:
    """Return a problem by name; `side` is the width of its image in pixels.

    "blobs128", "dense128" and "ml128" are fields of 128^3 samples (any number will do); "+mesh20k" behind
    the name puts the sphere of 20480 triangles into them.  "chest-ct" is the scan of the tests.

    Examples
    --------
    >>> problem = problem_of("ml16+mesh1k", 32)
    >>> problem.values.shape, len(problem.mesh.faces), problem.judged.size
    ((16, 16, 16), 1280, 15)
    """
    if name == "chest-ct":
        return chest_ct(side)
    found = re.fullmatch(r"(blobs|dense|ml)(\d+)(?:\+(\w+))?", name)
    if found is None or not (found[3] is None or found[3] in MESHES):
        message = f"problem must be like blobs128, dense128, ml128+mesh20k or chest-ct, got {name!r}; "
        raise ValueError(message + f"meshes are {', '.join(MESHES)}")
    field, samples, mesh = found[1], int(found[2]), found[3]
    make, knots = FIELDS[field]
    table = np.array(knots)
    return Problem(
        name=name,
        values=make(samples).astype(np.float32),
        spacing=(2 / (samples - 1),) * 3,
        origin=(-1.0, -1.0, -1.0),
        knots=table[:, 0] / 255,
        colors=table[:, 1:4],
        strengths=table[:, 4],
        unit_distance=None,
        entries=256,
        eye=(2.15, 1.65, 3.75),
        target=(0.0, 0.0, 0.0),
        up=(0.0, 1.0, 0.0),
        fov_y=30.0,
        width=side,
        height=side,
        mesh=mesh and sphere_mesh(MESH_RADIUS, MESH_CENTER, MESH_COLOR, subdivisions=MESHES[mesh]),
    )


def blobs(samples: int) -> Floats:
    """Sum of 14 Gaussian blobs on [-1, 1]^3, in 0..1."""
    rng = np.random.default_rng(7)
    centers, widths = rng.uniform(-0.65, 0.65, (14, 3)), rng.uniform(0.12, 0.32, 14)
    heights = rng.uniform(0.5, 1.0, 14)
    z, y, x = _axes_of(samples)
    values = np.zeros((samples, samples, samples))
    for center, width, height in zip(centers, widths, heights, strict=True):
        along = [
            np.exp(-((axis - middle) ** 2) / (2 * width * width))
            for axis, middle in zip((x, y, z), center, strict=True)
        ]
        values += height * (along[0] * along[1]) * along[2]
    return np.clip(values / 2.2, 0.0, 1.0)


def marschner_lobb(samples: int) -> Floats:
    """The test signal of Marschner and Lobb (1994) on [-1, 1]^3 with f_M = 6, alpha = 1/4, in 0..1."""
    z, y, x = _axes_of(samples)
    ripples = np.cos(2 * np.pi * 6 * np.cos(np.pi * np.sqrt(x * x + y * y) / 2))
    return ((1 - np.sin(np.pi * z / 2)) + 0.25 * (1 + ripples)) / (2 * (1 + 0.25))


def _axes_of(samples: int) -> tuple[Floats, Floats, Floats]:
    axis = np.linspace(-1.0, 1.0, samples)
    return axis[:, None, None], axis[None, :, None], axis[None, None, :]


FIELDS: dict[str, tuple[Callable[[int], Floats], tuple[tuple[float, ...], ...]]] = {
    "blobs": (blobs, SOFT),
    "dense": (blobs, DENSE),
    "ml": (marschner_lobb, PEAK),
}


def chest_ct(side: int) -> Problem:
    """Return the chest CT of the tests with its preset of 3D Slicer, as all renderers can take it.

    The axes of the scan that run the other way are reversed, and the knots rounded to whole HU: a table
    with an entry per HU then holds colours and opacities exactly, and the extinction to 3e-6 of itself.
    """
    scene = vr.load_scene(CT_FILE)
    volume, transfer = scene.volume, scene.transfer
    assert volume is not None
    assert transfer is not None
    assert transfer.opacity is not None
    assert transfer.unit_distance is not None
    backwards = np.diag(volume.direction) < 0
    spacing, last = np.array(volume.spacing), np.array(volume.size) - 1
    first = np.array(volume.origin) + np.where(backwards, last * spacing * np.diag(volume.direction), 0.0)
    turned = np.flip(volume.values, axis=[2 - axis for axis in np.flatnonzero(backwards)])
    knots = np.round(transfer.values)
    return Problem(
        name="chest-ct",
        values=np.ascontiguousarray(turned, np.float32),
        spacing=tuple(spacing.tolist()),
        origin=tuple(first.tolist()),
        knots=knots,
        colors=transfer.colors,
        strengths=transfer.opacity,
        unit_distance=transfer.unit_distance,
        entries=int(knots[-1] - knots[0]) + 1,
        eye=(160.0, -420.0, -520.0),
        target=(0.0, 179.0, -665.0),
        up=(0.0, 0.0, 1.0),
        fov_y=26.0,
        width=side,
        height=side * 3 // 4,
    )
