//! What a ray hits.

use bevy::prelude::*;

/// A hit of a ray on a volume: the place up to which a set share of the ray's light is stopped.
///
/// Hits of pointers carry it: `event.hit.extra_as::<VolumeHit>()`.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct VolumeHit {
    /// The volume's entity.
    pub volume: Entity,
    /// Distance from the ray's origin, world units.
    pub distance: f32,
    /// The place in the world.
    pub position: Vec3,
    /// Normal of the surface in the world. It points to the side that the ray comes from.
    ///
    /// It is the gradient of the intensities. On a cut it is the normal of the carver's triangle, on a face of the grid that
    /// of the face. Where there is no gradient, it points against the ray.
    pub normal: Dir3,
    /// The nearest voxel.
    pub voxel: UVec3,
    /// The place, voxels; whole numbers at voxel centres.
    pub place_voxels: Vec3,
    /// The value there, in the file's units, interpolated as in the picture.
    pub value: f64,
    /// The carver on whose cut the hit lies.
    ///
    /// As in the picture, a surface up to half a voxel behind a cut counts as the cut. Matter without a surface does up to
    /// two voxels behind it.
    pub carver: Option<Entity>,
}
