//! Pointers and rays: what of a volume they hit.
//!
//! [`VolumeRayCast`] casts rays from any system. Where the app has Bevy's `PickingPlugin`, as with `DefaultPlugins`, rays of
//! pointers hit volumes as well. So `Pointer` events arrive at the entities of volumes, and their hits carry a
//! [`VolumeHit`]. All of it runs on the CPU.

mod backend;
mod carved;
mod crossings;
mod field;
mod hit;
mod march;
mod optical_depths;
mod ray_cast;
mod settings;

use bevy::{
    picking::{PickingSystems, backend::ray::RayMap},
    prelude::*,
};

use crate::volume::VolumeSystems;

pub use hit::VolumeHit;
pub use ray_cast::VolumeRayCast;
pub use settings::{VolumePickingCamera, VolumePickingSettings, VolumeRayCastSettings};

/// Keeps what ray casts need of every volume, and tells pointers what they hit.
pub(crate) struct VolumePickingPlugin;

impl Plugin for VolumePickingPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<VolumePickingSettings>()
            .register_type::<VolumePickingSettings>()
            .register_type::<VolumePickingCamera>()
            .register_type::<VolumeHit>()
            .add_systems(
                PreUpdate,
                backend::hit_volumes
                    .in_set(PickingSystems::Backend)
                    // Without `PickingPlugin` there are no pointers.
                    .run_if(resource_exists::<RayMap>),
            )
            .add_systems(
                PostUpdate,
                (optical_depths::update_depths, optical_depths::remove_depths).after(VolumeSystems::Bake),
            );
    }
}
