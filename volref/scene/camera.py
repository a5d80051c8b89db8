"""Cameras: where the viewing rays start and which way they go.

View space is right-handed: x right, y up, the camera looks along -z.  Pixel centres lie at +1/2, and
row 0 is the top.  An image 4 pixels wide and 2 high has its pixel centres at

    x ndc:  -0.75  -0.25  0.25  0.75        y ndc:  0.5 (row 0), -0.5 (row 1)

so pixel (x=1, y=0) looks through ndc (-0.25, 0.5): x_ndc = 2 (x + 1/2) / width - 1 and
y_ndc = 1 - 2 (y + 1/2) / height.

"near" and "far" clip meshes only.  A perspective ray starts at the eye, an orthographic one on the near
plane, and the volume is integrated from there.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from volref.arrays import LARGEST_LENGTH, LEAST_LENGTH, Floats, float_array, number, one_of, set_fields
from volref.errors import SceneError
from volref.scene.transform import affine, invert_affine

CLIP_RANGES = ("-1..1", "0..1")


@dataclass(frozen=True, eq=False, init=False)
class Camera:
    """A pinhole or a parallel projection.

    Build one with `look_at`, `arcball`, `orthographic` or `from_matrices`, or read it with
    `volref.load_camera`.

    Parameters
    ----------
    view_from_world
        Affine 4x4 matrix from the world to view space.
    kind
        "perspective", "orthographic", or "matrix" for a given `clip_matrix`.
    fov_y
        Full vertical opening in degrees ("perspective" only).
    height
        World height of the image ("orthographic" only).
    near, far
        Distances of the clipping planes along the viewing axis, in world units.
    clip_matrix
        4x4 `clip_from_view` ("matrix" only).
    clip_z
        "-1..1" (WebGL) or "0..1" (WebGPU): the clip-space z of the near and the far plane.
    """

    view_from_world: Floats
    kind: str
    fov_y: float | None
    height: float | None
    near: float
    far: float
    clip_matrix: Floats | None
    clip_z: str

    def __init__(
        self,
        view_from_world: ArrayLike,
        kind: str,
        *,
        fov_y: float | None = None,
        height: float | None = None,
        near: float | None = None,
        far: float | None = None,
        clip_matrix: ArrayLike | None = None,
        clip_z: str = "-1..1",
    ) -> None:
        one_of("camera.kind", kind, ("perspective", "orthographic", "matrix"))
        one_of("camera.clip_z", clip_z, CLIP_RANGES)
        view = float_array("camera.view_from_world", view_from_world, (4, 4), limit=LARGEST_LENGTH)
        invert_affine("camera.view_from_world", view)
        clip = None
        if kind == "matrix":
            clip = float_array("camera.clip_matrix", clip_matrix, (4, 4), limit=LARGEST_LENGTH)
            planes = _planes_of(clip, clip_z)
            parallel = bool(clip[3, 3])
        else:
            planes = number("camera.near", near), number("camera.far", far)
            parallel = kind == "orthographic"
        _check_planes(*planes, parallel=parallel)
        set_fields(
            self,
            view_from_world=view,
            kind=kind,
            fov_y=_checked_angle(fov_y) if kind == "perspective" else None,
            height=_checked_height(height) if kind == "orthographic" else None,
            near=planes[0],
            far=planes[1],
            clip_matrix=clip,
            clip_z=clip_z,
        )

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike,
        fov_y: float,
        near: float,
        far: float,
        *,
        clip_z: str = "-1..1",
    ) -> Self:
        """Perspective camera at `eye`, looking at `target`, with `up` upwards in the image.

        Examples
        --------
        >>> camera = Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), 90.0, 0.1, 10.0)
        >>> camera.view_from_world[:3, 3].tolist()
        [0.0, 0.0, -5.0]
        """
        view = look_at_matrix(eye, target, up)
        return cls(view, "perspective", fov_y=fov_y, near=near, far=far, clip_z=clip_z)

    @classmethod
    def arcball(
        cls,
        quaternion: ArrayLike,
        *,
        target: ArrayLike,
        distance: float,
        fov_y: float,
        near: float,
        far: float,
        clip_z: str = "-1..1",
    ) -> Self:
        """Perspective camera `distance` away from `target`, which `quaternion` (x, y, z, w) has turned.

        The quaternion turns the world in front of a camera that looks along -z with y upwards, so
        `view_from_world` is T(0, 0, -distance) R(quaternion) T(-target), as a program has it that lets its
        user turn the object.  The camera itself is turned by the conjugate (-x, -y, -z, w).  A length other
        than 1 is divided out.  `volref.arcball_rotation` gives the quaternion of a drag; after it comes
        the one of before: Rotation(drag) * Rotation(before).

        Examples
        --------
        The world is turned by 90 degrees about y, so what was on +x is now behind, and the camera at -x:

        >>> half = 0.5**0.5
        >>> camera = Camera.arcball(
        ...     (0, half, 0, half), target=(1, 2, 3), distance=5, fov_y=30, near=0.1, far=10
        ... )
        >>> (camera.world_from_view[:3, 3].round(12) + 0.0).tolist()
        [-4.0, 2.0, 3.0]
        """
        view = arcball_matrix(quaternion, target, distance)
        return cls(view, "perspective", fov_y=fov_y, near=near, far=far, clip_z=clip_z)

    @classmethod
    def orthographic(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike,
        height: float,
        near: float,
        far: float,
        *,
        clip_z: str = "-1..1",
    ) -> Self:
        """Parallel projection along `target` - `eye`; the image is `height` world units high.

        Rays start on the plane `near` in front of `eye`; a negative `near` lies behind it.
        """
        view = look_at_matrix(eye, target, up)
        return cls(view, "orthographic", height=height, near=near, far=far, clip_z=clip_z)

    @classmethod
    def from_matrices(
        cls, view_from_world: ArrayLike, clip_from_view: ArrayLike, *, clip_z: str = "-1..1"
    ) -> Self:
        """Camera of a WebGL or WebGPU program: its two matrices, rows first (WebGL stores columns first).

        `clip_from_view` may be any perspective or parallel projection, off-centre ones included.
        """
        return cls(view_from_world, "matrix", clip_matrix=clip_from_view, clip_z=clip_z)

    @property
    def is_parallel(self) -> bool:
        """True when all rays have one direction."""
        if self.clip_matrix is not None:
            return bool(self.clip_matrix[3, 3])
        return self.kind == "orthographic"

    @property
    def world_from_view(self) -> Floats:
        """4x4 matrix from view space to the world."""
        return invert_affine("camera.view_from_world", self.view_from_world)

    def clip_from_view(self, width: int, height: int) -> Floats:
        """4x4 projection for an image of `width` x `height` square pixels (row-major, column vectors)."""
        if self.clip_matrix is not None:
            return self.clip_matrix
        depth = self.far - self.near
        matrix = np.zeros((4, 4))
        if self.kind == "orthographic":
            assert self.height is not None
            matrix[0, 0], matrix[1, 1] = 2 / self.height * (height / width), 2 / self.height
            matrix[2, 2:] = -2 / depth, -(self.far + self.near) / depth
            matrix[3, 3] = 1
        else:
            assert self.fov_y is not None
            scale = 1 / np.tan(np.radians(self.fov_y) / 2)
            matrix[0, 0], matrix[1, 1] = scale * (height / width), scale
            matrix[2, 2:] = -(self.far + self.near) / depth, -2 * self.far * self.near / depth
            matrix[3, 2] = -1
        if self.clip_z == "0..1":
            matrix[2] = (matrix[2] + matrix[3]) / 2
        return matrix

    def check_aspect(self, width: int, height: int) -> None:
        """Refuse a given projection matrix whose pixels would not be square.

        Raises
        ------
        SceneError
            If the aspect of `clip_matrix` disagrees with `width` / `height`.
        """
        if self.clip_matrix is None:
            return
        scale_x = float(np.linalg.norm(self.clip_matrix[0, :2]))
        scale_y = float(np.linalg.norm(self.clip_matrix[1, :2]))
        aspect = scale_y / scale_x
        # 1e-6: each entry of a float32 matrix is off by at most 2^-24, and four are in the ratio.
        if abs(aspect / (width / height) - 1) > 1e-6:
            message = f"camera.clip_matrix must have the aspect of the image, got {aspect:g} for "
            message += f"{width} x {height}; render at the canvas's own width and height"
            raise SceneError(message)


def look_at_matrix(eye: ArrayLike, target: ArrayLike, up: ArrayLike) -> Floats:
    """Return `view_from_world` for a camera at `eye` that looks at `target`.

    Raises
    ------
    SceneError
        If `eye` equals `target`, or `up` is zero or parallel to the view.

    Examples
    --------
    >>> look_at_matrix((0, 0, 5), (0, 0, 0), (0, 0, 1))
    Traceback (most recent call last):
    volref.errors.SceneError: camera.up must not be parallel to the view, got (0, 0, 1); choose another up
    """
    eye_point = float_array("camera.eye", eye, (3,), limit=LARGEST_LENGTH)
    forward = float_array("camera.target", target, (3,), limit=LARGEST_LENGTH) - eye_point
    distance = np.linalg.norm(forward)
    if distance == 0:
        message = f"camera.target must differ from camera.eye, got {target!r} for both; move one"
        raise SceneError(message)
    forward = forward / distance
    up_vector = float_array("camera.up", up, (3,), limit=LARGEST_LENGTH)
    right = np.cross(forward, up_vector)
    # The sine of the angle between them: below 1e-9 fewer than 7 digits of `right` are left.
    if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(up_vector):
        message = f"camera.up must not be parallel to the view, got {up!r}; choose another up"
        raise SceneError(message)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(right, forward), -forward])
    return affine(rotation, -rotation @ eye_point)


def arcball_matrix(quaternion: ArrayLike, target: ArrayLike, distance: float) -> Floats:
    """Return `view_from_world` = T(0, 0, -distance) R(quaternion) T(-target).

    Raises
    ------
    SceneError
        If the quaternion is zero, or `distance` is not above 0.

    Examples
    --------
    >>> arcball_matrix((0, 0, 0, 1), (1, 2, 3), 5.0)[:3].tolist()
    [[1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, -2.0], [0.0, 0.0, 1.0, -8.0]]
    """
    from scipy.spatial.transform import Rotation

    turn = float_array("camera.quaternion", quaternion, (4,), limit=LARGEST_LENGTH)
    length = np.linalg.norm(turn)
    if length < LEAST_LENGTH:
        message = f"camera.quaternion must not be zero, got {turn.tolist()}; give (0, 0, 0, 1) for no turn"
        raise SceneError(message)
    center = float_array("camera.target", target, (3,), limit=LARGEST_LENGTH)
    away = number("camera.distance", number("camera.distance", distance, above=0), high=LARGEST_LENGTH)
    rotation = np.asarray(Rotation.from_quat(turn / length).as_matrix(), dtype=np.float64)
    return affine(rotation, -rotation @ center - np.array([0.0, 0.0, away]))


def _checked_angle(fov_y: float | None) -> float:
    angle = number("camera.fov_y", fov_y, above=0)
    if angle >= 180:
        message = f"camera.fov_y must be below 180 degrees, got {angle:g}; give the vertical angle in degrees"
        raise SceneError(message)
    return angle


def _checked_height(height: float | None) -> float:
    return number(
        "camera.height", number("camera.height", height, above=0), low=LEAST_LENGTH, high=LARGEST_LENGTH
    )


def _check_planes(near: float, far: float, *, parallel: bool) -> None:
    if not parallel:
        number("camera.near", near, above=0)
    if not near < far:
        message = f"camera.far must be beyond camera.near, got near {near:g} and far {far:g}; "
        raise SceneError(message + "swap or move them")


def _planes_of(clip: Floats, clip_z: str) -> tuple[float, float]:
    """Return (near, far) of a projection matrix, after checking that it is one.

    A perspective matrix has the last row (0, 0, -1, 0), a parallel one (0, 0, 0, 1); the first two rows
    may shift and shear the image (off-centre frusta, oblique parallel rays), the third only scales and
    shifts z.
    """
    perspective = np.array_equal(clip[3], (0, 0, -1, 0))
    parallel = np.array_equal(clip[3], (0, 0, 0, 1))
    depth_varies = clip[2, 3] != 0 if perspective else clip[2, 2] != 0
    plain_rows = not clip[2, :2].any() and depth_varies and np.linalg.det(clip[:2, :2]) != 0
    if not (perspective or parallel) or not plain_rows or (perspective and clip[:2, 3].any()):
        message = "camera.clip_matrix must be a perspective projection with last row (0, 0, -1, 0) or a "
        message += f"parallel one with (0, 0, 0, 1), got rows {clip.tolist()}; "
        raise SceneError(message + "give clip_from_view with rows first (transpose a WebGL array)")
    scale, shift = float(clip[2, 2]), float(clip[2, 3])
    least = -1.0 if clip_z == "-1..1" else 0.0
    if parallel:  # clip z = -scale * distance + shift
        ends = (shift - least) / scale, (shift - 1.0) / scale
    else:  # clip z / clip w = -scale + shift / distance; a zero divisor is a plane at infinity
        ends = _divide(shift, scale + least), _divide(shift, scale + 1.0)
    return min(ends), max(ends)  # reversed depth has them the other way round


def _divide(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else math.inf
