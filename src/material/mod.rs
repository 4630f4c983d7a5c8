//! How a volume is drawn: a box with a material that casts view rays through it.

mod attach;
mod volume_material;

use bevy::{
    asset::{AssetEventSystems, embedded_asset},
    pbr::MaterialPlugin,
    prelude::*,
};

pub use volume_material::VolumeMaterial;

use crate::{render::DeviceSupport, volume::VolumeSystems};

/// Registers the material and gives it to every volume.
pub(crate) struct VolumeMaterialPlugin;

impl Plugin for VolumeMaterialPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "volume.wgsl");
        app.add_plugins(MaterialPlugin::<VolumeMaterial>::default()).add_systems(
            PostUpdate,
            (
                attach::attach_visuals.run_if(resource_exists::<DeviceSupport>),
                attach::detach_visuals,
                attach::require_depth,
            )
                .after(VolumeSystems::Bake)
                .before(AssetEventSystems),
        );
    }
}
