//! Rows of the lookup table's texture (`preintegration.wgsl`).

/// Number of rows for a gradient: colour and opacity, then integrals of the extinction and of the occlusion's opacity.
pub(super) const ROWS: u32 = 3;

/// Optical depth of a drawing step through an opaque intensity: a hundredth of a step is then half opaque.
const OPAQUE_STEP: f64 = 70.0;

/// Lengths over which opacities accumulate, in opacity unit distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StepLengths {
    pub drawing: f32,
    pub occlusion: f32,
}

/// The rows for a transfer function's entries at a gradient: linear colour, and opacity per unit distance.
pub(super) fn rows(entries: &[[f32; 4]], steps: StepLengths) -> Vec<[f32; 4]> {
    let most = OPAQUE_STEP / f64::from(steps.drawing).max(1e-6);
    let opacities = || entries.iter().map(|entry| f64::from(entry[3]));
    let extinction = |opacity: f64| if opacity < 1.0 { (-(-opacity).ln_1p()).min(most) } else { most };
    let occlusion = |opacity: f64| 1.0 - (1.0 - opacity).powf(steps.occlusion.into());
    let extinctions: Vec<_> = opacities().map(extinction).collect();
    let occlusions: Vec<_> = opacities().map(occlusion).collect();
    [entries.to_vec(), row(&extinctions), row(&occlusions)].concat()
}

/// A function's row: its value at each entry and at the next one, its integral up to the entry, and what single precision
/// loses of that.
fn row(values: &[f64]) -> Vec<[f32; 4]> {
    let next = |k: usize| values[(k + 1).min(values.len() - 1)];
    let entries = values.iter().zip(integral(values)).enumerate();
    entries.map(|(k, (&value, sum))| [value as f32, next(k) as f32, sum as f32, rest_of(sum)]).collect()
}

/// Integral of values, linear between entries, from the first entry up to each.
fn integral(values: &[f64]) -> impl Iterator<Item = f64> {
    let mut sum = 0.0;
    values.iter().enumerate().map(move |(k, value)| {
        if k > 0 {
            sum += 0.5 * (value + values[k - 1]);
        }
        sum
    })
}

/// What a number loses in single precision.
fn rest_of(value: f64) -> f32 {
    (value - f64::from(value as f32)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_keep_small_extinctions_behind_large_ones() {
        // Opaque entries, then translucent ones.
        let opacity = |k: usize| if k < 3000 { 1.0 } else { 1e-3 };
        let entries: Vec<_> = (0..4096).map(|k| [1.0, 0.5, 0.0, opacity(k)]).collect();
        let rows = rows(&entries, StepLengths { drawing: 0.5, occlusion: 2.0 });
        let row = |k: usize| &rows[4096 * (k + 1)..4096 * (k + 2)];
        let integral = |k: usize| f64::from(row(0)[k][2]) + f64::from(row(0)[k][3]);
        let mean = (integral(4000) - integral(3500)) / 500.0;
        let expected = -(1.0f64 - f64::from(1e-3f32)).ln();
        assert!((mean / expected - 1.0).abs() < 1e-3, "{mean} for {expected}");
        assert_eq!(integral(0), 0.0);
        let opaque_step = 1.0 - (-0.5 * (integral(2000) - integral(1000)) / 1000.0).exp();
        assert!(opaque_step > 0.999, "a step through opaque entries is {opaque_step}");
        let occlusion = f64::from(row(1)[4000][2] - row(1)[3500][2]) / 500.0;
        assert!((occlusion - 2e-3).abs() < 1e-4, "{occlusion}");
    }
}
