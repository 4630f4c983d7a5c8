//! Files that are dropped on the window.

use bevy::{prelude::*, window::FileDragAndDrop};
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

/// Tells that a file cannot be shown, and the reason.
#[derive(Event, Clone, Debug, PartialEq, Eq)]
pub struct CannotOpen(pub String);

/// Whether a file is held over the window.
#[derive(Resource, Default, PartialEq, Eq)]
pub struct Hovering(pub bool);

/// Content of a file, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    Volume,
    TransferFunction,
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
        } else {
            let [volumes, functions] = [Self::VOLUME.join(", "), Self::TRANSFER_FUNCTION.join(", ")];
            Err(format!("{name}: neither a volume ({volumes}) nor a transfer function ({functions})"))
        }
    }
}

fn read_drops(
    mut commands: Commands,
    mut messages: MessageReader<FileDragAndDrop>,
    mut hovering: ResMut<Hovering>,
) {
    for message in messages.read() {
        let is_hovered = matches!(message, FileDragAndDrop::HoveredFile { .. });
        hovering.set_if_neq(Hovering(is_hovered));
        if let FileDragAndDrop::DroppedFile { path_buf: path, .. } = message {
            match FileKind::of(path) {
                Ok(kind) => commands.trigger(OpenFile { path: path.clone(), kind }),
                Err(reason) => commands.trigger(CannotOpen(reason)),
            }
        }
    }
}
