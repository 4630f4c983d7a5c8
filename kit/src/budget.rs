//! How much of the graphics device's memory a volume may take, from command-line options.

use bevy_contextual_ao::{prelude::*, volume::TooLarge};
use clap::Args;

/// What is done with a volume that is too large.
#[derive(Args, Clone, Debug, Default)]
pub struct BudgetOptions {
    /// Shows a volume beyond the budget, or the graphics device, at half its resolution, or a quarter, instead
    /// of refusing it: `VolumeBudget::halves`.
    #[arg(long)]
    pub halve: bool,
    /// What a volume may take on the graphics device, MiB: `VolumeBudget::max_bytes` [default: 4096].
    #[arg(long, value_name = "N")]
    pub budget_mib: Option<u64>,
}

impl BudgetOptions {
    /// The budget.
    pub fn budget(&self) -> VolumeBudget {
        let max_bytes = self.budget_mib.map(|mib| mib.saturating_mul(1 << 20));
        VolumeBudget { max_bytes: max_bytes.unwrap_or(VolumeBudget::default().max_bytes), halves: self.halve }
    }
}

/// Why a volume cannot be shown, with the option that would show it.
pub fn explain(failure: &VolumeFailure) -> String {
    match failure {
        VolumeFailure::TooLarge(TooLarge { would_fit: Some(_), .. }) => format!("{failure} (option --halve)"),
        failure => failure.to_string(),
    }
}
