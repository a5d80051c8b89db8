"""Jobs for real WebGL: textures, targets and passes as data; every target comes back as an array.

Arrays of images are (height, width[, channels]) and (depth, height, width[, channels]) for 3-D textures;
formats of one channel have no last axis.  Row 0 of a texture is uploaded first: it lies at v = 0 unless
`flip_y`.  Row 0 of what comes back is the top.  Matrices are as in NumPy, `matrix @ column`.
"""

import json
from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.webgl.browser import Call, opened

CANVAS = "canvas"

# Format: channels, type.  In WebGL 1 r32f is LUMINANCE of floats, and reads the same through .r.
FORMATS = {
    "r8": (1, "u1"),
    "luminance8": (1, "u1"),
    "alpha8": (1, "u1"),
    "rg8": (2, "u1"),
    "luminance_alpha8": (2, "u1"),
    "rgb8": (3, "u1"),
    "rgba8": (4, "u1"),
    "srgb8_alpha8": (4, "u1"),
    "r16f": (1, "<f2"),
    "rgba16f": (4, "<f2"),
    "r32f": (1, "<f4"),
    "rgba32f": (4, "<f4"),
}

OVER = ("src_alpha", "one_minus_src_alpha", "one", "one_minus_src_alpha")

# What a uniform may be: the name of a texture or target, a number, a vector, a matrix, or an array of these.
Uniform = str | float | ArrayLike


class WebGLError(Exception):
    """What the page refused: GLSL that does not compile (with its numbered source) or a GL error."""


@dataclass(frozen=True, eq=False)
class Texture:
    """Image to upload; premultiplication and colour conversion are off, coordinates clamp to the edge."""

    values: ArrayLike
    format: str = "rgba8"
    filter: str = "nearest"  # "nearest", "linear" or "linear-mipmap-linear"
    flip_y: bool = False

    def as_json(self) -> dict[str, Any]:
        channels, dtype = FORMATS[self.format]
        values = np.asarray(self.values)
        dimensions = values.ndim - (channels > 1)
        if dimensions not in (2, 3) or (channels > 1 and values.shape[-1] != channels):
            message = (
                f"values of {self.format} must have 2 or 3 axes and {channels} channels, got {values.shape}"
            )
            raise ValueError(message)
        if not np.can_cast(values.dtype, dtype, "same_kind"):
            message = (
                f"values of {self.format} must be of type {dtype}, got {values.dtype}; convert them first"
            )
            raise ValueError(message)
        return {
            "format": self.format,
            "size": list(values.shape[:dimensions][::-1]),
            "filter": self.filter,
            "flip_y": self.flip_y,
            "data": _base64(values, dtype),
        }


@dataclass(frozen=True)
class Target:
    """Where passes draw and later ones read: r8, rgba8, rgba16f or rgba32f, of the job's size unless said."""

    format: str = "rgba8"
    depth: bool = False  # 24 bits
    filter: str = "nearest"
    width: int | None = None
    height: int | None = None


@dataclass(frozen=True)
class Program:
    """Vertex and fragment shader, GLSL ES as it stands; `defines` go in after the #version line."""

    vertex: str
    fragment: str
    defines: Mapping[str, object] = field(default_factory=dict)

    def as_json(self) -> dict[str, str]:
        return {"vertex": self._defined(self.vertex), "fragment": self._defined(self.fragment)}

    def _defined(self, source: str) -> str:
        source = source.lstrip()
        version, source = source.split("\n", 1) if source.startswith("#version") else ("", source)
        lines = [version, *(f"#define {name} {value}" for name, value in self.defines.items()), source]
        return "\n".join(line for line in lines if line)


@dataclass(frozen=True, eq=False)
class Geometry:
    """Triangles (T, 3) of vertices whose attributes are (V, n); counterclockwise is front."""

    attributes: Mapping[str, ArrayLike]
    triangles: ArrayLike

    def as_json(self) -> dict[str, Any]:
        arrays = {name: np.asarray(given) for name, given in self.attributes.items()}
        return {
            "attributes": {n: {"size": a.shape[1], "data": _base64(a, "<f4")} for n, a in arrays.items()},
            "indices": _base64(self.triangles, "<u4"),
            "count": np.size(self.triangles),
        }


