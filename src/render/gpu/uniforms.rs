//! Buffers of settings that live as long as the things they describe, and are written only on change.

use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{BindingResource, ShaderType, UniformBuffer, encase::internal::WriteInto},
        renderer::{RenderDevice, RenderQueue},
    },
};
use core::hash::Hash;

use super::device::Gpu;

/// Writes a value into a buffer, unless the buffer already holds it. Returns whether it was written.
pub(crate) fn write_if_changed<T: ShaderType + WriteInto + PartialEq>(
    buffer: &mut UniformBuffer<T>,
    value: T,
    device: &RenderDevice,
    queue: &RenderQueue,
) -> bool {
    let is_new = buffer.buffer().is_none() || *buffer.get() != value;
    if is_new {
        buffer.set(value);
        buffer.write_buffer(device, queue);
    }
    is_new
}

/// One buffer for each thing that comes and goes, such as a view.
pub(crate) struct BuffersOf<K, B> {
    /// Buffers that this frame asked for.
    now: HashMap<K, B>,
    /// Buffers of the previous frame that this frame has not asked for yet.
    before: HashMap<K, B>,
}

impl<K, B> Default for BuffersOf<K, B> {
    fn default() -> Self {
        Self { now: default(), before: default() }
    }
}

impl<K: Eq + Hash, B: Default> BuffersOf<K, B> {
    /// Begins a frame. Frees the buffers that the previous frame did not ask for.
    pub fn begin_frame(&mut self) {
        // Both maps keep their room.
        core::mem::swap(&mut self.now, &mut self.before);
        self.now.clear();
    }

    /// Buffer of a key, as the previous frame left it.
    pub fn of(&mut self, key: K) -> &mut B {
        let Self { now, before } = self;
        now.entry(key).or_insert_with_key(|key| before.remove(key).unwrap_or_default())
    }

    /// Buffer of a key that this frame asked for.
    pub fn get(&self, key: K) -> Option<&B> {
        self.now.get(&key)
    }

    /// Buffers that this frame asked for.
    pub fn iter(&self) -> impl Iterator<Item = &B> {
        self.now.values()
    }
}

impl<K: Eq + Hash, T: ShaderType + WriteInto + PartialEq + Default> BuffersOf<K, UniformBuffer<T>> {
    /// Writes the value of a key if it changed, and returns its binding.
    pub fn write(&mut self, key: K, value: T, gpu: &Gpu) -> Option<BindingResource<'_>> {
        let buffer = self.of(key);
        write_if_changed(buffer, value, &gpu.device, &gpu.queue);
        buffer.binding()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_frames_ask_for_is_kept_and_the_rest_freed() {
        let mut kept = BuffersOf::<u32, Vec<u32>>::default();
        kept.of(1).push(10);
        kept.of(2).push(20);
        kept.begin_frame();
        assert_eq!(*kept.of(1), [10]);
        assert_eq!(*kept.of(1), [10], "asked for twice in a frame");
        kept.begin_frame();
        assert_eq!((kept.of(1).clone(), kept.of(2).clone()), (vec![10], vec![]));
    }
}
