//! What passes are made of: formats that the device has, textures, compute passes.

pub(super) mod compute_pass;
pub(super) mod device_loss;
pub(super) mod formats;
pub(super) mod textures;
