#!/usr/bin/env python3
"""How far VTK's pictures of solids are from the truth: the scenes of `measure --picture` beside the ball.

README.md has what differs, ../../docs/picture.md the scenes and the definitions.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import vtk_picture
from vtk_picture import AMBIENT, BLUR, COLOUR, DIFFUSE, MATTER, SHININESS, SPECULAR, VIEW, light_of, value_at

STEPS_PER_VOXEL = 48  # of the integral
NEAR = 4.0  # voxels from a surface within which values are not those of air or of matter
LEAST = 1e-6  # change of opacity within a voxel that makes a surface

Solid = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # points -> distances outside, mm, and normals


@dataclass
class Scene:
    """A scene; lengths in mm."""

    name: str
    extent: float
    angle: float  # field of view, degrees
    solids: list[tuple[float, Solid]]  # value of the matter, and its place
    thickness: float  # between a face and the one behind it
    points: list[tuple[float, float, tuple[float, float, float]]]  # value, opacity over a voxel, light


def ball(center: tuple[float, float, float], radius: float) -> Solid:
    def solid(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        out = p - np.array(center)
        away = np.linalg.norm(out, axis=-1)
        return away - radius, out / np.maximum(away, 1e-9)[..., None]

    return solid


def slab(thickness: float) -> Solid:
    normal = np.array([0.3, 0.8, 0.5]) / np.linalg.norm([0.3, 0.8, 0.5])

    def solid(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        along = p @ normal
        return np.abs(along) - 0.5 * thickness, np.sign(along)[..., None] * normal

    return solid


def box() -> Solid:
    half = 0.5 * np.array([56.0, 46.0, 42.0])

    def about(axis: int, angle: float) -> np.ndarray:
        turn = np.eye(3)
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        turn[[a, a, b, b], [a, b, a, b]] = math.cos(angle), -math.sin(angle), math.sin(angle), math.cos(angle)
        return turn

    turn = about(1, 0.35) @ about(0, 0.2) @ about(2, 0.1)

    def solid(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = p @ turn
        beyond = np.abs(q) - half
        outside = np.maximum(beyond, 0.0)
        most = beyond.max(axis=-1)
        nearest = (beyond == most[..., None]).astype(float)
        out = np.where(most[..., None] > 0.0, outside, nearest) * np.sign(q)
        out /= np.maximum(np.linalg.norm(out, axis=-1), 1e-9)[..., None]
        return np.linalg.norm(outside, axis=-1) + np.minimum(most, 0.0), out @ turn.T

    return solid


def scenes(size: int) -> list[Scene]:
    """All scenes, with grids of this many voxels along each axis."""
    grey = (COLOUR,) * 3

    def soft(name: str, extent: float, angle: float, solid: Solid, thickness: float = 1e9) -> Scene:
        # The blur lowers a wall that is thinner than it.
        peak = MATTER - 2.0 * float(value_at(np.array([0.5 * thickness * size / extent]))[0])
        points = [(0.3 * peak, 0.0, grey), (0.7 * peak, 1.0, grey)]
        return Scene(name, extent, angle, [(MATTER, solid)], thickness, points)

    def wall(thickness: float) -> Scene:
        return soft(f"wall_{thickness}mm", 144.0, 15.0, slab(thickness), thickness)

    red, white = (tuple(light_of(255.0 * np.array(shown))) for shown in [(0.8, 0.4, 0.35), (0.88, 0.85, 0.78)])
    tissues = [(400.0, ball((0.0, 0.0, 0.0), 36.3)), (600.0, ball((7.0, 3.0, 9.0), 17.2))]
    points = [(150.0, 0.0, red), (250.0, 0.04, red), (600.0, 0.04, red), (800.0, 1.0, white)]
    return [
        soft("slab", 96.0, 15.0, slab(24.0), 24.0),
        soft("box", 96.0, 30.0, box()),
        Scene("two_tissues", 96.0, 30.0, tissues, 1e9, points),
        *(wall(thickness) for thickness in (0.3, 0.7, 1.5)),
    ]


def values_of(scene: Scene, p: np.ndarray, spacing: float) -> np.ndarray:
    found = 0.0
    for value, solid in scene.solids:
        away = solid(p)[0]
        found = found + value / MATTER * (value_at(away / spacing) - value_at((away + scene.thickness) / spacing))
    return found


def opacity_of(scene: Scene, values: np.ndarray) -> np.ndarray:
    at, shares, _ = zip(*scene.points)
    return np.minimum(np.interp(values, at, shares), 1.0 - 1e-12)


def grid(scene: Scene, size: int) -> np.ndarray:
    """The values at the voxels, rounded."""
    spacing = scene.extent / size
    g = (np.arange(size) + 0.5) * spacing - 0.5 * scene.extent
    slices = []
    for z in g:
        y, x = np.meshgrid(g, g, indexing="ij")
        slices.append(values_of(scene, np.stack([x, y, np.full_like(x, z)], axis=-1), spacing))
    return np.rint(np.stack(slices)).astype(np.uint16)


def rays(scene: Scene, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Origin and directions of the rays, rows from bottom to top."""
    out = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0.0, 1.0, 0.0], out)
    right /= np.linalg.norm(right)
    up = np.cross(out, right)
    place = (2.0 * (np.arange(pixels) + 0.5) / pixels - 1.0) * math.tan(math.radians(0.5 * scene.angle))
    across, along = np.meshgrid(place, place)
    towards = across[..., None] * right + along[..., None] * up - out
    return scene.extent * 5.0 / 3.0 * out, towards / np.linalg.norm(towards, axis=-1)[..., None]


