#!/usr/bin/env python3
"""How far VTK's picture of a ball is from the truth; README.md has the scene, ../../docs/picture.md the definitions."""

import argparse
import json
import math
import os
import pathlib

import numpy as np

# VTK chooses its window class on import: EGL needs no display.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
import vtk  # noqa: E402
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402

RESOLUTIONS = (48, 96, 192)  # voxels of the grid along each axis
EXTENT = 96.0  # mm along each axis
RADIUS = 36.3  # mm, of the ball about the origin
MATTER = 1000.0  # value inside
BLUR = 0.9  # voxels, standard deviation
RAMPS = ((300.0, 700.0), (499.0, 501.0))  # values from which and up to which the opacity rises, to 1 over a voxel
VIEW = np.array([0.55, 0.35, 0.8])  # direction of the camera, which looks at the origin; y is up
DISTANCE = EXTENT * 5.0 / 3.0  # mm
FIELD_OF_VIEW = 30.0  # degrees
GREY = 0.85  # sRGB-encoded
AMBIENT, DIFFUSE, SPECULAR, SHININESS = 0.3, 0.7, 0.2, 16

error_function = np.frompyfunc(math.erf, 1, 1)


def light_of(level: np.ndarray) -> np.ndarray:
    """Light, 0 to 1, of a display level, 0 to 255."""
    encoded = level / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def level_of(light: np.ndarray) -> np.ndarray:
    """Display level of light, not rounded."""
    return 255.0 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


COLOUR = float(light_of(np.array(255.0 * GREY)))


def lit(facing: np.ndarray) -> np.ndarray:
    """Light of a surface; `facing` is the cosine between its normal and the line of sight.

    VTK's highlight is Phong's, by the reflected light; that of this crate is Blinn's.
    """
    return COLOUR * (AMBIENT + DIFFUSE * facing) + SPECULAR * np.maximum(2.0 * facing**2 - 1.0, 0.0) ** SHININESS


def angle_of(light: np.ndarray) -> np.ndarray:
    """Degrees between normal and line of sight of a surface, from its light."""
    facing = np.linspace(0.0, 1.0, 20001)
    return np.degrees(np.arccos(np.interp(light, lit(facing), facing)))


def value_at(away: np.ndarray) -> np.ndarray:
    """Value at a distance outside the ball, in voxels."""
    return 0.5 * MATTER * (1.0 - error_function(away / (BLUR * math.sqrt(2.0))).astype(float))


def ball(size: int) -> np.ndarray:
    """The values at the voxels, rounded."""
    spacing = EXTENT / size
    g = (np.arange(size) + 0.5) * spacing - 0.5 * EXTENT
    z, y, x = np.meshgrid(g, g, g, indexing="ij", sparse=True)
    return np.rint(value_at((np.sqrt(x * x + y * y + z * z) - RADIUS) / spacing)).astype(np.uint16)


def offsets(pixels: int) -> np.ndarray:
    """Distance, mm, of each pixel's ray from the middle of the ball, rows from bottom to top."""
    place = (2.0 * (np.arange(pixels) + 0.5) / pixels - 1.0) * math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    slope = np.hypot(*np.meshgrid(place, place))
    return DISTANCE * np.sin(np.arctan(slope))


