#!/usr/bin/env python3
"""Times VTK's volume ray caster while a volume is cut and the camera turns; README.md has the scene."""

import argparse
import json
import os
import pathlib
import re
import statistics
import time

import numpy as np

# VTK chooses its window class on import: EGL needs no display.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402

MODES = ("unshaded", "phong", "ssao", "scattering")
SIZE = 128  # nodes of the grid along each axis, 1 mm apart, their middle at the origin
CAMERA = (132.0, 88.0, 198.0)  # mm; it looks at the origin (VTK's default), y is up
FIELD_OF_VIEW = 30.0  # degrees
CUT = 16.0  # mm; what lies in front of this z is cut away at frame 0
CUT_WAY = 8  # the cut moves to and fro by up to this many mm, one per frame
WARM_UP = 2  # frames


def shell() -> np.ndarray:
    """A bumpy shell with a rod along each axis: values 0 to 4000, indexed [z, y, x]."""
    g = np.linspace(-1.0, 1.0, SIZE)
    z, y, x = np.meshgrid(g, g, g, indexing="ij", sparse=True)
    radius = np.sqrt(x * x + y * y + z * z)
    bumps = 0.04 * np.sin(9 * x) * np.sin(9 * y) * np.sin(9 * z)
    value = np.maximum(1.0 - np.abs(radius - 0.75 - bumps) / 0.08, 0.0)
    for a, b in ((y, z), (z, x), (x, y)):
        value = np.maximum(value, np.clip(1.0 - (np.hypot(a, b) - 0.12) / 0.04, 0.0, 1.0))
    return np.rint(4000.0 * value).astype("<u2")


def write_nrrd(values: np.ndarray, path: pathlib.Path) -> None:
    """Writes the volume, its x, y, z to the patient's left, up and front: our crate's world axes."""
    half = 0.5 * (SIZE - 1)
    header = f"""NRRD0004
type: uint16
dimension: 3
space: right-anterior-superior
sizes: {SIZE} {SIZE} {SIZE}
space directions: (-1,0,0) (0,0,1) (0,1,0)
endian: little
encoding: raw
space origin: ({half},{-half},{-half})

"""
    path.write_bytes(header.encode("ascii") + values.tobytes())


