//! Number of surfaces of a carver's mesh, as far as it is known. The count comes from the GPU, a frame after the GPU
//! made it.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, MapMode, PollType},
        renderer::RenderDevice,
    },
};
use std::sync::{Arc, OnceLock};

use super::clip_keys::DepthKey;

/// Known number of surfaces of one carver's mesh.
#[derive(Default)]
pub(crate) struct SurfaceCount {
    counted: Option<(DepthKey, u32)>,
    pending: Option<Pending>,
}

/// A count under way.
struct Pending {
    of: DepthKey,
    staging: Buffer,
    /// Whether the staging buffer could be read, once known. `None` before the request.
    arrived: Option<Arc<OnceLock<bool>>>,
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
        self.pending.is_none() && !self.is_final(key)
    }

    /// Expects a count in `staging`.
    pub fn expect(&mut self, of: DepthKey, staging: Buffer) {
        self.pending = Some(Pending { of, staging, arrived: None });
    }

    /// Takes over a count that has arrived.
    pub fn receive(&mut self, device: &RenderDevice) {
        let Some(Pending { arrived: Some(arrived), of, staging }) = &self.pending else {
            return;
        };
        // An error means that the device was lost.
        let _ = device.poll(PollType::Poll);
        let Some(&is_readable) = arrived.get() else {
            return;
        };
        if is_readable {
            let bytes = staging.slice(..).get_mapped_range();
            self.counted = Some((*of, bytemuck::pod_read_unaligned(&bytes)));
        }
        self.pending = None;
    }

    /// Requests the count, once its copy is submitted.
    pub fn request(&mut self, device: &RenderDevice) {
        if let Some(Pending { arrived: arrived @ None, staging, .. }) = &mut self.pending {
            let result = Arc::new(OnceLock::new());
            *arrived = Some(result.clone());
            device.map_buffer(&staging.slice(..), MapMode::Read, move |mapped| {
                let _ = result.set(mapped.is_ok());
            });
        }
    }
}

/// Number of layers of a mesh with `surfaces` surfaces along a line of sight. A layer that begins and does not end does
/// not count.
pub(crate) fn layers_of(surfaces: u32) -> u32 {
    (surfaces / 2).max(1)
}
