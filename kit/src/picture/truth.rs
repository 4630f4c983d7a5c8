//! The picture that a scene should have: the volume rendering integral in double precision.

use bevy::math::{DVec3, UVec2};
use std::{num::NonZero, thread};

use super::{field::Field, occlusion::Occlusion};

// Blinn-Phong coefficients of a light at the camera.
const AMBIENT: f64 = 0.3;
const DIFFUSE: f64 = 0.7;
const SPECULAR: f64 = 0.2;
const SHININESS: i32 = 16;

/// Longest and shortest step, and the least distance by which a way out of a cut goes on, voxels.
const STEP: f64 = 1.0 / 16.0;
const LEAST_STEP: f64 = 1.0 / 32768.0;
const LEAST_WAY: f64 = 1e-5;
/// A step is halved while the opacity over a voxel's length changes by more, and while its own opacity is more.
const LARGEST_CHANGE: f64 = 1.0 / 64.0;
/// A ray ends where less light gets through.
const DARK: f64 = 1e-7;
/// Number of places on a ray at which occlusion is found: each stands for an equal part of what is seen.
const PLACES: f64 = 8.0;

/// The light of a lit surface of one colour. `facing` is the cosine between its normal and the line of sight.
pub fn lit(color: DVec3, facing: f64, ambient: f64) -> DVec3 {
    color * (AMBIENT + DIFFUSE * facing) * ambient + SPECULAR * facing.powi(SHININESS)
}

/// The cosine between normal and line of sight of a surface that is lit but not occluded, from its light: the inverse
/// of [`lit`], which grows with it. Light that no surface has gives 0 or 1.
pub fn facing_of(light: f64, color: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..48 {
        let middle = 0.5 * (low + high);
        let is_less = lit(DVec3::splat(color), middle, 1.0).x < light;
        (low, high) = if is_less { (middle, high) } else { (low, middle) };
    }
    0.5 * (low + high)
}

/// Opacity over a length, voxels. `opacity` is that over the length of a voxel.
fn opacity_of(opacity: f64, voxels: f64) -> f64 {
    1.0 - (1.0 - opacity).powf(voxels)
}

/// A camera; lengths in mm, in volume space.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Place of the camera, which looks at the origin; y is up.
    pub position: DVec3,
    /// Vertical field of view, radians.
    pub fov: f64,
    /// Size of the picture, pixels.
    pub size: UVec2,
}

impl Eye {
    /// A camera in a direction from the origin and at a distance from it, with `pixels` along each side.
    pub fn looking_from(direction: DVec3, distance_mm: f64, pixels: u32) -> Self {
        let position = distance_mm * direction.normalize();
        Self { position, fov: 30f64.to_radians(), size: UVec2::splat(pixels) }
    }

    /// Direction of the ray through the centre of a pixel; rows go from top to bottom.
    pub fn direction(&self, pixel: UVec2) -> DVec3 {
        let forward = -self.position.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let size = self.size.as_dvec2();
        let from_middle = (pixel.as_dvec2() + 0.5 - 0.5 * size) / (0.5 * size.y) * (0.5 * self.fov).tan();
        (forward + from_middle.x * right - from_middle.y * up).normalize()
    }
}

/// What a pixel should show.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Light without occlusion, of the lit scene.
    pub lit: DVec3,
    /// Light with occlusion, without a light.
    pub occluded: DVec3,
    /// Light with both.
    pub lit_occluded: DVec3,
    /// Opacity, 0 to 1.
    pub alpha: f64,
    /// Mean cosine between normals and line of sight; 1 where there is no surface.
    pub facing: f64,
}

/// A part of a ray that is seen.
#[derive(Clone, Copy, Debug, Default)]
struct Slice {
    along_mm: f64,
    /// Share of the pixel.
    weight: f64,
    color: DVec3,
    /// Cosine between normal and line of sight; `None` where there is no surface.
    facing: Option<f64>,
}

impl Slice {
    /// The light of the slice, lit from the camera. Without a surface it has the colour.
    fn lit(&self, ambient: f64) -> DVec3 {
        self.facing.map_or(self.color * ambient, |facing| lit(self.color, facing, ambient))
    }
}

/// A scene with its occlusion.
pub struct Truth<'a> {
    field: &'a Field,
    occlusion: Occlusion<'a>,
    /// Factor on the lengths of steps, and on the opacity of a step and its change. Less than 1 is finer.
    pub coarseness: f64,
}

impl<'a> Truth<'a> {
    /// The truth of a scene whose occlusion rays have `steps` samples.
    pub fn new(field: &'a Field, steps: u32) -> Self {
        Self { field, occlusion: Occlusion::new(field, steps), coarseness: 1.0 }
    }

