//! How much memory an occlusion method takes.

/// What an occlusion method keeps for a volume, beside a factor a voxel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MethodBytes {
    pub total: u64,
    /// The largest buffer.
    pub largest_buffer: u64,
}

impl MethodBytes {
    /// Of buffers of these sizes.
    pub fn of_buffers(sizes: &[u64]) -> Self {
        Self { total: sizes.iter().sum(), largest_buffer: sizes.iter().copied().max().unwrap_or(0) }
    }
}
