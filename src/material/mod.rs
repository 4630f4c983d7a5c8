//! Drawing of a volume: a box with a material that casts view rays through the box.

mod attach;
mod box_mesh;
mod depth_prepass;
mod volume_material;
mod warm_up;

use bevy::{
    asset::{AssetEventSystems, embedded_asset},
    camera::visibility::VisibilitySystems,
    pbr::MaterialPlugin,
    prelude::*,
    render::{ExtractSchedule, Render, RenderApp, RenderSystems, erased_render_asset::prepare_erased_assets},
};

pub use volume_material::VolumeMaterial;

use crate::{
    clip::ClipSystems,
    occlusion::fit_occlusion,
    render::{DeviceSupport, OcclusionRenderSystems},
    volume::VolumeSystems,
};

/// Sets of the material plugin's systems, in [`PostUpdate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum VolumeMaterialSystems {
    /// Decides how much of its requested occlusion a volume gets.
    FitOcclusion,
    /// Gives volumes the children that draw them.
    Attach,
}

/// Registers the material and gives it to every volume.
pub(crate) struct VolumeMaterialPlugin;

impl Plugin for VolumeMaterialPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "volume.wgsl");
        app.add_plugins(MaterialPlugin::<VolumeMaterial>::default())
            .add_observer(depth_prepass::leave_to_user)
            .add_systems(
                PostUpdate,
                (
                    (
                        fit_occlusion.in_set(VolumeMaterialSystems::FitOcclusion),
                        attach::attach_visuals.in_set(VolumeMaterialSystems::Attach),
                    )
                        .chain()
                        .run_if(resource_exists::<DeviceSupport>),
                    attach::detach_visuals,
                    depth_prepass::require_depth,
                )
                    .after(TransformSystems::Propagate)
                    .after(VolumeSystems::Bake)
                    .after(ClipSystems::Capacity)
                    // A volume is drawn in the frame in which it appears.
                    .before(VisibilitySystems::VisibilityPropagate)
                    .before(AssetEventSystems),
            );
        let ready = warm_up::ReadyWarmUps::default();
        app.insert_resource(ready.clone());
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            let prepare_materials = prepare_erased_assets::<MeshMaterial3d<VolumeMaterial>>;
            render_app
                .insert_resource(ready)
                .init_resource::<warm_up::ExtractedWarmUps>()
                .configure_sets(Render, OcclusionRenderSystems::Keep.before(prepare_materials))
                .add_systems(ExtractSchedule, warm_up::extract_warm_ups)
                .add_systems(Render, warm_up::find_ready.in_set(RenderSystems::Cleanup));
        }
    }
}
