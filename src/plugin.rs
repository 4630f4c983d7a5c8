//! The plugin that adds all parts to an app.

use bevy::{
    prelude::*,
    render::{
        RenderApp,
        render_resource::WgpuLimits,
        renderer::{RenderAdapter, RenderDevice},
    },
};

use crate::{
    clip::{ClipMeshCutOff, ClipPlugin, LayersWanted},
    diagnostics::{CountWork, PlanTime, RenderStatus, ReportChannel, TimePassesByClock},
    drawing::VolumeDrawingPlugin,
    occlusion::OcclusionPlugin,
    render::{DeviceSupport, Formats, OcclusionRenderPlugin},
    volume::{OcclusionReady, VolumeOccluded, VolumePlugin},
};

/// Shows volumes and lets meshes carve them. Add it after Bevy's `DefaultPlugins`.
///
/// Without compute shaders, or without a renderer, the plugin warns once. Assets still load, but volumes
/// are not drawn. The rest of the app is unharmed.
#[derive(Default)]
pub struct ContextualAoPlugin;

impl Plugin for ContextualAoPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<ReportChannel>()
            .init_resource::<RenderStatus>()
            .init_resource::<PlanTime>()
            .init_resource::<CountWork>()
            .init_resource::<TimePassesByClock>()
            .add_plugins((VolumePlugin, ClipPlugin, OcclusionPlugin))
            .add_systems(PreUpdate, receive_report);
        #[cfg(feature = "picking")]
        app.add_plugins(crate::picking::VolumePickingPlugin);
        #[cfg(feature = "hands")]
        app.add_plugins(crate::hands::HandPlugin);
        #[cfg(feature = "gizmos")]
        app.add_plugins(crate::gizmos::VolumeGizmoPlugin);
        if app.get_sub_app(RenderApp).is_none() {
            warn!("ContextualAoPlugin: there is no renderer, so volumes are not drawn");
            return;
        }
        app.add_plugins((OcclusionRenderPlugin, VolumeDrawingPlugin));
    }

    // The graphics device does not exist before.
    fn finish(&self, app: &mut App) {
        let Some(device) = app.world().get_resource::<RenderDevice>() else {
            return;
        };
        if let Err(lacking) = check_limits(&device.limits()) {
            warn!("ContextualAoPlugin: volumes are not drawn, the graphics device lacks {lacking}");
            return;
        }
        if let Some(adapter) = app.world().get_resource::<RenderAdapter>() {
            let stored = Formats::new(device, adapter).stored_bytes();
            app.insert_resource(stored);
        }
        app.insert_resource(DeviceSupport);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.insert_resource(DeviceSupport);
        }
    }
}

/// Checks the limits that the passes need and that drawing in Bevy does not.
fn check_limits(limits: &WgpuLimits) -> Result<(), String> {
    let needed = [
        ("compute workgroups of 64 invocations", limits.max_compute_invocations_per_workgroup, 64),
        ("a storage texture per stage", limits.max_storage_textures_per_shader_stage, 1),
        ("7 storage buffers per stage", limits.max_storage_buffers_per_shader_stage, 7),
        ("14 KiB uniform buffers", limits.max_uniform_buffer_binding_size as u32, 14_336),
    ];
    match needed.iter().find(|(_, has, needs)| has < needs) {
        Some((what, has, _)) => Err(format!("{what} (it has {has})")),
        None => Ok(()),
    }
}

/// Receives the render world's report. Triggers events on volumes that became complete and on carvers
/// whose meshes are cut off.
fn receive_report(
    mut commands: Commands,
    channel: Res<ReportChannel>,
    (mut status, mut plan_time): (ResMut<RenderStatus>, ResMut<PlanTime>),
    mut volumes: Query<&mut OcclusionReady>,
    mut layers_wanted: ResMut<LayersWanted>,
    mut cut_off: Local<Vec<ClipMeshCutOff>>,
) {
    let Ok(mut report) = channel.0.lock() else {
        return;
    };
    let new = RenderStatus {
        usage: report.usage,
        passes: report.passes.clone(),
        clip_layers: report.layers_wanted,
        superbricks_tested: report.superbricks_tested,
    };
    status.set_if_neq(new);
    plan_time.set_if_neq(PlanTime(report.plan_time));
    layers_wanted.set_if_neq(LayersWanted(report.layers_wanted));
    if *cut_off != report.cut_off {
        for new in report.cut_off.iter().filter(|new| !cut_off.contains(new)) {
            commands.trigger(*new);
        }
        cut_off.clone_from(&report.cut_off);
    }
    for (entity, is_ready) in report.ready.drain(..) {
        let Ok(mut current) = volumes.get_mut(entity) else {
            continue;
        };
        if current.set_if_neq(OcclusionReady(is_ready)) && is_ready {
            commands.trigger(VolumeOccluded { entity });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_without_compute_is_refused_by_name() {
        assert_eq!(check_limits(&WgpuLimits::default()), Ok(()));
        let webgl = WgpuLimits::downlevel_webgl2_defaults();
        let lacking = check_limits(&webgl).expect_err("WebGL2 has no compute shaders");
        assert!(lacking.contains("compute"), "{lacking}");
    }
}
