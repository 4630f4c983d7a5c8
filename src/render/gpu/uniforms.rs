//! Uniform buffers that live as long as what they describe, and are written where it changed.

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

/// Puts a value where shaders read it, unless it is there. Returns whether it was not.
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

/// A buffer each for things that come and go, as views do.
pub(crate) struct BuffersOf<K, B> {
    /// Of the frame.
    now: HashMap<K, B>,
    /// Of the frame before, as far as the frame has not asked for them.
    before: HashMap<K, B>,
}

impl<K, B> Default for BuffersOf<K, B> {
    fn default() -> Self {
        Self { now: default(), before: default() }
    }
}

impl<K: Eq + Hash, B: Default> BuffersOf<K, B> {
    /// Begins a frame: what the frame before did not ask for is freed.
    pub fn begin_frame(&mut self) {
        self.before = core::mem::take(&mut self.now);
    }

    /// The buffer of one, as the frame before left it.
    pub fn of(&mut self, key: K) -> &mut B {
        let Self { now, before } = self;
        now.entry(key).or_insert_with_key(|key| before.remove(key).unwrap_or_default())
    }
}

impl<K: Eq + Hash, T: ShaderType + WriteInto + PartialEq + Default> BuffersOf<K, UniformBuffer<T>> {
    /// Writes the value of one where it changed, and binds it.
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
