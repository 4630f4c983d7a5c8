//! Errors of values against the truth, as they are and with their brightness fitted by one factor.

/// Errors of a set of values. Without values all numbers are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fit {
    pub count: u64,
    /// Root mean square of the differences.
    pub rms: f64,
    /// Factor on the values that brings them nearest to the truth.
    pub factor: f64,
    /// Root mean square of the differences with this factor.
    pub fitted_rms: f64,
    /// Correlation of the values with the truth (Pearson); 0 if either does not vary.
    pub correlation: f64,
}

impl Fit {
    /// Fit of pairs of a value and the true value.
    pub fn of(pairs: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let (mut count, mut sums, mut products) = (0u64, [0.0; 2], [0.0; 3]);
        for [value, truth] in pairs {
            count += 1;
            sums = [sums[0] + value, sums[1] + truth];
            products =
                [products[0] + value * value, products[1] + value * truth, products[2] + truth * truth];
        }
        if count == 0 {
            return Self::default();
        }
        let of = |sum: f64| sum / count as f64;
        let [squares, mixed, true_squares] = products.map(of);
        let factor = if squares > 0.0 { mixed / squares } else { 1.0 };
        let rms_by =
            |factor: f64| (true_squares - 2.0 * factor * mixed + factor * factor * squares).max(0.0).sqrt();
        let [mean, true_mean] = sums.map(of);
        let spread =
            (squares - mean * mean).max(0.0).sqrt() * (true_squares - true_mean * true_mean).max(0.0).sqrt();
        let correlation = if spread > 1e-12 { (mixed - mean * true_mean) / spread } else { 0.0 };
        Self { count, rms: rms_by(1.0), factor, fitted_rms: rms_by(factor), correlation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_half_as_bright_fit_by_a_factor_of_two() {
        let fit = Fit::of([[0.1, 0.2], [0.3, 0.6], [0.5, 1.0]]);
        assert_eq!(fit.count, 3);
        assert!((fit.factor - 2.0).abs() < 1e-12 && fit.fitted_rms < 1e-7, "{fit:?}");
        // The root of (0.01 + 0.09 + 0.25) / 3.
        assert!((fit.rms - 0.341_565).abs() < 1e-6 && (fit.correlation - 1.0).abs() < 1e-9, "{fit:?}");
    }

    #[test]
    fn values_that_say_nothing_do_not_correlate() {
        assert_eq!(Fit::of([]), Fit::default());
        let fit = Fit::of([[0.5, 0.1], [0.5, 0.9]]);
        assert_eq!((fit.factor, fit.correlation), (1.0, 0.0));
        let fit = Fit::of([[0.1, 0.9], [0.9, 0.1]]);
        assert!((fit.correlation + 1.0).abs() < 1e-9, "{fit:?}");
    }
}
