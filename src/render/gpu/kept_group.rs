//! Bind group that lives as long as the buffers that it binds.

use bevy::render::render_resource::{BindGroup, Buffer, BufferId};

/// A bind group, with the buffers that it binds.
pub(crate) struct KeptGroup<const N: usize>(Option<([BufferId; N], BindGroup)>);

impl<const N: usize> Default for KeptGroup<N> {
    fn default() -> Self {
        Self(None)
    }
}

impl<const N: usize> KeptGroup<N> {
    /// The group of some buffers, made anew if it binds others.
    pub fn of(&mut self, buffers: [&Buffer; N], make: impl FnOnce() -> BindGroup) -> BindGroup {
        let ids = buffers.map(|buffer| buffer.id());
        match &self.0 {
            Some((bound, group)) if *bound == ids => group.clone(),
            _ => self.0.insert((ids, make())).1.clone(),
        }
    }
}
