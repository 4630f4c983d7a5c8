//! Step VI: drawing of volumes, each as a box among the transparent objects of a view.
//!
//! Main world: `attach` (the box that views show or not), `depth_prepass`. Render world: `queue`, `pipeline`, `phase`, `depth`;
//! before any view is drawn, `outline_colors`; before a view, `shadows`; behind it, `motion_vectors`. Volumes that share space:
//! `merging`.

mod attach;
mod depth;
mod depth_prepass;
mod merging;
mod motion_vectors;
mod outline_colors;
mod phase;
mod pipeline;
mod queue;
mod shadows;
mod variants;

use bevy::{
    asset::embedded_asset,
    camera::visibility::VisibilitySystems,
    core_pipeline::{Core3d, Core3dSystems, core_3d::Transparent3d, schedule::camera_driver},
    pbr::MeshPipelineSystems,
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems, init_gpu_resource,
        render_phase::AddRenderCommand,
        render_resource::{SpecializedComputePipelines, SpecializedRenderPipelines},
        renderer::{RenderGraph, RenderGraphSystems},
    },
    shader::load_shader_library,
};

use crate::{
    clip::ClipSystems,
    occlusion::fit_occlusion,
    render::{DeviceSupport, OcclusionRenderSystems, ShadesViews},
    volume::VolumeSystems,
};

/// Sets of the drawing plugin's systems, in [`PostUpdate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum VolumeDrawingSystems {
    /// Decides how much of its requested occlusion a volume gets.
    FitOcclusion,
    /// Gives volumes the children whose boxes are drawn.
    Attach,
}

/// Draws every volume.
pub(crate) struct VolumeDrawingPlugin;

impl Plugin for VolumeDrawingPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "ambient_light.wgsl");
        load_shader_library!(app, "compositing.wgsl");
        load_shader_library!(app, "drawn_box.wgsl");
        load_shader_library!(app, "scene_lights.wgsl");
        embedded_asset!(app, "depth.wgsl");
        embedded_asset!(app, "motion_vectors.wgsl");
        embedded_asset!(app, "outline_colors.wgsl");
        embedded_asset!(app, "volume.wgsl");
        app.add_observer(depth_prepass::leave_to_user).add_systems(
            PostUpdate,
            (
                (
                    fit_occlusion.in_set(VolumeDrawingSystems::FitOcclusion),
                    attach::attach_boxes.in_set(VolumeDrawingSystems::Attach),
                )
                    .chain()
                    .run_if(resource_exists::<DeviceSupport>),
                attach::detach_boxes,
                depth_prepass::require_depth,
            )
                .after(TransformSystems::Propagate)
                .after(VolumeSystems::Bake)
                .after(ClipSystems::Capacity)
                // A volume is drawn in the frame in which it appears.
                .before(VisibilitySystems::VisibilityPropagate),
        );
        app.add_plugins((merging::MergingPlugin, shadows::VolumeShadowPlugin));
        let variants = variants::DrawnVariants::default();
        app.insert_resource(variants.clone());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .insert_resource(variants)
            .init_gpu_resource::<phase::DrawnVolumes>()
            .init_gpu_resource::<motion_vectors::Motions>()
            .init_gpu_resource::<outline_colors::OutlineColors>()
            .init_gpu_resource::<SpecializedRenderPipelines<pipeline::DrawPipeline>>()
            .init_gpu_resource::<SpecializedRenderPipelines<depth::DepthPipeline>>()
            .init_gpu_resource::<SpecializedRenderPipelines<motion_vectors::MotionPipeline>>()
            .init_gpu_resource::<SpecializedComputePipelines<outline_colors::OutlineColorPipeline>>()
            .add_render_command::<Transparent3d, phase::DrawVolume>()
            .add_render_command::<Transparent3d, phase::DrawCutOffRays>()
            .add_render_command::<Transparent3d, phase::DrawFarSamples>()
            .add_systems(
                RenderStartup,
                (
                    init_gpu_resource::<pipeline::DrawPipeline>,
                    init_gpu_resource::<depth::DepthPipeline>,
                    init_gpu_resource::<motion_vectors::MotionPipeline>,
                    init_gpu_resource::<outline_colors::OutlineColorPipeline>,
                )
                    .chain()
                    .after(MeshPipelineSystems)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Render,
                (
                    queue::queue_volumes.in_set(RenderSystems::Queue).after(RenderSystems::QueueMeshes),
                    variants::find_ready.in_set(RenderSystems::PrepareResources),
                    (
                        phase::bind_volumes,
                        (motion_vectors::prepare_motions, outline_colors::prepare_outline_colors),
                    )
                        .chain()
                        .in_set(RenderSystems::PrepareBindGroups),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                RenderGraph,
                outline_colors::color_outlines
                    .in_set(RenderGraphSystems::Render)
                    .after(OcclusionRenderSystems::Encode)
                    .before(camera_driver)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Core3d,
                motion_vectors::write_motion_vectors
                    .after(Core3dSystems::MainPass)
                    .after(ShadesViews)
                    .before(Core3dSystems::EarlyPostProcess)
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}
