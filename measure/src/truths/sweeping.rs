//! Monte Carlo of occlusion sweeping's own definition (Singh, Yuksel, House 2009, equation 2; figures 3 and 4): the
//! cosine-weighted share of the hemisphere from which no ray meets the isosurface again.

use bevy::math::DVec3;
use bevy_contextual_ao::occlusion::fibonacci_direction;

use super::field::{Eye, Field, spiral};

/// Rays from each point: an error of 0.02 where half of them are open, were they random.
const RAYS: u32 = 512;
/// Distance of samples along rays, voxels. The first is a voxel away from the point.
const STEP: f64 = 0.5;

/// Share of the light that reaches what is seen in a direction; `None` where no surface is seen. Without the geometry
/// term, rays go in all directions with the same weight.
pub fn light_at(field: &Field, isovalue: f64, eye: &Eye, direction: DVec3, has_term: bool) -> Option<f64> {
    let hit = hit(field, isovalue, eye.origin, direction)?;
    let normal = field.outwards(hit);
    let start = hit + field.voxel_mm * normal;
    let open = (0..RAYS).filter(|&k| {
        let ray = if has_term { around(normal, k) } else { fibonacci_direction(k, RAYS) };
        is_open(field, isovalue, start, ray)
    });
    Some(open.count() as f64 / f64::from(RAYS))
}

/// Share of the cosine-weighted light from a cone that reaches what is seen in a direction. The cone's solid angle is an
/// octant's, whose middle is the light (section 4.1).
pub fn light_from(field: &Field, isovalue: f64, eye: &Eye, direction: DVec3, light: DVec3) -> Option<f64> {
    let hit = hit(field, isovalue, eye.origin, direction)?;
    let normal = field.outwards(hit);
    let start = hit + field.voxel_mm * normal;
    let sum: f64 = (0..RAYS)
        .map(|k| {
            // An octant is an eighth of the directions: cosines from 3/4 to 1.
            let ray = spiral(light, k, 1.0 - 0.25 * (f64::from(k) + 0.5) / f64::from(RAYS));
            let cosine = normal.dot(ray).max(0.0);
            if cosine > 0.0 && is_open(field, isovalue, start, ray) { cosine } else { 0.0 }
        })
        .sum();
    // Over the octant, as a share of the cosine's integral over a hemisphere.
    Some(0.5 * sum / f64::from(RAYS))
}

/// First point of a ray on the surface.
fn hit(field: &Field, isovalue: f64, origin: DVec3, direction: DVec3) -> Option<DVec3> {
    let [mut along, end] = field.bounds(origin, direction);
    let step = STEP * field.voxel_mm;
    while along < end && field.at(origin + along * direction) < isovalue {
        along += step;
    }
    if along >= end {
        return None;
    }
    let (mut outside, mut inside) = (along - step, along);
    for _ in 0..12 {
        let middle = 0.5 * (outside + inside);
        if field.at(origin + middle * direction) < isovalue { outside = middle } else { inside = middle }
    }
    Some(origin + inside * direction)
}

fn is_open(field: &Field, isovalue: f64, start: DVec3, ray: DVec3) -> bool {
    let step = STEP * field.voxel_mm * ray;
    let mut p = start;
    while field.contains(p) {
        if field.at(p) >= isovalue {
            return false;
        }
        p += step;
    }
    true
}

/// Direction `k` of [`RAYS`], as dense as the cosine to the normal (Malley).
fn around(normal: DVec3, k: u32) -> DVec3 {
    let squared = (f64::from(k) + 0.5) / f64::from(RAYS);
    spiral(normal, k, (1.0 - squared).sqrt())
}
