//! Number of surfaces of a carver's mesh, as far as it is known. The count comes from the GPU, a frame after the GPU
//! made it.

use bevy::{
    prelude::*,
    render::{render_resource::Buffer, renderer::RenderDevice},
};

use super::clip_keys::DepthKey;
use crate::render::gpu::readback::WordReadback;

/// Known number of surfaces of one carver's mesh.
#[derive(Default)]
pub(crate) struct SurfaceCount {
    counted: Option<(DepthKey, u32)>,
    readback: WordReadback<DepthKey>,
}

impl SurfaceCount {
    /// Largest number of surfaces along a line of sight, of the latest counted form of `mesh`. A deforming mesh is
    /// still drawn while its new form is being counted.
    pub fn of(&self, mesh: AssetId<Mesh>) -> Option<u32> {
        self.counted.filter(|(key, _)| key.mesh == mesh).map(|(_, count)| count)
    }

    /// Whether the count is that of `key` itself.
    fn is_final(&self, key: &DepthKey) -> bool {
        self.counted.is_some_and(|(counted, _)| counted == *key)
    }

    /// Whether a count has to be made.
    pub fn is_wanted(&self, key: &DepthKey) -> bool {
        self.readback.is_idle() && !self.is_final(key)
    }

    /// Buffer into which a count is to be copied. `None` while another one is under way.
    pub fn begin(&mut self, of: DepthKey, device: &RenderDevice) -> Option<Buffer> {
        self.readback.begin(of, device)
    }

    /// Takes over a count that has arrived.
    pub fn receive(&mut self, device: &RenderDevice) {
        self.counted = self.readback.receive(device).or(self.counted);
    }

    /// Requests the count, once its copy is submitted.
    pub fn request(&mut self, device: &RenderDevice) {
        self.readback.request(device);
    }
}

/// Number of layers of a mesh with `surfaces` surfaces along a line of sight. A layer that begins and does not end does
/// not count.
pub(crate) fn layers_of(surfaces: u32) -> u32 {
    (surfaces / 2).max(1)
}