def truth(offset: np.ndarray, size: int, ramp: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Light and mean cosine of rays that pass the middle of the ball at these distances (mm)."""
    spacing = EXTENT / size
    # Distances outside the surface between which the opacity rises, and just inside, where it is 1.
    search = np.linspace(-3.0, 3.0, 600001)
    values = value_at(search)
    away = [float(np.interp(-value, -values, search)) for value in ramp]
    steps = np.linspace(away[0], away[1], 4001)
    radii = RADIUS + spacing * steps
    opacity = np.clip((value_at(steps) - ramp[0]) / (ramp[1] - ramp[0]), 0.0, 1.0 - 1e-12)
    light, facing = np.zeros_like(offset), np.zeros_like(offset)
    through = np.ones_like(offset)
    along_before = None
    for k, radius in enumerate(radii):
        along = -np.sqrt(np.maximum(radius**2 - offset**2, 0.0)) / spacing
        if along_before is not None:
            middle = 0.5 * (radius + radii[k - 1])
            clear = (1.0 - 0.5 * (opacity[k] + opacity[k - 1])) ** np.maximum(along - along_before, 0.0)
            cosine = np.sqrt(np.maximum(1.0 - (offset / middle) ** 2, 0.0))
            light += through * (1.0 - clear) * lit(cosine)
            facing += through * (1.0 - clear) * cosine
            through *= clear
        along_before = along
    # Behind the ramp all that is left is stopped at once.
    cosine = np.sqrt(np.maximum(1.0 - (offset / radii[-1]) ** 2, 0.0))
    return light + through * lit(cosine), facing + through * cosine


def picture(
    values: np.ndarray,
    extent: float,
    points: list[tuple[float, float, tuple[float, float, float]]],
    angle: float,
    pixels: int,
    options: argparse.Namespace,
) -> vtk.vtkImageData:
    """VTK's picture of a cube of values. Points have a value, its opacity over a voxel's length, and its light."""
    size = len(values)
    spacing = extent / size
    image = vtk.vtkImageData()
    image.SetDimensions(size, size, size)
    image.SetSpacing([spacing] * 3)
    image.SetOrigin([0.5 * (spacing - extent)] * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(options.step_voxels * spacing)
    mapper.SetUseJittering(options.jitter)
    opacity = vtk.vtkPiecewiseFunction()
    colour = vtk.vtkColorTransferFunction()
    for value, share, light in points:
        opacity.AddPoint(value, share)
        colour.AddRGBPoint(value, *light)
    look = vtk.vtkVolumeProperty()
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(spacing)
    look.SetColor(colour)
    look.SetInterpolationTypeToLinear()
    look.ShadeOn()
    look.SetAmbient(AMBIENT)
    look.SetDiffuse(DIFFUSE)
    look.SetSpecular(SPECULAR)
    look.SetSpecularPower(SHININESS)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(volume)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(pixels, pixels)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(extent * 5.0 / 3.0 * VIEW / np.linalg.norm(VIEW))
    camera.SetViewAngle(angle)
    camera.SetClippingRange(10.0, 1000.0)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ShouldRerenderOff()
    grab.Update()
    return grab.GetOutput()


def light_in(image: vtk.vtkImageData) -> np.ndarray:
    """Light of a picture, rows from bottom to top."""
    width, height, _ = image.GetDimensions()
    # VTK's levels are light: it does not encode them for a display.
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1) / 255.0


def save(image: vtk.vtkImageData, name: str, folder: pathlib.Path | None) -> None:
    """Saves a picture, if there is a folder for it."""
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        writer = vtk.vtkPNGWriter()
        writer.SetInputData(image)
        writer.SetFileName(str(folder / f"vtk_{name}.png"))
        writer.Write()


def inner(counts: np.ndarray) -> np.ndarray:
    """Pixels that count with all 24 around them: the outline is left out."""
    kept = counts.copy()
    for down in range(-2, 3):
        for right in range(-2, 3):
            kept &= np.roll(counts, (down, right), axis=(0, 1))
    return kept


def figures(shown: np.ndarray, true: np.ndarray, facing: np.ndarray) -> dict:
    """The difference of two pictures, of light, in the pixels that count. Rows are pixels, columns are colours."""
    apart = level_of(shown) - level_of(true)
    fitted = [np.polynomial.Polynomial.fit(facing, column, 4)(facing) for column in apart.T]
    rest = apart - np.stack(fitted, axis=1)
    return {
        "residual_std": float(np.sqrt(np.mean(rest**2))),
        "residual_largest": float(np.max(np.abs(rest))),
        "rms": float(np.sqrt(np.mean(apart**2))),
        "largest": float(np.max(np.abs(apart))),
        "pixels": len(facing),
    }


def normals(shown: np.ndarray, true: np.ndarray, facing: np.ndarray) -> dict:
    """The difference of the angles between normals and lines of sight, degrees."""
    judged = facing < 0.97
    angles = np.abs(angle_of(shown[judged]) - angle_of(true[judged]))
    return {"normals_deg": float(np.mean(angles)), "normals_largest_deg": float(np.max(angles))}


def options_of(about: str | None, pixels: int) -> argparse.Namespace:
    """The command line; pictures are `pixels` wide and high unless it says otherwise."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--voxels", nargs="+", type=int, default=RESOLUTIONS, help="along each axis [48 96 192]")
    parser.add_argument("--pixels", type=int, default=pixels, help=f"width and height of the image [{pixels}]")
    parser.add_argument("--step-voxels", type=float, default=0.5, help="distance between samples [0.5]")
    parser.add_argument("--jitter", action="store_true", help="move the starts of rays by noise")
    parser.add_argument("--out", type=pathlib.Path, metavar="FOLDER", help="save the pictures as PNG")
    return parser.parse_args()


def tell(scene: str, voxels: int, options: argparse.Namespace, found: dict) -> None:
    """Prints the figures of a picture as a line of JSON."""
    of = {"peer": f"vtk {vtk.VTK_VERSION}", "scene": scene, "voxels": voxels, "mode": "phong"}
    how = {"step_voxels": options.step_voxels, "jitter": options.jitter}
    print(json.dumps({**of, **how, **found}), flush=True)


def main() -> None:
    options = options_of(__doc__, 256)
    offset = offsets(options.pixels)
    for size in options.voxels:
        for ramp in RAMPS:
            # Both depend on the distance alone, so that few of them will do.
            few = np.linspace(0.0, RADIUS, 4001)
            true, facing = (np.interp(offset, few, of, right=0.0) for of in truth(few, size, ramp))
            points = [(ramp[0], 0.0, (COLOUR,) * 3), (ramp[1], 1.0, (COLOUR,) * 3)]
            image = picture(ball(size), EXTENT, points, FIELD_OF_VIEW, options.pixels, options)
            transfer = f"{ramp[0]:.0f}-{ramp[1]:.0f}"
            save(image, f"ball_{transfer}_{size}", options.out)
            kept = inner(facing > 0.3)
            shown, true, facing = light_in(image)[kept][:, 1:2], true[kept][:, None], facing[kept]
            found = figures(shown, true, facing)
            angles = normals(shown[:, 0], true[:, 0], facing)
            tell("ball", size, options, {"transfer": transfer, **found, **angles})


if __name__ == "__main__":
    main()
