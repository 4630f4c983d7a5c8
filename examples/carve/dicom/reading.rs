//! Reads the volume that was chosen from the list.

use bevy::prelude::*;
use bevy_contextual_ao::{prelude::*, volume::dicom::DicomProgress};
use contextual_ao_kit::dicom::{Choice, settings, title};

use super::{
    super::{
        dropping::{FileKind, OpenFile},
        loading::Show,
        shown::{Opened, Shown},
    },
    list::SeriesList,
    work::Work,
};

/// Asks to read a volume of the list, and to show it.
#[derive(Event, Clone, Copy, Debug)]
pub struct OpenVolume(pub Choice);

/// The volume that is being read, and the one that was read last.
#[derive(Resource, Default)]
pub struct Reading {
    now: Option<Now>,
    /// The list's number, the choice and the volume.
    last: Option<(u64, Choice, Handle<Volume>)>,
}

struct Now {
    work: Work<Result<(Volume, TransferFunction), String>>,
    choice: Choice,
    list: u64,
    title: String,
    warnings: Vec<String>,
}

impl Reading {
    /// Name of the volume that is being read, and the progress.
    pub fn progress(&self) -> Option<(&str, &DicomProgress)> {
        let now = self.now.as_ref()?;
        Some((&now.title, &now.work.progress))
    }

    /// The volume of a list that is in the scene.
    pub fn chosen(&self, list: &SeriesList, shown: &Shown) -> Option<Choice> {
        let (number, choice, volume) = self.last.as_ref()?;
        (*number == list.number && *volume == shown.opened.volume).then_some(*choice)
    }
}

/// Begins to read a volume. Another one that is being read is given up.
pub fn begin(
    open: On<OpenVolume>,
    list: Res<SeriesList>,
    budget: Res<VolumeBudget>,
    mut reading: ResMut<Reading>,
    mut shown: ResMut<Shown>,
) {
    shown.errors.clear();
    reading.now = None;
    let choice = open.0;
    let Some(dicom) = list.found.as_ref().map(|found| found.dicom.clone()) else {
        return;
    };
    let Some((series, listed)) = choice.of(&dicom) else {
        return;
    };
    let title = title(series, choice.volume);
    let settings = match settings(listed, &budget) {
        Ok(settings) => settings,
        Err(reason) => return shown.note(format!("{title}: {reason}")),
    };
    let volume = listed.clone();
    reading.now = Some(Now {
        work: Work::begin(move |progress| {
            let read = volume.read(&settings, progress).map_err(|error| error.cause.to_string())?;
            let first_look = volume.first_look(&read);
            Ok((read, first_look))
        }),
        choice,
        list: list.number,
        title,
        warnings: listed.warnings().to_vec(),
    });
}

/// Shows the volume once it has been read.
pub fn finish(
    mut commands: Commands,
    mut reading: ResMut<Reading>,
    mut volumes: ResMut<Assets<Volume>>,
    mut shown: ResMut<Shown>,
) {
    let Some(result) = reading.now.as_mut().and_then(|now| now.work.result()) else {
        return;
    };
    let Some(Now { choice, list, title, warnings, .. }) = reading.now.take() else {
        return;
    };
    match result {
        Ok((volume, first_look)) => {
            let volume = volumes.add(volume);
            reading.last = Some((list, choice, volume.clone()));
            let first_look = Some(first_look);
            commands.trigger(Show(Opened { volume, name: title, first_look, warnings }));
        }
        Err(cause) => shown.note(format!("{title}: {cause}")),
    }
}

/// Gives up reading when another file is opened.
pub fn give_up(open: On<OpenFile>, mut reading: ResMut<Reading>) {
    if open.kind == FileKind::Volume {
        reading.now = None;
    }
}
