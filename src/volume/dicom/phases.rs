//! Tells slices at one place apart: echoes, b-values, phases, acquisitions.

use std::collections::BTreeMap;

use super::{
    image::code,
    slice::{Slice, Tells},
};

/// Slices of one volume.
pub(super) struct Phase {
    /// Difference from the other volumes on the grid; empty if there is no other.
    pub label: String,
    pub slices: Vec<Slice>,
    pub warning: Option<String>,
}

/// Slices nearer to each other are at one place, mm. Scanners round positions to hundredths or finer.
const SAME_PLACE_MM: f64 = 0.005;

/// Splits the slices of a grid until no place is taken twice.
pub(super) fn phases(slices: Vec<Slice>) -> Vec<Phase> {
    let mut phases = Vec::new();
    split(Phase { label: String::new(), slices, warning: None }, &DIFFERENCES, &mut phases);
    phases
}

/// A difference between volumes: its name, and a slice's value in an order.
struct Difference {
    name: &'static str,
    of: fn(&Tells) -> Option<Key>,
}

/// A number or a text, in order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    /// Millionths.
    Number(i64),
    Text(String),
}

fn number(value: f64) -> Key {
    Key::Number((value * 1e6).round() as i64)
}

/// Differences by how sure they are: what a slice shows before when it was taken.
const DIFFERENCES: [Difference; 8] = [
    Difference { name: "kind", of: |tells| Some(Key::Text(tells.kind.clone())) },
    Difference { name: "echo time", of: |tells| tells.echo_ms.map(number) },
    Difference { name: "b-value", of: |tells| tells.b_value.map(number) },
    Difference {
        name: "gradient",
        of: |tells| Some(Key::Text(tells.gradient.iter().map(|x| format!("{x:.3} ")).collect())),
    },
    Difference { name: "temporal position", of: |tells| tells.time.map(number) },
    Difference { name: "trigger delay", of: |tells| tells.delay_ms.map(number) },
    Difference { name: "stack", of: |tells| Some(Key::Text(tells.stack.clone())) },
    Difference { name: "acquisition", of: |tells| tells.acquisition.map(number) },
];

fn split(phase: Phase, differences: &[Difference], into: &mut Vec<Phase>) {
    let most = most_at_a_place(&phase.slices);
    if most <= 1 {
        into.push(phase);
        return;
    }
    let Some((difference, others)) = differences.split_first() else {
        by_number(phase, most, into);
        return;
    };
    let mut parts: BTreeMap<Option<Key>, Vec<Slice>> = BTreeMap::new();
    for slice in phase.slices {
        parts.entry((difference.of)(&slice.tells)).or_default().push(slice);
    }
    // More parts than slices at a place are no phases: an acquisition may be a step of the table.
    if parts.len() == 1 || parts.len() > most {
        let slices = parts.into_values().flatten().collect();
        split(Phase { slices, ..phase }, others, into);
        return;
    }
    for (key, slices) in parts {
        let value = match key {
            Some(Key::Number(millionths)) => (millionths as f64 / 1e6).to_string(),
            Some(Key::Text(text)) if !text.is_empty() => code(text.trim()),
            _ => "none".into(),
        };
        let comma = if phase.label.is_empty() { "" } else { ", " };
        let label = format!("{}{comma}{} {value}", phase.label, difference.name);
        split(Phase { label, slices, warning: None }, others, into);
    }
}

/// Splits slices that no field tells apart by the order of their numbers, with a warning.
fn by_number(phase: Phase, most: usize, into: &mut Vec<Phase>) {
    let mut parts: Vec<Vec<Slice>> = vec![Vec::new(); most];
    for mut place in places(phase.slices) {
        place.sort_by_key(|slice| (slice.image.instance_number, slice.frame));
        for (part, slice) in parts.iter_mut().zip(place) {
            part.push(slice);
        }
    }
    for (index, slices) in parts.into_iter().enumerate() {
        let comma = if phase.label.is_empty() { "" } else { ", " };
        let label = format!("{}{comma}pass {}", phase.label, index + 1);
        let warning = format!(
            "{most} slices lie at one place, and no field tells them apart: they are {most} volumes by their \
             InstanceNumber"
        );
        into.push(Phase { label, slices, warning: Some(warning) });
    }
}

fn most_at_a_place(slices: &[Slice]) -> usize {
    let Some(normal) = slices.first().map(Slice::normal) else { return 0 };
    let mut heights: Vec<f64> = slices.iter().map(|slice| slice.position.dot(normal)).collect();
    heights.sort_by(f64::total_cmp);
    heights.chunk_by(|a, b| b - a < SAME_PLACE_MM).map(<[f64]>::len).max().unwrap_or(0)
}

/// Slices by their place.
fn places(mut slices: Vec<Slice>) -> Vec<Vec<Slice>> {
    let Some(normal) = slices.first().map(Slice::normal) else { return Vec::new() };
    let height = |slice: &Slice| slice.position.dot(normal);
    slices.sort_by(|a, b| height(a).total_cmp(&height(b)));
    let same = |a: &Slice, b: &Slice| height(b) - height(a) < SAME_PLACE_MM;
    slices.chunk_by(same).map(<[Slice]>::to_vec).collect()
}
