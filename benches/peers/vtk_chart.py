#!/usr/bin/env python3
"""Draws a scene of `measure --chart` with VTK: pictures for the chart's errors, and times of the chart's three kinds of
frames. README.md says how the scene is handed over."""

import argparse
import json
import os
import pathlib
import time
from collections.abc import Callable

import numpy as np

# VTK chooses its window class on import: EGL needs no display.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk  # noqa: E402
from vtk_shell import renderer_of, ssao_pass  # noqa: E402

EDIT = 0.01  # shift of the transfer function's first point
LIT = {"ambient": 0.2, "diffuse": 0.8}  # Phong's shares
FLAT = {"ambient": 1.0, "diffuse": 0.0}

# Ambient occlusion as 3D Slicer has it, radius and bias as shares of the diagonal. It darkens colours alone, as the chart's
# truth does. Scattering takes the place of Phong by half (1) or wholly (2).
MODES = {
    "Phong": {**LIT},
    "SSAO 32": {**FLAT, "ssao": 32},
    "SSAO 128": {**FLAT, "ssao": 128},
    "scattering 1": {**LIT, "blending": 1.0},
    "scattering 2": {**LIT, "blending": 2.0},
}


class Scene:
    """The volume in a window of its own, set up for one mode."""

    def __init__(self, scene: dict, volumes: list[np.ndarray], mode: dict) -> None:
        self.volumes = [numpy_to_vtk(values, deep=True) for values in volumes]
        self.image = vtk.vtkImageData()
        self.image.SetDimensions(scene["dimensions"])
        self.image.SetSpacing(scene["spacing_mm"])
        self.mapper = vtk.vtkGPUVolumeRayCastMapper()
        self.mapper.SetInputData(self.image)
        self.mapper.SetAutoAdjustSampleDistances(False)
        self.mapper.SetSampleDistance(scene["step_mm"])
        self.mapper.SetUseJittering(False)
        self.opacity = vtk.vtkPiecewiseFunction()
        self.points = [(point["value"], point["opacity"]) for point in scene["points"]]
        colour = vtk.vtkColorTransferFunction()
        for point in scene["points"]:
            colour.AddRGBPoint(point["value"], *point["color"])
        look = vtk.vtkVolumeProperty()
        look.SetScalarOpacity(self.opacity)
        look.SetScalarOpacityUnitDistance(scene["opacity_unit_mm"])
        look.SetColor(colour)
        look.SetInterpolationTypeToLinear()
        look.ShadeOn()  # without it VTK draws no screen-space occlusion
        look.SetAmbient(mode["ambient"])
        look.SetDiffuse(mode["diffuse"])
        look.SetSpecular(0.0)
        volume = vtk.vtkVolume()
        volume.SetMapper(self.mapper)
        volume.SetProperty(look)
        volume.SetUserMatrix(matrix(scene["world_from_grid"]))
        renderer = vtk.vtkRenderer()
        renderer.AddVolume(volume)
        if "ssao" in mode:
            diagonal = float(np.linalg.norm(np.multiply(scene["dimensions"], scene["spacing_mm"])))
            renderer.SetPass(ssao_pass(mode["ssao"], diagonal))
        if "blending" in mode:
            self.mapper.SetVolumetricScatteringBlending(mode["blending"])
            self.mapper.SetGlobalIlluminationReach(1.0)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(scene["pixels"])
        self.window.AddRenderer(renderer)
        look_through(renderer.GetActiveCamera(), scene["camera"])
        self.edit(0.0)
        self.carve(0)

    def carve(self, step: int) -> None:
        """Hands over the volume after a step of the carver."""
        self.image.GetPointData().SetScalars(self.volumes[step])
        self.image.Modified()

    def edit(self, by: float) -> None:
        """Shifts the transfer function's first point."""
        self.opacity.RemoveAllPoints()
        for k, (value, opacity) in enumerate(self.points):
            self.opacity.AddPoint(value + (by if k == 0 else 0.0), opacity)

    def draw(self, change: Callable[[], None] | None = None) -> float:
        """Draws a frame after a change and waits until it is done; milliseconds."""
        begin = time.perf_counter()
        if change:
            change()
        self.window.Render()
        self.window.WaitForCompletion()  # glFinish
        return 1e3 * (time.perf_counter() - begin)

    def save(self, file: pathlib.Path) -> None:
        """Saves the last frame."""
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ShouldRerenderOff()
        grab.Update()
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(grab.GetOutputPort())
        writer.SetFileName(str(file))
        writer.Write()


def matrix(numbers: list[float]) -> vtk.vtkMatrix4x4:
    """A matrix from its rows."""
    made = vtk.vtkMatrix4x4()
    made.DeepCopy(numbers)
    return made


def look_through(camera: vtk.vtkCamera, place: dict) -> None:
    """Places the camera. Its clipping planes are far enough apart for any volume around the focal point."""
    camera.SetPosition(place["position"])
    camera.SetFocalPoint(place["focal_point"])
    camera.SetViewUp(place["up"])
    camera.SetViewAngle(place["fov_degrees"])
    distance = camera.GetDistance()
    camera.SetClippingRange(0.02 * distance, 3.0 * distance)


def measure(name: str, folder: pathlib.Path, scene: dict, frames: int) -> dict:
    """Pictures and times of one mode, as the fields of its line."""
    volumes = [np.fromfile(folder / file, dtype="<u2") for file in scene["volumes"]]
    drawn = Scene(scene, volumes, MODES[name])
    pictures = []
    for step in range(len(volumes)):
        drawn.draw(lambda step=step: drawn.carve(step))
        pictures.append(f"vtk_{name.replace(' ', '_')}_{step}.png")
        drawn.save(folder / pictures[-1])
    last = len(volumes) - 1
    ms = {"carve": [], "rest": [], "edit": []}
    for _ in range(frames):
        drawn.draw(lambda: drawn.carve(last - 1))
        ms["carve"].append(drawn.draw(lambda: drawn.carve(last)))
        ms["rest"].append(drawn.draw())
        ms["edit"].append(drawn.draw(lambda: drawn.edit(EDIT)))
        drawn.edit(0.0)
    return {"ms": ms, "images": pictures, "gl": renderer_of(drawn.window)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path, help="folder of the scene; the pictures go there, too")
    parser.add_argument("--frames", type=int, default=10, help="frames timed of each kind [10]")
    options = parser.parse_args()
    scene = json.loads((options.folder / "scene.json").read_text())
    for name in MODES:
        line = {"peer": f"vtk {vtk.VTK_VERSION}", "mode": name}
        print(json.dumps({**line, **measure(name, options.folder, scene, options.frames)}), flush=True)


if __name__ == "__main__":
    main()
