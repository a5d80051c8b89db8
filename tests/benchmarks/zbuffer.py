"""CPU time of the z-buffer at 512 x 512: `python -m tests.benchmarks.zbuffer`.

Prints, for 20 thousand and 300 thousand triangles, the CPU seconds of projection, clipping test and
z-buffer together, the same with distances and colours, nanoseconds per fragment, and the ratio to one
take-and-multiply pass over as many elements as there are fragments, measured in the same run: machines
differ, the ratio less so.
"""

import numpy as np

from tests.benchmarks.stopwatch import cpu_seconds
from tests.oracles.meshes import bumpy_sphere
from volref.scene.camera import Camera
from volref.scene.scene import Scene
from volref.stages.clipping import project
from volref.truth.meshes.surfaces import visible_surface
from volref.truth.meshes.triangles import nearest_faces, triangles_of

WIDTH = HEIGHT = 512


def sphere_scene(triangles: int, near: float = 0.1) -> Scene:
    """Return a bumpy sphere that covers about two thirds of the image."""
    camera = Camera.look_at((2.4, 1.7, 1.6), (0, 0, 0), (0, 0, 1), 40.0, near, 100.0)
    return Scene(None, None, camera, WIDTH, HEIGHT, meshes=[bumpy_sphere(triangles)])


def expected_fragments(scene: Scene) -> int:
    """Return the area of all triangles on the screen: as many pixel centres, front and back, on average."""
    mesh = scene.meshes[0]
    x_w, y_w, depth = project(mesh.vertices, scene.camera, WIDTH, HEIGHT)
    x, y = (x_w / depth)[mesh.faces], (y_w / depth)[mesh.faces]
    twice = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    return int(np.abs(twice).sum() / 2)


def main() -> None:
    """Print the table."""
    rng = np.random.default_rng(0)
    print("triangles  fragments  z-buffer s  ns/fragment  ratio  with surface s  ratio")
    for triangles in (20_000, 300_000):
        scene = sphere_scene(triangles)
        fragments = expected_fragments(scene)
        table, where = rng.random(WIDTH * HEIGHT), rng.integers(0, WIDTH * HEIGHT, fragments)
        unit = cpu_seconds(lambda table=table, where=where: table.take(where) * 1.5)
        buffer = cpu_seconds(
            lambda scene=scene: nearest_faces(scene, triangles_of(scene, range(len(scene.meshes))))
        )
        surface = cpu_seconds(lambda scene=scene: visible_surface(scene))
        print(
            f"{len(scene.meshes[0].faces):9d}  {fragments:9d}  {buffer:10.4f}"
            f"  {buffer / fragments * 1e9:11.1f}  {buffer / unit:5.1f}"
            f"  {surface:14.4f}  {surface / unit:5.1f}"
        )


if __name__ == "__main__":
    main()
