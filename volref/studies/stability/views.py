"""Cases of where the camera stands and how its rays run through the lattice of samples."""

import math
from itertools import pairwise, product

import numpy as np

from volref.arrays import Floats
from volref.phantoms import closed
from volref.phantoms.scenes import ball_scene, homogeneous_scene, ramp_scene
from volref.phantoms.separable import pixel_ray
from volref.phantoms.transfer import grey_ramp, two_colors
from volref.scene import Camera, Scene, TransferFunction, Volume
from volref.studies.stability.case import EPS, Case, Measured
from volref.studies.stability.meshes import cube
from volref.studies.stability.pictures import CERTIFICATE, ESTIMATE, ROUNDING, known, rounding

FAMILY = "Cameras and the lattice"

COLOR = (0.9, 0.5, 0.2)
NOTHING = np.zeros(4)


def along_z(size: int, middle: float) -> Camera:
    """Return parallel rays along -z, one world unit apart, the middle one at x = y = `middle`."""
    return Camera.orthographic((middle, middle, 30.0), (middle, middle, 0.0), (0, 1, 0), size, 0.0, 60.0)


def one_value(extinction: float) -> TransferFunction:
    """Return a table of one colour and one extinction."""
    return TransferFunction([0.5], [COLOR], [extinction])


def _lattice_planes() -> Measured:
    """Look along the rows of samples of a rough 8^3 volume; those at the rim run in faces."""
    values = np.random.default_rng(3).random((8, 8, 8))
    scene = Scene(Volume(values, centering="node"), grey_ramp(extinction=0.8), along_z(8, 3.5), 8, 8)
    pixels = [_along_row(values[::-1, 7 - row, column]) for row in range(8) for column in range(8)]
    return known([scene], np.array(pixels), step=1 / 64)


def _along_row(samples: Floats) -> Floats:
    """Return the pixel of a grey ramp along samples 1 apart: linear colour and extinction between them."""
    total = np.zeros(4)
    for a, b in pairwise(samples.tolist()):
        total = closed.over(total, closed.linear_both((a, a, a), (b, b, b), 0.8 * a, 0.8 * b, 1.0))
    return total


def _lattice_diagonals() -> Measured:
    """Look along the diagonals of one cell, both ways, whose value is 1 in one corner and 0 in the others.

    Along the diagonal through that corner the value is the cube of the way, so tau = 2 sqrt(3) / 4; the
    three others through two corners of value 0 see f^2 (1 - f), so tau = 2 sqrt(3) / 12.
    """
    values = np.zeros((2, 2, 2))
    values[1, 1, 1] = 1.0
    table = TransferFunction([0, 1], [COLOR, COLOR], [0.0, 2.0])
    scenes, pixels = [], []
    for corner in product((0.0, 1.0), repeat=3):
        start, end = np.array(corner), 1 - np.array(corner)
        camera = Camera.orthographic(start + (start - end), end, (0.3, 1, 0.1), 1.0, 0.0, 10.0)
        scenes.append(Scene(Volume(values, centering="node"), table, camera, 1, 1))
        through = len({*corner}) == 1
        depth = 2 * math.sqrt(3) / (4 if through else 12)
        alpha = -math.expm1(-depth)
        pixels.append([*(c * alpha for c in COLOR), alpha])
    # The ray misses the corners by a few ulp, over which value and chord change by as much.
    return known(scenes, np.array(pixels), step=1 / 128, slack=64 * EPS)


def _in_faces() -> Measured:
    """Send parallel rays 1 apart; the second ring of them runs in the faces and edges of a 4^3 volume."""
    scene, _ = homogeneous_scene(7, 7, color=COLOR, extinction=0.3, camera=along_z(7, 0.0))
    assert scene.volume is not None
    inside = closed.homogeneous(COLOR, 0.3, 4.0)
    pixels = np.zeros((7, 7, 4))
    pixels[1:6, 1:6] = inside
    return known([scene], pixels, march=rounding(8, 0.3, 32))


def _edges_and_corners() -> Measured:
    """Send rays that touch the 8 corners and 12 edges of a dense volume from outside."""
    volume = Volume(np.full((4, 4, 4), 0.5), origin=(-1.5, -1.5, -1.5))
    scenes = []
    for point in product((-2.0, 0.0, 2.0), repeat=3):
        if np.count_nonzero(point) < 2:
            continue
        tangent = _tangent(np.array(point))
        camera = Camera.orthographic(np.array(point) - 5 * tangent, point, (0.1, 0.2, 1), 1.0, 0.0, 20.0)
        scenes.append(Scene(volume, one_value(1e3), camera, 1, 1))
    # The line misses the point by 8 eps of 10; the chord is at most that over each part of the direction:
    # (1 / 0.79 + 1 / 0.58 + 1 / 0.13) < 11 times as much.
    touching = 11 * 8 * EPS * 10 * 1e3
    # Nobody can tell a chord below the rounding of the two distances, 3/2 eps of 5 each, from none.
    return known(scenes, np.zeros((20, 4)), march=touching, certified=3 * EPS * 5 * 1e3, slack=touching)


def _tangent(point: Floats) -> Floats:
    """Return a unit vector along which a line through an edge or a corner of the box only touches it."""
    first, second, *rest = [axis for axis in range(3) if point[axis] != 0] + [
        axis for axis in range(3) if point[axis] == 0
    ]
    direction = np.zeros(3)
    direction[first], direction[second] = 2.3 * np.sign(point[first]), -1.7 * np.sign(point[second])
    direction[rest] = 0.4
    return direction / np.linalg.norm(direction)


