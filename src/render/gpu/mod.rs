//! What passes are made of: formats that the device has, textures, compute passes, variants of render pipelines.

pub(super) mod compute_pass;
pub(super) mod device_loss;
pub(super) mod formats;
pub(super) mod render_pipelines;
pub(super) mod textures;
