//! A word of a buffer that arrives on the CPU some frames later.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode, PollType},
        renderer::RenderDevice,
    },
};
use std::sync::{Arc, OnceLock};

/// Reads back one word at a time. A word has a tag, by which its reader knows what it is of.
pub(crate) struct WordReadback<T> {
    staging: Option<Buffer>,
    under_way: Option<UnderWay<T>>,
}

impl<T> Default for WordReadback<T> {
    fn default() -> Self {
        Self { staging: None, under_way: None }
    }
}

struct UnderWay<T> {
    tag: T,
    /// Whether the buffer could be read, once known. `None` before the request.
    arrived: Option<Arc<OnceLock<bool>>>,
}

impl<T: Copy> WordReadback<T> {
    /// Whether no word is under way.
    pub fn is_idle(&self) -> bool {
        self.under_way.is_none()
    }

    /// Buffer into which this frame is to copy the word. `None` while another word is under way.
    pub fn begin(&mut self, tag: T, device: &RenderDevice) -> Option<Buffer> {
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

    /// Requests a word whose copy was submitted. [`Self::receive`] does so at the latest, a frame later.
    pub fn request(&mut self, device: &RenderDevice) {
        if let (Some(staging), Some(UnderWay { arrived: arrived @ None, .. })) =
            (&self.staging, &mut self.under_way)
        {
            let arrived = arrived.insert(default()).clone();
            device.map_buffer(&staging.slice(..), MapMode::Read, move |result| {
                let _ = arrived.set(result.is_ok());
            });
        }
    }

    /// Tag and value of a word that has arrived. Called once a frame, before [`Self::begin`].
    pub fn receive(&mut self, device: &RenderDevice) -> Option<(T, u32)> {
        if self.under_way.as_ref()?.arrived.is_none() {
            self.request(device);
            return None;
        }
        let (staging, under_way) = (self.staging.as_ref()?, self.under_way.as_ref()?);
        let arrived = under_way.arrived.as_ref()?;
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
