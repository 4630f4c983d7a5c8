//! Values of figures, and their fields in JSON.

use bevy_contextual_ao::{
    diagnostics::{
        SPAN_CLIP, SPAN_COUNT, SPAN_CULL, SPAN_DEPTH, SPAN_DILATE, SPAN_DISTANCES, SPAN_DRAW, SPAN_MARCH,
        SPAN_RANGES,
    },
    occlusion::{
        DirectionalOcclusion, OcclusionFiltering, OcclusionRays, OcclusionSweeping, ScreenSpaceOcclusion,
        SummedAreaOcclusion,
    },
};
use serde_json::{Value, json};

/// Passes that are timed.
pub const SPANS: [&str; 16] = [
    SPAN_COUNT,
    SPAN_DEPTH,
    SPAN_DILATE,
    SPAN_RANGES,
    SPAN_CULL,
    SPAN_CLIP,
    SPAN_DISTANCES,
    SPAN_MARCH,
    OcclusionRays::SPAN_MARK,
    OcclusionRays::SPAN_CAST,
    OcclusionSweeping::SPAN,
    OcclusionFiltering::SPAN,
    SummedAreaOcclusion::SPAN_TABLE,
    SummedAreaOcclusion::SPAN_BOXES,
    ScreenSpaceOcclusion::SPAN,
    DirectionalOcclusion::SPAN,
];

/// Milliseconds of one frame, or medians of several.
#[derive(Clone, Copy, Default)]
pub struct FrameTimes {
    /// Time of the whole frame, by the clock.
    pub total: f64,
    /// Time of each of [`SPANS`]; 0 if the pass did not run.
    pub passes: [f64; SPANS.len()],
    /// Time of drawing.
    pub draw: f64,
}

impl FrameTimes {
    /// Time of a pass.
    pub fn of(&self, span: &str) -> f64 {
        if span == SPAN_DRAW {
            return self.draw;
        }
        SPANS.iter().position(|name| *name == span).map_or(0.0, |index| self.passes[index])
    }

    /// Time of clipping and casting: steps IV and V.
    pub fn clip_and_cast(&self) -> f64 {
        let [clipping, cast, ..] = self.breakdown();
        clipping + cast
    }

    /// Times of the parts of figure 10 of the paper: clipping (step IV), ray cast (V), rendering (VI), and the rest.
    pub fn breakdown(&self) -> [f64; 4] {
        let sum = |spans: &[&str]| spans.iter().map(|span| self.of(span)).sum::<f64>();
        let clipping = sum(&[SPAN_CULL, SPAN_CLIP]);
        let cast = sum(&[SPAN_DISTANCES, OcclusionRays::SPAN_MARK, OcclusionRays::SPAN_CAST]);
        let rendering = sum(&[SPAN_MARCH]) + self.draw;
        [clipping, cast, rendering, (self.total - clipping - cast - rendering).max(0.0)]
    }

    /// Median of each time.
    pub fn medians(times: &[Self]) -> Self {
        let of = |value: &dyn Fn(&Self) -> f64| median(times.iter().map(value).collect());
        Self {
            total: of(&|times| times.total),
            passes: std::array::from_fn(|index| of(&|times| times.passes[index])),
            draw: of(&|times| times.draw),
        }
    }

    /// Names and milliseconds of the passes of occlusion by rays, and of the whole frame.
    pub fn named(self) -> [(&'static str, f64); 9] {
        [
            ("cull", self.of(SPAN_CULL)),
            ("clip", self.of(SPAN_CLIP)),
            ("distances", self.of(SPAN_DISTANCES)),
            ("march", self.of(SPAN_MARCH)),
            ("mark", self.of(OcclusionRays::SPAN_MARK)),
            ("cast", self.of(OcclusionRays::SPAN_CAST)),
            ("draw", self.draw),
            ("clip_and_cast", self.clip_and_cast()),
            ("total", self.total),
        ]
    }

    /// Fields for a line of JSON.
    pub fn to_json(self) -> Value {
        self.named().into_iter().map(|(name, ms)| (format!("ms_{name}"), json!(ms))).collect()
    }
}

/// Median: the middle value, or the mean of the middle two; 0 without values.
pub fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// Value below which a share of the values lie, linear between neighbours; 0 without values.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let low = place.floor() as usize;
    let high = (low + 1).min(last);
    values[low] + (place - low as f64) * (values[high] - values[low])
}

/// `of` divided by `by`.
pub fn ratio(of: u64, by: u64) -> f64 {
    of as f64 / by as f64
}

/// Errors of values against true values.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Root mean square.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
    /// Number of values that were compared.
    pub count: usize,
}

impl Errors {
    /// Errors of pairs of a value and the true value.
    pub fn of(pairs: impl IntoIterator<Item = (u8, u8)>) -> Self {
        let (mut squares, mut largest, mut count) = (0u64, 0, 0);
        for (value, truth) in pairs {
            let error = value.abs_diff(truth);
            squares += u64::from(error) * u64::from(error);
            largest = largest.max(error);
            count += 1;
        }
        let rms = (squares as f64 / count.max(1) as f64).sqrt();
        Self { rms, largest: largest.into(), count }
    }
}

/// Merges the fields of two JSON objects.
pub fn merged(mut fields: Value, more: Value) -> Value {
    if let (Value::Object(fields), Value::Object(more)) = (&mut fields, more) {
        fields.extend(more);
    }
    fields
}
