//! The volume that is read, and how it is read.

use bevy::prelude::*;
use bevy_contextual_ao::{
    prelude::*,
    volume::dicom::{Dicom, DicomReadSettings, DicomSeries, DicomVolume},
};

use super::reasons;

/// A volume among those of a folder, by indices from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    pub series: usize,
    /// Index among the volumes of the series.
    pub volume: usize,
}

impl Choice {
    /// The series and its volume, if they are there.
    pub fn of(self, dicom: &Dicom) -> Option<(&DicomSeries, &DicomVolume)> {
        let series = dicom.series.get(self.series)?;
        Some((series, series.volumes.get(self.volume)?))
    }
}

/// Chooses a volume by the options `--series` and `--component`. Without them it is the first volume of the series with
/// the most voxels.
pub fn choose(dicom: &Dicom, series: Option<u32>, component: Option<u32>) -> Result<Choice, String> {
    let Some(largest) = largest(dicom) else {
        let reasons = reasons(dicom);
        let why = if reasons.is_empty() { "there is no file".into() } else { reasons.join("; ") };
        return Err(format!("no volume: {why}"));
    };
    let choice = Choice {
        series: series.map_or(largest, |series| series as usize),
        volume: component.map_or(0, |component| component as usize),
    };
    let Some(chosen) = dicom.series.get(choice.series) else {
        return Err(format!("--series {}: there are {}, counted from 0", choice.series, dicom.series.len()));
    };
    if choice.volume >= chosen.volumes.len() {
        let count = chosen.volumes.len();
        return Err(format!("--component {}: the series has {count}, counted from 0", choice.volume));
    }
    Ok(choice)
}

/// Index of the series with the most voxels; of equal ones the first.
fn largest(dicom: &Dicom) -> Option<usize> {
    let voxels = |series: &DicomSeries| series.volumes.iter().map(voxels).sum::<u64>();
    let sizes = dicom.series.iter().map(voxels).enumerate();
    sizes.rev().max_by_key(|(_, voxels)| *voxels).map(|(index, _)| index)
}

/// Voxels of a volume if nothing limits them.
fn voxels(volume: &DicomVolume) -> u64 {
    let unlimited = DicomReadSettings { max_bytes: u64::MAX, ..default() };
    volume.grid(&unlimited).map_or(0, |grid| grid.dimensions.as_u64vec3().element_product())
}

/// Settings that read a volume within a budget, or why it is refused. A budget that halves has it read at half its
/// resolution or less.
pub fn settings(volume: &DicomVolume, budget: &VolumeBudget) -> Result<DicomReadSettings, String> {
    let with = |halvings| DicomReadSettings { max_bytes: budget.max_bytes, halvings, ..default() };
    let Err(refused) = volume.grid(&with(0)) else {
        return Ok(with(0));
    };
    let cause = refused.cause;
    match (1..=8).find(|&halvings| volume.grid(&with(halvings)).is_ok()) {
        Some(halvings) if budget.halves => Ok(with(halvings)),
        Some(_) => Err(format!("{cause} (option --halve)")),
        None => Err(cause.to_string()),
    }
}
