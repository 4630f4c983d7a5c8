//! Rows of the lookup table that hold integrals over intensities (`preintegration.wgsl`).

/// Number of these rows. They follow those of the occlusion method.
pub(super) const ROWS: u32 = 4;

/// Optical depth of a drawing step through an opaque intensity: a hundredth of a step is then half opaque.
const OPAQUE_STEP: f64 = 70.0;

/// Lengths over which opacities accumulate, in opacity unit distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StepLengths {
    pub drawing: f32,
    pub occlusion: f32,
}

/// The rows for a transfer function's entries: linear colour, and opacity per unit distance.
pub(super) fn rows(entries: &[[f32; 4]], steps: StepLengths) -> Vec<[f32; 4]> {
    let most = OPAQUE_STEP / f64::from(steps.drawing).max(1e-6);
    let extinction = |entry: &[f32; 4]| {
        let [r, g, b, opacity] = entry.map(f64::from);
        let extinction = if opacity < 1.0 { (-(-opacity).ln_1p()).min(most) } else { most };
        [r * extinction, g * extinction, b * extinction, extinction]
    };
    let extinctions: Vec<_> = entries.iter().map(extinction).collect();
    let integrals: Vec<_> = integral(&extinctions).collect();
    let occlusion = |entry: &[f32; 4]| [1.0 - (1.0 - f64::from(entry[3])).powf(steps.occlusion.into())];
    let opacities: Vec<_> = entries.iter().map(occlusion).collect();
    let single = |values: &[f64; 4]| values.map(|value| value as f32);
    let rest = |values: &[f64; 4]| values.map(rest_of);
    let of_occlusion = opacities.iter().zip(integral(&opacities));
    extinctions
        .iter()
        .map(single)
        .chain(integrals.iter().map(single))
        .chain(integrals.iter().map(rest))
        .chain(of_occlusion.map(|(&[opacity], [sum])| [opacity as f32, sum as f32, rest_of(sum), 0.0]))
        .collect()
}

/// Integral of values, linear between entries, from the first entry up to each.
fn integral<const N: usize>(values: &[[f64; N]]) -> impl Iterator<Item = [f64; N]> {
    let mut sum = [0.0; N];
    values.iter().enumerate().map(move |(k, value)| {
        for (axis, sum) in sum.iter_mut().enumerate().filter(|_| k > 0) {
            *sum += 0.5 * (value[axis] + values[k - 1][axis]);
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
        let row = |k: usize| &rows[4096 * k..4096 * (k + 1)];
        let integral = |k: usize| f64::from(row(1)[k][3]) + f64::from(row(2)[k][3]);
        let mean = (integral(4000) - integral(3500)) / 500.0;
        let expected = -(1.0f64 - f64::from(1e-3f32)).ln();
        assert!((mean / expected - 1.0).abs() < 1e-3, "{mean} for {expected}");
        assert_eq!(integral(0), 0.0);
        let opaque_step = 1.0 - (-0.5 * (integral(2000) - integral(1000)) / 1000.0).exp();
        assert!(opaque_step > 0.999, "a step through opaque entries is {opaque_step}");
        let occlusion = f64::from(row(3)[4000][1] - row(3)[3500][1]) / 500.0;
        assert!((occlusion - 2e-3).abs() < 1e-4, "{occlusion}");
    }
}
