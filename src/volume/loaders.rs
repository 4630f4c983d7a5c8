//! Asset loaders: the readers behind Bevy's asset server.

use bevy::{
    asset::{AssetLoader, AssetPath, LoadContext, io::Reader},
    prelude::*,
};

use super::{
    TransferFunction, TransferFunctionError, Volume, VolumeError, VolumeFileError,
    readers::{Format, data_file_candidates, decode::decode},
};

/// Loads [`Volume`]s from NIfTI-1 (`.nii`, `.nii.gz`, `.hdr` with `.img`), NRRD (`.nrrd`, `.nhdr`)
/// and MetaImage files (`.mha`, `.mhd`).
#[derive(Default, TypePath)]
pub struct VolumeLoader;

impl AssetLoader for VolumeLoader {
    type Asset = Volume;
    type Settings = ();
    type Error = VolumeFileError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _: &(),
        load_context: &mut LoadContext<'_>,
    ) -> Result<Volume, VolumeFileError> {
        let asset_path = load_context.path().clone_owned();
        let path = asset_path.path().to_owned();
        let at =
            |path: &std::path::Path, cause: VolumeError| VolumeFileError { path: path.to_owned(), cause };
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await.map_err(|error| at(&path, error.into()))?;
        let header =
            Format::of(&path).and_then(|format| format.parse(&bytes)).map_err(|cause| at(&path, cause))?;
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
        Err(missing
            .unwrap_or_else(|| at(&path, VolumeError::Truncated { expected_bytes: 1, found_bytes: 0 })))
    }

    fn extensions(&self) -> &[&str] {
        &["nii", "nii.gz", "hdr", "hdr.gz", "nrrd", "nhdr", "mha", "mhd"]
    }
}

/// Loads [`TransferFunction`]s from Slicer volume properties (`.vp`) and from RON (`.tf.ron`).
#[derive(Default, TypePath)]
pub struct TransferFunctionLoader;

/// Why a transfer function file could not be loaded; the asset server adds the file's name.
#[derive(Debug, thiserror::Error)]
pub enum TransferFunctionLoadError {
    /// The file could not be read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is not text.
    #[error("not UTF-8 text: {0}")]
    Text(#[from] std::string::FromUtf8Error),
    /// The text is no transfer function.
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
        load_context: &mut LoadContext<'_>,
    ) -> Result<TransferFunction, TransferFunctionLoadError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let text = String::from_utf8(bytes)?;
        let is_slicer = load_context
            .path()
            .path()
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("vp"));
        Ok(if is_slicer {
            TransferFunction::from_slicer_vp(&text)?
        } else {
            TransferFunction::from_ron(&text)?
        })
    }

    fn extensions(&self) -> &[&str] {
        &["vp", "tf.ron"]
    }
}
