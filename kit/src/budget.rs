//! Memory budget of a volume on the graphics device, from command-line options.

use bevy_contextual_ao::{prelude::*, volume::TooLarge};
use clap::Args;

/// Handling of a volume that is too large.
#[derive(Args, Clone, Debug, Default)]
pub struct BudgetOptions {
    /// Shows a volume beyond the budget or the graphics device at half or a quarter of its resolution. Otherwise such
    /// a volume is refused. Sets `VolumeBudget::halves`.
    #[arg(long)]
    pub halve: bool,
    /// Most memory that a volume may take on the graphics device, MiB: `VolumeBudget::max_bytes` [default: 4096].
    #[arg(long, value_name = "N")]
    pub budget_mib: Option<u64>,
}

impl BudgetOptions {
    pub fn budget(&self) -> VolumeBudget {
        let max_bytes = self.budget_mib.map(|mib| mib.saturating_mul(1 << 20));
        VolumeBudget { max_bytes: max_bytes.unwrap_or(VolumeBudget::default().max_bytes), halves: self.halve }
    }
}

/// Reason why a volume cannot be shown, with the option that would show it.
pub fn explain(failure: &VolumeFailure) -> String {
    match failure {
        VolumeFailure::TooLarge(TooLarge { would_fit: Some(_), .. }) => format!("{failure} (option --halve)"),
        failure => failure.to_string(),
    }
}
