//! A head made by code: the demo volume, free of any patient's data.
//!
//! The head is modelled with signed distances in millimetres, from the skin inwards, and painted
//! layer by layer into Hounsfield units. The values are ordered like the layers: air, skin, fat, muscle; fluid,
//! cortex, white matter; vessels; spongy and hard bone, teeth. A voxel on the boundary of two layers mixes
//! their values. In this order the mixture seldom looks like a third tissue.

mod brain;
mod jaw;
mod sdf;
mod skin;
mod skull;
mod tubes;
mod vessels;

use bevy::math::{UVec3, Vec3};
use sdf::{at, capsule, ellipsoid, noise, ramp};
use std::num::NonZero;
use vessels::Vessels;

/// Hounsfield units of the phantom's tissues.
mod tissue {
    pub(super) const AIR: f32 = -1000.0;
    pub(super) const SKIN: f32 = -100.0;
    pub(super) const FAT: f32 = -75.0;
    pub(super) const MUSCLE: f32 = -40.0;
    pub(super) const FLUID: f32 = 4.0;
    pub(super) const GREY_MATTER: f32 = 32.0;
    pub(super) const WHITE_MATTER: f32 = 44.0;
    pub(super) const VESSEL: f32 = 300.0;
    pub(super) const SPONGY_BONE: f32 = 520.0;
    pub(super) const HARD_BONE: f32 = 1500.0;
    pub(super) const TOOTH: f32 = 2000.0;
}

/// Height of the generated volume.
const HEIGHT_MM: f32 = 240.0;
/// Half the width of edges between skin and air, voxels.
const AIR_EDGE: f32 = 2.0;
/// Width of the edge of [`brain_mask`], voxels.
pub const MASK_EDGE: f32 = 3.0;
/// Largest number of voxels along the height; more would not fit into memory.
const MAX_VOXELS_HIGH: u32 = 1024;

/// A generated computed tomography of a head.
///
/// The axes are RAS+: x grows to the patient's right, y to the front (anterior) and z to the top
/// (superior). The centre of the volume is the origin of the head.
#[derive(Clone, Debug, PartialEq)]
pub struct HeadPhantom {
    /// Number of voxels along x, y and z.
    pub dimensions: UVec3,
    /// Edge length of a (cubic) voxel in millimetres.
    pub spacing_mm: f32,
    /// Hounsfield units, x fastest, then y, then z.
    pub values: Vec<i16>,
}

/// Generates a head, `voxels_high` voxels (1 to 1024) from the neck's end to above the vertex.
///
/// The work is spread over all processors. The result is the same on every machine. 160 voxels
/// make a good demo of 120 x 144 x 160.
pub fn head_phantom(voxels_high: u32) -> HeadPhantom {
    let field = HeadField::new(voxels_high);
    let values = field.sample(|p| field.value(p).round() as i16);
    HeadPhantom { dimensions: field.dimensions, spacing_mm: field.spacing_mm, values }
}

/// Generates a mask of the brain of [`head_phantom`], on the same grid: 255 inside, 0 outside, x fastest. Its edge is
/// [`MASK_EDGE`] voxels wide, so that its surface is smooth.
pub fn brain_mask(voxels_high: u32) -> Vec<u8> {
    let field = HeadField::new(voxels_high);
    let edge_mm = MASK_EDGE * field.spacing_mm;
    field.sample(|p| {
        let q = at(p.x.abs(), p.y, p.z);
        (255.0 * ramp(0.5 * edge_mm, -0.5 * edge_mm, brain::brain(p, q).surface)).round() as u8
    })
}

/// The values of a [`HeadPhantom`] at any point, before they are rounded: what its picture should show.
#[derive(Debug)]
pub struct HeadField {
    dimensions: UVec3,
    spacing_mm: f32,
    vessels: Vessels,
}

impl HeadField {
    /// The field of [`head_phantom`] with as many voxels. Boundaries of tissues are as wide as its voxels.
    pub fn new(voxels_high: u32) -> Self {
        let high = voxels_high.clamp(1, MAX_VOXELS_HIGH);
        let spacing_mm = HEIGHT_MM / high as f32;
        Self {
            dimensions: UVec3::new((high * 3 / 4).max(1), (high * 9 / 10).max(1), high),
            spacing_mm,
            // Thinner vessels would vanish between coarse voxels.
            vessels: Vessels::new((0.5 * spacing_mm).min(2.0)),
        }
    }

    /// Number of voxels along x, y and z.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// Edge length of a (cubic) voxel, mm.
    pub fn spacing_mm(&self) -> f32 {
        self.spacing_mm
    }

    /// Values at the centres of all voxels, x fastest, by all processors.
    fn sample<T: Default + Clone + Send>(&self, value_at: impl Fn(Vec3) -> T + Sync) -> Vec<T> {
        let UVec3 { x: width, y: rows, z: slices } = self.dimensions;
        let middle = (self.dimensions.as_vec3() - Vec3::ONE) / 2.0;
        let slice_len = (width * rows) as usize;
        let mut values = vec![T::default(); slice_len * slices as usize];
        let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
        // Every thread takes each n-th slice, because the slices through the brain cost the most.
        let mut shares: Vec<Vec<(usize, &mut [T])>> = (0..threads).map(|_| Vec::new()).collect();
        for (z, slice) in values.chunks_mut(slice_len).enumerate() {
            shares[z % threads].push((z, slice));
        }
        let fill = |(z, slice): (usize, &mut [T])| {
            for (i, value) in (0..).zip(slice) {
                let index = at((i % width) as f32, (i / width) as f32, z as f32);
                *value = value_at((index - middle) * self.spacing_mm);
            }
        };
        std::thread::scope(|scope| {
            for share in shares {
                scope.spawn(|| share.into_iter().for_each(fill));
            }
        });
        values
    }

