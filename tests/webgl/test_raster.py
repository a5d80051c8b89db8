"""Rasterised triangles held to real WebGL: coverage, varyings in float and 8 bits, depth, facing."""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.webgl.engine import Geometry, Job, Pass, Program, Target
from volref.scene.camera import Camera
from volref.stages.raster import depth_test, rasterize

VERTEX = """
attribute vec4 position;
attribute vec3 color;
varying vec3 c;
void main() { gl_Position = position; c = color; }
"""
FRAGMENT = """
precision highp float;
varying vec3 c;
void main() { gl_FragColor = OUTPUT; }
"""
ONES = ("one", "one", "one", "one")

# What differs between devices: the grid, the planes of attributes, the depth buffer.
RASTERS = {
    "swiftshader": {"subpixel_bits": 4, "planes": "snapped"},
    "llvmpipe": {"subpixel_bits": 8, "planes": "unsnapped"},
    "lavapipe": {"subpixel_bits": 8, "planes": "unsnapped"},
}
DEPTH_BITS = {"swiftshader": 32, "llvmpipe": 24, "lavapipe": 24}

# Float32 planes: SwiftShader starts them at a corner of the triangle, so a few roundings of 2^-24 remain;
# Mesa at the corner of the image, where a plane that is steep on the screen has grown to some tens.
CUBE_ERROR = {"swiftshader": 1e-6, "llvmpipe": 4e-6, "lavapipe": 4e-6}
# Triangles a few pixels wide are ten times as steep.
MESH_ERROR = 3e-5

# (eye, target, fov_y, near, far) around the unit cube.
CAMERAS = {
    "oblique": ((2.1, 1.4, 2.3), (0.5, 0.5, 0.5), 40.0, 0.1, 10.0),
    "axis-aligned": ((0.5, 0.5, 3.0), (0.5, 0.5, 0.5), 35.0, 0.1, 10.0),
    "wide": ((1.6, 1.3, -0.9), (0.5, 0.5, 0.5), 80.0, 0.1, 10.0),
    "cut by the frame": ((1.3, 1.2, 1.4), (0.5, 0.5, 0.5), 40.0, 0.1, 10.0),
    "cut by the near plane": ((1.2, 0.9, 1.3), (0.5, 0.5, 0.5), 50.0, 0.7, 10.0),
    "inside": ((0.6, 0.55, 0.7), (0.5, 0.5, 0.5), 70.0, 0.05, 10.0),
    "inside, cut by both planes": ((0.3, 0.45, 0.7), (0.9, 0.5, 0.1), 60.0, 0.3, 0.8),
}
SIZES = [(128, 96), (256, 256)]


@dataclass(frozen=True)
class Drawn:
    """Fragments of volref, which of them survive, and the targets of WebGL as rows of pixels."""

    fragments: object
    survivors: object
    count: object
    color: object
    color8: object
    coord: object


def cube():
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return corners, np.array([part for a, b, c, d in quads for part in ((a, b, c), (a, c, d))])


def sphere(across=60, down=40):
    around, below = np.meshgrid(np.linspace(0, 2 * np.pi, across + 1), np.linspace(0, np.pi, down + 1))
    place = np.stack([np.cos(around) * np.sin(below), np.sin(around) * np.sin(below), np.cos(below)], axis=2)
    first = (np.arange(down)[:, None] * (across + 1) + np.arange(across)).ravel()
    upper = np.stack([first, first + across + 1, first + across + 2], axis=1)
    lower = np.stack([first, first + across + 2, first + 1], axis=1)
    return 0.5 + 0.5 * place.reshape(-1, 3), np.concatenate([upper, lower])


