//! The list of series: what was found in folders, archives and files.

use bevy::prelude::*;
use bevy_contextual_ao::{
    prelude::*,
    volume::{
        VolumeFileError,
        dicom::{Dicom, DicomProgress, DicomSeries, DicomVolume, read_dicom_with},
    },
};
use contextual_ao_kit::dicom::{choose, facts, picture, reasons, series_title, settings};
use image::GrayImage;
use std::sync::Arc;

use super::{
    super::{dropping::OpenDicom, shown::Shown},
    reading::OpenVolume,
    work::Work,
};

/// Width and height of a picture, pixels.
const PICTURE: u32 = 128;

/// The series that were found last.
#[derive(Resource, Default)]
pub struct SeriesList {
    pub found: Option<Found>,
    /// Number of lists before this one.
    pub number: u64,
    listing: Option<Listing>,
    /// The picture that is being made, and its series.
    drawing: Option<(usize, Work<Result<GrayImage, VolumeFileError>>)>,
}

/// Files that are being looked at.
struct Listing {
    work: Work<Result<Dicom, VolumeFileError>>,
    /// The series and the volume that are opened at once.
    wanted: [Option<u32>; 2],
}

/// Series, and files that belong to none.
pub struct Found {
    pub dicom: Arc<Dicom>,
    pub entries: Vec<Entry>,
    /// Reasons of files that are left out.
    pub left_out: Vec<String>,
}

/// A series in the list.
pub struct Entry {
    pub title: String,
    pub picture: Picture,
    pub volumes: Vec<VolumeEntry>,
}

/// A series' picture.
#[derive(Default)]
pub enum Picture {
    #[default]
    ToCome,
    Made(GrayImage),
    /// The reason why the middle slice cannot be read.
    Failed(String),
}

/// A volume of a series in the list.
pub struct VolumeEntry {
    /// Difference from the series' other volumes, the slices, the voxels and their distances.
    pub text: String,
    /// Reason why it cannot be shown.
    pub refused: Option<String>,
}

impl SeriesList {
    /// Progress of looking at files.
    pub fn progress(&self) -> Option<&DicomProgress> {
        Some(&self.listing.as_ref()?.work.progress)
    }
}

impl Entry {
    fn of(series: &DicomSeries, budget: &VolumeBudget) -> Self {
        let volume = |volume: &DicomVolume| {
            let label = volume.label();
            let text = if label.is_empty() { facts(volume) } else { format!("{label}: {}", facts(volume)) };
            VolumeEntry { text, refused: settings(volume, budget).err() }
        };
        Self {
            title: series_title(series),
            picture: Picture::default(),
            volumes: series.volumes.iter().map(volume).collect(),
        }
    }
}

/// Begins to look at files. A list before stays until these are listed.
pub fn begin(open: On<OpenDicom>, mut list: ResMut<SeriesList>, mut shown: ResMut<Shown>) {
    shown.errors.clear();
    let paths = open.paths.clone();
    list.listing = Some(Listing {
        work: Work::begin(move |progress| read_dicom_with(&paths, progress)),
        wanted: [open.series, open.component],
    });
}

/// Lists what was found. A volume alone, or one that is asked for, is opened at once.
pub fn finish(
    mut commands: Commands,
    budget: Res<VolumeBudget>,
    mut list: ResMut<SeriesList>,
    mut shown: ResMut<Shown>,
) {
    let Some(listing) = &mut list.listing else {
        return;
    };
    let Some(result) = listing.work.result() else {
        return;
    };
    let [series, component] = listing.wanted;
    list.listing = None;
    let dicom = match result {
        Ok(dicom) => Arc::new(dicom),
        Err(error) => return shown.note(error.cause.to_string()),
    };
    list.number += 1;
    list.drawing = None;
    list.found = Some(Found {
        entries: dicom.series.iter().map(|series| Entry::of(series, &budget)).collect(),
        left_out: reasons(&dicom),
        dicom: dicom.clone(),
    });
    let volumes = dicom.series.iter().map(|series| series.volumes.len()).sum::<usize>();
    match choose(&dicom, series, component) {
        Ok(choice) if volumes == 1 || series.or(component).is_some() => commands.trigger(OpenVolume(choice)),
        Ok(_) => (),
        Err(reason) => shown.note(reason),
    }
}

/// Makes the pictures of the list, one after the other: a volume that is clicked need not wait for all of them.
pub fn make_pictures(mut list: ResMut<SeriesList>) {
    let SeriesList { found: Some(found), drawing, .. } = &mut *list else {
        return;
    };
    if let Some((index, work)) = drawing {
        let Some(result) = work.result() else {
            return;
        };
        if let Some(entry) = found.entries.get_mut(*index) {
            entry.picture = match result {
                Ok(picture) => Picture::Made(picture),
                Err(error) => Picture::Failed(error.cause.to_string()),
            };
        }
        *drawing = None;
    }
    let next = found.entries.iter().position(|entry| matches!(entry.picture, Picture::ToCome));
    if let Some(index) = next {
        let dicom = found.dicom.clone();
        *drawing = Some((index, Work::begin(move |_| picture(&dicom.series[index].volumes[0], PICTURE))));
    }
}
