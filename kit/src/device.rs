//! Devices of apps without a window. `docs/drivers.md` says why they come and go one at a time, and why their objects
//! have no names.

use bevy::{
    prelude::*,
    render::{
        render_resource::WgpuLimits,
        settings::{Backends, InstanceFlags, WgpuFeatures, WgpuSettings, WgpuSettingsPriority},
    },
};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// With `web`, all devices have what every browser with WebGPU has, and no more.
const LIMITS_VARIABLE: &str = "CONTEXTUAL_AO_TEST_LIMITS";

/// Held by a thread that creates or drops a device.
static COMING_OR_GOING: Mutex<()> = Mutex::new(());

/// Waits until no other thread creates or drops a device, and keeps others from it while the guard is held.
pub fn alone() -> MutexGuard<'static, ()> {
    COMING_OR_GOING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Settings of a device.
pub fn settings() -> WgpuSettings {
    // Compute needs no OpenGL, which complains where there is no window system.
    let mut settings = WgpuSettings { backends: Some(Backends::PRIMARY), ..default() };
    // Nobody reads the names of objects here.
    settings.instance_flags.remove(InstanceFlags::DEBUG);
    match std::env::var(LIMITS_VARIABLE).as_deref() {
        Ok("web") => {
            settings.priority = WgpuSettingsPriority::WebGPU;
            settings.features = WgpuFeatures::empty();
        }
        Ok(other) => panic!("{LIMITS_VARIABLE} is `{other}`; it may be `web`"),
        Err(_) => {}
    }
    settings
}

/// [`settings`] with no more than these limits.
pub fn limited(limits: WgpuLimits) -> WgpuSettings {
    // The limits of wgpu have no room for binding arrays, which Bevy uses wherever the device has the feature.
    let binding_arrays = WgpuFeatures::TEXTURE_BINDING_ARRAY
        | WgpuFeatures::BUFFER_BINDING_ARRAY
        | WgpuFeatures::STORAGE_RESOURCE_BINDING_ARRAY;
    WgpuSettings { constrained_limits: Some(limits), disabled_features: Some(binding_arrays), ..settings() }
}
