//! Extinctions of a transfer function and their integrals, as `preintegration.wgsl` has them.

use bevy::prelude::*;

use crate::volume::LookupTable;

/// Optical depth of half a voxel of an opaque intensity, as where it is drawn.
const OPAQUE: f64 = 70.0;

/// A volume's [`LookupTable`] as extinctions: light stopped per length, as optical depth per opacity unit distance.
#[derive(Component)]
pub(crate) struct OpticalDepths {
    /// One row, or several for different gradients.
    rows: Vec<Row>,
    /// Stored intensity of the first entry, and entries per unit of stored intensity.
    first_stored: f64,
    density: f64,
    /// Rows per unit of the gradient, in stored intensities per mm.
    rows_per_gradient: f64,
    pub unit_mm: f64,
}

struct Row {
    extinctions: Vec<f32>,
    /// Integral from the first entry to each.
    integrals: Vec<f64>,
}

impl OpticalDepths {
    fn of(table: &LookupTable) -> Self {
        let unit_mm = f64::from(table.opacity_unit_distance_mm);
        let most = OPAQUE * unit_mm / (0.5 * table.geometry.spacing_mm.min_element());
        let [first_stored, end] = table.stored_range;
        let span = end - first_stored;
        let rows: Vec<_> = table.entries.chunks(LookupTable::ENTRIES).map(|row| Row::of(row, most)).collect();
        let last_row = rows.len().saturating_sub(1) as f64;
        Self {
            rows,
            first_stored,
            density: if span > 0.0 { (LookupTable::ENTRIES - 1) as f64 / span } else { 0.0 },
            rows_per_gradient: table.last_gradient.map_or(0.0, |last| last_row / last),
            unit_mm,
        }
    }

    /// Whether the gradient has an effect.
    pub fn is_by_gradient(&self) -> bool {
        self.rows.len() > 1
    }

    /// Place of a stored intensity in the table, entries.
    pub fn entry(&self, stored: f64) -> f64 {
        (stored - self.first_stored) * self.density
    }

    /// Opacity of an opacity unit distance at an entry, for a gradient in stored intensities per mm.
    pub fn opacity_at(&self, entry: f64, gradient: f64) -> f64 {
        1.0 - (-self.mean_between(entry, entry, gradient)).exp()
    }

    /// Mean extinction over all entries between two, for a gradient in stored intensities per mm.
    pub fn mean_between(&self, a: f64, b: f64, gradient: f64) -> f64 {
        let last = self.rows.len().saturating_sub(1);
        let row = (gradient * self.rows_per_gradient).max(0.0).min(last as f64);
        let below = row as usize;
        let mean = |row: usize| self.rows.get(row).map_or(0.0, |row| row.mean_between(a, b));
        let share = row - below as f64;
        let lower = mean(below);
        if share > 0.0 { lower + share * (mean(below + 1) - lower) } else { lower }
    }
}

impl Row {
    fn of(entries: &[[f32; 4]], most: f64) -> Self {
        let extinction = |&[.., opacity]: &[f32; 4]| {
            let extinction = if opacity < 1.0 { -f64::from(-opacity).ln_1p() } else { most };
            extinction.min(most).max(0.0) as f32
        };
        let extinctions: Vec<_> = entries.iter().map(extinction).collect();
        let mut integrals = vec![0.0; extinctions.len()];
        for k in 1..extinctions.len() {
            let [a, b] = [extinctions[k - 1], extinctions[k]].map(f64::from);
            integrals[k] = integrals[k - 1] + 0.5 * (a + b);
        }
        Self { extinctions, integrals }
    }

    /// Entry at or before a place, and how far the place is behind it. A place beyond the table is far behind or before it.
    fn split(&self, entry: f64) -> (usize, f64) {
        let below = entry.max(0.0).min(self.extinctions.len().saturating_sub(2) as f64) as usize;
        (below, entry - below as f64)
    }

    /// Extinction at an entry, and the integral up to it. Beyond the table the function is constant.
    fn at(&self, entry: f64) -> [f64; 2] {
        let (below, behind) = self.split(entry);
        let value = |k: usize| self.extinctions.get(k).map_or(0.0, |&value| f64::from(value));
        let (a, b) = (value(below), value(below + 1));
        // What is no number counts as none.
        let part = if behind > 0.0 { behind.min(1.0) } else { 0.0 };
        let outside = behind - part;
        let here = a + part * (b - a);
        let integral = self.integrals.get(below).copied().unwrap_or(0.0);
        [here, integral + 0.5 * part * (a + here) + outside * here]
    }

    fn mean_between(&self, a: f64, b: f64) -> f64 {
        // Closer entries leave a difference of integrals too few digits.
        const SAME: f64 = 1e-6;
        let [here, integral] = self.at(a);
        if (b - a).abs() < SAME {
            return here;
        }
        let [_, integral_behind] = self.at(b);
        ((integral_behind - integral) / (b - a)).max(0.0)
    }
}

/// Follows the tables of all volumes.
pub(super) fn update_depths(
    mut commands: Commands,
    volumes: Query<(Entity, &LookupTable), Changed<LookupTable>>,
) {
    for (entity, table) in &volumes {
        commands.entity(entity).try_insert(OpticalDepths::of(table));
    }
}

pub(super) fn remove_depths(
    mut commands: Commands,
    orphans: Query<Entity, (With<OpticalDepths>, Without<LookupTable>)>,
) {
    for entity in &orphans {
        commands.entity(entity).try_remove::<OpticalDepths>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_many_values() {
        let opacity = |k: usize| (0.3 + 0.3 * (k as f32 * 0.7).sin()).powi(2);
        let entries: Vec<_> = (0..50).map(|k| [0.0, 0.0, 0.0, opacity(k)]).collect();
        let row = Row::of(&entries, 100.0);
        for (a, b) in [(3.2, 3.7), (3.2, 41.9), (41.9, 3.2), (-7.0, 5.5), (44.0, 80.0), (12.0, 12.0)] {
            let steps = 100_000;
            let values = (0..steps).map(|k| row.at(a + (b - a) * (f64::from(k) + 0.5) / f64::from(steps))[0]);
            let mean = values.sum::<f64>() / f64::from(steps);
            assert!((row.mean_between(a, b) - mean).abs() < 1e-6, "{a} to {b}");
        }
        let exact = -f64::from(-opacity(7)).ln_1p();
        assert!((row.at(7.0)[0] - exact).abs() < 1e-6);
    }
}
