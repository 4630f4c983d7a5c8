//! The passes, in the render world. This file only wires them up:
//!
//! main world → `extract` → `carvers`, `volumes` (what stays on the device) → `plan` (what this frame needs) →
//! `encode` (the passes, in order).
//!
//! Folders by the steps of the paper, each with its shaders: `carvers` (II and III), `clipping` (IV), `methods` (V; `rays`
//! is the paper's). `views` is what passes share with drawing (VI, `material`), `gpu` what passes are made of.

#[cfg(test)]
mod agreement;
mod carvers;
mod clipping;
mod encode;
mod extract;
mod frame;
mod gpu;
mod method_pipelines;
mod methods;
mod passes;
mod plan;
mod views;
pub(crate) mod volumes;

use bevy::{
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems,
        extract_resource::ExtractResourcePlugin,
        init_gpu_resource,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

use crate::diagnostics::{ReportChannel, SweepDistancesAlone};

pub(crate) use carvers::clip_maps::ClipMaps;
pub(crate) use gpu::formats::Formats;
pub(crate) use method_pipelines::{CompilesInBackground, MethodPipelines};
pub(crate) use methods::fit_occlusion::fit_occlusion;
pub(crate) use methods::sweeping::draws_isosurface;
pub(crate) use volumes::occlusion_texels::OcclusionTexels;
pub use volumes::volume_store::{VolumeStore, VolumeTexture, VoxelMask};

/// Where, in the render world, what stays on the device is made: whatever binds it comes after.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct VolumeResourceSystems;

/// Stands in both worlds where the device has what the passes need.
#[derive(Resource)]
pub(crate) struct DeviceSupport;

/// Adds the passes to the render world.
pub(crate) struct OcclusionRenderPlugin;

impl Plugin for OcclusionRenderPlugin {
    fn build(&self, app: &mut App) {
        volumes::add_shaders(app);
        carvers::add_shaders(app);
        clipping::add_shaders(app);
        views::add_shaders(app);
        methods::add_shaders(app);
        app.add_plugins((
            ExtractResourcePlugin::<SweepDistancesAlone>::default(),
            methods::screen_space::ScreenSpacePlugin,
            methods::direct::DirectOcclusionPlugin,
        ));
        let report = app.world().resource::<ReportChannel>().clone();
        let pipelines = MethodPipelines::default();
        let in_background = CompilesInBackground::of(app);
        app.insert_resource(in_background).insert_resource(pipelines.clone());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .insert_resource(report)
            .insert_resource(pipelines)
            .init_resource::<extract::ExtractedScene>()
            .init_gpu_resource::<ClipMaps>()
            .init_gpu_resource::<VolumeStore>()
            .init_gpu_resource::<plan::FramePlan>()
            .init_gpu_resource::<SpecializedRenderPipelines<carvers::clip_draw::ClipDrawPipeline>>()
            .init_gpu_resource::<Formats>()
            .add_systems(
                RenderStartup,
                (
                    init_gpu_resource::<carvers::clip_draw::ClipDrawPipeline>,
                    init_gpu_resource::<carvers::count_surfaces::CountPass>,
                    init_gpu_resource::<carvers::peel::PeelPasses>,
                    init_gpu_resource::<carvers::dilate::DilatePasses>,
                    init_gpu_resource::<clipping::ranges::RangesPass>,
                    init_gpu_resource::<clipping::cull::CullPass>,
                    init_gpu_resource::<clipping::clip::ClipPasses>,
                    init_gpu_resource::<clipping::distances::DistancePasses>,
                    init_gpu_resource::<methods::filtering::FilteringPasses>,
                    init_gpu_resource::<methods::rays::mark::MarkPass>,
                    init_gpu_resource::<methods::rays::ray_cast::RayCastPasses>,
                    init_gpu_resource::<methods::sweeping::SweepPasses>,
                )
                    .after(init_gpu_resource::<Formats>)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(RenderStartup, gpu::device_loss::forget_lost_bind_groups)
            .add_systems(ExtractSchedule, extract::extract_scene)
            .add_systems(
                Render,
                (
                    volumes::volume_store::prepare_resources
                        .in_set(RenderSystems::PrepareAssets)
                        .in_set(VolumeResourceSystems),
                    (method_pipelines::find_ready, plan::plan_views, plan::plan_carvers, plan::plan_volumes)
                        .chain()
                        .in_set(RenderSystems::PrepareResources),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                RenderGraph,
                (
                    encode::encode_passes.in_set(RenderGraphSystems::Render).before(camera_driver),
                    carvers::count_surfaces::request_counts.in_set(RenderGraphSystems::Finish),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}
