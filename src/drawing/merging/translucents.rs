//! Translucent meshes of the views: where they are now, and their boxes.
//!
//! Bevy 0.19.1 keeps a mesh's centre from the frame in which it was queued (`queue_material_meshes`). So a mesh that moved
//! would be drawn in the order of then.

use bevy::{
    camera::primitives::Aabb,
    core_pipeline::core_3d::{Transparent3d, TransparentSortingInfo3d},
    platform::collections::HashMap,
    prelude::*,
    render::{Extract, render_phase::ViewSortedRenderPhases, sync_world::MainEntity},
};

use super::boxes::WorldBox;

/// Centre and box of each translucent mesh that was queued before this frame.
#[derive(Resource, Default)]
pub(in crate::drawing) struct Translucents(HashMap<MainEntity, (Vec3, WorldBox)>);

impl Translucents {
    /// Box of a mesh, if it is known.
    pub fn box_of(&self, mesh: MainEntity) -> Option<&WorldBox> {
        self.0.get(&mesh).map(|(_, world_box)| world_box)
    }
}

/// Looks up the queued meshes in the main world.
pub(in crate::drawing) fn extract_translucents(
    phases: Res<ViewSortedRenderPhases<Transparent3d>>,
    meshes: Extract<Query<(&Aabb, &GlobalTransform), With<Mesh3d>>>,
    mut translucents: ResMut<Translucents>,
) {
    translucents.0.clear();
    for (_, mesh) in phases.values().flat_map(|phase| phase.items.keys()) {
        if let Ok((bounds, transform)) = meshes.get(mesh.id()) {
            let (center, half_extents) = (bounds.center.into(), bounds.half_extents.into());
            let world_box = WorldBox::around(transform.affine(), center, half_extents);
            translucents.0.insert(*mesh, (transform.transform_point(center), world_box));
        }
    }
}

/// Sorts translucent meshes by where they are now.
pub(in crate::drawing) fn update_centers(
    translucents: Res<Translucents>,
    mut phases: ResMut<ViewSortedRenderPhases<Transparent3d>>,
) {
    for phase in phases.values_mut() {
        for ((_, mesh), item) in &mut phase.items {
            if let TransparentSortingInfo3d::Sorted { mesh_center, .. } = &mut item.sorting_info
                && let Some((center, _)) = translucents.0.get(mesh)
            {
                *mesh_center = *center;
            }
        }
    }
}
