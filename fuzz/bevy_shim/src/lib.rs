//! As much of Bevy as the readers name.

pub use glam as math;

pub mod asset {
    pub use bevy_shim_derive::Asset;
}

pub mod reflect {
    pub use bevy_shim_derive::TypePath;
}
