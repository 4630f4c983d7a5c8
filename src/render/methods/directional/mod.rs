//! Directional occlusion shading. Every view that shows a volume with this method has passes that draw the volume in place
//! of slices along view rays.
//!
//! `slicing` (places of the slices) → `views` (volumes of each view, with bind groups) → `slices` (the pass over
//! every slice) → `composite` (over the image drawn so far).

mod buffers;
mod composite;
mod slices;
mod slicing;
mod views;

use bevy::{
    asset::embedded_asset,
    core_pipeline::{
        Core3d, Core3dSystems,
        core_3d::{main_opaque_pass_3d, main_transparent_pass_3d},
    },
    pbr::main_transmissive_pass_3d,
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems, init_gpu_resource,
        render_resource::{PipelineCache, SpecializedRenderPipelines},
    },
};

#[cfg(test)]
pub(in crate::render) use buffers::TILE;
#[cfg(test)]
pub(in crate::render) use slicing::SlicingData;

use super::pipelines::{AskForPipelines, MethodPipelines, ViewPipelines, ask};
use crate::{
    occlusion::{DirectionalOcclusion, MethodSettings},
    render::gpu::{device::DeviceSupport, formats::Formats, frame::are_timed_by_clock},
};
use composite::CompositePipelines;
use slices::DirectionalPasses;

/// Adds the passes to the render world.
pub(in crate::render) struct DirectionalOcclusionPlugin;

impl Plugin for DirectionalOcclusionPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "slices.wgsl");
        embedded_asset!(app, "composite.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_gpu_resource::<views::DirectionalViews>()
            .init_gpu_resource::<views::DirectionalUniforms>()
            .init_gpu_resource::<buffers::DirectionalBuffers>()
            .init_gpu_resource::<SpecializedRenderPipelines<composite::CompositePipeline>>()
            .add_systems(AskForPipelines, ask_for_pipelines.before(ask))
            .add_systems(
                RenderStartup,
                (init_gpu_resource::<DirectionalPasses>, init_gpu_resource::<composite::CompositePipeline>)
                    .after(init_gpu_resource::<Formats>)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Render,
                views::prepare_views
                    .in_set(RenderSystems::PrepareBindGroups)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Core3d,
                // Passes timed by the clock are submitted at once. Their inputs must be submitted before.
                (ApplyDeferred.run_if(are_timed_by_clock), views::shade_views)
                    .chain()
                    .in_set(Core3dSystems::MainPass)
                    .after(main_opaque_pass_3d)
                    .after(main_transmissive_pass_3d)
                    .before(main_transparent_pass_3d)
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}

fn ask_for_pipelines(
    passes: Res<DirectionalPasses>,
    mut composite: CompositePipelines,
    cache: Res<PipelineCache>,
    wanted: Res<MethodPipelines>,
    mut pipelines: ResMut<ViewPipelines>,
) {
    let name = DirectionalOcclusion::default().name();
    if wanted.wants(name) {
        pipelines.tell(name, passes.is_ready(&cache) & composite.are_ready(&cache));
    }
}
