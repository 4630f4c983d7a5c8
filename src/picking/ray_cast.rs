//! Casts rays at volumes.

use bevy::{
    camera::visibility::RenderLayers,
    ecs::{query::QueryData, system::SystemParam},
    math::{DAffine3, DVec3},
    prelude::*,
};

use super::{
    VolumeHit, VolumeRayCastSettings,
    carved::{Carvers, Cut, Stretch, through_box},
    crossings::Line,
    field::Field,
    march::{March, Stops},
    optical_depths::OpticalDepths,
};
use crate::{
    clip::placed,
    occlusion::{AmbientOcclusion, ShownOcclusion, VolumeShading},
    volume::{LookupTable, Volume, WORLD_UNITS_PER_MM},
};

/// Casts rays at the surfaces of volumes, as transfer functions and carvers leave them. It neither waits for the GPU nor
/// needs one.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_contextual_ao::prelude::*;
/// fn probe(ray_cast: VolumeRayCast, tool: Single<&GlobalTransform, With<Camera3d>>) {
///     let ray = Ray3d::new(tool.translation(), tool.forward());
///     if let Some(hit) = ray_cast.cast(ray, &VolumeRayCastSettings::default().with_max_distance(0.5)) {
///         info!("{} at voxel {}, {} m away", hit.value, hit.voxel, hit.distance);
///     }
/// }
/// # bevy::ecs::system::assert_is_system(probe);
/// ```
///
/// A ray takes as many samples as a view ray of the same length, some 1,000 through a volume of 512 voxels a side. Where
/// there are carvers in its way, it tests all their triangles.
///
/// Volumes and carvers are where their [`GlobalTransform`]s say. Transfer functions and the poses of skinned carvers count
/// as of the last [`PostUpdate`]. A carver counts if its vertices are kept in the main world
/// ([`RenderAssetUsages::MAIN_WORLD`](bevy::asset::RenderAssetUsages)). All its layers count: where
/// [`ClipMeshCutOff`](crate::clip::ClipMeshCutOff) tells of a carver with fewer in the picture, rays go through gaps of its
/// mesh that the picture fills.
#[derive(SystemParam)]
pub struct VolumeRayCast<'w, 's> {
    volumes: Query<'w, 's, Target>,
    carvers: Carvers<'w, 's>,
}

/// A volume that has loaded.
#[derive(QueryData)]
struct Target {
    entity: Entity,
    table: &'static LookupTable,
    depths: &'static OpticalDepths,
    shading: &'static VolumeShading,
    occlusion: &'static AmbientOcclusion,
    /// What is drawn, if there is a renderer.
    shown: Option<&'static ShownOcclusion>,
    transform: &'static GlobalTransform,
    visibility: &'static InheritedVisibility,
    layers: Option<&'static RenderLayers>,
}

