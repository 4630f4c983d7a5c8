//! The volume that is shown, and what the panel tells about it.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;

use super::content::Content;

/// A volume with its name.
#[derive(Clone, Default)]
pub struct Opened {
    pub volume: Handle<Volume>,
    /// Name of the volume's file, or of its series.
    pub name: String,
    /// The transfer function that the files ask for.
    pub first_look: Option<TransferFunction>,
    /// All that was not as it should be.
    pub warnings: Vec<String>,
}

/// State of the volume for the panel.
#[derive(Resource, Default)]
pub struct Shown {
    /// Name of the volume that is seen.
    pub name: String,
    /// The volume in the scene.
    pub opened: Opened,
    /// Facts about the volume once it has been read.
    pub content: Option<Content>,
    /// Source of the transfer function.
    pub function: FunctionSource,
    /// Reasons why files could not be shown.
    pub errors: Vec<String>,
    /// The volume before, which comes back if the new one cannot be shown.
    pub before: Option<Opened>,
}

impl Shown {
    /// Keeps an error once.
    pub fn note(&mut self, error: String) {
        if !self.errors.contains(&error) {
            self.errors.push(error);
        }
    }

    /// Puts a volume in the scene, and returns the one before. A transfer function from a file stays.
    pub fn put(
        &mut self,
        new: Opened,
        volume: &mut Volume3d,
        function: &mut VolumeTransferFunction,
    ) -> Opened {
        volume.0 = new.volume.clone();
        if self.function != FunctionSource::File {
            function.0 = Handle::default();
        }
        core::mem::replace(&mut self.opened, new)
    }
}

/// Source of a transfer function. A function from a file stays when another volume is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FunctionSource {
    /// Asked for by DICOM files, guessed from the volume's histogram, or the generated head's own.
    #[default]
    Volume,
    Preset(Preset),
    File,
}
