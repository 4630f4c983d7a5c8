//! Drawing of volumes that share space, and of volumes with translucent meshes in them (`merged.wgsl`).
//!
//! `boxes` and `parts` say what is drawn together, and in which parts; `translucents` knows the meshes. `records` writes what
//! the draws read, `transmittance` finds how much light passes each volume, and `dimming` dims what is behind.

mod boxes;
mod dimming;
mod parts;
mod pipelines;
mod records;
mod translucents;
mod transmittance;

use bevy::{
    asset::embedded_asset,
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        ExtractSchedule, GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems,
        init_gpu_resource,
        render_resource::{SpecializedComputePipelines, SpecializedRenderPipelines},
        renderer::{RenderGraph, RenderGraphSystems},
    },
    shader::load_shader_library,
};

pub(super) use boxes::{WorldBox, groups_of};
pub(super) use parts::{DrawnPart, parts_of, whole_behind};
pub(super) use pipelines::{MergedPipelines, MergingPipelines};
pub(super) use records::{MERGED_BIND_GROUP, MergedDraws, merged_bindings, merged_layout, offset_of_record};
pub(super) use translucents::Translucents;

use super::{phase::bind_volumes, pipeline::DrawPipeline, queue::queue_volumes};
use crate::render::{DeviceSupport, OcclusionRenderSystems};

/// Adds what merged draws need.
pub(super) struct MergingPlugin;

impl Plugin for MergingPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "curve.wgsl");
        load_shader_library!(app, "merged.wgsl");
        embedded_asset!(app, "dimming.wgsl");
        embedded_asset!(app, "transmittance.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<Translucents>()
            .init_gpu_resource::<MergedDraws>()
            .init_gpu_resource::<transmittance::Transmittances>()
            .init_gpu_resource::<SpecializedRenderPipelines<dimming::DimmingPipeline>>()
            .init_gpu_resource::<SpecializedComputePipelines<transmittance::TransmittancePipeline>>()
            .add_systems(ExtractSchedule, translucents::extract_translucents)
            .add_systems(
                RenderStartup,
                (
                    init_gpu_resource::<dimming::DimmingPipeline>,
                    init_gpu_resource::<transmittance::TransmittancePipeline>,
                )
                    .after(init_gpu_resource::<DrawPipeline>)
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                Render,
                (
                    translucents::update_centers
                        .in_set(RenderSystems::Queue)
                        .after(RenderSystems::QueueMeshes)
                        .before(queue_volumes),
                    records::write_records.in_set(RenderSystems::PrepareBindGroups).before(bind_volumes),
                    transmittance::prepare_transmittances
                        .in_set(RenderSystems::PrepareBindGroups)
                        .after(bind_volumes),
                )
                    .run_if(resource_exists::<DeviceSupport>),
            )
            .add_systems(
                RenderGraph,
                transmittance::find_transmittances
                    .in_set(RenderGraphSystems::Render)
                    .after(OcclusionRenderSystems::Encode)
                    .before(camera_driver)
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}
