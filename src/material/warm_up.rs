//! Compiles the shaders of a material before a volume gets the material. Until then the volume is drawn as before, so
//! that no change of settings shows an empty frame.
//!
//! Meanwhile a child that draws nothing has the new material, in the same views.

use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{NoAutoAabb, RenderLayers},
    },
    ecs::system::SystemParam,
    light::{NotShadowCaster, NotShadowReceiver},
    pbr::SpecializedMaterialPipelineCache,
    platform::collections::HashSet,
    prelude::*,
    render::{Extract, render_resource::PipelineCache, sync_world::MainEntity},
};
use std::sync::{Arc, Mutex};

use super::{VolumeMaterial, box_mesh::box_mesh, volume_material::MaterialVariant};
use crate::volume::VolumeGeometry;

/// Marks the child of a volume's box whose shaders are being compiled.
#[derive(Component)]
pub(super) struct WarmUp(MaterialVariant);

/// Warm-up children whose shaders are compiled.
#[derive(Resource, Clone, Default)]
pub(super) struct ReadyWarmUps(Arc<Mutex<HashSet<Entity>>>);

/// Warm-up children that views may show in this frame.
#[derive(Resource, Default)]
pub(super) struct ExtractedWarmUps(Vec<Entity>);

/// Parameters for making and removing warm-up children.
#[derive(SystemParam)]
pub(super) struct WarmUps<'w, 's> {
    commands: Commands<'w, 's>,
    children: Query<'w, 's, (Entity, &'static ChildOf, &'static WarmUp)>,
    places: Query<'w, 's, (&'static GlobalTransform, Option<&'static RenderLayers>)>,
    ready: Res<'w, ReadyWarmUps>,
}

impl WarmUps<'_, '_> {
    /// Whether the box of a volume, drawn by the variant `shown`, can get the material `wanted`.
    pub fn are_done(
        &mut self,
        volume_box: Entity,
        shown: MaterialVariant,
        wanted: VolumeMaterial,
        geometry: &VolumeGeometry,
        meshes: &mut Assets<Mesh>,
        materials: &mut Assets<VolumeMaterial>,
    ) -> bool {
        let is_needed = !wanted.variant.has_pipelines_of(&shown);
        let mut child = self.children.iter().find(|(_, of, _)| of.parent() == volume_box);
        let is_ready = |child: Entity| self.ready.0.lock().is_ok_and(|ready| ready.contains(&child));
        let is_done = !is_needed
            || child.is_some_and(|(child, _, of)| of.0.has_pipelines_of(&wanted.variant) && is_ready(child));
        let is_old = |of: &WarmUp| is_done || !of.0.has_pipelines_of(&wanted.variant);
        if let Some((old, _, _)) = child.take_if(|(_, _, of)| is_old(of)) {
            self.commands.entity(old).try_despawn();
        }
        if !is_done && child.is_none() {
            self.spawn(volume_box, wanted, geometry, meshes, materials);
        }
        is_done
    }

    fn spawn(
        &mut self,
        volume_box: Entity,
        material: VolumeMaterial,
        geometry: &VolumeGeometry,
        meshes: &mut Assets<Mesh>,
        materials: &mut Assets<VolumeMaterial>,
    ) {
        let Ok((place, layers)) = self.places.get(volume_box) else {
            return;
        };
        // The child is in the place of the box. Its triangles have no extent.
        let bounds = Aabb::enclosing(geometry.corners().map(|corner| corner.as_vec3()));
        let mesh = box_mesh(geometry).with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0f32; 3]; 8]);
        let variant = material.variant;
        let mut child = self.commands.spawn((
            WarmUp(variant),
            *place,
            Mesh3d(meshes.add(mesh)),
            MeshMaterial3d(materials.add(material)),
            (NoAutoAabb, NotShadowCaster, NotShadowReceiver),
            ChildOf(volume_box),
        ));
        if let Some(bounds) = bounds {
            child.insert(bounds);
        }
        if let Some(layers) = layers {
            child.insert(layers.clone());
        }
    }
}

pub(super) fn extract_warm_ups(
    mut extracted: ResMut<ExtractedWarmUps>,
    children: Extract<Query<Entity, With<WarmUp>>>,
) {
    extracted.0.clear();
    extracted.0.extend(&children);
}

/// Finds the children whose pipelines are compiled in all views that show them.
pub(super) fn find_ready(
    extracted: Res<ExtractedWarmUps>,
    views: Res<SpecializedMaterialPipelineCache>,
    cache: Res<PipelineCache>,
    ready: Res<ReadyWarmUps>,
) {
    let Ok(mut ready) = ready.0.lock() else {
        return;
    };
    let is_there = |child: &&Entity| {
        let mut pipelines = views.values().filter_map(|view| view.get(&MainEntity::from(**child)));
        pipelines.all(|pipeline| cache.get_render_pipeline(*pipeline).is_some())
    };
    ready.clear();
    ready.extend(extracted.0.iter().filter(is_there));
}
