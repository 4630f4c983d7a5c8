//! Series and volumes as text.

use bevy::prelude::*;
use bevy_contextual_ao::volume::dicom::{Dicom, DicomReadSettings, DicomSeries, DicomVolume};

use super::Choice;
use crate::digits::significant;

/// Name of a series: its scanner's kind, and its number in the study.
pub fn series_title(series: &DicomSeries) -> String {
    let modality = if series.modality.is_empty() { "unknown kind" } else { &series.modality };
    match series.number {
        Some(number) => format!("{modality} series {number}"),
        None => modality.into(),
    }
}

/// Name of a volume: its series, and its difference from the others in it.
pub fn title(series: &DicomSeries, volume: usize) -> String {
    let name = series_title(series);
    let label = series.volumes.get(volume).map(DicomVolume::label).unwrap_or_default();
    match (label, series.volumes.len()) {
        ("", 0 | 1) => name,
        ("", _) => format!("{name}, volume {volume}"),
        (label, _) => format!("{name}, {label}"),
    }
}

/// The slices in the files, and the voxels and their distances, in one line.
pub fn facts(volume: &DicomVolume) -> String {
    let slices = volume.slices();
    let unlimited = DicomReadSettings { max_bytes: u64::MAX, ..default() };
    match volume.grid(&unlimited) {
        Ok(grid) => {
            let size = grid.dimensions;
            let [x, y, z] = grid.spacing_mm().to_array().map(significant);
            format!("{slices} slices, {} x {} x {} voxels of {x} x {y} x {z} mm", size.x, size.y, size.z)
        }
        Err(error) => format!("{slices} slices, {}", error.cause),
    }
}

/// Reasons of files that are left out, with the number of files: a line each.
pub fn reasons(dicom: &Dicom) -> Vec<String> {
    let plural = |files| if files == 1 { "file" } else { "files" };
    dicom.reasons().iter().map(|(files, reason)| format!("{files} {}: {reason}", plural(*files))).collect()
}

/// All volumes, with the options that choose them, and all reasons of files that are left out.
pub fn list(dicom: &Dicom, chosen: Choice) -> String {
    let mut lines = Vec::new();
    for (s, series) in dicom.series.iter().enumerate() {
        for (v, volume) in series.volumes.iter().enumerate() {
            let mark = if chosen == (Choice { series: s, volume: v }) { ">" } else { " " };
            let component =
                if series.volumes.len() > 1 { format!(" --component {v}") } else { String::new() };
            lines.push(format!("{mark} --series {s}{component}: {}, {}", title(series, v), facts(volume)));
        }
    }
    lines.extend(reasons(dicom).iter().map(|reason| format!("  left out, {reason}")));
    lines.join("\n")
}