impl VolumeRayCast<'_, '_> {
    /// The nearest hit of a ray.
    pub fn cast(&self, ray: Ray3d, settings: &VolumeRayCastSettings) -> Option<VolumeHit> {
        self.hits(ray, settings).min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// The hits of a ray, nearest first: one for each volume that is hit.
    pub fn cast_all(&self, ray: Ray3d, settings: &VolumeRayCastSettings) -> Vec<VolumeHit> {
        let mut hits: Vec<_> = self.hits(ray, settings).collect();
        hits.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        hits
    }

    fn hits(&self, ray: Ray3d, settings: &VolumeRayCastSettings) -> impl Iterator<Item = VolumeHit> {
        let ray = Line { origin: ray.origin.as_dvec3(), direction: ray.direction.as_dvec3().normalize() };
        let targets = self.volumes.iter().filter(move |target| target.may_be_hit(settings));
        targets.filter_map(move |target| self.hit(&target, ray, settings))
    }

    fn hit(&self, target: &TargetItem, ray: Line, settings: &VolumeRayCastSettings) -> Option<VolumeHit> {
        let isovalue = target.isovalue();
        let table = target.table;
        let millimetres = DAffine3::from_scale(DVec3::splat(WORLD_UNITS_PER_MM.into()));
        let march = March::new(
            Field::new(&table.volume, isovalue.is_none() && target.is_tricubic()),
            target.depths,
            &table.geometry,
            &(placed(target.transform)? * millimetres),
            ray,
            target.shading.drawn_step_voxels().into(),
        )?;
        let stops = match isovalue {
            Some(value) => surface_at(value, &table.volume),
            None => Stops::Depth(settings.optical_depth()),
        };
        let whole = in_grid(&march, settings.max_distance.into())?;
        let left = self.carvers.leave(target.entity, &ray, whole);
        let (distance, stretch) = march.stop(&left, stops)?;
        let (normal, cut) = march.surface_at(distance, &stretch, stops);
        let place = march.in_voxels.at(distance);
        let last = (table.geometry.dimensions - 1).as_dvec3();
        Some(VolumeHit {
            volume: target.entity,
            distance: distance as f32,
            position: ray.at(distance).as_vec3(),
            normal: Dir3::new(normal.as_vec3()).ok()?,
            voxel: place.round().max(DVec3::ZERO).min(last).as_uvec3(),
            place_voxels: place.as_vec3(),
            value: table.volume.to_file_units(march.field.at(place)),
            carver: cut.and_then(|cut| cut.carver),
        })
    }
}

impl TargetItem<'_, '_> {
    fn may_be_hit(&self, settings: &VolumeRayCastSettings) -> bool {
        let is_on = |wanted: &RenderLayers| self.layers.cloned().unwrap_or_default().intersects(wanted);
        (settings.hits_hidden || self.visibility.get())
            && settings.layers.as_ref().is_none_or(is_on)
            && (settings.filter)(self.entity)
    }

    fn drawn_occlusion(&self) -> &AmbientOcclusion {
        self.shown.map_or(self.occlusion, |shown| &shown.fitted.occlusion)
    }

    /// Whether view rays take tricubic intensities. Methods that shade by views do not.
    fn is_tricubic(&self) -> bool {
        let reconstruction = self.shown.map_or(self.shading.reconstruction, |shown| shown.reconstruction);
        reconstruction.is_tricubic() && self.drawn_occlusion().method.kind().is_of_voxels()
    }

    /// Intensity, in the file's units, of the isosurface that alone is drawn.
    #[cfg(feature = "other_methods")]
    fn isovalue(&self) -> Option<f64> {
        use crate::occlusion::{OcclusionMethod, SweepingSurface};
        match &self.drawn_occlusion().method {
            OcclusionMethod::Sweeping(sweeping) => match sweeping.surface {
                SweepingSurface::Isosurface(value) => Some(value.into()),
                _ => None,
            },
            _ => None,
        }
    }

    #[cfg(not(feature = "other_methods"))]
    fn isovalue(&self) -> Option<f64> {
        None
    }
}

/// Part of a ray in the box that the voxels fill. A ray that begins outside begins at a face.
fn in_grid(march: &March, max_distance: f64) -> Option<Stretch> {
    let size = march.geometry.dimensions.as_dvec3();
    let ([begin, end], axis) = through_box(&march.in_voxels, DVec3::splat(-0.5), size - 0.5);
    let normal = march.voxel_from_world.matrix3.transpose() * DVec3::AXES[axis];
    let face = (begin > 0.0).then_some(Cut { carver: None, normal });
    let stretch = Stretch { begin: begin.max(0.0), end: end.min(max_distance), cut: face };
    (stretch.begin < stretch.end).then_some(stretch)
}

/// The surface of what has a higher value, in the file's units.
fn surface_at(value: f64, volume: &Volume) -> Stops {
    // No voxel is inside the surface of what is no number.
    let value = if value.is_nan() { f64::INFINITY } else { value };
    Stops::Surface { stored: volume.to_stored(value), is_above: volume.rescale().slope > 0.0 }
}
