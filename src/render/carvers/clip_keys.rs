//! Keys of a carver's maps. A map is remade when its key changes, and only then.

use bevy::{math::Vec3, prelude::*};

use crate::{
    clip::{ClipFrame, ClipOperation, DilationFrame},
    render::extract::{ExtractedCarver, Influence},
};

/// Inputs of a depth map, besides the number of its layers.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct DepthKey {
    pub mesh: AssetId<Mesh>,
    revision: u32,
    pub frame: ClipFrame,
    /// Texels per side.
    map_size: u32,
}

impl DepthKey {
    pub fn of(carver: &ExtractedCarver, map_size: u32) -> Self {
        Self { mesh: carver.mesh, revision: carver.revision, frame: carver.frame, map_size }
    }
}

/// Inputs of a dilation map, besides the depth map: half axes of ellipsoids, clip map space.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct DilationKey {
    /// Ellipsoid that inflates the mesh.
    pub inflation: Vec3,
    /// Ellipsoid that shrinks the mesh.
    pub shrinkage: Vec3,
}

impl DilationKey {
    /// Key that a carver needs. `current` is kept while it serves. Turning a carver changes the radii only by rounding,
    /// which the margins of reach and footprint cover. `None` if the carver is collapsed.
    pub fn new(
        frame: &ClipFrame,
        world_from_local: Mat3,
        operation: ClipOperation,
        influence: Influence,
        current: Option<Self>,
    ) -> Option<Self> {
        let radii = |length| frame.reach_radii(world_from_local, length);
        let (reach, footprint) = (radii(influence.reach_world)?, radii(influence.footprint_world)?);
        let new = match operation {
            ClipOperation::Subtract => Self { inflation: reach, shrinkage: footprint },
            ClipOperation::Intersect => Self { inflation: footprint, shrinkage: reach },
        };
        let serves = |old: &Self| {
            let change = |old: Vec3, new: Vec3| (new / old - 1.0).abs().max_element();
            change(old.inflation, new.inflation).max(change(old.shrinkage, new.shrinkage)) < 1e-4
        };
        Some(current.filter(serves).unwrap_or(new))
    }

    /// The part of clip map space that the dilation map covers.
    pub fn frame(&self) -> DilationFrame {
        DilationFrame::for_radii(self.inflation)
    }
}
