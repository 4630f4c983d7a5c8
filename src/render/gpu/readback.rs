//! A word of a buffer that arrives on the CPU some frames later.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode, PollType},
        renderer::RenderDevice,
    },
};
use std::sync::{Arc, OnceLock};

/// Reads back one word at a time. A word has a tag, by which its reader knows of which frame it is.
#[derive(Default)]
pub(crate) struct WordReadback {
    staging: Option<Buffer>,
    under_way: Option<UnderWay>,
}

struct UnderWay {
    tag: u64,
    /// Whether the buffer could be read, once known. `None` before the request.
    arrived: Option<Arc<OnceLock<bool>>>,
}

impl WordReadback {
    /// Buffer into which this frame is to copy the word. `None` while another word is under way.
    pub fn begin(&mut self, tag: u64, device: &RenderDevice) -> Option<Buffer> {
        if self.under_way.is_some() {
            return None;
        }
        self.under_way = Some(UnderWay { tag, arrived: None });
        let staging = self.staging.get_or_insert_with(|| {
            device.create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_word_read"),
                size: 4,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        Some(staging.clone())
    }

    /// Tag and value of a word that has arrived. Called once a frame, before [`Self::begin`].
    pub fn receive(&mut self, device: &RenderDevice) -> Option<(u64, u32)> {
        let (staging, under_way) = (self.staging.as_ref()?, self.under_way.as_mut()?);
        let Some(arrived) = &under_way.arrived else {
            // The frame that copied the word was submitted.
            let arrived = under_way.arrived.insert(default());
            let arrived = arrived.clone();
            device.map_buffer(&staging.slice(..), MapMode::Read, move |result| {
                let _ = arrived.set(result.is_ok());
            });
            return None;
        };
        // An error means that the device was lost.
        let _ = device.poll(PollType::Poll);
        let is_readable = *arrived.get()?;
        let word = is_readable.then(|| {
            let bytes = staging.slice(..).get_mapped_range();
            let word = bytes.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
            drop(bytes);
            staging.unmap();
            word
        });
        let tag = under_way.tag;
        self.under_way = None;
        Some((tag, word.flatten()?))
    }
}
