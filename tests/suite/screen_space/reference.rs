//! The kernel of screen-space occlusion, evaluated on boxes that rays hit.

use bevy::{
    math::{DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{occlusion::ScreenSpaceOcclusion, volume::WORLD_UNITS_PER_MM};

use crate::scene::IMAGE;

/// A box by its lowest and highest corner, mm from the volume's centre.
pub type Block = [DVec3; 2];

/// Place from which the step is seen, mm.
pub const EYE: DVec3 = DVec3::new(10.0, 6.0, 34.0);

/// A camera at a place, which looks at the volume's centre.
pub fn looking_from(eye_mm: DVec3) -> Transform {
    Transform::from_translation(eye_mm.as_vec3() * WORLD_UNITS_PER_MM).looking_at(Vec3::ZERO, Vec3::Y)
}

/// Projection of a view.
#[derive(Clone, Copy)]
pub enum Lens {
    /// Half the height of the image one unit in front of the camera.
    Perspective(f64),
    /// Half the height of the image, mm.
    Orthographic(f64),
}

/// The default of `PerspectiveProjection`.
impl Default for Lens {
    fn default() -> Self {
        Self::Perspective((core::f64::consts::FRAC_PI_4 * 0.5).tan())
    }
}

/// Evaluation of the view from `EYE`.
pub struct Reference<'a> {
    pub blocks: &'a [Block],
    pub lens: Lens,
    pub settings: ScreenSpaceOcclusion,
}

/// Surface point that a pixel shows, in view space (mm).
#[derive(Clone, Copy)]
pub struct Hit {
    point: DVec3,
    normal: DVec3,
}

impl Reference<'_> {
    /// Ray parameter at which a ray enters the first block, and the normal there.
    fn first_hit(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let hits = self.blocks.iter().filter_map(|[low, high]| {
            let (a, b) = ((*low - origin) / direction, (*high - origin) / direction);
            let (entries, exits) = (a.min(b), a.max(b));
            let entry = entries.max_element();
            let normal = DVec3::select(entries.cmpge(DVec3::splat(entry)), -direction.signum(), DVec3::ZERO);
            (entry < exits.min_element() && entry > 0.0).then_some((entry, normal))
        });
        hits.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Points that the pixels show, and whether each lies on a face, away from edges and creases. A volume of voxels
    /// is round at edges and creases.
    pub fn hits(&self) -> Vec<Option<(Hit, bool)>> {
        let turn = looking_from(EYE).rotation.as_dquat();
        let pixels = (0..IMAGE.y).flat_map(|y| (0..IMAGE.x).map(move |x| UVec2::new(x, y)));
        let hit = |pixel: UVec2| {
            let place =
                (pixel.as_dvec2() + 0.5) / IMAGE.as_dvec2() * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
            let (origin, direction) = match self.lens {
                Lens::Perspective(half) => (EYE, turn * (place * half).extend(-1.0)),
                Lens::Orthographic(half) => (EYE + turn * (place * half).extend(0.0), turn * DVec3::NEG_Z),
            };
            let (t, normal) = self.first_hit(origin, direction)?;
            let local = origin + t * direction;
            let is_near = |plane: f64, at: f64| (plane - at).abs() < 2.0;
            let near_axis =
                |axis: usize| self.blocks.iter().flatten().any(|corner| is_near(corner[axis], local[axis]));
            let is_on_face = (0..3).filter(|&axis| near_axis(axis)).count() == 1;
            let view = turn.inverse();
            Some((Hit { point: view * (local - EYE), normal: view * normal }, is_on_face))
        };
        pixels.map(hit).collect()
    }

    /// Occlusion factor of a pixel.
    fn factor(&self, hits: &[Option<(Hit, bool)>], kernel: &[Vec3], pixel: UVec2) -> Option<f64> {
        let at = |pixel: UVec2| hits[(pixel.y * IMAGE.x + pixel.x) as usize].map(|(hit, _)| hit);
        let Hit { point: center, normal } = at(pixel)?;
        // Ranks of the 16 angles, in the order of Bayer's matrix.
        const RANKS: [[u32; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
        let rank = RANKS[(pixel.y % 4) as usize][(pixel.x % 4) as usize];
        let (sin, cos) = (f64::from(rank) / 16.0 * core::f64::consts::TAU).sin_cos();
        let towards = DVec3::new(cos, sin, 0.0);
        let tangent = (towards - normal * towards.dot(normal)).normalize();
        let bitangent = normal.cross(tangent);
        let [radius, bias] =
            [self.settings.radius_mm, self.settings.bias_mm].map(|mm| f64::from(mm.expect("set")));
        let hidden = kernel.iter().map(|offset| {
            let offset = radius * offset.as_dvec3();
            let point = center + tangent * offset.x + bitangent * offset.y + normal * offset.z;
            let ndc = match self.lens {
                Lens::Perspective(half) => point.truncate() / (-point.z * half),
                Lens::Orthographic(half) => point.truncate() / half,
            };
            let place = (ndc * DVec2::new(0.5, -0.5) + 0.5) * IMAGE.as_dvec2();
            if place.cmplt(DVec2::ZERO).any() || place.cmpge(IMAGE.as_dvec2()).any() {
                return 0.0;
            }
            let Some(seen) = at(place.as_uvec2()) else { return 0.0 };
            let x = (radius / (seen.point.z - center.z).abs().max(1e-9)).min(1.0);
            if seen.point.z >= point.z + bias { x * x * (3.0 - 2.0 * x) } else { 0.0 }
        });
        Some(1.0 - hidden.sum::<f64>() / kernel.len() as f64)
    }

    /// Compares an image's linear red with the evaluation. Returns the number of compared pixels, and of those that
    /// the step darkens.
    pub fn compare(&self, image: &[f64]) -> (usize, usize) {
        let (hits, kernel) = (self.hits(), self.settings.kernel());
        let (mut compared, mut darkened, mut sum, mut far) = (0, 0, 0.0, 0);
        for index in (0..image.len()).filter(|&index| hits[index].is_some_and(|(_, is_on_face)| is_on_face)) {
            let pixel = UVec2::new(index as u32 % IMAGE.x, index as u32 / IMAGE.x);
            let expected = self.factor(&hits, &kernel, pixel).expect("it shows something");
            let difference = (image[index] - expected).abs();
            compared += 1;
            darkened += usize::from(expected < 0.9);
            sum += difference;
            far += usize::from(difference > 3.5 / 64.0);
        }
        let mean = sum / compared as f64;
        println!("{compared} pixels, {darkened} dark: mean difference {mean:.5}, {far} far off");
        // The surface lies within a tenth of a voxel of the blocks' faces, and is round at their edges. Of 64 points,
        // one or two may be on the other side of the seen surface. These points lie about as deep as the surface.
        // Bytes round by 0.002 (sRGB, of white).
        assert!(mean <= 0.006, "mean difference {mean}");
        assert!(far <= compared / 50, "{far} of {compared} are off by more than 3 points of 64");
        (compared, darkened)
    }
}
