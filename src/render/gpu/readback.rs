//! Parts of buffers that arrive on the CPU some frames later.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode, PollType},
        renderer::RenderDevice,
    },
};
use std::sync::{Arc, OnceLock};

/// Reads back some bytes at a time. They have a tag, by which their reader knows what they are of.
pub(crate) struct Readback<T> {
    staging: Option<Buffer>,
    under_way: Option<UnderWay<T>>,
}

impl<T> Default for Readback<T> {
    fn default() -> Self {
        Self { staging: None, under_way: None }
    }
}

struct UnderWay<T> {
    tag: T,
    /// Whether the buffer could be read, once known. `None` before the request.
    arrived: Option<Arc<OnceLock<bool>>>,
}

impl<T: Copy> Readback<T> {
    /// Whether nothing is under way.
    pub fn is_idle(&self) -> bool {
        self.under_way.is_none()
    }

    /// Buffer into which this frame is to copy so many bytes. `None` while others are under way.
    pub fn begin(&mut self, tag: T, bytes: u64, device: &RenderDevice) -> Option<Buffer> {
        if self.under_way.is_some() {
            return None;
        }
        self.under_way = Some(UnderWay { tag, arrived: None });
        let kept = self.staging.take().filter(|staging| staging.size() == bytes);
        let staging = kept.unwrap_or_else(|| {
            device.create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_readback"),
                size: bytes,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        Some(self.staging.insert(staging).clone())
    }

    /// Requests bytes whose copy was submitted. [`Self::receive`] does so at the latest, a frame later.
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

    /// Tag and bytes that have arrived. Called once a frame, before [`Self::begin`].
    pub fn receive(&mut self, device: &RenderDevice) -> Option<(T, Vec<u8>)> {
        if self.under_way.as_ref()?.arrived.is_none() {
            self.request(device);
            return None;
        }
        let (staging, under_way) = (self.staging.as_ref()?, self.under_way.as_ref()?);
        let arrived = under_way.arrived.as_ref()?;
        // An error means that the device was lost.
        let _ = device.poll(PollType::Poll);
        let is_readable = *arrived.get()?;
        let bytes = is_readable.then(|| {
            let bytes = staging.slice(..).get_mapped_range().to_vec();
            staging.unmap();
            bytes
        });
        let tag = under_way.tag;
        self.under_way = None;
        Some((tag, bytes?))
    }
}

/// Reads back one word at a time.
pub(crate) struct WordReadback<T>(Readback<T>);

impl<T> Default for WordReadback<T> {
    fn default() -> Self {
        Self(default())
    }
}

impl<T: Copy> WordReadback<T> {
    /// Whether no word is under way.
    pub fn is_idle(&self) -> bool {
        self.0.is_idle()
    }

    /// Buffer into which this frame is to copy the word. `None` while another word is under way.
    pub fn begin(&mut self, tag: T, device: &RenderDevice) -> Option<Buffer> {
        self.0.begin(tag, 4, device)
    }

    /// Requests a word whose copy was submitted. [`Self::receive`] does so at the latest, a frame later.
    pub fn request(&mut self, device: &RenderDevice) {
        self.0.request(device);
    }

    /// Tag and value of a word that has arrived. Called once a frame, before [`Self::begin`].
    pub fn receive(&mut self, device: &RenderDevice) -> Option<(T, u32)> {
        let (tag, bytes) = self.0.receive(device)?;
        Some((tag, u32::from_le_bytes(*bytes.first_chunk()?)))
    }
}
