//! The passes, in the render world. This file only wires them up:
//!
//! main world → `extract` → `volume_store`, `clip_maps` (what stays on the device) → `plan` (what
//! this frame needs) → `encode` (the passes, in order).

#[cfg(test)]
mod agreement;
mod brick_resources;
mod carver_uniform;
mod clip;
mod clip_draw;
mod clip_keys;
mod clip_maps;
mod clip_textures;
mod compute_pass;
mod count_surfaces;
mod cull;
mod device_loss;
mod dilate;
mod direct;
mod distances;
mod encode;
mod extract;
mod filtering;
mod fit_occlusion;
mod formats;
mod frame;
mod gpu_volume;
mod mark;
mod method_bytes;
mod method_pipelines;
mod occlusion_texels;
mod pass_uniforms;
mod passes;
mod peel;
mod plan;
mod ranges;
mod ray_cast;
mod screen_space;
mod surface_count;
mod sweeping;
mod textures;
pub(crate) mod volume_bindings;
mod volume_state;
mod volume_store;
mod volume_uniform;

use bevy::{
    asset::embedded_asset,
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems,
        extract_resource::ExtractResourcePlugin,
        init_gpu_resource,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
    shader::load_shader_library,
};

use crate::diagnostics::{ReportChannel, SweepDistancesAlone};

pub(crate) use clip_maps::ClipMaps;
pub(crate) use fit_occlusion::fit_occlusion;
pub(crate) use formats::Formats;
pub(crate) use method_pipelines::{CompilesInBackground, MethodPipelines};
pub(crate) use occlusion_texels::OcclusionTexels;
pub(crate) use sweeping::draws_isosurface;
pub use volume_store::{VolumeStore, VolumeTexture, VoxelMask};

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
        load_shader_library!(app, "volume_bindings.wgsl");
        load_shader_library!(app, "bricks.wgsl");
        load_shader_library!(app, "brick_bindings.wgsl");
        load_shader_library!(app, "voxel_masks.wgsl");
        load_shader_library!(app, "work_list.wgsl");
        load_shader_library!(app, "listed.wgsl");
        load_shader_library!(app, "changes.wgsl");
        load_shader_library!(app, "emptiness.wgsl");
        load_shader_library!(app, "clip_test.wgsl");
        load_shader_library!(app, "occlusion_pass.wgsl");
        load_shader_library!(app, "coverage.wgsl");
        load_shader_library!(app, "view_ray.wgsl");
        load_shader_library!(app, "density.wgsl");
        load_shader_library!(app, "orientation.wgsl");
        load_shader_library!(app, "shading.wgsl");
        load_shader_library!(app, "window.wgsl");
        embedded_asset!(app, "clip_draw.wgsl");
        embedded_asset!(app, "count_surfaces.wgsl");
        embedded_asset!(app, "peel.wgsl");
        embedded_asset!(app, "dilate.wgsl");
        embedded_asset!(app, "ranges.wgsl");
        embedded_asset!(app, "cull.wgsl");
        embedded_asset!(app, "clip.wgsl");
        embedded_asset!(app, "expire.wgsl");
        embedded_asset!(app, "distances.wgsl");
        embedded_asset!(app, "mark.wgsl");
        embedded_asset!(app, "ray_cast.wgsl");
        filtering::add_shaders(app);
        sweeping::add_shaders(app);
        app.add_plugins((
            ExtractResourcePlugin::<SweepDistancesAlone>::default(),
            screen_space::ScreenSpacePlugin,
            direct::DirectOcclusionPlugin,
        ));
        let report = app.world().resource::<ReportChannel>().clone();
        let methods = MethodPipelines::default();
        let in_background = CompilesInBackground::of(app);
        app.insert_resource(in_background).insert_resource(methods.clone());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .insert_resource(report)
            .insert_resource(methods)
            .init_resource::<extract::ExtractedScene>()
            .init_gpu_resource::<ClipMaps>()
            .init_gpu_resource::<VolumeStore>()
            .init_gpu_resource::<plan::FramePlan>()
            .init_gpu_resource::<SpecializedRenderPipelines<clip_draw::ClipDrawPipeline>>()
            .init_gpu_resource::<Formats>()
            .add_systems(
                RenderStartup,
                (
                    init_gpu_resource::<clip_draw::ClipDrawPipeline>,
                    init_gpu_resource::<count_surfaces::CountPass>,
                    init_gpu_resource::<peel::PeelPasses>,
                    init_gpu_resource::<dilate::DilatePasses>,
                    init_gpu_resource::<ranges::RangesPass>,
                    init_gpu_resource::<cull::CullPass>,
                    init_gpu_resource::<clip::ClipPasses>,
                    init_gpu_resource::<distances::DistancePasses>,
                    init_gpu_resource::<filtering::FilteringPasses>,
                    init_gpu_resource::<mark::MarkPass>,
                    init_gpu_resource::<ray_cast::RayCastPasses>,
                    init_gpu_resource::<sweeping::SweepPasses>,
                )
                    .after(init_gpu_resource::<Formats>)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(RenderStartup, device_loss::forget_lost_bind_groups)
            .add_systems(ExtractSchedule, extract::extract_scene)
            .add_systems(
                Render,
                (
                    volume_store::prepare_resources
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
                    count_surfaces::request_counts.in_set(RenderGraphSystems::Finish),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}
