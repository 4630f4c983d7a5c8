//! Frames first: while something moves, volumes are drawn with as many samples as the display leaves time for. On request,
//! frames cast as many rays.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use bevy_mod_openxr::resources::OxrFrameState;
use clap::Args;

/// Interval of a display that does not tell, ms.
const USUAL_INTERVAL_MS: f32 = 1e3 / 60.0;
/// Frames that wait for a display hide how much faster they could be, up to a third.
const SLACK: f32 = 4.0 / 3.0;

/// What frames may leave out, from command-line options.
#[derive(Args, Resource, Clone, Debug)]
pub struct FrameOptions {
    /// Lowest quality while something moves: low, medium, high or reference. A lower one makes faster frames possible.
    #[arg(long, value_name = "NAME", default_value = "low")]
    pub lowest: Quality,
    /// Lets occlusion come later rather than a frame.
    #[arg(long)]
    pub pace: bool,
}

pub struct FrameRatePlugin;

impl Plugin for FrameRatePlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, set_targets);
    }
}

/// Longest frame time, ms, given the interval of the display, ms.
pub fn target_ms(interval_ms: Option<f32>) -> f32 {
    SLACK * interval_ms.filter(|interval| *interval > 0.0).unwrap_or(USUAL_INTERVAL_MS)
}

fn set_targets(
    mut commands: Commands,
    frame: Option<Res<OxrFrameState>>,
    options: Res<FrameOptions>,
    volumes: Query<(Entity, Option<&MotionQuality>), With<Volume3d>>,
    pacing: Option<Res<CastPacing>>,
) {
    let interval_ms = frame.map(|frame| 1e-6 * frame.predicted_display_period.as_nanos() as f32);
    let target_frame_ms = target_ms(interval_ms);
    let wanted = MotionQuality { target_frame_ms, lowest: options.lowest, ..default() };
    for (volume, _) in volumes.iter().filter(|(_, present)| *present != Some(&wanted)) {
        commands.entity(volume).insert(wanted.clone());
    }
    let wanted = CastPacing { target_frame_ms, ..default() };
    if options.pace && pacing.is_none_or(|present| *present != wanted) {
        commands.insert_resource(wanted);
    }
}
