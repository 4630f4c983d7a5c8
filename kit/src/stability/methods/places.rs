//! Figures of a method on simple shapes. They show differences between views and grids, uneven shadows, bright edges,
//! thin walls, densities of several modes.

use crate::mode::ShadingMode;
use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::{occlusion::OcclusionFiltering, prelude::*, render::VolumeTexture};
use std::f64::consts::TAU;

use super::super::super::{
    headless::voxel_at,
    random::Random,
    small_scene::{TestScene, volume_from},
};
use super::floor::{FLOOR, Floor, cuboid, floor_points, nothing, post, rms};

/// RMS difference between two eyes at the same points of a floor, under a block.
pub fn eyes(occlusion: &AmbientOcclusion) -> f64 {
    let block = |p| cuboid(p, DVec3::new(0.0, 0.0, 0.0), DVec3::splat(4.0));
    let mut floor = Floor::new(occlusion, &block, 0.0);
    // The point where a view ray meets the floor depends on the ray's samples.
    floor.set_view_step(0.05);
    // Both eyes see these points. The block hides points nearer to the middle.
    let points = floor_points(7.0, 13.0);
    let views = [-3.0, 3.0].map(|degrees| {
        floor.look_tilted(degrees);
        floor.frame();
        floor.frame().at_all(&points)
    });
    rms(&views[0], &views[1])
}

/// Standard deviation of the floor's shading at a distance of 7 mm from a round post.
pub fn unevenness(occlusion: &AmbientOcclusion) -> f64 {
    let mut floor = Floor::new(occlusion, &|p| post(p, 3.0, 10.0), 0.0);
    let shown = floor.shown();
    let around = (0..64).map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / 64.0).sin_cos();
        shown.at(DVec3::new(10.0 * cos, 10.0 * sin, FLOOR))
    });
    let around: Vec<_> = around.collect();
    let mean = around.iter().sum::<f64>() / around.len() as f64;
    rms(&around, &vec![mean; around.len()])
}

/// Brightness of a cube's upper face at its edges, minus that in its middle.
pub fn edges(occlusion: &AmbientOcclusion) -> f64 {
    let mut floor =
        Floor::new(occlusion, &|p| cuboid(p, DVec3::new(0.0, 0.0, 0.0), DVec3::new(9.0, 9.0, 6.0)), 0.0);
    let shown = floor.shown();
    let mean = |points: Vec<DVec3>| shown.at_all(&points).iter().sum::<f64>() / points.len() as f64;
    let along = || (-4..=4).map(f64::from);
    let edges = along().flat_map(|t| [(t, 8.0), (t, -8.0), (8.0, t), (-8.0, t)]);
    let face = along().flat_map(|x| along().map(move |y| (0.5 * x, 0.5 * y)));
    let top = |(x, y)| DVec3::new(x, y, 6.0);
    mean(edges.map(top).collect()) - mean(face.map(top).collect())
}

/// RMS difference between a scene and the same scene in a grid turned about the vertical.
pub fn turned(occlusion: &AmbientOcclusion) -> f64 {
    let things = |p: DVec3| post(p, 4.0, 6.0).min(cuboid(p, DVec3::new(10.0, 2.0, -3.0), DVec3::splat(3.0)));
    let points = floor_points(5.0, 15.0);
    let shown = [0.0, 45.0].map(|degrees| Floor::new(occlusion, &things, degrees).shown().at_all(&points));
    rms(&shown[0], &shown[1])
}

/// Shadow at the foot of a wall one voxel thin, over the shadow of a thick wall. Both have a face at the same place.
pub fn thin(occlusion: &AmbientOcclusion) -> f64 {
    let wall = |from: f64| {
        move |p| {
            let (center, half) = (0.5 * (from + 0.5), 0.5 * (0.5 - from));
            cuboid(p, DVec3::new(center, 0.0, -1.0), DVec3::new(half, 12.0, 5.0))
        }
    };
    let points: Vec<_> = (-6..=6).map(|y| DVec3::new(3.0, f64::from(y), FLOOR)).collect();
    let mean = |solid: &dyn Fn(DVec3) -> f64| {
        let shown = Floor::new(occlusion, solid, 0.0).shown().at_all(&points);
        shown.iter().sum::<f64>() / shown.len() as f64
    };
    let bare = mean(&nothing);
    (bare - mean(&wall(-0.5))) / (bare - mean(&wall(-8.0)))
}

/// RMS error of a method that counts denser voxels, against their exact share. The figures are for densities of one
/// mode, and of three modes far apart. `None` for other methods.
pub fn modes(occlusion: &AmbientOcclusion) -> Option<[f64; 2]> {
    let OcclusionMethod::Filtering(filtering) = occlusion.method else {
        return None;
    };
    const RADIUS: i64 = 3;
    let filtering = OcclusionFiltering { radius_mm: Some(RADIUS as f32), ..filtering };
    let size = UVec3::splat(16);
    let errors = [1, 3].map(|modes| {
        let mut random = Random(7);
        let densities: Vec<f64> = (0..size.element_product())
            .map(|_| match modes {
                // The mean of four uniform values has a single mode.
                1 => (0..4).map(|_| f64::from(random.share())).sum::<f64>() / 4.0,
                _ => [0.1, 0.2, 0.9][random.below(3)] + 0.05 * f64::from(random.share()),
            })
            .collect();
        let index = |p: DVec3| ((p + 1.0) / 2.0 * size.as_dvec3()).as_uvec3();
        let volume = volume_from(size, DVec3::ONE, |p| densities[flat(index(p), size)]);
        let ramp = TransferFunction::ramp(0.0, 255.0, 1.0, [1.0; 3]).expect("a valid ramp");
        let settings = AmbientOcclusion::by(filtering);
        let mut scene = TestScene::new(volume, ramp, settings, ShadingMode::Cao);
        scene.settle();
        let opacities = scene.opacities();
        let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
        let exact: Vec<f64> =
            (0..found.len()).map(|voxel| share_not_denser(&opacities, voxel, size, RADIUS)).collect();
        let found: Vec<f64> = found.iter().map(|byte| f64::from(*byte) / 255.0).collect();
        rms(&found, &exact)
    });
    Some(errors)
}

fn flat(voxel: UVec3, size: UVec3) -> usize {
    ((voxel.z * size.y + voxel.y) * size.x + voxel.x) as usize
}

/// Share of the voxels in a box around `voxel` that are not denser. Voxels beyond the grid are empty.
fn share_not_denser(opacities: &[u8], voxel: usize, size: UVec3, radius: i64) -> f64 {
    let (here, at) = (opacities[voxel], voxel_at(voxel as u32, size).as_i64vec3());
    let sides = || -radius..=radius;
    let around = sides().flat_map(|z| sides().flat_map(move |y| sides().map(move |x| [x, y, z])));
    let is_denser = |offset: [i64; 3]| {
        let p = at + bevy::math::I64Vec3::from_array(offset);
        let is_inside = p.min_element() >= 0 && p.cmplt(size.as_i64vec3()).all();
        is_inside && opacities[flat(p.as_uvec3(), size)] > here
    };
    let denser = around.filter(|offset| is_denser(*offset)).count();
    1.0 - denser as f64 / (2 * radius + 1).pow(3) as f64
}
