//! Asset loaders: the readers behind Bevy's asset server.

use bevy::{
    asset::{AssetLoader, AssetPath, LoadContext, io::Reader},
    prelude::*,
};

use super::{
    TransferFunction, TransferFunctionError, Volume, VolumeError, VolumeFileError, VolumeReadSettings,
    readers::{Format, data_file_candidates, decode::decode, warn_of_background},
};

/// Loads [`Volume`]s from NIfTI (`.nii`, `.nii.gz`, `.hdr` with `.img`), NRRD (`.nrrd`, `.nhdr`)
/// and MetaImage files (`.mha`, `.mhd`). [`VolumeReadSettings`] choose one of several volumes in a file.
#[derive(Default, TypePath)]
pub struct VolumeLoader;

impl AssetLoader for VolumeLoader {
    type Asset = Volume;
    type Settings = VolumeReadSettings;
    type Error = VolumeFileError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &VolumeReadSettings,
        load_context: &mut LoadContext<'_>,
    ) -> Result<Volume, VolumeFileError> {
        let volume = read(reader, settings, load_context).await?;
        warn_of_background(load_context.path().path(), &volume);
        Ok(settings.halve(volume))
    }

    fn extensions(&self) -> &[&str] {
        &["nii", "nii.gz", "hdr", "hdr.gz", "nrrd", "nhdr", "mha", "mhd"]
    }
}

/// Reads a volume from its header's file, and from a data file that the header names.
async fn read(
    reader: &mut dyn Reader,
    settings: &VolumeReadSettings,
    load_context: &mut LoadContext<'_>,
) -> Result<Volume, VolumeFileError> {
    let asset_path = load_context.path().clone_owned();
    let path = asset_path.path().to_owned();
    let at = |path: &std::path::Path, cause: VolumeError| VolumeFileError { path: path.to_owned(), cause };
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes).await.map_err(|error| at(&path, error.into()))?;
    let header = Format::of(&path)
        .and_then(|format| format.parse(&bytes, settings))
        .map_err(|cause| at(&path, cause))?;
    let candidates = data_file_candidates(&path, &header);
    if candidates.is_empty() {
        return decode(&header, &bytes).map_err(|cause| at(&path, cause));
    }
    let mut missing = None;
    for candidate in candidates {
        let sibling = AssetPath::from_path(&candidate).with_source(asset_path.source().clone_owned());
        match load_context.read_asset_bytes(sibling).await {
            Ok(bytes) => return decode(&header, &bytes).map_err(|cause| at(&candidate, cause)),
            Err(error) => {
                let cause = VolumeError::Io(std::io::Error::other(error));
                missing.get_or_insert(at(&candidate, cause));
            }
        }
    }
    Err(missing.unwrap_or_else(|| at(&path, VolumeError::Truncated { expected_bytes: 1, found_bytes: 0 })))
}

/// Loads [`TransferFunction`]s from Slicer volume properties (`.vp`, `.vp.json`) and from RON (`.tf.ron`).
///
/// The file's content tells the format: see [`TransferFunction::from_bytes`].
#[derive(Default, TypePath)]
pub struct TransferFunctionLoader;

/// Reason why a transfer function file could not be loaded; the asset server adds the file's name.
#[derive(Debug, thiserror::Error)]
pub enum TransferFunctionLoadError {
    /// The file could not be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is no transfer function.
    #[error(transparent)]
    Content(#[from] TransferFunctionError),
}

impl AssetLoader for TransferFunctionLoader {
    type Asset = TransferFunction;
    type Settings = ();
    type Error = TransferFunctionLoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _: &(),
        _: &mut LoadContext<'_>,
    ) -> Result<TransferFunction, TransferFunctionLoadError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        Ok(TransferFunction::from_bytes(&bytes)?)
    }

    fn extensions(&self) -> &[&str] {
        &["vp", "vp.json", "tf.ron"]
    }
}