    /// Hounsfield units at a point, mm from the origin of the head along the axes of [`HeadPhantom`].
    pub fn value(&self, p: Vec3) -> f32 {
        let q = at(p.x.abs(), p.y, p.z);
        if skin::bound(q) > AIR_EDGE * self.spacing_mm {
            return tissue::AIR;
        }
        let cavity = skull::cavity(q);
        if cavity < -self.spacing_mm {
            // Behind the bone the outer layers cannot be seen: skip them.
            return self.contents(tissue::FLUID, p, q);
        }
        let bone = skull::bone(q, cavity);
        let skin = skin::skin(q, bone);
        if skin > AIR_EDGE * self.spacing_mm {
            return tissue::AIR;
        }
        let value = self.soft_tissue(q, skin);
        let value = self.paint_in_air(value, tissue::AIR, skin::air(q, skin));
        let value = self.paint_crisp(value, hard_tissue(q, bone), bone);
        let value = self.paint(value, tissue::TOOTH, jaw::teeth(q));
        let inside = cavity.min(skull::spinal_canal(q));
        let value = self.paint_crisp(value, tissue::FLUID, inside);
        self.contents(value, p, q)
    }

    /// Skin, fat, muscle and the eye, below the skin's surface at distance `skin`.
    fn soft_tissue(&self, q: Vec3, skin: f32) -> f32 {
        let value = self.paint_in_air(tissue::AIR, tissue::SKIN, skin);
        let value = self.paint(value, tissue::FAT, skin + 2.0);
        // Streaks of fat between the strands of muscle.
        let streaks = ramp(0.25, 0.5, noise(q / at(7.0, 7.0, 16.0), 31));
        let muscle = tissue::MUSCLE + (tissue::FAT - tissue::MUSCLE) * streaks;
        let value = self.paint(value, muscle, skin + 6.0);
        if q.y < 0.0 || q.z < -20.0 || q.z > 40.0 {
            return value;
        }
        let value = self.paint(value, tissue::FAT, skull::orbit(q).max(skin + 3.0));
        let back = skin::EYE - at(0.0, 6.0, 0.0);
        let nerve = capsule(q, (back, 2.2), (at(14.0, 18.0, 13.0), 2.2));
        let eye = (q.distance(skin::EYE) - skin::EYE_RADIUS).min(nerve);
        let value = self.paint(value, tissue::GREY_MATTER, eye);
        let lens = ellipsoid(q, skin::EYE + at(0.0, 8.5, 0.0), at(4.6, 2.0, 4.6));
        self.paint(value, tissue::WHITE_MATTER, lens)
    }

    /// Brain and vessels over `value`.
    fn contents(&self, value: f32, p: Vec3, q: Vec3) -> f32 {
        let brain = brain::brain(p, q);
        let value = self.paint(value, tissue::GREY_MATTER, brain.surface);
        // The border of the white matter is blurred, as in any real image.
        let white = tissue::WHITE_MATTER - tissue::GREY_MATTER;
        let white = white * ramp(0.8, -0.8, brain.white) * ramp(0.0, -self.spacing_mm, brain.surface);
        // A third of a voxel is added around vessels, so that thin vessels also reach their full value.
        let vessel = self.vessels.distance(p) - 0.35 * self.spacing_mm;
        self.paint_crisp(value + white, tissue::VESSEL, vessel)
    }

    /// Covers `value` with `with` where the distance `d` is negative, blended over one voxel.
    fn paint(&self, value: f32, with: f32, d: f32) -> f32 {
        let cover = (0.5 - d / self.spacing_mm).clamp(0.0, 1.0);
        value + (with - value) * cover
    }

    /// Like [`Self::paint`], but blended as a scanner does: the step has a standard deviation of 0.9 voxels. Steeper
    /// edges would show voxels in the shading.
    fn paint_in_air(&self, value: f32, with: f32, d: f32) -> f32 {
        value + (with - value) * ramp(AIR_EDGE, -AIR_EDGE, d / self.spacing_mm)
    }

    /// Like [`Self::paint`], but blended over two thirds of a voxel.
    ///
    /// The mixtures along the surface of bones have the values of vessels, so they must be thin.
    fn paint_crisp(&self, value: f32, with: f32, d: f32) -> f32 {
        self.paint(value, with, 1.5 * d)
    }
}

/// Bone at the distance `bone` to its surface: hard outside, spongy inside.
fn hard_tissue(q: Vec3, bone: f32) -> f32 {
    let spongy = tissue::SPONGY_BONE + 60.0 * noise(q / 6.0, 41);
    tissue::HARD_BONE + (spongy - tissue::HARD_BONE) * ramp(-1.6, -3.0, bone)
}

#[cfg(test)]
mod tests;
