//! The passes, in the render world. This file only wires them up:
//!
//! main world → `extract` → `windows` (views of each volume) → `carvers`, `volumes` (resources on the GPU) → `plan`
//! (passes that this frame needs) → `encode` (the passes, in order).
//!
//! Folders follow the steps of the paper, each with its shaders: `carvers` (II and III), `clipping` (IV), `methods` (V;
//! `rays` is the paper's). `views` finds what view rays meet, for drawing (VI, `drawing`) to shade; `gpu` holds the
//! building blocks of passes. Each module imports only from modules before it in this order: `gpu`, `extract`, `windows`, `carvers`,
//! `volumes`, `clipping`, `views`, `methods`, `plan`, `encode`.

#[cfg(all(test, feature = "other_methods"))]
mod agreement;
mod carvers;
mod clipping;
mod encode;
mod extract;
mod gpu;
mod methods;
mod plan;
mod views;
pub(crate) mod volumes;
mod windows;

use bevy::{
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems,
        init_gpu_resource,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

use crate::diagnostics::ReportChannel;
use methods::{
    pipelines::{self, AllAreThere, AskForPipelines, ViewPipelines},
    registry::{self, VoxelMethods},
};

pub(crate) use carvers::{clip_maps::ClipMaps, clip_textures::ClipTextures};
pub(crate) use extract::{ExtractedScene, ExtractedVolume};
pub(crate) use gpu::device::DeviceSupport;
pub(crate) use gpu::formats::Formats;
pub(crate) use gpu::frame::ShadesViews;
pub(crate) use gpu::kept_group::KeptGroup;
#[cfg(feature = "gizmos")]
pub(crate) use gpu::readback::Readback;
pub(crate) use gpu::render_pipelines::variants_are_ready;
pub(crate) use gpu::textures::TextureAndView;
pub(crate) use gpu::uniforms::BuffersOf;
pub use gpu::{
    compute_pass::{ComputePass, Groups, ListEnd, PassDescriptor},
    device::Gpu,
    frame::Frame,
};
pub(crate) use methods::pipelines::{CompilesInBackground, MethodPipelines};
pub use methods::{
    registry::VoxelMethodPlugin,
    voxel_method::{KeptVolume, VolumeFrame, VoxelMethod, factor_format, volume_layout},
};
pub(crate) use views::{
    dispatch::ViewArray,
    runs::{BOX_VERTICES, MarchedViewUniform, OutlinesOfView, RUNS_BINDING, VolumeRuns, pack_pixel},
};
#[cfg(feature = "gizmos")]
pub(crate) use volumes::listed_cast::listed_bricks;
pub(crate) use volumes::{contents::MarchVariant, store::VolumeResources};
pub use volumes::{
    kept::{LatestCast, MethodResources},
    store::{VolumeStore, VolumeTexture, VoxelMask},
};
pub(crate) use windows::{VolumeInView, VolumeWindow, VolumeWindows, shows};

/// System sets of the passes, in the render world.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OcclusionRenderSystems {
    /// In [`Render`]: makes the resources that stay on the GPU. Systems that bind them run after this set.
    Keep,
    /// In [`Render`]: decides which passes this frame needs.
    Plan,
    /// In [`RenderGraph`]: encodes the passes, once for all cameras and before any camera.
    Encode,
}

/// Adds the passes to the render world.
pub(crate) struct OcclusionRenderPlugin;

impl Plugin for OcclusionRenderPlugin {
    fn build(&self, app: &mut App) {
        volumes::add_shaders(app);
        carvers::add_shaders(app);
        clipping::add_shaders(app);
        views::add_shaders(app);
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
            .init_schedule(AskForPipelines)
            .init_resource::<ViewPipelines>()
            .init_resource::<AllAreThere>()
            .init_resource::<extract::ExtractedScene>()
            .init_resource::<gpu::frame::TimesByClock>()
            .init_gpu_resource::<ClipMaps>()
            .init_gpu_resource::<VolumeStore>()
            .init_resource::<windows::VolumeWindows>()
            .init_gpu_resource::<views::runs::VolumeRuns>()
            .init_gpu_resource::<clipping::job::KeptClipGroups>()
            .init_gpu_resource::<carvers::plan::CarverPlan>()
            .init_gpu_resource::<plan::VolumePlan>()
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
                    init_gpu_resource::<clipping::static_distances::StaticDistancePasses>,
                    init_gpu_resource::<clipping::cull_superbricks::CullSuperbrickPasses>,
                    init_gpu_resource::<clipping::cull_bricks::CullBricksPass>,
                    init_gpu_resource::<clipping::clip::ClipPasses>,
                    init_gpu_resource::<clipping::distances::DistancePasses>,
                    init_gpu_resource::<views::march::MarchPass>,
                    init_gpu_resource::<VoxelMethods>,
                )
                    .after(init_gpu_resource::<Formats>)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(RenderStartup, gpu::device_loss::forget_lost_bind_groups)
            .add_systems(ExtractSchedule, extract::extract_scene)
            .add_systems(AskForPipelines, pipelines::ask)
            .add_systems(
                Render,
                (
                    (
                        registry::begin_methods,
                        carvers::clip_maps::keep_clip_maps,
                        volumes::store::keep_volumes,
                        registry::keep_for_methods,
                    )
                        .chain()
                        .in_set(RenderSystems::PrepareAssets)
                        .in_set(OcclusionRenderSystems::Keep),
                    (
                        pipelines::find_ready,
                        windows::find_windows,
                        carvers::plan::plan_carvers,
                        plan::plan_volumes,
                    )
                        .chain()
                        .in_set(RenderSystems::PrepareResources)
                        .in_set(OcclusionRenderSystems::Plan),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                RenderGraph,
                (
                    encode::encode_passes
                        .in_set(RenderGraphSystems::Render)
                        .in_set(OcclusionRenderSystems::Encode)
                        .before(camera_driver),
                    carvers::count_surfaces::request_counts.in_set(RenderGraphSystems::Finish),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            );
        app.add_plugins(methods::MethodPlugins);
    }
}
