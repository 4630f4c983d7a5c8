//! Parts of passes: formats that the device has, textures, uniform buffers, compute passes, variants of render
//! pipelines. Also the encoding, timing and counting of passes.

pub(super) mod compute_pass;
pub(super) mod device;
pub(super) mod device_loss;
pub(super) mod formats;
pub(super) mod frame;
pub(super) mod kept_group;
pub(super) mod readback;
pub(super) mod render_pipelines;
pub(super) mod textures;
pub(super) mod uniforms;
