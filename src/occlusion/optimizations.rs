//! Switches for work that is left out because it cannot change the image.

use bevy::{prelude::*, reflect::Typed};

/// Ways of leaving out work without changing a bit of the image. All are on by default. Each can be switched off
/// by itself, to measure its worth or to look for a fault in it.
///
/// With all of them off ([`Optimizations::NONE`]) occlusion is computed as published. Every frame then visits
/// every voxel, and casts full rays from all voxels that a carver affects.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct Optimizations {
    /// A frame in which nothing changed computes nothing. Off: clipping and occlusion are computed
    /// in every frame.
    pub rest: bool,
    /// Only bricks near a carver that changed are clipped. Off: all voxels are visited.
    pub lists: bool,
    /// Only voxels that a view reads cast rays. Off: all voxels that some view could read.
    pub demand: bool,
    /// After a change of carvers alone, voxels that a view reads are searched only where the change may show in the
    /// view. Off: in all pixels of the volume.
    pub outlines: bool,
    /// Without `demand`: only voxels next to something that is not transparent cast rays. Off: all voxels that are
    /// not clipped away.
    pub sampleable: bool,
    /// Occlusion rays end where they leave the grid, or where no more light gets through.
    pub early_end: bool,
    /// Occlusion rays leap over empty space.
    pub leaps: bool,
    /// View rays leap over empty space.
    pub draw_leaps: bool,
    /// Clip tests check only the carvers near a point. Off: all carvers.
    pub near_carvers: bool,
}

impl Optimizations {
    /// The algorithm as published.
    pub const NONE: Self = Self::all(false);

    const fn all(is_on: bool) -> Self {
        Self {
            rest: is_on,
            lists: is_on,
            demand: is_on,
            outlines: is_on,
            sampleable: is_on,
            early_end: is_on,
            leaps: is_on,
            draw_leaps: is_on,
            near_carvers: is_on,
        }
    }

    /// The names of all optimizations.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let info = <Self as Typed>::type_info().as_struct();
        info.into_iter().flat_map(|info| info.field_names()).copied()
    }

    /// These optimizations without the named one; `None` for a name that is not among [`Optimizations::names`].
    pub fn without(mut self, name: &str) -> Option<Self> {
        *self.get_field_mut::<bool>(name)? = false;
        Some(self)
    }
}

impl Default for Optimizations {
    fn default() -> Self {
        Self::all(true)
    }
}
