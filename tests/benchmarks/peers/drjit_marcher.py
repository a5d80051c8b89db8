"""A marcher written in Dr.Jit, the compiler under Mitsuba 3, on its LLVM back end: float32, vectorised.

Meshes are intersected each frame by Mitsuba's own scene (Embree).
"""

from typing import Any

import numpy as np

from tests.benchmarks.peers.problems import MESH_COLOR, Problem
from tests.benchmarks.peers.renderers import Draw
from volref.arrays import Floats

OPAQUE = 1e-4


def prepare(problem: Problem) -> tuple[Draw, str]:
    """Return what draws a frame at a step in voxels; the first, coarse one compiled the kernel."""
    import drjit as dr
    from drjit.llvm import Float

    dr.set_thread_count(1)

    def upload(array: Floats) -> Any:
        return Float(np.ascontiguousarray(array, np.float32).ravel())

    volume, table = upload(problem.values), upload(problem.table(problem.entries))
    slopes = [upload(slope) for slope in problem.index_directions.T]
    near, far = (upload(end) for end in problem.spans)
    first_hit = None if problem.mesh is None else _intersector(problem, upload)

    def draw(step: float) -> Floats:
        surface, ends = None, far
        if first_hit is not None:
            surface = first_hit()
            ends = dr.minimum(far, surface)
        length = dr.opaque(Float, step * problem.voxel)
        light = march(problem, volume, table, slopes, near, ends, length)
        dr.eval(light)
        *rgb, clear = (np.array(channel) for channel in light)
        if surface is not None:
            behind = np.where(np.isfinite(np.array(surface)), clear, 0)
            rgb = [channel + behind * part for channel, part in zip(rgb, MESH_COLOR, strict=True)]
            clear = clear - behind
        return np.stack([*rgb, 1 - clear], axis=-1).reshape(problem.height, problem.width, 4)

    draw(4.0)
    return draw, f"LLVM {'.'.join(map(str, _llvm_version()))}"


def march(
    problem: Problem, volume: Any, table: Any, slopes: list[Any], near: Any, far: Any, length: Any
) -> tuple[Any, Any, Any, Any]:
    """Return red, green, blue and transmittance of all rays, as yet unevaluated."""
    import drjit as dr
    from drjit.llvm import Array4f, Float, UInt

    row = int(problem.size[0])
    plane = row * int(problem.size[1])
    eye = [Float(x) for x in problem.index_eye]
    top = [float(count) - 1.0001 for count in problem.size]
    low, scale = float(problem.knots[0]), (problem.entries - 1) / float(np.ptp(problem.knots))

    def lit(t: Any, clear: Any, *_: Any) -> Any:
        return (t < far) & (clear > OPAQUE)

    def step(t: Any, clear: Any, red: Any, green: Any, blue: Any) -> tuple[Any, ...]:
        h = dr.minimum(length, far - t)
        middle = dr.fma(h, 0.5, t)
        place = [dr.clip(dr.fma(d, middle, o), 0, m) for d, o, m in zip(slopes, eye, top, strict=True)]
        i, j, k = (UInt(x) for x in place)
        u, v, w = (x - Float(n) for x, n in zip(place, (i, j, k), strict=True))
        corner = k * plane + j * row + i

        def along_x(offset: int) -> Any:
            ends = (dr.gather(Float, volume, corner + offset + dx) for dx in (0, 1))
            return dr.lerp(*ends, u)

        lower = dr.lerp(along_x(0), along_x(row), v)
        upper = dr.lerp(along_x(plane), along_x(plane + row), v)
        entry = dr.clip((dr.lerp(lower, upper, w) - low) * scale, 0, problem.entries - 1)
        first = dr.minimum(UInt(entry), problem.entries - 2)
        one, other = (dr.gather(Array4f, table, first + n) for n in (0, 1))
        looked_up = one + (other - one) * (entry - Float(first))
        opacity = 1 - dr.exp(-looked_up[3] * h)
        weight = clear * opacity
        sums = (dr.fma(weight, looked_up[n], channel) for n, channel in enumerate((red, green, blue)))
        return (t + length, clear * (1 - opacity), *sums)

    start = (Float(near), Float(1), Float(0), Float(0), Float(0))
    _, clear, red, green, blue = dr.while_loop(start, lit, step)
    return red, green, blue, clear


def _intersector(problem: Problem, upload: Any) -> Any:
    """Return what finds the distance of the mesh along every ray, infinite where there is none."""
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    assert problem.mesh is not None
    vertices, faces = problem.mesh.vertices, problem.mesh.faces
    mesh = mi.Mesh("mesh", len(vertices), len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ascontiguousarray(vertices, np.float32).ravel()
    parameters["faces"] = np.ascontiguousarray(faces, np.uint32).ravel()
    parameters.update()
    scene = mi.load_dict({"type": "scene", "mesh": mesh})
    directions = mi.Vector3f(*(mi.Float(upload(part)) for part in problem.directions.T))
    rays = mi.Ray3f(mi.Point3f(*problem.eye), directions)

    def distances() -> Any:
        return dr.detach(scene.ray_intersect_preliminary(rays, coherent=True).t, preserve_type=False)

    return distances


def _llvm_version() -> tuple[int, ...]:
    import drjit as dr

    return tuple(dr.detail.llvm_version())
