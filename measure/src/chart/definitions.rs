//! Own definitions of methods that do not estimate local ambient occlusion. They are evaluated on the CPU, for some
//! voxels.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{DensitySource, OcclusionFiltering, fibonacci_direction},
    volume::{Volume, VolumeGeometry},
};
use std::{num::NonZero, thread};

use contextual_ao_kit::{
    carver::{Carver, Shape},
    headless::voxel_at,
    random::Random,
};

/// Number of voxels that are evaluated.
const VOXELS: usize = 3000;
/// Number of directions from each voxel through the whole volume.
const DIRECTIONS: u32 = 192;
/// A ray ends if it lets through less of the light: half a quantum of a byte.
const OPAQUE: f64 = 1.0 / 512.0;

/// Opacities (of a voxel's thickness) and intensities of a clipped volume, and the voxels that are evaluated.
pub struct Definitions {
    opacities: Vec<u8>,
    intensities: Vec<u16>,
    geometry: VolumeGeometry,
    /// Indices, each voxel at most once.
    pub voxels: Vec<usize>,
}

impl Definitions {
    /// Chooses voxels from `from` at random, the same in every run.
    pub fn new(
        opacities: Vec<u8>,
        intensities: Vec<u16>,
        geometry: VolumeGeometry,
        mut from: Vec<usize>,
    ) -> Self {
        let mut random = Random(1);
        for place in 0..VOXELS.min(from.len()) {
            let other = place + random.below(from.len() - place);
            from.swap(place, other);
        }
        from.truncate(VOXELS);
        Self { opacities, intensities, geometry, voxels: from }
    }

    /// Share of the voxels in the box around each voxel that are not denser. Nothing is dense beyond the grid.
    pub fn not_denser(&self, filtering: OcclusionFiltering) -> Vec<f64> {
        let radius = filtering.radii(&self.geometry).as_ivec3();
        match filtering.density {
            DensitySource::Opacity => self.not_denser_within(radius, &self.opacities),
            _ => self.not_denser_within(radius, &self.intensities),
        }
    }

    fn not_denser_within<T: Copy + PartialOrd + Sync>(&self, radius: IVec3, densities: &[T]) -> Vec<f64> {
        let box_size = (2 * radius + 1).as_i64vec3().element_product();
        self.evaluate(|voxel| {
            let density = densities[self.index(voxel)];
            let last = self.geometry.dimensions.as_ivec3() - 1;
            let (low, high) = ((voxel - radius).max(IVec3::ZERO), (voxel + radius).min(last));
            let mut denser = 0usize;
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    let row = self.index(IVec3::new(low.x, y, z));
                    let row = &densities[row..=row + (high.x - low.x) as usize];
                    denser += row.iter().filter(|&&other| other > density).count();
                }
            }
            1.0 - denser as f64 / box_size as f64
        })
    }

    /// Mean of the light that comes from all directions through the whole volume. Samples are a voxel apart, the
    /// first a voxel away.
    pub fn whole_volume(&self) -> Vec<f64> {
        let to_voxels = self.geometry.local_from_voxel.matrix3.inverse();
        let step_mm = self.geometry.spacing_mm.min_element();
        let steps: Vec<DVec3> =
            (0..DIRECTIONS).map(|k| to_voxels * (step_mm * fibonacci_direction(k, DIRECTIONS))).collect();
        let size = self.geometry.dimensions.as_dvec3();
        self.evaluate(|voxel| {
            let light = steps.iter().map(|&step| {
                let (mut p, mut light) = (voxel.as_dvec3() + step, 1.0);
                while light > OPAQUE && p.cmpgt(DVec3::NEG_ONE).all() && p.cmplt(size).all() {
                    light *= 1.0 - self.opacity(p);
                    p += step;
                }
                if light > OPAQUE { light } else { 0.0 }
            });
            light.sum::<f64>() / f64::from(DIRECTIONS)
        })
    }

    /// Evaluates a value for each voxel, on all processors.
    fn evaluate(&self, value: impl Fn(IVec3) -> f64 + Sync) -> Vec<f64> {
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        let share = self.voxels.len().div_ceil(threads).max(1);
        let at = |index: &usize| value(voxel_at(*index as u32, self.geometry.dimensions).as_ivec3());
        thread::scope(|scope| {
            let shares = self.voxels.chunks(share);
            let running: Vec<_> =
                shares.map(|share| scope.spawn(|| share.iter().map(at).collect::<Vec<_>>())).collect();
            running.into_iter().flat_map(|thread| thread.join().expect("evaluating does not panic")).collect()
        })
    }

    fn index(&self, voxel: IVec3) -> usize {
        let size = self.geometry.dimensions.as_ivec3();
        ((voxel.z * size.y + voxel.y) * size.x + voxel.x) as usize
    }

    /// Opacity of a voxel, 0 beyond the grid.
    fn opacity_of(&self, voxel: IVec3) -> u8 {
        let is_in = voxel.cmpge(IVec3::ZERO).all() && voxel.cmplt(self.geometry.dimensions.as_ivec3()).all();
        if is_in { self.opacities[self.index(voxel)] } else { 0 }
    }

    /// Opacity at a point, trilinear, 0 beyond the grid.
    fn opacity(&self, p: DVec3) -> f64 {
        let (base, share) = (p.floor(), p - p.floor());
        let corners = (0..8).map(|k| {
            let far = IVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let weight = DVec3::select(far.cmpeq(IVec3::ONE), share, 1.0 - share).element_product();
            weight * f64::from(self.opacity_of(base.as_ivec3() + far))
        });
        corners.sum::<f64>() / 255.0
    }
}

/// Stored intensities of a volume from which a ball is carved. The ball has the lowest intensity.
pub fn clipped_intensities(volume: &Volume, carver: Option<&Carver>) -> Vec<u16> {
    const PARTS: i32 = 4;
    let geometry = VolumeGeometry::of(volume);
    let half_voxel = 0.5 * geometry.cell_diagonal_mm();
    let values = || (0..volume.voxel_count() as usize).filter_map(|index| volume.intensities().get(index));
    let lowest = f64::from(values().min().unwrap_or_default());
    let clipped = |(index, value): (u32, u16)| {
        let Some(Carver { shape: Shape::Sphere { radius }, position, .. }) = carver else {
            return value;
        };
        let voxel = voxel_at(index, volume.dimensions()).as_dvec3();
        let beyond = |p: DVec3| {
            let p = geometry.local_from_voxel.transform_point3(p);
            p.distance(position.as_dvec3()) - f64::from(*radius)
        };
        let visible = match beyond(voxel) {
            far if far > half_voxel => 1.0,
            deep if deep < -half_voxel => 0.0,
            _ => {
                let parts =
                    (0..PARTS.pow(3)).map(|k| IVec3::new(k % PARTS, k / PARTS % PARTS, k / PARTS / PARTS));
                let offsets = parts.map(|part| (part.as_dvec3() + 0.5) / f64::from(PARTS) - 0.5);
                offsets.filter(|offset| beyond(voxel + *offset) > 0.0).count() as f64
                    / f64::from(PARTS.pow(3))
            }
        };
        (lowest + visible * (f64::from(value) - lowest)).round() as u16
    };
    (0..).zip(values()).map(clipped).collect()
}
