//! Fast occlusion sweeping (Singh, Yuksel, House 2009): light goes from voxel to voxel through the whole volume,
//! in a sweep for each octant of directions, and a distance field is found by the way.
//!
//! A sweep goes over tiles of 8x8x8 voxels. Those in a plane across the sweep's diagonal do not depend on each
//! other: they are one dispatch, and the planes follow one another.

mod geometry_term;
mod passes;
mod planes;
mod resources;

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

pub(crate) use geometry_term::{TABLE_ROWS, geometry_term_table};
pub(crate) use passes::{SweepJob, SweepPasses};
pub(crate) use resources::{SweepResources, draws_isosurface, method_bytes};
#[cfg(test)]
pub(crate) use {
    geometry_term::SIDE,
    planes::{SweepPlane, TILE},
    resources::SweepingUniform,
};

/// Makes the shaders known.
pub(in crate::render) fn add_shaders(app: &mut App) {
    load_shader_library!(app, "sweeping.wgsl");
    embedded_asset!(app, "isosurface.wgsl");
    embedded_asset!(app, "sweep.wgsl");
    embedded_asset!(app, "collect.wgsl");
    embedded_asset!(app, "surface.wgsl");
}
