//! Files and folders that are dropped on the window.

use bevy::{prelude::*, window::FileDragAndDrop};
use contextual_ao_kit::dicom::is_dicom;
use std::path::{Path, PathBuf};

pub struct DroppingPlugin;

impl Plugin for DroppingPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Hovering>().add_systems(PreUpdate, read_drops);
    }
}

/// Asks to show a file in place of the current file.
#[derive(Event, Clone, Debug, PartialEq, Eq)]
pub struct OpenFile {
    pub path: PathBuf,
    pub kind: FileKind,
}

/// Asks to list the series of folders, archives and files.
#[derive(Event, Clone, Debug, Default, PartialEq, Eq)]
pub struct OpenDicom {
    pub paths: Vec<PathBuf>,
    /// Index of the series that is opened at once.
    pub series: Option<u32>,
    /// Index of the volume in that series.
    pub component: Option<u32>,
}

/// Tells that a file cannot be shown, and the reason.
#[derive(Event, Clone, Debug, PartialEq, Eq)]
pub struct CannotOpen(pub String);

/// Whether a file is held over the window.
#[derive(Resource, Default, PartialEq, Eq)]
pub struct Hovering(pub bool);

/// Content of a file or folder, by its name, and for DICOM also by its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    Volume,
    TransferFunction,
    Dicom,
}

impl FileKind {
    const VOLUME: [&str; 8] = [".nii", ".nii.gz", ".hdr", ".hdr.gz", ".nrrd", ".nhdr", ".mha", ".mhd"];
    const TRANSFER_FUNCTION: [&str; 3] = [".vp", ".vp.json", ".tf.ron"];

    /// Kind of a file, or the reason why it has none.
    pub fn of(path: &Path) -> Result<Self, String> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let lower = name.to_ascii_lowercase();
        let ends_in = |endings: &[&str]| endings.iter().any(|ending| lower.ends_with(ending));
        if ends_in(&Self::VOLUME) {
            Ok(Self::Volume)
        } else if ends_in(&Self::TRANSFER_FUNCTION) {
            Ok(Self::TransferFunction)
        } else if is_dicom(path) {
            Ok(Self::Dicom)
        } else {
            let [volumes, functions] = [Self::VOLUME.join(", "), Self::TRANSFER_FUNCTION.join(", ")];
            Err(format!(
                "{name}: neither a volume ({volumes}), nor DICOM, nor a transfer function ({functions})"
            ))
        }
    }
}

fn read_drops(
    mut commands: Commands,
    mut messages: MessageReader<FileDragAndDrop>,
    mut hovering: ResMut<Hovering>,
) {
    // All files of a series may be dropped at once.
    let mut dicom = Vec::new();
    for message in messages.read() {
        let is_hovered = matches!(message, FileDragAndDrop::HoveredFile { .. });
        hovering.set_if_neq(Hovering(is_hovered));
        if let FileDragAndDrop::DroppedFile { path_buf: path, .. } = message {
            match FileKind::of(path) {
                Ok(FileKind::Dicom) => dicom.push(path.clone()),
                Ok(kind) => commands.trigger(OpenFile { path: path.clone(), kind }),
                Err(reason) => commands.trigger(CannotOpen(reason)),
            }
        }
    }
    if !dicom.is_empty() {
        commands.trigger(OpenDicom { paths: dicom, ..default() });
    }
}
