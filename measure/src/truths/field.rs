//! Intensities of a volume between its voxels, and the rays of a camera.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    prelude::Volume,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};
use core::f64::consts::TAU;

/// A volume as truths read it, in its file's units.
pub struct Field {
    values: Vec<f32>,
    lowest: f64,
    geometry: VolumeGeometry,
    /// Voxel coordinates of volume space.
    voxel_from_local: bevy::math::DAffine3,
    /// Smallest voxel spacing, mm.
    pub voxel_mm: f64,
}

impl Field {
    pub fn new(volume: &Volume) -> Self {
        let stored = (0..volume.voxel_count() as usize).filter_map(|index| volume.intensities().get(index));
        let geometry = VolumeGeometry::of(volume);
        Self {
            values: stored.map(|value| volume.to_file_units(value.into()) as f32).collect(),
            lowest: volume.range()[0],
            geometry,
            voxel_from_local: geometry.local_from_voxel.inverse(),
            voxel_mm: volume.spacing_mm().min_element().into(),
        }
    }

    /// Whether a point (volume space, mm) lies in the grid.
    pub fn contains(&self, p: DVec3) -> bool {
        let voxel = self.voxel_from_local.transform_point3(p);
        let last = self.geometry.dimensions.as_dvec3() - 0.5;
        voxel.cmpgt(DVec3::splat(-0.5)).all() && voxel.cmplt(last).all()
    }

    /// Intensity at a point, trilinear; the lowest beyond the grid.
    pub fn at(&self, p: DVec3) -> f64 {
        if !self.contains(p) {
            return self.lowest;
        }
        let size = self.geometry.dimensions.as_ivec3();
        let voxel = self.voxel_from_local.transform_point3(p).clamp(DVec3::ZERO, (size - 1).as_dvec3());
        let base = voxel.floor();
        let (share, base) = (voxel - base, base.as_ivec3());
        let value = |far: IVec3| {
            let IVec3 { x, y, z } = (base + far).min(size - 1);
            f64::from(self.values[((z * size.y + y) * size.x + x) as usize])
        };
        let along_x =
            |y, z| value(IVec3::new(0, y, z)) * (1.0 - share.x) + value(IVec3::new(1, y, z)) * share.x;
        let along_y = |z| along_x(0, z) * (1.0 - share.y) + along_x(1, z) * share.y;
        along_y(0) * (1.0 - share.z) + along_y(1) * share.z
    }

    /// Direction in which intensities fall.
    pub fn outwards(&self, p: DVec3) -> DVec3 {
        let step = self.voxel_mm;
        let along = |axis: DVec3| self.at(p - step * axis) - self.at(p + step * axis);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)).normalize_or_zero()
    }

    /// Distances, mm, at which a ray from outside enters a ball around the grid and leaves it.
    pub fn bounds(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let radius = self.geometry.corners().iter().map(|corner| corner.length()).fold(0.0, f64::max);
        let middle = -origin.dot(direction);
        [(middle - radius).max(0.0), middle + radius]
    }
}

/// Direction `k` of a spiral around an axis, at this cosine to the axis. Turns are golden sections, so that directions are
/// spread evenly if cosines are.
pub fn spiral(axis: DVec3, k: u32, cosine: f64) -> DVec3 {
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let (sin, cos) = (TAU * (f64::from(k) * golden).fract()).sin_cos();
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    (1.0 - cosine * cosine).sqrt() * (cos * tangent + sin * bitangent) + cosine * axis
}

/// A camera that looks at the volume's centre.
pub struct Eye {
    pub origin: DVec3,
    view: Transform,
    /// Half the image's height at a distance of 1.
    half_height: f64,
    size: UVec2,
}

impl Eye {
    pub fn new(view: Transform, fov_degrees: f32, size: UVec2) -> Self {
        let origin = view.translation.as_dvec3() / f64::from(WORLD_UNITS_PER_MM);
        Self { origin, view, half_height: f64::from(0.5 * fov_degrees.to_radians()).tan(), size }
    }

    /// Direction through a pixel.
    pub fn through(&self, pixel: UVec2) -> DVec3 {
        let place = (pixel.as_dvec2() + 0.5) / self.size.as_dvec2() * 2.0 - 1.0;
        let aspect = f64::from(self.size.x) / f64::from(self.size.y);
        let [right, up, forward] =
            [*self.view.right(), *self.view.up(), *self.view.forward()].map(|axis| axis.as_dvec3());
        let across = place.x * aspect * right - place.y * up;
        (forward + self.half_height * across).normalize()
    }
}
