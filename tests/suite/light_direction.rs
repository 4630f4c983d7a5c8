//! Occlusion sweeping with one large light from any direction (Singh et al., section 4.1), by a turned grid.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
    render::VolumeTexture,
    volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::voxel_at,
    scene::{TestScene, folded_volume, is_empty, opaque_ramp, volume_from},
};

/// A settled scene of a volume by sweeping.
fn swept(volume: &Volume, sweeping: OcclusionSweeping, sky: Sky, is_carved: bool) -> TestScene {
    let occlusion = AmbientOcclusion { method: OcclusionMethod::Sweeping(sweeping), sky, ..default() };
    let mut scene = TestScene::new(volume.clone(), opaque_ramp(), occlusion, ShadingMode::Cao);
    if is_carved {
        scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 5.0));
    }
    scene.settle();
    scene
}

/// Occlusion texels of a volume by sweeping, and its picture.
fn texels(volume: &Volume, sweeping: OcclusionSweeping, sky: Sky, is_carved: bool) -> (Vec<u8>, Vec<u8>) {
    let scene = swept(volume, sweeping, sky, is_carved);
    (scene.headless.texels(scene.volume, VolumeTexture::Occlusion), scene.headless.image())
}

#[test]
fn a_light_along_a_diagonal_is_a_sky_of_one_octant() {
    let volume = folded_volume(UVec3::splat(19), DVec3::ONE);
    let opaque = OcclusionSweeping { gamma: 1.0, ..default() };
    let surface = OcclusionSweeping { surface: SweepingSurface::Isovalue(100.5), opacity: 0.8, ..opaque };
    let cosine = OcclusionSweeping { geometry_term: GeometryTerm::Cosine, ..surface };
    for (octant, sweeping) in [(0, opaque), (5, opaque), (6, surface), (3, cosine)] {
        let direction = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 3.0 } else { -3.0 });
        let light = Some(Vec3::from_array(direction));
        let (by_sky, image_by_sky) = texels(&volume, sweeping, Sky::octant(octant), true);
        let (by_light, image) = texels(&volume, OcclusionSweeping { light, ..sweeping }, default(), true);
        assert!(!is_empty(&image));
        // The grid of the light is that of the volume: it differs by the rounding of places between voxels, which adds up
        // over the 57 steps across the grid. The octant's channel may be another, so that images are compared, too.
        if sweeping.geometry_term == GeometryTerm::None {
            let most = by_sky.iter().zip(&by_light).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(most <= Some(1), "octant {octant}: {most:?}");
        }
        let most = image_by_sky.iter().zip(&image).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most <= Some(2), "octant {octant}: {most:?}");
    }
}

/// A floor, and a block above it if wanted, in a grid with one axis upright.
fn floor(has_block: bool) -> Volume {
    volume_from(UVec3::splat(SIDE), DVec3::ONE, |p| {
        let is_block = has_block && (p - BLOCK).abs().max_element() < 0.13;
        f64::from(u8::from(p.z < FLOOR || is_block))
    })
}

const SIDE: u32 = 40;
/// Top of the floor and middle of the block, as shares of half the grid's width from its centre.
const FLOOR: f64 = -0.8;
const BLOCK: DVec3 = DVec3::new(0.05, -0.05, 0.1);

#[test]
fn a_shadow_falls_away_from_the_light() {
    let [empty, with_block] = [false, true].map(floor);
    let geometry = VolumeGeometry::of(&with_block);
    let place = |share: DVec3| {
        let voxel = (share + 1.0) * 0.5 * f64::from(SIDE) - 0.5;
        geometry.local_from_voxel.transform_point3(voxel)
    };
    // The layer of voxels on the floor.
    let layer = ((FLOOR + 1.0) * 0.5 * f64::from(SIDE)).ceil() as u32;
    for surface in [SweepingSurface::Opacity, SweepingSurface::Isovalue(127.5)] {
        let sweeping = |light| OcclusionSweeping { surface, gamma: 1.0, light: Some(light), ..default() };
        let mut scenes = [&empty, &with_block].map(|volume| {
            let occlusion = AmbientOcclusion::by(sweeping(Vec3::Y));
            TestScene::new(volume.clone(), opaque_ramp(), occlusion, ShadingMode::Cao)
        });
        for (tilt, around) in [(0.0f64, 0.0f64), (0.5, 0.3), (0.5, 2.4), (0.5, 4.6)] {
            let direction = DVec3::new(tilt.sin() * around.cos(), tilt.cos(), tilt.sin() * around.sin());
            let [open, shaded] = scenes.each_mut().map(|scene| {
                let volume = scene.volume;
                let occlusion = AmbientOcclusion::by(sweeping(direction.as_vec3()));
                scene.world().entity_mut(volume).insert(occlusion);
                scene.settle();
                scene.headless.voxels(volume, VolumeTexture::Occlusion)
            });
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for index in (0..SIDE * SIDE * SIDE).filter(|index| index / (SIDE * SIDE) == layer) {
                let darker = f64::from(open[index as usize]) - f64::from(shaded[index as usize]);
                let voxel = voxel_at(index, UVec3::splat(SIDE)).as_dvec3();
                sum += darker * geometry.local_from_voxel.transform_point3(voxel);
                total += darker;
            }
            assert!(total > 5000.0, "{direction}: there is no shadow, {total}");
            let center = sum / total;
            let down = place(BLOCK).y - center.y;
            let expected = place(BLOCK) - direction * (down / direction.y);
            // Upright light gives a centre to a fraction of a voxel. The rest is for the part of a tilted light's shadow
            // that misses the floor.
            let allowed = if tilt == 0.0 { 0.3 } else { 1.5 };
            let off = center.distance(expected);
            println!("{surface:?} {direction}: {off:.2} mm off, shadow {total}");
            assert!(off < allowed, "{surface:?} {direction}: at {center}, expected {expected}");
        }
    }
}

#[test]
fn thin_matter_is_brighter_than_thick_when_it_is_lit_from_behind() {
    // Steps of 1 to 6 voxels, seen from the front and lit from behind.
    let steps = volume_from(UVec3::new(36, 24, 12), DVec3::ONE, |p| {
        let step = ((p.x + 1.0) * 3.0).floor() + 1.0;
        f64::from(u8::from(p.z < 0.0 && p.z > -step / 6.0 - 0.01))
    });
    let geometry = VolumeGeometry::of(&steps);
    let behind = (geometry.local_from_voxel.matrix3 * DVec3::NEG_Z).as_vec3();
    let mut before = [-1.0; 5];
    for opacity in [1.0, 0.5, 0.25, 0.1] {
        let sweeping = OcclusionSweeping { opacity, gamma: 1.0, light: Some(behind), ..default() };
        let scene = swept(&steps, sweeping, default(), false);
        let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
        // In the middle of each step but the last, which light passes at the grid's end; in the first layer in front.
        let seen: [f64; 5] = core::array::from_fn(|step| {
            let voxel = UVec3::new(6 * step as u32 + 3, 12, 6);
            f64::from(found[((voxel.z * 24 + voxel.y) * 36 + voxel.x) as usize])
        });
        println!("opacity {opacity}: {seen:?}");
        assert!(
            seen.iter().zip(before).all(|(seen, before)| *seen > before),
            "{opacity}: {seen:?}, {before:?}"
        );
        if opacity < 1.0 {
            assert!(seen.windows(2).all(|pair| pair[0] > pair[1]), "{opacity}: {seen:?}");
        } else {
            // Light comes around the edges, or through a layer that is not quite opaque.
            assert!(seen.iter().all(|seen| *seen < 128.0), "{seen:?}");
        }
        before = seen;
    }
}