# One triangle that covers the target: attribute vec2 position, already in clip space.
SCREEN = Geometry({"position": [(-1, -1), (3, -1), (-1, 3)]}, [(0, 1, 2)])


@dataclass(frozen=True, eq=False)
class Pass:
    """One draw call, with all the state it depends on; the viewport is the whole target."""

    program: Program
    geometry: Geometry = SCREEN
    uniforms: Mapping[str, Uniform] = field(default_factory=dict)
    target: str = CANVAS
    clear: tuple[float, float, float, float] | None = None  # clears depth too, to clear_depth
    clear_depth: float = 1.0
    depth_test: str | None = None  # "less", "lequal", "greater", "always" ...
    depth_write: bool = True
    cull: str = "none"  # "none", "front" or "back"
    blend: tuple[str, str, str, str] | None = None  # source and destination of colour, then of alpha

    def as_json(self, geometry: int) -> dict[str, Any]:
        state = {name: getattr(self, name) for name in self.__dataclass_fields__}
        uniforms = {name: _uniform(value) for name, value in self.uniforms.items()}
        return {**state, "program": self.program.as_json(), "geometry": geometry, "uniforms": uniforms}


@dataclass(frozen=True, eq=False)
class Job:
    """Uploads and passes in order; a frame more is one or more passes more, with uniforms of their own.

    `read` names the targets that come back: all of them, and the canvas if a pass draws on it, unless said.
    """

    width: int
    height: int
    passes: tuple[Pass, ...]
    textures: Mapping[str, Texture] = field(default_factory=dict)
    targets: Mapping[str, Target] = field(default_factory=dict)
    read: tuple[str, ...] | None = None
    version: int = 1  # of WebGL

    def as_json(self) -> dict[str, Any]:
        geometries = {id(one.geometry): one.geometry for one in self.passes}
        places = {key: place for place, key in enumerate(geometries)}
        return {
            "version": self.version,
            "width": self.width,
            "height": self.height,
            "textures": {name: texture.as_json() for name, texture in self.textures.items()},
            "targets": {name: asdict(self._sized(target)) for name, target in self.targets.items()},
            "geometries": [geometry.as_json() for geometry in geometries.values()],
            "passes": [one.as_json(places[id(one.geometry)]) for one in self.passes],
            "read": list(self.reads()),
        }

    def reads(self) -> tuple[str, ...]:
        if self.read is not None:
            return self.read
        on_canvas = any(one.target == CANVAS for one in self.passes)
        return (*self.targets, *((CANVAS,) if on_canvas else ()))

    def _sized(self, target: Target) -> Target:
        width, height = target.width or self.width, target.height or self.height
        return Target(target.format, target.depth, target.filter, width, height)


@dataclass(frozen=True)
class Engine:
    """An open page of one implementation, ready to run jobs."""

    name: str
    call: Call

    def run(self, job: Job) -> dict[str, NDArray[Any]]:
        """Return what targets hold after the last pass: (height, width, 4), uint8 or float32, row 0 = top.

        Raises
        ------
        WebGLError
            If a shader does not compile or link, a uniform or attribute is missing, or GL reports an error.
        """
        answer = self.call("runJob", json.dumps(job.as_json()))
        if "error" in answer:
            raise WebGLError(f"{self.name}: {answer['error']}")
        return {name: _pixels(**read) for name, read in answer["pixels"].items()}


@contextmanager
def engine(name: str) -> Iterator[Engine]:
    """Keep an engine of the implementation of that name, see `tests.webgl.browser.opened`."""
    with opened(name) as call:
        call("text => (0, eval)(text)", Path(__file__).with_name("engine.js").read_text(encoding="utf-8"))
        yield Engine(name, call)


def _base64(values: ArrayLike, dtype: str) -> str:
    return b64encode(np.ascontiguousarray(values, dtype=dtype).tobytes()).decode("ascii")


def _uniform(value: Uniform) -> str | dict[str, str]:
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    # WebGL takes matrices column by column; JSON has no NaN.
    columns = array.T if array.ndim == 2 and array.shape[0] == array.shape[1] else array
    return {"numbers": _base64(columns, "<f8")}


def _pixels(width: int, height: int, kind: str, data: str) -> NDArray[Any]:
    dtype = "u1" if kind == "UNSIGNED_BYTE" else "<f4"
    return np.frombuffer(b64decode(data), dtype).reshape(height, width, 4)[::-1].copy()
