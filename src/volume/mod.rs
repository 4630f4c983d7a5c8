//! Volumes, their files and transfer functions, and the components that put volumes into a scene.

mod asset;
mod bake;
mod budget;
#[cfg(feature = "dicom")]
pub mod dicom;
mod error;
mod events;
mod fit;
mod geometry;
mod halve;
mod halved_volumes;
mod loaders;
mod lookup_table;
mod otsu;
mod percentiles;
#[cfg(feature = "phantom")]
pub mod phantom;
pub mod presets;
mod readers;
#[cfg(feature = "slicer")]
mod slicer;
mod transfer_function;
mod transfer_function_error;
mod transfer_function_files;
mod transfer_function_samples;
mod volume3d;

use bevy::{asset::AssetEventSystems, prelude::*};

pub use asset::{Intensities, Rescale, Volume};
pub(crate) use budget::{BytesTaken, StoredBytes};
pub use budget::{SizeLimit, TooLarge, VolumeBudget};
pub use error::{VolumeError, VolumeFileError};
pub use events::{VolumeFailed, VolumeFailure, VolumeLoaded, VolumeOccluded};
pub use geometry::VolumeGeometry;
pub(crate) use geometry::longest_stretch;
pub use loaders::{TransferFunctionLoader, VolumeLoader};
pub use lookup_table::LookupTable;
pub use presets::Preset;
pub use readers::{VolumeReadSettings, read_volume_file, read_volume_file_with};
pub use transfer_function::{ControlPoint, GradientPoint, GradientUnit, PointsAtGradient, TransferFunction};
pub use transfer_function_error::TransferFunctionError;
pub(crate) use volume3d::{DrawnBox, VolumeBox};
pub use volume3d::{OcclusionReady, Volume3d, VolumeTransferFunction, WORLD_UNITS_PER_MM};

/// Sets of the volume plugin's systems, in [`PostUpdate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum VolumeSystems {
    /// Decides the volume that an entity shows: the requested volume, a smaller copy, or the volume before.
    Fit,
    /// Bakes transfer functions into a [`LookupTable`] per volume.
    Bake,
}

/// Registers the assets, their loaders and the volume components.
pub(crate) struct VolumePlugin;

impl Plugin for VolumePlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<Volume>()
            .init_asset::<TransferFunction>()
            .register_asset_reflect::<TransferFunction>()
            .register_type::<Volume3d>()
            .register_type::<VolumeTransferFunction>()
            .register_type::<OcclusionReady>()
            .register_type::<volume3d::BoxMark>()
            .init_asset_loader::<VolumeLoader>()
            .init_asset_loader::<TransferFunctionLoader>()
            .init_resource::<VolumeBudget>()
            .init_resource::<BytesTaken>()
            .init_resource::<StoredBytes>()
            .init_resource::<halved_volumes::HalvedVolumes>()
            .add_observer(events::log_failures)
            .add_systems(
                PostUpdate,
                // Before asset events are sent, so that assets made from a table reach the renderer in the same
                // frame as the table.
                (
                    (
                        fit::fit_volumes.in_set(VolumeSystems::Fit),
                        bake::bake_lookup_tables.in_set(VolumeSystems::Bake),
                    )
                        .chain(),
                    events::report_unreadable,
                    volume3d::remove_read_boxes,
                )
                    .before(AssetEventSystems),
            );
        // After the other loader, so that it gets names without an ending: files of a hospital often have none.
        #[cfg(feature = "dicom")]
        app.init_resource::<dicom::DicomLoads>().init_asset_loader::<dicom::DicomLoader>();
    }
}
