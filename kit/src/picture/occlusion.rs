//! Ambient occlusion by its definition, at any point: equations 2 and 3 of the CAO paper. Opacities are those of the
//! field, not those of voxels.

use bevy::math::DVec3;
use std::f64::consts::TAU;

use super::{
    field::{Body, Field, Tissue},
    solid::Solid,
};

/// Directions of the mean in general, around the head, whose values take long, and where it has to be found at few
/// points alone.
const DIRECTIONS: u32 = 512;
const DIRECTIONS_OF_HEAD: u32 = 128;
const MOST_DIRECTIONS: u32 = 8192;
/// Places of a table by radius, per voxel.
const PLACES_PER_VOXEL: f64 = 32.0;

/// Directions spread evenly over the sphere: a Fibonacci lattice.
pub fn directions(count: u32) -> Vec<DVec3> {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let of = |k: u32| {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
        let (sin, cos) = (TAU * (f64::from(k) * golden).fract()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * cos, across * sin, z)
    };
    (0..count).map(of).collect()
}

/// The share of ambient light that reaches a point: the mean over `directions` of the mean transmittance along the ray.
/// A ray has `steps` samples a voxel apart, the first a voxel's diagonal away, and counts the point itself as clear.
pub fn ambient(field: &Field, p: DVec3, directions: &[DVec3], steps: u32) -> f64 {
    let sum: f64 = directions.iter().map(|direction| ray_factor(field, p, *direction, steps)).sum();
    sum / directions.len() as f64
}

fn ray_factor(field: &Field, p: DVec3, direction: DVec3, steps: u32) -> f64 {
    let voxel = field.voxel_mm;
    let mut transmittance = 1.0;
    let mut sum = 1.0;
    let mut i = 0;
    while i < steps {
        let q = p + direction * voxel * (3f64.sqrt() + f64::from(i));
        let clear = field.clear_way_mm(q);
        if clear == 0.0 && field.is_shown(q) {
            transmittance *= 1.0 - field.opacity(q);
        }
        if transmittance < 1e-9 {
            break;
        }
        // Samples on which nothing is seen.
        let count = (1 + (clear / voxel) as u32).min(steps - i);
        sum += f64::from(count) * transmittance;
        i += count;
    }
    sum / f64::from(steps + 1)
}

/// Occlusion of a scene. Around a single ball it depends on the radius alone: a table holds it.
pub struct Occlusion<'a> {
    field: &'a Field,
    directions: Vec<DVec3>,
    steps: u32,
    by_radius: Vec<f64>,
}

impl<'a> Occlusion<'a> {
    /// Occlusion by rays of `steps` samples.
    pub fn new(field: &'a Field, steps: u32) -> Self {
        let by_radius = round_tissues(field).map(|tissues| table(field, tissues, steps)).unwrap_or_default();
        let count = match field.body {
            Body::Solids(_) => DIRECTIONS,
            Body::Head(_) => DIRECTIONS_OF_HEAD,
        };
        Self { field, directions: directions(count), steps, by_radius }
    }

    /// The share of ambient light that reaches a point.
    pub fn at(&self, p: DVec3) -> f64 {
        let place = p.length() / self.field.voxel_mm * PLACES_PER_VOXEL;
        let below = place as usize;
        match self.by_radius.get(below..below + 2) {
            Some([a, b]) => a + (b - a) * place.fract(),
            _ => ambient(self.field, p, &self.directions, self.steps),
        }
    }
}

/// The tissues of a scene that is balls about the origin alone.
fn round_tissues(field: &Field) -> Option<&[Tissue]> {
    let is_ball =
        |tissue: &Tissue| matches!(tissue.solid, Solid::Ball { center, .. } if center == DVec3::ZERO);
    match &field.body {
        Body::Solids(tissues) if field.cuts.is_empty() && tissues.iter().all(is_ball) => Some(tissues),
        _ => None,
    }
}

/// Occlusion by radius from the origin to the grid's end.
fn table(field: &Field, tissues: &[Tissue], steps: u32) -> Vec<f64> {
    let all = directions(MOST_DIRECTIONS);
    let places = (0.5 * f64::from(field.dimensions.x) * PLACES_PER_VOXEL) as u32;
    let at = |place: u32| {
        let p = DVec3::new(0.6, 0.48, 0.64) * (f64::from(place) / PLACES_PER_VOXEL * field.voxel_mm);
        // Deep inside no sample is seen, and far outside none counts.
        let away = tissues.iter().map(|tissue| tissue.solid.distance(p).abs());
        let is_near = away.fold(f64::INFINITY, f64::min) < 3.0 * field.voxel_mm;
        if is_near { ambient(field, p, &all, steps) } else { f64::NAN }
    };
    (0..places).map(at).collect()
}