def truth(scene: Scene, size: int, pixels: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light, opacity and mean cosine of all pixels: the volume rendering integral in small steps."""
    spacing = scene.extent / size
    origin, towards = rays(scene, pixels)
    towards = towards.reshape(-1, 3)
    light, facing, through = np.zeros_like(towards), np.zeros(len(towards)), np.ones(len(towards))
    half = 0.5 * scene.extent
    at, _, lights = zip(*scene.points)
    step = spacing / STEPS_PER_VOXEL
    nearest = np.linalg.norm(origin) - math.sqrt(3.0) * half
    farthest = np.linalg.norm(origin) + math.sqrt(3.0) * half
    for middle in np.arange(nearest + 0.5 * step, farthest, step):
        p = origin + middle * towards
        in_grid = (np.abs(p) <= half).all(axis=1) & (through > 1e-6)
        away = [solid(p[in_grid])[0] for _, solid in scene.solids]
        seen = np.flatnonzero(in_grid)[np.min(away, axis=0) < NEAR * spacing] if in_grid.any() else []
        if not len(seen):
            continue
        p = p[seen]
        values = values_of(scene, p, spacing)
        opacity = opacity_of(scene, values)
        gradient = 0.0
        for value, solid in scene.solids:
            distance, normal = solid(p)
            faces = [distance, distance + scene.thickness]
            near, far = (np.exp(-0.5 * (face / (BLUR * spacing)) ** 2) for face in faces)
            steep = value * (near - far)
            gradient = gradient + steep[:, None] * normal
        normal = gradient / np.maximum(np.linalg.norm(gradient, axis=1), 1e-30)[:, None]
        changes = np.zeros(len(seen), dtype=bool)
        for side in (-spacing, spacing):
            beside = opacity_of(scene, values_of(scene, p + side * normal, spacing))
            changes |= np.abs(beside - opacity) > LEAST
        cosine = np.abs(np.sum(normal * towards[seen], axis=1))
        colour = np.stack([np.interp(values, at, [of[k] for of in lights]) for k in range(3)], axis=1)
        highlight = SPECULAR * np.maximum(2.0 * cosine**2 - 1.0, 0.0) ** SHININESS
        lit = colour * (AMBIENT + DIFFUSE * cosine)[:, None] + highlight[:, None]
        weight = through[seen] * (1.0 - (1.0 - opacity) ** (step / spacing))
        light[seen] += weight[:, None] * np.where(changes[:, None], lit, colour)
        facing[seen] += weight * np.where(changes, cosine, 1.0)
        through[seen] -= weight
    alpha = 1.0 - through
    shape = (pixels, pixels)
    return light.reshape(*shape, 3), alpha.reshape(shape), (facing / np.maximum(alpha, 1e-9)).reshape(shape)


def main() -> None:
    options = vtk_picture.options_of(__doc__, 128)
    for size in options.voxels:
        for scene in scenes(size):
            values = grid(scene, size)
            image = vtk_picture.picture(values, scene.extent, scene.points, scene.angle, options.pixels, options)
            vtk_picture.save(image, f"{scene.name}_{size}", options.out)
            light, alpha, facing = truth(scene, size, options.pixels)
            kept = vtk_picture.inner((alpha >= 0.5) & (facing > 0.3))
            found = vtk_picture.figures(vtk_picture.light_in(image)[kept], light[kept], facing[kept])
            vtk_picture.tell(scene.name, size, options, found)


if __name__ == "__main__":
    main()
