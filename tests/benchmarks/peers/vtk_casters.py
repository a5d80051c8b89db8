"""VTK's two ray casters: fixed point on the CPU, and the GPU's shader on software GL (Mesa's llvmpipe).

What they are told so that they draw the same scene: point data; a table of opacities 1 - exp(-sigma h) meant
for a unit distance of the step h, so that no sample's opacity is converted again; no jitter, one ray for
each pixel, no step of their own choice.  Both hand over the 8 bits per channel of their window.
"""

import os
from typing import Any, NamedTuple

import numpy as np

from tests.benchmarks.peers.problems import MESH_COLOR, Problem
from tests.benchmarks.peers.renderers import Draw
from volref.arrays import Floats

# A table has a node at every knot of the transfer function, and at least so many between two entries.
LEAST_NODES = 4000


class _Stage(NamedTuple):
    """VTK's objects that a frame needs again."""

    window: Any
    mapper: Any
    volume: Any
    look: Any


def fixed_point(problem: Problem) -> tuple[Draw, str]:
    """Draw by vtkFixedPointVolumeRayCastMapper: 15 bits after the point."""
    import vtk

    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetImageSampleDistance(1.0)
    mapper.SetInteractiveSampleDistance(1e-9)
    mapper.IntermixIntersectingGeometryOn()
    mapper.SetNumberOfThreads(len(os.sched_getaffinity(0)))
    return _ready(problem, mapper)


def software_gpu(problem: Problem) -> tuple[Draw, str]:
    """Draw by vtkOpenGLGPUVolumeRayCastMapper."""
    import vtk

    mapper = vtk.vtkOpenGLGPUVolumeRayCastMapper()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetUseJittering(0)
    mapper.SetImageSampleDistance(1.0)
    return _ready(problem, mapper)


def _ready(problem: Problem, mapper: Any) -> tuple[Draw, str]:
    import vtk

    vtk.vtkObject.GlobalWarningDisplayOff()
    stage = _stage(problem, mapper)
    current = [0.0]

    def draw(step: float) -> Floats:
        if step != current[0]:
            _set_step(problem, stage, step * problem.voxel)
            current[0] = step
        stage.volume.Modified()
        stage.window.Render()
        return _pixels(problem, stage.window)

    draw(4.0)
    lines = stage.window.ReportCapabilities().splitlines()
    named = (line.partition(":")[2] for line in lines if line.startswith("OpenGL renderer string"))
    return draw, next(named, "").strip()


def _stage(problem: Problem, mapper: Any) -> _Stage:
    """Return volume, mesh and camera in a window that nobody sees."""
    import vtk

    mapper.SetInputData(_image(problem))
    mapper.SetBlendModeToComposite()
    look = vtk.vtkVolumeProperty()
    look.SetInterpolationTypeToLinear()
    look.ShadeOff()
    look.IndependentComponentsOn()
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.SetBackgroundAlpha(0)
    renderer.AddVolume(volume)
    if problem.mesh is not None:
        renderer.AddActor(_actor(problem))
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    window.SetSize(problem.width, problem.height)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*problem.eye)
    camera.SetFocalPoint(*problem.target)
    camera.SetViewUp(*problem.up)
    camera.SetViewAngle(problem.fov_y)
    renderer.ResetCameraClippingRange()
    return _Stage(window, mapper, volume, look)


def _image(problem: Problem) -> Any:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    image = vtk.vtkImageData()
    image.SetDimensions(*(int(count) for count in problem.size))
    image.SetOrigin(*problem.origin)
    image.SetSpacing(*problem.spacing)
    samples = numpy_to_vtk(problem.values.ravel(), deep=1)
    samples.SetName("values")
    image.GetPointData().SetScalars(samples)
    return image


def _actor(problem: Problem) -> Any:
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    assert problem.mesh is not None
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(problem.mesh.vertices, np.float32), deep=1))
    triangles = vtk.vtkCellArray()
    faces = np.ascontiguousarray(problem.mesh.faces, np.int64).ravel()
    triangles.SetData(3, numpy_to_vtkIdTypeArray(faces, deep=1))
    body = vtk.vtkPolyData()
    body.SetPoints(points)
    body.SetPolys(triangles)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(body)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*MESH_COLOR)
    actor.GetProperty().LightingOff()
    return actor


def _set_step(problem: Problem, stage: _Stage, length: float) -> None:
    """State the step, and the table of opacities for it."""
    import vtk

    between = -(-LEAST_NODES // problem.entries)
    nodes = between * (problem.entries - 1) + 1
    table = problem.table(nodes)
    low, high = float(problem.knots[0]), float(problem.knots[-1])
    opacity = vtk.vtkPiecewiseFunction()
    opacity.BuildFunctionFromTable(low, high, nodes, np.ascontiguousarray(-np.expm1(-table[:, 3] * length)))
    color = vtk.vtkColorTransferFunction()
    color.SetColorSpaceToRGB()
    color.BuildFunctionFromTable(low, high, nodes, np.ascontiguousarray(table[:, :3]).ravel())
    stage.look.SetColor(color)
    stage.look.SetScalarOpacity(opacity)
    stage.look.SetScalarOpacityUnitDistance(length)
    stage.mapper.SetSampleDistance(length)


def _pixels(problem: Problem, window: Any) -> Floats:
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    codes = vtk.vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, problem.width - 1, problem.height - 1, 1, codes)
    bottom_up = vtk_to_numpy(codes).reshape(problem.height, problem.width, 4)
    return np.asarray(bottom_up[::-1] / np.float32(255))
