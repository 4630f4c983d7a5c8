//! The asset loader: one file, a DICOMDIR, an archive or a list of names, also on the web.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use bevy::{
    asset::{AssetLoader, AssetPath, LoadContext, io::Reader},
    log::{info, warn},
    prelude::*,
};

use super::{
    find::{Found, Kind},
    left_out::{LeftOut, Reason},
    parallel::DicomProgress,
    read::{Dicom, list},
    settings::DicomReadSettings,
    source::Source,
    volume::DicomVolume,
};
use crate::volume::{Volume, VolumeError, VolumeFileError};

/// Progress of the DICOM assets that are being loaded, by their paths.
#[derive(Resource, Clone, Debug, Default)]
pub struct DicomLoads(Arc<Mutex<HashMap<AssetPath<'static>, DicomProgress>>>);

impl DicomLoads {
    /// Progress of an asset; `None` before its pixels are being read and after.
    pub fn progress(&self, path: &AssetPath<'static>) -> Option<DicomProgress> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(path).cloned()
    }

    fn begin(&self, path: &AssetPath<'static>) -> Loading {
        let progress = DicomProgress::default();
        let mut loads = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        loads.insert(path.clone(), progress.clone());
        Loading { loads: self.clone(), path: path.clone(), progress }
    }
}

/// An asset that is being loaded; dropped when it is loaded, failed or abandoned.
struct Loading {
    loads: DicomLoads,
    path: AssetPath<'static>,
    progress: DicomProgress,
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.loads.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.path);
    }
}

/// Loads [`Volume`]s from DICOM: one file (`.dcm`, `.dicom`, `.ima`, or a name without an ending), a `DICOMDIR`, a `.zip`
/// archive, or a `.dcmlist` with the name of a file on each line. [`DicomReadSettings`] choose the series and the volume.
///
/// Names in a list are relative to it; lines that begin with `#` are ignored. A browser cannot list folders, so an app
/// on the web loads one of these. The label `transfer_function` is the
/// [first look](DicomVolume::first_look).
#[derive(TypePath)]
pub struct DicomLoader {
    loads: DicomLoads,
}

impl FromWorld for DicomLoader {
    fn from_world(world: &mut World) -> Self {
        Self { loads: world.get_resource_or_init::<DicomLoads>().clone() }
    }
}

/// Label of the transfer function in a loaded volume.
const TRANSFER_FUNCTION: &str = "transfer_function";

impl AssetLoader for DicomLoader {
    type Asset = Volume;
    type Settings = DicomReadSettings;
    type Error = VolumeFileError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &DicomReadSettings,
        load_context: &mut LoadContext<'_>,
    ) -> Result<Volume, VolumeFileError> {
        let asset_path = load_context.path().clone_owned();
        let loading = self.loads.begin(&asset_path);
        let path = asset_path.path().to_owned();
        let mut bytes = Vec::new();
        let at = |cause: VolumeError| VolumeFileError { path: path.clone(), cause };
        reader.read_to_end(&mut bytes).await.map_err(|error| at(error.into()))?;
        let found = files(&path, bytes, load_context).await?;
        let dicom = list(found, &loading.progress);
        let chosen = choose(&dicom, settings).map_err(at)?;
        report(&path, &dicom, chosen);
        let volume = chosen.read(settings, &loading.progress)?;
        load_context.add_labeled_asset(TRANSFER_FUNCTION, chosen.first_look(&volume));
        Ok(volume)
    }

    fn extensions(&self) -> &[&str] {
        &["dcm", "dicom", "ima", "IMA", "DCM", "zip", "dcmlist"]
    }
}

/// The files that an asset holds or names.
async fn files(
    path: &Path,
    bytes: Vec<u8>,
    load_context: &mut LoadContext<'_>,
) -> Result<Found, VolumeFileError> {
    let is_list = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dcmlist"));
    let mut found = Found::default();
    let names: Vec<Vec<PathBuf>> = if is_list {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        // Names that leave the folder are refused by Bevy.
        lines.map(|line| vec![PathBuf::from(line)]).collect()
    } else {
        let source = Source::memory(path, bytes);
        match Kind::of(&source).map_err(|cause| source.error(cause))? {
            Kind::Archive => {
                found.archive(source)?;
                return Ok(found);
            }
            Kind::Image => {
                found.sources.push(source);
                return Ok(found);
            }
            Kind::Directory(records) => records.iter().map(|record| spellings(&record.names)).collect(),
        }
    };
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let source = load_context.path().source().clone_owned();
    for names in names {
        let first = folder.join(&names[0]);
        let mut read = None;
        for name in &names {
            let file = folder.join(name);
            let asset = AssetPath::from_path(&file).with_source(source.clone());
            if let Ok(bytes) = load_context.read_asset_bytes(asset).await {
                read = Some(Source::memory(&file, bytes));
                break;
            }
        }
        match read {
            Some(file) => found.sources.push(file),
            None => found.left_out.push(LeftOut { path: first, reason: Reason::NotThere }),
        }
    }
    Ok(found)
}

/// A DICOMDIR's name of a file, in capitals as the standard has it, and as other systems spell it; whole, and without the
/// folders that a copy may lack.
fn spellings(names: &[String]) -> Vec<PathBuf> {
    let whole_and_ends = (0..names.len()).filter_map(|skip| names.get(skip..));
    let paths = whole_and_ends.map(|names| names.iter().collect::<PathBuf>());
    paths.flat_map(|path| [path.clone(), path.to_string_lossy().to_lowercase().into()]).collect()
}

fn choose<'a>(dicom: &'a Dicom, settings: &DicomReadSettings) -> Result<&'a DicomVolume, VolumeError> {
    if dicom.series.is_empty() {
        let reasons: Vec<_> = dicom.left_out.iter().map(|one| one.reason.to_string()).collect();
        let value = reasons.first().cloned().unwrap_or_else(|| "no file".into());
        return Err(VolumeError::field("series", value, "none of the files is a slice of a volume"));
    }
    let series = dicom.series.get(settings.series as usize).ok_or_else(|| {
        let reason = format!("there are {}, counted from 0", dicom.series.len());
        VolumeError::field("series", settings.series, reason)
    })?;
    series.volumes.get(settings.volume as usize).ok_or_else(|| VolumeError::Component {
        count: series.volumes.len() as u64,
        along: series.to_string(),
        chosen: Some(settings.volume),
    })
}

/// Logs the choice and all that was left out, without a word about the patient.
fn report(path: &Path, dicom: &Dicom, chosen: &DicomVolume) {
    let path = path.display();
    if dicom.series.len() > 1 || dicom.series[0].volumes.len() > 1 {
        for (index, series) in dicom.series.iter().enumerate() {
            info!("{path}: series {index} is {series}");
        }
    }
    for warning in chosen.warnings() {
        warn!("{path}: {warning}");
    }
    for (files, reason) in dicom.reasons() {
        info!("{path}: {files} files left out: {reason}");
    }
}
