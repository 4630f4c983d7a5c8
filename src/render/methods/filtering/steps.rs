//! Passes that find the occlusion of a volume, and their order.

use bevy::prelude::*;

use crate::occlusion::{OcclusionFiltering, OpacityModulation};

/// A quantity of the densities around every voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Mean,
    /// Mean of the squared densities.
    Square,
    /// Lowest and highest density.
    Extrema,
}

impl Quantity {
    pub const ALL: [Self; 3] = [Self::Mean, Self::Square, Self::Extrema];
}

/// Output of the estimate, from the shares of voxels that are not denser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The occlusion factor.
    Factors,
    /// The occlusion factor, and the share of the opacity that is drawn, by the variance.
    Modulated,
    /// The share itself, from which its gradient is found.
    Shares,
}

impl Outcome {
    pub const ALL: [Self; 3] = [Self::Factors, Self::Modulated, Self::Shares];
}

/// One dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// One invocation a voxel, as in the last two steps. Filters have one invocation a line.
    Densities,
    Filter {
        quantity: Quantity,
        /// Number of axes filtered before.
        turn: usize,
    },
    Estimate(Outcome),
    Gradient,
}

/// Axes in the order of filtering. Along the last axis neighbours in memory are on one line, not side by side. Only
/// there does a device have to fetch voxels one by one.
pub(super) const AXES: [u32; 3] = [1, 2, 0];

/// Quantities to filter: only those that the estimate and the modulation need.
pub(super) fn quantities(settings: &OcclusionFiltering) -> Vec<Quantity> {
    let is_needed = |quantity: &Quantity| match quantity {
        Quantity::Mean => true,
        Quantity::Square => settings.filters_squares(),
        Quantity::Extrema => settings.filters_extrema(),
    };
    Quantity::ALL.into_iter().filter(is_needed).collect()
}

/// All dispatches, in order. All quantities are filtered along one axis before any is filtered along the next: in the
/// first turn all read the densities.
pub(super) fn steps(settings: &OcclusionFiltering) -> Vec<Step> {
    let quantities = quantities(settings);
    let filters = (0..AXES.len())
        .flat_map(|turn| quantities.iter().map(move |&quantity| Step::Filter { quantity, turn }));
    let end: &[Step] = match settings.modulation {
        OpacityModulation::None => &[Step::Estimate(Outcome::Factors)],
        OpacityModulation::Variance(_) => &[Step::Estimate(Outcome::Modulated)],
        OpacityModulation::Gradient(_) => &[Step::Estimate(Outcome::Shares), Step::Gradient],
    };
    [Step::Densities].into_iter().chain(filters).chain(end.iter().copied()).collect()
}

impl Step {
    /// Number of invocations. Filters have one for each line, however wide the interval is.
    pub fn invocations(self, dimensions: UVec3) -> u32 {
        let voxels = dimensions.element_product();
        match self {
            Self::Filter { turn, .. } => voxels / dimensions[AXES[turn] as usize],
            _ => voxels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occlusion::{DensityEstimate, MethodSettings};

    #[test]
    fn work_does_not_grow_with_the_radius() {
        let dimensions = UVec3::new(5, 7, 11);
        let dispatches = |radius_mm, estimate| {
            let settings = OcclusionFiltering { radius_mm: Some(radius_mm), estimate, ..default() };
            steps(&settings).into_iter().map(|step| (step, step.invocations(dimensions))).collect::<Vec<_>>()
        };
        for estimate in [DensityEstimate::Chebyshev, DensityEstimate::Power, DensityEstimate::Gaussian] {
            let narrow = dispatches(1.0, estimate);
            assert_eq!(narrow, dispatches(100.0, estimate));
            // Each estimate filters two quantities.
            assert_eq!(narrow.len(), 8);
            let lines: u32 = narrow[1..7].iter().map(|(_, invocations)| invocations).sum();
            assert_eq!(lines, 2 * (5 * 11 + 5 * 7 + 7 * 11));
        }
    }

    #[test]
    fn only_what_is_needed_is_filtered() {
        let by_variance = OcclusionFiltering { modulation: OpacityModulation::Variance(0.1), ..default() };
        assert_eq!(quantities(&by_variance), Quantity::ALL);
        // Each quantity has two buffers of one word a voxel.
        assert_eq!(by_variance.bytes(UVec3::ONE).total, 24);
        let gaussian = OcclusionFiltering { estimate: DensityEstimate::Gaussian, ..default() };
        assert_eq!(quantities(&gaussian), [Quantity::Mean, Quantity::Square]);
    }
}