def vtk_image(values: np.ndarray) -> vtk.vtkImageData:
    """The volume as VTK's point data."""
    image = vtk.vtkImageData()
    image.SetDimensions(SIZE, SIZE, SIZE)
    image.SetOrigin([-0.5 * (SIZE - 1)] * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    return image


def volume_property(shade: bool) -> vtk.vtkVolumeProperty:
    """Opacity, colour and, where shaded, light."""
    opacity = vtk.vtkPiecewiseFunction()
    opacity.AddPoint(1500.0, 0.0)
    opacity.AddPoint(2500.0, 0.95)
    colour = vtk.vtkColorTransferFunction()
    colour.AddRGBPoint(0.0, 0.95, 0.9, 0.82)
    look = vtk.vtkVolumeProperty()
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(1.0)
    look.SetColor(colour)
    look.SetInterpolationTypeToLinear()
    look.SetShade(shade)
    look.SetAmbient(0.2)
    look.SetDiffuse(0.8)
    look.SetSpecular(0.2)
    look.SetSpecularPower(20.0)
    return look


def ssao_pass(samples: int, size: float) -> vtk.vtkSSAOPass:
    """Screen-space ambient occlusion for a scene of a size; it takes the volume's depth where it is half opaque."""
    ssao = vtk.vtkSSAOPass()
    ssao.SetDelegatePass(vtk.vtkRenderStepsPass())
    ssao.SetRadius(0.1 * size)  # radius and bias as 3D Slicer has them for a scene of this size
    ssao.SetBias(0.001 * size)
    ssao.SetKernelSize(samples)
    ssao.BlurOn()
    ssao.SetDepthFormat(vtk.vtkTextureObject.Fixed32)  # the volume mapper copies depth only in this one
    ssao.SetVolumeOpacityThreshold(0.5)
    return ssao


def renderer_of(window: vtk.vtkRenderWindow) -> str:
    """Name of what draws in a window."""
    name = re.search(r"OpenGL renderer string:\s*(.+)", window.ReportCapabilities())
    return name.group(1).strip() if name else "unknown"


class Scene:
    """The volume in a window of its own, set up for one mode."""

    def __init__(self, image: vtk.vtkImageData, mode: str, options: argparse.Namespace) -> None:
        self.plane = vtk.vtkPlane()
        self.plane.SetNormal(0.0, 0.0, -1.0)
        mapper = vtk.vtkGPUVolumeRayCastMapper()
        mapper.SetInputData(image)
        mapper.SetAutoAdjustSampleDistances(False)
        mapper.SetSampleDistance(1.0)
        mapper.SetUseJittering(False)
        mapper.AddClippingPlane(self.plane)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(volume_property(shade=mode != "unshaded"))
        self.renderer = vtk.vtkRenderer()
        self.renderer.AddVolume(volume)
        if mode == "ssao":
            self.renderer.SetPass(ssao_pass(options.ssao_samples, SIZE))
        elif mode == "scattering":
            mapper.SetVolumetricScatteringBlending(options.blending)
            mapper.SetGlobalIlluminationReach(options.reach)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetSize(options.pixels, options.pixels)
        self.window.AddRenderer(self.renderer)

    def draw(self, frame: int) -> float:
        """Draws a frame and waits until it is done; milliseconds."""
        phase = frame % (2 * CUT_WAY)
        self.plane.SetOrigin(0.0, 0.0, CUT + min(phase, 2 * CUT_WAY - phase))
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(CAMERA)
        camera.SetViewAngle(FIELD_OF_VIEW)
        camera.SetClippingRange(100.0, 500.0)
        camera.Azimuth(frame)
        begin = time.perf_counter()
        self.window.Render()
        self.window.WaitForCompletion()  # glFinish
        return 1e3 * (time.perf_counter() - begin)


def measure(image: vtk.vtkImageData, mode: str, options: argparse.Namespace) -> dict:
    """What one mode takes, as the fields of its line."""
    if mode == "ssao" and not hasattr(vtk.vtkSSAOPass, "SetVolumeOpacityThreshold"):
        return {"unsupported": "this VTK has no ambient occlusion for volumes"}
    if mode == "scattering" and not hasattr(vtk.vtkGPUVolumeRayCastMapper, "SetGlobalIlluminationReach"):
        return {"unsupported": "this VTK has no volumetric scattering"}
    scene = Scene(image, mode, options)
    times = [scene.draw(frame) for frame in range(WARM_UP + options.frames)][WARM_UP:]
    scene.draw(0)
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(scene.window)
    grab.ShouldRerenderOff()
    grab.Update()
    picture = grab.GetOutput()
    if vtk_to_numpy(picture.GetPointData().GetScalars()).any(axis=1).mean() < 0.1:
        raise SystemExit(f"{mode}: nothing to see; VTK's messages above may say why")
    if options.image:
        options.image.mkdir(parents=True, exist_ok=True)
        writer = vtk.vtkPNGWriter()
        writer.SetInputData(picture)
        writer.SetFileName(str(options.image / f"vtk_{mode}.png"))
        writer.Write()
    settings = {"ssao": ("ssao_samples",), "scattering": ("blending", "reach")}.get(mode, ())
    return {
        "ms_median": round(statistics.median(times), 2),
        "ms_min": round(min(times), 2),
        "frames": options.frames,
        "image": [options.pixels, options.pixels],
        "volume": [SIZE, SIZE, SIZE],
        "gl": renderer_of(scene.window),
        **{name: getattr(options, name) for name in settings},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mode", nargs="+", choices=MODES, default=MODES, help="modes to time [all]")
    parser.add_argument("--frames", type=int, default=20, help="frames timed per mode [20]")
    parser.add_argument("--pixels", type=int, default=512, help="width and height of the image [512]")
    parser.add_argument("--ssao-samples", type=int, default=32, help="samples per pixel [32, VTK's default]")
    parser.add_argument("--blending", type=float, default=1.0, help="scattering: 0 none to 2 nothing else [1]")
    parser.add_argument("--reach", type=float, default=1.0, help="scattering: 0 near to 1 all shadows [1]")
    parser.add_argument("--image", type=pathlib.Path, metavar="FOLDER", help="save a PNG of frame 0 per mode")
    parser.add_argument("--write-volume", type=pathlib.Path, metavar="FILE", help="only write the volume, as NRRD")
    options = parser.parse_args()
    if options.frames < 1:
        parser.error("--frames must be at least 1")
    if options.write_volume:
        return write_nrrd(shell(), options.write_volume)
    image = vtk_image(shell())
    for mode in options.mode:
        line = {"peer": f"vtk {vtk.VTK_VERSION}", "mode": mode, **measure(image, mode, options)}
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
