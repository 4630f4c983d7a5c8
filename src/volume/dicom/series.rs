//! Sorts slices into series, and the slices of a series into grids.

use std::collections::{HashMap, hash_map};

use bevy::math::DVec3;

use super::{
    left_out::{LeftOut, Reason},
    phases::{Phase, phases},
    slice::Slice,
    stack::Stack,
    volume::{DicomSeries, DicomVolume},
};

/// Largest difference of directions within a volume.
const SAME_DIRECTION: f64 = 1e-3;
/// Largest relative difference of pixel spacings within a volume.
const SAME_SPACING: f64 = 1e-3;

/// Sorts slices into series, the largest first.
pub(super) fn sort(slices: Vec<Slice>, left_out: &mut Vec<LeftOut>) -> Vec<DicomSeries> {
    let mut series: Vec<Vec<Slice>> = Vec::new();
    let mut by_uid = HashMap::new();
    for slice in without_duplicates(slices, left_out) {
        let index = *by_uid.entry(slice.image.series.clone()).or_insert(series.len());
        if index == series.len() {
            series.push(Vec::new());
        }
        series[index].push(slice);
    }
    let mut series: Vec<_> = series
        .into_iter()
        .map(|slices| one_series(slices, left_out))
        .filter(|one| !one.volumes.is_empty())
        .collect();
    series.sort_by_key(|one| std::cmp::Reverse(one.volumes.iter().map(DicomVolume::slices).sum::<usize>()));
    series
}

/// Leaves out images that are there twice.
fn without_duplicates(slices: Vec<Slice>, left_out: &mut Vec<LeftOut>) -> Vec<Slice> {
    let mut first = HashMap::new();
    let mut told = HashMap::new();
    let mut kept = Vec::with_capacity(slices.len());
    for slice in slices {
        let instance = &slice.image.instance;
        // An image without an identifier is no other's duplicate.
        if instance.is_empty() {
            kept.push(slice);
            continue;
        }
        match first.entry((instance.clone(), slice.frame)) {
            hash_map::Entry::Vacant(vacant) => {
                vacant.insert(slice.image.source.path.clone());
                kept.push(slice);
            }
            hash_map::Entry::Occupied(of) => {
                let path = slice.image.source.path.clone();
                if told.insert(path.clone(), ()).is_none() {
                    left_out.push(LeftOut { path, reason: Reason::Duplicate { of: of.get().clone() } });
                }
            }
        }
    }
    kept
}

fn one_series(slices: Vec<Slice>, left_out: &mut Vec<LeftOut>) -> DicomSeries {
    let (modality, number) = slices
        .first()
        .map(|slice| (slice.image.modality.clone(), slice.image.series_number))
        .unwrap_or_default();
    let mut volumes = Vec::new();
    for grid in grids(slices) {
        for Phase { label, slices, warning } in phases(grid) {
            let paths = paths(&slices);
            match Stack::of(slices) {
                Ok(stack) => volumes.push(DicomVolume::new(label, stack, warning)),
                Err(reason) => left_out.extend(leave_out(paths, reason)),
            }
        }
    }
    // Stable: phases keep their order.
    volumes.sort_by_key(|volume| std::cmp::Reverse(volume.slices()));
    DicomSeries { modality, number, volumes }
}

/// The slices' files, each once.
fn paths(slices: &[Slice]) -> Vec<std::path::PathBuf> {
    let mut paths: Vec<_> = slices.iter().map(|slice| slice.image.source.path.clone()).collect();
    paths.sort();
    paths.dedup();
    paths
}

/// The first file with the reason; the others with a reference to it would say no more.
fn leave_out(paths: Vec<std::path::PathBuf>, reason: Reason) -> Vec<LeftOut> {
    let text = reason.to_string();
    let mut reason = Some(reason);
    let reasons = paths.into_iter().map(|path| {
        let reason = reason.take().unwrap_or_else(|| Reason::WithOthers(text.clone()));
        LeftOut { path, reason }
    });
    reasons.collect()
}

/// Slices that can lie in one grid.
fn grids(slices: Vec<Slice>) -> Vec<Vec<Slice>> {
    let mut grids: Vec<Vec<Slice>> = Vec::new();
    let mut by_size: HashMap<_, Vec<usize>> = HashMap::new();
    for slice in slices {
        let image = &slice.image;
        let size = (image.columns, image.rows, image.format.bits_allocated, image.frame_of_reference.clone());
        let candidates = by_size.entry(size).or_default();
        match candidates.iter().find(|&&index| fits(&grids[index][0], &slice)) {
            Some(&index) => grids[index].push(slice),
            None => {
                candidates.push(grids.len());
                grids.push(vec![slice]);
            }
        }
    }
    grids
}

fn fits(a: &Slice, b: &Slice) -> bool {
    let same = |a: DVec3, b: DVec3| a.abs_diff_eq(b, SAME_DIRECTION);
    let close = |a: f64, b: f64| (a - b).abs() <= SAME_SPACING * a;
    let spacings = a.spacing.into_iter().zip(b.spacing).all(|(a, b)| close(a, b));
    same(a.axes[0], b.axes[0]) && same(a.axes[1], b.axes[1]) && spacings
}
