//! Gizmos: boxes of volumes, clip cameras, reaches of carvers and listed bricks, drawn by Bevy's gizmos.
//!
//! [`VolumeGizmoConfigGroup`] says what is drawn, and in which colours. Its store is Bevy's
//! [`GizmoConfigStore`]. [`ShowVolumeGizmos`] asks for the gizmos of one entity.
//! They need Bevy's `GizmoPlugin`, as with `DefaultPlugins`, and its feature `bevy_gizmos_render` to be seen.

mod boxes;
mod config;
mod listed_bricks;

use bevy::{
    gizmos::GizmoPlugin,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, RenderApp,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

use crate::{
    clip::ClipSystems,
    render::{DeviceSupport, OcclusionRenderSystems},
    volume::VolumeSystems,
};

pub use config::{ShowVolumeGizmos, VolumeGizmoConfigGroup};
pub use listed_bricks::ListedBricks;

/// Draws the gizmos, and has the lists of bricks read back while their gizmos are shown.
pub(crate) struct VolumeGizmoPlugin;

impl Plugin for VolumeGizmoPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<GizmoPlugin>() {
            return;
        }
        let arrived = listed_bricks::Arrived::default();
        app.init_gizmo_group::<VolumeGizmoConfigGroup>()
            .register_type::<VolumeGizmoConfigGroup>()
            .register_type::<ShowVolumeGizmos>()
            .insert_resource(arrived.clone())
            .add_systems(
                PostUpdate,
                (
                    (listed_bricks::ask, listed_bricks::receive, boxes::draw_volumes).chain(),
                    boxes::draw_carvers,
                )
                    .after(TransformSystems::Propagate)
                    .after(ClipSystems::Cameras)
                    .after(VolumeSystems::Bake)
                    .run_if(config::is_enabled.or_else(any_with_component::<ListedBricks>)),
            );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .insert_resource(arrived)
            .init_gpu_resource::<listed_bricks::Readbacks>()
            .add_systems(ExtractSchedule, listed_bricks::extract)
            .add_systems(
                RenderGraph,
                (
                    // The list stays until the next frame's passes.
                    listed_bricks::copy
                        .in_set(RenderGraphSystems::Render)
                        .after(OcclusionRenderSystems::Encode),
                    listed_bricks::request.in_set(RenderGraphSystems::Finish),
                )
                    .run_if(resource_exists::<DeviceSupport>.and_then(listed_bricks::any_asked_for)),
            );
    }
}
