//! Frames of a setting whose errors are taken: occlusion of voxels, and image.

use bevy::prelude::*;
use bevy_contextual_ao::{
    prelude::*,
    render::{VolumeTexture, VoxelMask},
};
use contextual_ao_kit::{headless::voxel_at, mode::ShadingMode};

use crate::stage::Stage;

/// Number of frames whose errors are taken. Each follows a step of the carver, whose last step leads to its start.
/// Only settings that lag behind differ from frame to frame.
pub const STEPS: u32 = 2;

/// Result of a setting in a frame.
pub struct Shot {
    /// Occlusion as drawn, of the voxels that the image reads. Empty for methods without voxels.
    pub occlusion: Vec<Option<f32>>,
    pub image: Vec<u8>,
}

/// Renders the frames after steps of the carver, each from the state before. The last frame comes first. The carver has
/// been moving to and fro for a number of frames before.
pub fn shots(stage: &mut Stage, occlusion: &AmbientOcclusion, moving: u32) -> Result<Vec<Shot>, String> {
    stage.carve(STEPS + moving);
    stage.prepare_with(ShadingMode::Cao, occlusion.clone())?;
    for step in (STEPS..STEPS + moving).rev() {
        stage.carve(step);
        stage.headless.frame();
    }
    let mut shots = Vec::new();
    for step in (0..STEPS).rev() {
        shots.insert(0, step_shot(stage, step));
    }
    Ok(shots)
}

/// Pixels that show the object in the frames of the steps: those that differ from the background.
pub fn objects(stage: &mut Stage) -> Result<Vec<Vec<bool>>, String> {
    let occlusion = stage.occlusion();
    stage.prepare_with(ShadingMode::Solid, occlusion)?;
    let mut object = |step| {
        stage.carve(step);
        let image = stage.image();
        let background = &image[..4];
        image.chunks(4).map(|pixel| pixel != background).collect()
    };
    Ok((0..STEPS).map(&mut object).collect())
}

/// Renders the frame in which the carver takes a step.
pub fn step_shot(stage: &mut Stage, step: u32) -> Shot {
    stage.carve(step);
    stage.headless.frame();
    Shot::take(stage)
}

/// Renders one frame, for which everything is computed.
pub fn shot(stage: &mut Stage, occlusion: &AmbientOcclusion) -> Result<Shot, String> {
    stage.prepare_with(ShadingMode::Cao, occlusion.clone())?;
    Ok(Shot::take(stage))
}

impl Shot {
    /// Takes the shot of the last frame.
    pub fn take(stage: &Stage) -> Self {
        let (headless, volume) = (&stage.headless, stage.scene.volume);
        let method = stage.occlusion().method;
        let image = headless.image();
        if !method.kind().is_of_voxels() {
            return Self { occlusion: Vec::new(), image };
        }
        let texels = headless.voxels(volume, VolumeTexture::Occlusion);
        let rays = method.rays();
        let valid = if rays.is_some() {
            headless.mask(volume, VoxelMask::Valid)
        } else {
            vec![true; stage.scene.voxels as usize]
        };
        let dimensions = stage.scene.geometry.dimensions;
        let occlusion = if rays.is_some_and(|rays| rays.resolution == OcclusionResolution::Half) {
            (0..dimensions.element_product())
                .map(|index| half_at(voxel_at(index, dimensions), dimensions, &texels, &valid))
                .collect()
        } else {
            let values = texels.iter().zip(valid);
            values.map(|(&value, valid)| valid.then_some(f32::from(value) / 255.0)).collect()
        };
        Self { occlusion, image }
    }
}

/// Occlusion at a voxel's centre, drawn from texels of 2x2x2 voxels. `None` if one of the texels is not valid; the
/// mask has the texel's validity at its first voxel.
fn half_at(voxel: UVec3, dimensions: UVec3, texels: &[u8], valid: &[bool]) -> Option<f32> {
    let size = dimensions.map(|voxels| voxels.div_ceil(2));
    let near = voxel / 2;
    // The next texel lies on the side on which the voxel is in its own texel. At the edge it is the same texel.
    let side = (voxel % 2).as_ivec3() * 2 - 1;
    let next = (near.as_ivec3() + side).clamp(IVec3::ZERO, size.as_ivec3() - 1).as_uvec3();
    let index = |at: UVec3, size: UVec3| ((at.z * size.y + at.y) * size.x + at.x) as usize;
    (0..8).try_fold(0.0, |sum, k| {
        let is_next = BVec3::new(k & 1 == 1, k & 2 == 2, k & 4 == 4);
        let texel = UVec3::select(is_next, next, near);
        let weight = Vec3::select(is_next, Vec3::splat(0.25), Vec3::splat(0.75)).element_product();
        let value = f32::from(texels[index(texel, size)]) / 255.0;
        valid[index(2 * texel, dimensions)].then_some(sum + weight * value)
    })
}