def draw(webgl, mesh, view, width, height, *, cull="none", depth=False):
    """Draw a mesh whose colour is its place, here and there; without a depth test the last triangle stays."""
    places, triangles = mesh
    eye, target, fov_y, near, far = CAMERAS[view]
    camera = Camera.look_at(eye, target, (0.1, 1.0, 0.0), fov_y, near, far)
    matrix = camera.clip_from_view(width, height) @ camera.view_from_world
    clip = np.concatenate([places, np.ones((len(places), 1))], axis=1) @ matrix.T
    # What a vertex buffer holds.
    clip, color = (given.astype(np.float32).astype(np.float64) for given in (clip, places))
    fragments = rasterize(clip, triangles, color, width, height, cull=cull, **RASTERS[webgl.name])
    if depth:
        survivors = depth_test(fragments, width * height, depth_bits=DEPTH_BITS[webgl.name])
    else:
        last = np.full(width * height, -1)
        last[fragments.pixel] = np.arange(len(fragments.pixel))
        survivors = last[last >= 0]
    geometry = Geometry({"position": clip, "color": color}, triangles)
    outputs = {
        "count": ("vec4(1.0 / 255.0)", "rgba8"),
        "color": ("vec4(c, gl_FrontFacing ? 2.0 : 1.0)", "rgba32f"),
        "color8": ("vec4(c, 1.0)", "rgba8"),
        "coord": ("gl_FragCoord", "rgba32f"),
    }
    passes = [
        Pass(
            Program(VERTEX, FRAGMENT, {"OUTPUT": output}),
            geometry,
            target=name,
            clear=(0.0, 0.0, 0.0, 0.0),
            depth_test="less" if depth and name != "count" else None,
            cull=cull,
            blend=ONES if name == "count" else None,
        )
        for name, (output, _) in outputs.items()
    ]
    targets = {name: Target(kind, depth=depth) for name, (_, kind) in outputs.items()}
    images = webgl.run(Job(width, height, tuple(passes), targets=targets))
    return Drawn(fragments, survivors, **{name: image.reshape(-1, 4) for name, image in images.items()})


def rounded(values):
    return np.rint(np.clip(values.astype(np.float32), 0, 1) * np.float32(255)).astype(np.uint8)


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("cull", ["front", "back"])
@pytest.mark.parametrize("view", CAMERAS)
def test_a_color_cube_is_drawn_as_webgl_draws_it(every_webgl, view, cull, width, height):
    drawn = draw(every_webgl, cube(), view, width, height, cull=cull)
    fragments = drawn.fragments
    expected = np.zeros(width * height, dtype=int)
    expected[fragments.pixel] = 1
    np.testing.assert_array_equal(drawn.count[:, 0], expected)
    color = drawn.color[fragments.pixel]
    np.testing.assert_array_equal(fragments.front, color[:, 3] == 2)
    error = CUBE_ERROR[every_webgl.name]
    coord = drawn.coord[fragments.pixel]
    np.testing.assert_allclose(fragments.varyings.T, color[:, :3], rtol=0, atol=error)
    np.testing.assert_allclose(fragments.window_z, coord[:, 2], rtol=0, atol=error)
    np.testing.assert_allclose(fragments.inverse_w, coord[:, 3], rtol=error)


def test_color_cubes_in_8_bits_are_equal_at_9999_of_10000_pixels(every_webgl):
    different, all_pixels = 0, 0
    for view in CAMERAS:
        for cull in ("front", "back"):
            drawn = draw(every_webgl, cube(), view, 256, 256, cull=cull)
            pixel = drawn.fragments.pixel
            ours = rounded(drawn.fragments.varyings.T)
            theirs = drawn.color8[pixel, :3]
            different += int((ours != theirs).any(axis=1).sum())
            all_pixels += len(pixel)
            # A coordinate within float32's rounding of the middle between two codes may fall on either side.
            assert np.abs(ours.astype(int) - theirs).max(initial=0) <= 1
    assert all_pixels > 300_000
    assert different <= 1e-4 * all_pixels


@pytest.mark.parametrize("view", CAMERAS)
def test_a_mesh_is_covered_and_depth_tested_as_by_webgl(every_webgl, view):
    drawn = draw(every_webgl, sphere(), view, 256, 256, depth=True)
    fragments, survivors = drawn.fragments, drawn.survivors
    np.testing.assert_array_equal(np.bincount(fragments.pixel, minlength=256**2), drawn.count[:, 0])
    pixel = fragments.pixel[survivors]
    np.testing.assert_allclose(fragments.window_z[survivors], drawn.coord[pixel, 2], rtol=0, atol=MESH_ERROR)
    there = np.flatnonzero(
        np.abs(fragments.varyings[:, survivors].T - drawn.color[pixel, :3]).max(axis=1) > MESH_ERROR
    )
    assert len(there) <= 2
    # Where front and back meet in one depth float32 decides: WebGL kept another fragment of that pixel.
    for place in pixel[there]:
        rivals = np.flatnonzero(fragments.pixel == place)
        theirs = np.array([*drawn.color[place, :3], drawn.coord[place, 2]])
        ours = np.concatenate([fragments.varyings[:, rivals], fragments.window_z[None, rivals]])
        assert np.abs(ours.T - theirs).max(axis=1).min() <= 1e-3
    ours, theirs = rounded(fragments.varyings[:, survivors].T), drawn.color8[pixel, :3]
    assert (ours != theirs).any(axis=1).mean() <= 3e-4
