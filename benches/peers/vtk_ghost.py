#!/usr/bin/env python3
"""Measures what stays of a block's shadow when VTK cuts the block away; README.md has the scene."""

import json
import os

import numpy as np

# VTK chooses its window class on import: EGL needs no display.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402

SIZE = (48, 48, 32)  # nodes of the grid, 1 mm apart, their middle at the origin
FLOOR = -6.0  # mm; a disk up to this height
BLOCK = ((0.0, 0.0, 1.0), (7.0, 7.0, 4.5))  # centre and half extent, mm
CUT = -4.6  # mm; what lies above is cut away, which leaves the floor whole
WIDTH = 44.0  # mm that the image shows, from above, in parallel projection
IMAGE = 96  # pixels, both ways
MODES = ("phong", "ssao", "scattering")


def volume(has_block: bool) -> vtk.vtkImageData:
    """A floor, with a block above it or without: 0 to 255, a voxel's width of slope at surfaces."""
    x, y, z = (np.arange(n) - 0.5 * (n - 1) for n in SIZE)
    z, y, x = np.meshgrid(z, y, x, indexing="ij", sparse=True)
    distance = np.maximum(np.hypot(x, y) - 21.0, z - FLOOR)
    if has_block:
        q = [np.abs(p - c) - h for p, c, h in zip((x, y, z), *BLOCK)]
        outside = np.sqrt(sum(np.maximum(axis, 0.0) ** 2 for axis in q))
        inside = np.minimum(np.maximum(np.maximum(q[0], q[1]), q[2]), 0.0)
        distance = np.minimum(distance, outside + inside)
    values = np.rint(255.0 * np.clip(0.5 - distance, 0.0, 1.0)).astype(np.uint8)
    image = vtk.vtkImageData()
    image.SetDimensions(SIZE)
    image.SetOrigin([-0.5 * (n - 1) for n in SIZE])
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    return image


def look() -> vtk.vtkVolumeProperty:
    """White and opaque, lit from above; without highlights."""
    opacity = vtk.vtkPiecewiseFunction()
    opacity.AddPoint(100.0, 0.0)
    opacity.AddPoint(160.0, 1.0)
    colour = vtk.vtkColorTransferFunction()
    colour.AddRGBPoint(0.0, 1.0, 1.0, 1.0)
    found = vtk.vtkVolumeProperty()
    found.SetScalarOpacity(opacity)
    found.SetScalarOpacityUnitDistance(1.0)
    found.SetColor(colour)
    found.SetInterpolationTypeToLinear()
    found.ShadeOn()
    found.SetAmbient(0.1)
    found.SetDiffuse(0.9)
    found.SetSpecular(0.0)
    return found


def shot(mode: str, has_block: bool, cuts: bool) -> np.ndarray:
    """The brightness of the image's pixels, 0 to 1, rows upwards."""
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(volume(has_block))
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(0.25)
    mapper.SetUseJittering(False)
    if cuts:
        plane = vtk.vtkPlane()
        plane.SetOrigin(0.0, 0.0, CUT)
        plane.SetNormal(0.0, 0.0, -1.0)
        mapper.AddClippingPlane(plane)
    renderer = vtk.vtkRenderer()
    if mode == "scattering":
        mapper.SetVolumetricScatteringBlending(1.0)
        mapper.SetGlobalIlluminationReach(1.0)
    elif mode == "ssao":
        ssao = vtk.vtkSSAOPass()
        ssao.SetDelegatePass(vtk.vtkRenderStepsPass())
        ssao.SetRadius(10.0)
        ssao.SetBias(0.5)
        ssao.SetKernelSize(64)
        ssao.BlurOn()
        ssao.SetDepthFormat(vtk.vtkTextureObject.Fixed32)  # the only one in which volumes copy depth
        ssao.SetVolumeOpacityThreshold(0.5)
        renderer.SetPass(ssao)
    actor = vtk.vtkVolume()
    actor.SetMapper(mapper)
    actor.SetProperty(look())
    renderer.AddVolume(actor)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetParallelScale(0.5 * WIDTH)
    camera.SetPosition(0.0, 0.0, 120.0)
    camera.SetViewUp(0.0, 1.0, 0.0)
    camera.SetClippingRange(10.0, 200.0)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(IMAGE, IMAGE)
    window.AddRenderer(renderer)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ShouldRerenderOff()
    grab.Update()
    pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return pixels[:, 0].reshape(IMAGE, IMAGE) / 255.0


def main() -> None:
    places = (np.arange(IMAGE) + 0.5) / IMAGE * WIDTH - 0.5 * WIDTH
    x, y = np.meshgrid(places, places)
    seen = np.hypot(x, y) < 15.0
    for mode in MODES:
        bare = shot(mode, has_block=False, cuts=True)[seen]
        cut = shot(mode, has_block=True, cuts=True)[seen]
        line = {
            "peer": f"vtk {vtk.VTK_VERSION}",
            "mode": mode,
            "case": "a block is cut away",
            "floor": round(float(bare.mean()), 4),
            "ghost that stays": round(float(np.sqrt(np.mean((cut - bare) ** 2))), 4),
            "largest": round(float(np.abs(cut - bare).max()), 4),
        }
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
