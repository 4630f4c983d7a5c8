//! Shadows that volumes cast, in the shadow maps that Bevy keeps of meshes. So all that receives the shadows of meshes receives
//! those of volumes: meshes, other volumes, and the volume itself.
//!
//! Bevy clears its maps in every frame. `depths` follows the rays of a light once it or the volume changed, and keeps where
//! they are stopped; `maps` puts that into the maps.

mod depths;
mod maps;

use bevy::{
    asset::embedded_asset,
    core_pipeline::{Core3d, Core3dSystems, schedule::camera_driver},
    pbr::{LATE_SHADOW_PASS, per_view_shadow_pass, shared_shadow_pass},
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems, init_gpu_resource,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

use crate::render::{DeviceSupport, OcclusionRenderSystems};

/// Draws the shadows of volumes.
pub(super) struct VolumeShadowPlugin;

impl Plugin for VolumeShadowPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "depths.wgsl");
        embedded_asset!(app, "maps.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_gpu_resource::<depths::Shadows>()
            .init_gpu_resource::<SpecializedRenderPipelines<depths::ShadowPipeline>>()
            .add_systems(
                RenderStartup,
                (init_gpu_resource::<depths::ShadowPipeline>, init_gpu_resource::<maps::ShadowMapPipeline>)
                    .chain()
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Render,
                depths::prepare_shadows
                    .in_set(RenderSystems::PrepareBindGroups)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                RenderGraph,
                depths::find_depths
                    .in_set(RenderGraphSystems::Render)
                    .after(OcclusionRenderSystems::Encode)
                    .before(camera_driver)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Core3d,
                maps::draw_shadows
                    .after(per_view_shadow_pass::<LATE_SHADOW_PASS>)
                    .after(shared_shadow_pass::<LATE_SHADOW_PASS>)
                    .before(Core3dSystems::MainPass)
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}
