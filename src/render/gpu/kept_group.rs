//! Bind groups that live as long as the buffers that they bind.

use bevy::render::render_resource::{BindGroup, Buffer, BufferId};

/// Bind groups, with buffers that they bind. Everything else that they bind lives as long as these buffers.
pub(crate) struct KeptGroup<const N: usize, G = BindGroup>(Option<([BufferId; N], G)>);

impl<const N: usize, G> Default for KeptGroup<N, G> {
    fn default() -> Self {
        Self(None)
    }
}

impl<const N: usize, G: Clone> KeptGroup<N, G> {
    /// The groups of some buffers, made anew if they bind others.
    pub fn of(&mut self, buffers: [&Buffer; N], make: impl FnOnce() -> G) -> G {
        let ids = buffers.map(|buffer| buffer.id());
        match &self.0 {
            Some((bound, groups)) if *bound == ids => groups.clone(),
            _ => self.0.insert((ids, make())).1.clone(),
        }
    }
}
