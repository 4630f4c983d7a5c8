//! Screen-space ambient occlusion of volumes, the method of VTK's `vtkSSAOPass` (Kitware 2023). It runs after drawing,
//! in every view that shows a volume with this method. It finds the surface in each pixel (`opaque_surface.wgsl`,
//! `volume_surface.wgsl`) and its openness (`occlusion.wgsl`), and darkens the view's colours (`darken.wgsl`).
//! Nothing is kept from frame to frame. This file only wires up the passes.

mod darken;
mod occlusion;
mod passes;
mod shade;
mod surfaces;
pub(in crate::render) mod uniform;
mod views;

use bevy::{
    asset::embedded_asset,
    core_pipeline::{Core3d, Core3dSystems},
    ecs::schedule::ApplyDeferred,
    prelude::*,
    render::{
        GpuResourceAppExt, Render, RenderApp, RenderStartup, RenderSystems, init_gpu_resource,
        render_resource::{PipelineCache, SpecializedRenderPipelines},
    },
    shader::load_shader_library,
};

use super::pipelines::{AskForPipelines, MethodPipelines, ViewPipelines, ask};
use crate::{
    occlusion::{MethodSettings, ScreenSpaceOcclusion},
    render::gpu::{
        device::DeviceSupport,
        formats::Formats,
        frame::{ShadesViews, are_timed_by_clock},
    },
};
use darken::DarkenPipelines;
use passes::ScreenSpacePasses;

/// Adds the method to the render world.
pub(crate) struct ScreenSpacePlugin;

impl Plugin for ScreenSpacePlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "bindings.wgsl");
        embedded_asset!(app, "opaque_surface.wgsl");
        embedded_asset!(app, "volume_surface.wgsl");
        embedded_asset!(app, "occlusion.wgsl");
        embedded_asset!(app, "darken.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_gpu_resource::<views::ScreenSpaceViews>()
            .init_gpu_resource::<views::ScreenSpaceUniforms>()
            .init_gpu_resource::<SpecializedRenderPipelines<darken::DarkenPipeline>>()
            .add_systems(AskForPipelines, ask_for_pipelines.before(ask))
            .add_systems(
                RenderStartup,
                (init_gpu_resource::<ScreenSpacePasses>, init_gpu_resource::<darken::DarkenPipeline>)
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
                (ApplyDeferred.run_if(are_timed_by_clock), shade::shade_view)
                    .chain()
                    .in_set(ShadesViews)
                    .after(Core3dSystems::MainPass)
                    .before(Core3dSystems::EarlyPostProcess)
                    .run_if(resource_exists::<DeviceSupport>),
            );
    }
}

fn ask_for_pipelines(
    passes: Res<ScreenSpacePasses>,
    mut darken: DarkenPipelines,
    cache: Res<PipelineCache>,
    wanted: Res<MethodPipelines>,
    mut pipelines: ResMut<ViewPipelines>,
) {
    let name = ScreenSpaceOcclusion::default().name();
    if wanted.wants(name) {
        pipelines.tell(name, passes.is_ready(&cache) & darken.are_ready(&cache));
    }
}
