//! Words whose rays wait for later frames, and how many each frame cast.

use bevy::render::render_resource::Buffer;

use crate::{
    occlusion::{CastPacing, PacedWords},
    render::gpu::{device::Gpu, readback::Readback},
};

/// Casts whose state may be under way at a time: as many as frames may lie between the GPU and the CPU.
const UNDER_WAY: usize = 4;
/// Bytes of the part of `CastState` in WGSL that is read back.
pub(super) const READ_BYTES: u64 = 16;

/// What tells a cast.
#[derive(Clone, Copy)]
struct CastId {
    cast: u64,
    frame: u64,
}

/// Words whose rays wait for later frames.
#[derive(Default)]
pub(super) struct WaitingWords {
    /// Number of frames and of casts so far, and number of the last cast before which words were listed.
    frames: u64,
    pub casts: u64,
    listed_before: u64,
    /// Whether any word may wait.
    pub any: bool,
    pub paced: PacedWords,
    states: [Readback<CastId>; UNDER_WAY],
}

impl WaitingWords {
    /// Begins a frame. Takes over what casts did some frames ago.
    pub fn begin_frame(&mut self, pacing: Option<CastPacing>, frame_ms: f32, gpu: &Gpu) {
        self.frames += 1;
        self.paced.begin_frame(frame_ms);
        for state in &mut self.states {
            let Some((id, bytes)) = state.receive(&gpu.device) else {
                continue;
            };
            let [first, end, _, left] = words_of(&bytes);
            self.paced.note(self.frames - id.frame, end.saturating_sub(first));
            if left == 0 && id.cast >= self.listed_before {
                self.any = false;
            }
        }
        match pacing {
            Some(pacing) => self.paced.follow(&pacing),
            None => self.paced = PacedWords::default(),
        }
    }

    /// Begins a cast, of all words or of some. Returns a buffer into which its state is to be copied, if that matters.
    pub fn begin_cast(
        &mut self,
        lists_words: bool,
        casts_all: bool,
        paces: bool,
        gpu: &Gpu,
    ) -> Option<Buffer> {
        self.casts += 1;
        if lists_words {
            self.listed_before = self.casts;
        }
        self.any = !casts_all && (self.any || lists_words);
        let idle = self.states.iter_mut().find(|state| state.is_idle()).filter(|_| self.any || paces)?;
        idle.begin(CastId { cast: self.casts, frame: self.frames }, READ_BYTES, &gpu.device)
    }
}

/// First and end place in the list, words of a workgroup, and words that wait.
fn words_of(bytes: &[u8]) -> [u32; 4] {
    let mut words = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word));
    [(); 4].map(|()| words.next().unwrap_or_default())
}
