//! Predicted figures. A pass takes the instructions of its work over the rate at which a device issues instructions.
//! `docs/gpu/README.md` says how the numbers were found.

/// Names of devices, with the 10^9 instructions of a warp (a wave) that they issue in a second: processors x
/// schedulers x clock.
const ISSUE_RATES: [(&str, f64); 6] = [
    ("RTX 4070", 455.0),
    ("RX 6700 XT", 194.0),
    ("Iris(R) Xe", 31.0),
    ("Iris Xe", 31.0),
    // 132 x 4 x 1.755 GHz.
    ("H100", 927.0),
    ("H200", 927.0),
];
/// Faster models whose names begin as those of the table do.
const OTHER_MODELS: [&str; 4] = [" Ti", " SUPER", " Laptop", " MAX"];
/// Share of the issue rate that passes are likely to reach.
const REACHED: f64 = 0.6;

/// 10^9 instructions of clipping, in the shell of 512 voxels.
const CLIP: f64 = 0.125;
/// 10^9 instructions of following view rays and marking what they read, for each of 10^6 pixels, with a sample every
/// half voxel.
const MARCH_AND_MARK: f64 = 0.331;
/// 10^9 instructions of casting 54 rays of 50 samples. Fewer or shorter rays take their share.
const CAST: f64 = 2.06;

/// Growth of the work with twice the voxels along each side: that of a surface.
pub const GROWTH: f64 = 4.0;
/// A second eye over one, where nothing is cast: all work is done for each eye.
pub const SECOND_EYE: f64 = 2.0;
/// A turning camera over the same without occlusion. The figure is of a software driver, not of the model.
pub const TURNING_OVER_DRAWING: f64 = 1.17;

/// Second eye over one while a carver moves: clipping and casting are done once.
pub fn second_eye_carving(rays: u32, steps: u32, pixels: u32) -> f64 {
    let once = CLIP + cast(rays, steps);
    let of_eye = MARCH_AND_MARK * f64::from(pixels) / 1e6;
    (once + 2.0 * of_eye) / (once + of_eye)
}

/// A device that the model knows.
#[derive(Clone, Copy)]
pub struct Device {
    /// 10^9 instructions in a second.
    issue_rate: f64,
}

impl Device {
    /// Device of an adapter's name, if it is in the table.
    pub fn named(adapter: &str) -> Option<Self> {
        let is_named = |(name, _): &&(&str, f64)| {
            let rest = adapter.split_once(name).map(|(_, rest)| rest);
            rest.is_some_and(|rest| !OTHER_MODELS.iter().any(|model| rest.starts_with(model)))
        };
        ISSUE_RATES.iter().find(is_named).map(|&(_, issue_rate)| Self { issue_rate })
    }

    /// Likely milliseconds of clipping.
    pub fn clip_ms(self) -> f64 {
        self.ms(CLIP)
    }

    /// Likely milliseconds of casting `rays` rays of `steps` samples.
    pub fn cast_ms(self, rays: u32, steps: u32) -> f64 {
        self.ms(cast(rays, steps))
    }

    /// Likely milliseconds of following view rays through so many pixels and marking what they read.
    pub fn march_and_mark_ms(self, pixels: u32) -> f64 {
        self.ms(MARCH_AND_MARK * f64::from(pixels) / 1e6)
    }

    fn ms(self, instructions: f64) -> f64 {
        1e3 * instructions / self.issue_rate / REACHED
    }
}

fn cast(rays: u32, steps: u32) -> f64 {
    CAST * f64::from(rays * steps) / (54.0 * 50.0)
}
