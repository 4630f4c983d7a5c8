//! What is shown: volumes, their files, transfer functions, and the components that put them into
//! a scene.

mod asset;
mod budget;
mod bundle;
mod error;
mod geometry;
mod halve;
mod loaders;
mod lookup_table;
mod otsu;
mod percentiles;
pub mod phantom;
pub mod presets;
mod readers;
mod slicer;
mod transfer_function;

use bevy::{asset::AssetEventSystems, prelude::*};

pub use asset::{Intensities, Rescale, Volume};
pub use budget::VolumeBudget;
pub(crate) use budget::{ShownVolume, VolumeSize};
pub use bundle::{
    OcclusionProgress, Volume3d, VolumeBundle, VolumeFailed, VolumeLoaded, VolumeOccluded,
    VolumeTransferFunction, WORLD_UNITS_PER_MM,
};
pub use error::{VolumeError, VolumeFileError};
pub use geometry::VolumeGeometry;
pub(crate) use geometry::longest_stretch;
pub use loaders::{TransferFunctionLoader, VolumeLoader};
pub use lookup_table::LookupTable;
pub use presets::Preset;
pub use readers::read_volume_file;
pub use transfer_function::{ControlPoint, TransferFunction, TransferFunctionError};

/// Where the volume plugin's systems run, in [`PostUpdate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub enum VolumeSystems {
    /// Transfer functions are baked into a [`LookupTable`] per volume.
    Bake,
}

/// Registers the assets, their loaders and the volume components.
pub(crate) struct VolumePlugin;

impl Plugin for VolumePlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<Volume>()
            .init_asset::<TransferFunction>()
            .register_type::<Volume3d>()
            .register_type::<VolumeTransferFunction>()
            .register_type::<OcclusionProgress>()
            .init_asset_loader::<VolumeLoader>()
            .init_asset_loader::<TransferFunctionLoader>()
            .init_resource::<VolumeBudget>()
            .add_systems(
                PostUpdate,
                // Before asset events go out, so that what is made of a table reaches the renderer
                // in the same frame as the table.
                (
                    (budget::fit_volumes, lookup_table::bake_lookup_tables.in_set(VolumeSystems::Bake))
                        .chain(),
                    bundle::report_failures,
                )
                    .before(AssetEventSystems),
            );
    }
}
