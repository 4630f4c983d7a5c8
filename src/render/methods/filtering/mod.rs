//! Volumetric ambient occlusion by filtering (Ruiz et al. 2010): the occlusion of all voxels from means and
//! extrema of the densities around them, which separable filters find in a time that does not depend on how
//! far around. `steps` says in which order, `passes` runs them, `resources` keeps what they find.

mod passes;
mod resources;
mod steps;

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

pub(crate) use passes::{FilteringJob, FilteringPasses};
#[cfg(test)]
pub(in crate::render) use resources::FilteringData;
pub(crate) use resources::{FilteringResources, method_bytes};

/// Makes the shaders known.
pub(in crate::render) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "voxel_lines.wgsl");
    load_shader_library!(app, "voxel_density.wgsl");
    embedded_asset!(app, "densities.wgsl");
    embedded_asset!(app, "means.wgsl");
    embedded_asset!(app, "extrema.wgsl");
    embedded_asset!(app, "estimate.wgsl");
    embedded_asset!(app, "gradient.wgsl");
}
