//! Cases that are measured in turns in one scene.

use bevy::prelude::*;

use crate::stage::Stage;

/// Opacity of translucent matter, of a voxel.
const TRANSLUCENT: f32 = 0.05;

/// Begins a case: sets how opaque visible matter is, and removes what the case before has marked with a component.
pub fn begin_case<Mark: Component>(stage: &mut Stage, is_translucent: bool) {
    let opacity = if is_translucent { TRANSLUCENT } else { 1.0 };
    stage.set_transfer_function(|function| {
        function.points.iter_mut().for_each(|point| {
            point.opacity = if point.opacity > 0.0 { opacity } else { 0.0 };
        })
    });
    let world = stage.headless.app.world_mut();
    let mut before = world.query_filtered::<Entity, With<Mark>>();
    for entity in before.iter(world).collect::<Vec<_>>() {
        world.despawn(entity);
    }
}
