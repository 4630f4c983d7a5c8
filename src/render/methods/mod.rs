//! Step V of the CAO paper: the occlusion, by the paper's rays or by another method. A folder holds a whole method
//! except for its settings, which are in `occlusion`. No other folder names a method.
//!
//! There are two kinds of methods. Methods of voxels implement `VoxelMethod`, and the core runs them. Methods of views
//! add their passes to the schedule of a view.

#[cfg(feature = "other_methods")]
mod directional;
#[cfg(feature = "other_methods")]
mod filtering;
pub(super) mod pipelines;
mod rays;
pub(super) mod registry;
#[cfg(feature = "other_methods")]
mod screen_space;
#[cfg(feature = "other_methods")]
mod summed_area;
#[cfg(feature = "other_methods")]
mod sweeping;
pub(super) mod voxel_method;

use bevy::{prelude::*, shader::load_shader_library};

/// All methods of this crate. A new method adds a line.
pub(super) struct MethodPlugins;

impl Plugin for MethodPlugins {
    fn build(&self, app: &mut App) {
        // Drawing is always compiled with these libraries, whatever is drawn.
        load_shader_library!(app, "sweeping/octants.wgsl");
        load_shader_library!(app, "sweeping/surface_ray.wgsl");
        app.add_plugins(rays::RaysPlugin);
        #[cfg(feature = "other_methods")]
        app.add_plugins((
            sweeping::SweepingPlugin,
            filtering::FilteringPlugin,
            summed_area::SummedAreaPlugin,
            screen_space::ScreenSpacePlugin,
            directional::DirectionalOcclusionPlugin,
        ));
    }
}

#[cfg(all(test, feature = "other_methods"))]
pub(super) use {
    directional::{SlicingData, TILE as SLICE_TILE},
    filtering::FilteringData,
    rays::kept::{Part, RayPassUniform},
    screen_space::uniform::{KernelUniform, ScreenSpaceUniform},
    summed_area::Shell,
    sweeping::{SIDE, SweepPlane, resources::SweepingUniform},
};