def _on_a_face() -> Measured:
    """Put the eye on the face z = 2 of a volume, looking in and looking out."""
    inwards = Camera.look_at((0.3, -0.2, 2.0), (0, 0, 0), (0, 1, 0), 70.0, 1e-3, 100.0)
    outwards = Camera.look_at((0.3, -0.2, 2.0), (0.3, -0.2, 9.0), (0, 1, 0), 70.0, 1e-3, 100.0)
    (scene, pixels), (other, nothing) = (
        homogeneous_scene(8, 8, color=COLOR, extinction=0.3, camera=camera) for camera in (inwards, outwards)
    )
    truth = np.concatenate([pixels.reshape(-1, 4), 0 * nothing.reshape(-1, 4)])
    return known([scene, other], truth, march=rounding(20, 0.3, 8))


def _on_a_voxel() -> Measured:
    camera = Camera.look_at((0.5, 0.5, 0.5), (3.5, 2.5, -7.5), (0, 1, 0), 60.0, 1e-3, 100.0)
    table = two_colors(0.0, 200.0, extinction=0.8)
    scene, pixels = ball_scene(8, 8, transfer=table, camera=camera)
    return known([scene], pixels, step=1 / 32)


def _inside_a_mesh() -> Measured:
    """Put the eye in a cube of half side 1 in a volume: it sees the light on the way to the wall, and it."""
    camera = Camera.look_at((0, 0, 0), (0, 0, -1), (0, 1, 0), 90.0, 1e-3, 10.0)
    wall = (0.1, 0.3, 1.0)
    volume = Volume(np.full((4, 4, 4), 0.5), origin=(-1.5, -1.5, -1.5))
    scene = Scene(volume, one_value(0.7), camera, 8, 8, [cube((0, 0, 0), 1.0, wall)])
    rays = [pixel_ray(camera, 8, 8, x, y)[1] for y in range(8) for x in range(8)]
    behind = np.array([*wall, 1.0])
    truth = [closed.over(closed.homogeneous(COLOR, 0.7, 1 / -d[2]), behind) for d in rays]
    straight = [closed.over(closed.homogeneous(COLOR, 0.7, 1.0), behind) for _ in rays]
    slack = 0.7 * 16 * EPS * math.sqrt(3)
    return known(
        [scene], np.array(truth), textbook=np.array(straight), march=rounding(4, 0.7, 2), slack=slack
    )


def _wide_angle() -> Measured:
    camera = Camera.look_at((0.2, 0.1, 2.0), (0, 0, -2.0), (0, 1, 0), 179.0, 1e-3, 100.0)
    scene, pixels = ramp_scene(16, 16, camera=camera)
    return known([scene], pixels, step=1 / 64)


CASES = (
    Case(
        "rays-in-lattice-planes",
        FAMILY,
        "Along the rows of samples of a rough volume, of which the outer ones lie in its faces?",
        "between samples colour and extinction are linear; phantoms.closed.linear_both, put over each other",
        "the shader: rays in faces are lost to NaN",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        _lattice_planes,
    ),
    Case(
        "rays-along-lattice-diagonals",
        FAMILY,
        "Along the diagonals of a cell, through its corners, where the value is a cubic?",
        "one corner 1: tau = 2 sqrt(3) / 4 through it, 2 sqrt(3) / 12 elsewhere",
        "the shader: float32 at half a voxel",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}.  64 eps for a ray that misses the corners by rounding",
        _lattice_diagonals,
    ),
    Case(
        "rays-in-faces",
        FAMILY,
        "Do parallel rays in the faces and edges of a volume see it, and those beside it not?",
        "c (1 - exp(-4 sigma)) for 25 pixels, 0 for 24; phantoms.closed.homogeneous",
        "the shader: NaN in the slab test, taken for a miss",
        f"march: {ROUNDING}.  exact: {CERTIFICATE}",
        _in_faces,
    ),
    Case(
        "rays-past-edges-and-corners",
        FAMILY,
        "Do rays that only touch the 8 corners and 12 edges of a dense volume (1000 per unit) see nothing?",
        "0: the chord is a point, and the image continuous",
        "the shader: float32 chords of 1e-6",
        "the ray is off by 8 eps of its length, 10, a wedge makes at most 11 times that a chord, and the "
        "extinction multiplies it.  exact: its certificate, at most 3 eps of the distance, "
        "5, times the extinction: no shorter chord can be told from none",
        _edges_and_corners,
    ),
    Case(
        "camera-on-a-face",
        FAMILY,
        "With the eye on a face: is all seen inwards, and nothing outwards?",
        "c (1 - exp(-sigma chord)) by scalar code with rays of its own; nothing outwards",
        "the shader: float32",
        f"march: {ROUNDING}.  exact: {CERTIFICATE}",
        _on_a_face,
    ),
    Case(
        "camera-on-a-voxel",
        FAMILY,
        "With the eye on a sample within a volume of x^2 + y^2 + z^2?",
        "a broken line along every ray; phantoms.separable.separable_image",
        "the shader: float32 at half a voxel",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        _on_a_voxel,
    ),
    Case(
        "camera-inside-a-mesh",
        FAMILY,
        "With the eye in a closed mesh within a volume: is the volume cut at the wall?",
        "c (1 - exp(-sigma d)) over the wall's colour, d = 1 / cos of the ray's angle",
        "the depth along the axis, 1, taken for the distance",
        f"march: {ROUNDING}, and 16 eps for the distance of the wall.  exact: {CERTIFICATE}",
        _inside_a_mesh,
    ),
    Case(
        "opening-of-179-degrees",
        FAMILY,
        "Through an opening of 179 degrees, along nearly every direction?",
        "linear colour and extinction along every ray; phantoms.separable.separable_image",
        "the shader: float32 at half a voxel",
        f"march: {ESTIMATE}.  exact: {CERTIFICATE}",
        _wide_angle,
    ),
)