    /// All pixels, rows from top to bottom.
    pub fn picture(&self, eye: &Eye) -> Vec<Pixel> {
        let UVec2 { x: width, y: height } = eye.size;
        let threads = thread::available_parallelism().map_or(1, NonZero::get) as u32;
        let row = |y| (0..width).map(move |x| self.pixel(eye.position, eye.direction(UVec2::new(x, y))));
        // Every thread takes every so many-th row.
        let rows_of =
            |first: u32| (first..height).step_by(threads as usize).map(|y| row(y).collect::<Vec<_>>());
        let mut shares: Vec<_> = thread::scope(|scope| {
            let running: Vec<_> =
                (0..threads).map(|k| scope.spawn(move || rows_of(k).collect::<Vec<_>>())).collect();
            running.into_iter().map(|thread| thread.join().unwrap_or_default().into_iter()).collect()
        });
        (0..height).flat_map(|y| shares[(y % threads) as usize].next().unwrap_or_default()).collect()
    }

    /// The pixel of a ray; `direction` is a unit vector.
    pub fn pixel(&self, origin: DVec3, direction: DVec3) -> Pixel {
        let slices = self.slices(origin, direction);
        let mut pixel = Pixel::default();
        let alpha: f64 = slices.iter().map(|slice| slice.weight).sum();
        let (mut place, mut first) = (0.0, 0);
        for (k, slice) in slices.iter().enumerate() {
            place += slice.weight;
            // A group of slices has a common place at which occlusion is found.
            if place < alpha / PLACES && k + 1 < slices.len() {
                continue;
            }
            let group = &slices[first..=k];
            let along_mm = group.iter().map(|slice| slice.weight * slice.along_mm).sum::<f64>() / place;
            let ambient = self.occlusion.at(origin + along_mm * direction);
            for slice in group {
                pixel.lit += slice.weight * slice.lit(1.0);
                pixel.occluded += slice.weight * slice.color * ambient;
                pixel.lit_occluded += slice.weight * slice.lit(ambient);
                pixel.facing += slice.weight * slice.facing.unwrap_or(1.0);
            }
            (place, first) = (0.0, k + 1);
        }
        pixel.alpha = alpha;
        pixel.facing /= alpha.max(f64::MIN_POSITIVE);
        pixel
    }

    /// The parts of a ray that are seen, front to back.
    fn slices(&self, origin: DVec3, direction: DVec3) -> Vec<Slice> {
        let field = self.field;
        let voxel = field.voxel_mm;
        let at = |along: f64| origin + along * direction;
        let Some((begin, end)) = self.in_grid(origin, direction) else { return Vec::new() };
        let mut slices = Vec::new();
        let (mut along, mut transmittance) = (begin, 1.0);
        // Step that the change of opacity last allowed.
        let mut fit = STEP * voxel;
        // Normal of the cut that the ray has just left.
        let mut cut_normal = None;
        while along < end && transmittance > DARK {
            let p = at(along);
            let from_cut = field.distance_from_cuts(p);
            if from_cut < 0.0 {
                along += (-from_cut).max(LEAST_WAY * voxel);
                cut_normal = self.nearest_cut_normal(p);
                continue;
            }
            let clear = field.clear_way_mm(p);
            if clear > 0.0 {
                // Nothing is seen on the way, cut or not.
                along += clear.max(LEAST_WAY * voxel);
                cut_normal = None;
                continue;
            }
            let opacity = field.opacity(p);
            let most = (STEP * voxel * self.coarseness).min(from_cut.max(LEAST_WAY * voxel)).min(end - along);
            let mut step = (2.0 * fit).min(most);
            let is_coarse = |step: f64| {
                let next = field.opacity(at(along + step));
                let change = (next - opacity).abs().max(opacity_of(next.max(opacity), step / voxel));
                change > LARGEST_CHANGE * self.coarseness
            };
            while step > LEAST_STEP * voxel && is_coarse(step) {
                step *= 0.5;
            }
            fit = step;
            let middle = along + 0.5 * step;
            let (color, opacity) = field.classify(field.value(at(middle)));
            let weight = transmittance * opacity_of(opacity, step / voxel);
            if weight > 0.0 {
                let normal = cut_normal.or_else(|| field.normal(at(middle)));
                let facing = normal.map(|normal| normal.dot(direction).abs());
                slices.push(Slice { along_mm: middle, weight, color, facing });
                transmittance -= weight;
            }
            cut_normal = None;
            along += step;
        }
        slices
    }

    /// Part of a ray in the grid, mm.
    fn in_grid(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        let half = self.field.half_extent_mm();
        let (a, b) = ((-half - origin) / direction, (half - origin) / direction);
        let (begin, end) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        (begin < end).then_some((begin, end))
    }

    /// Normal of the cut whose surface is nearest.
    fn nearest_cut_normal(&self, p: DVec3) -> Option<DVec3> {
        let cuts = self.field.cuts.iter();
        let nearest = cuts.min_by(|a, b| a.distance(p).total_cmp(&b.distance(p)))?;
        Some(nearest.normal(p))
    }
}
