//! As much of Bevy as the readers name.

pub use glam as math;

pub mod asset {
    pub use bevy_shim_derive::Asset;
}

pub mod reflect {
    pub use bevy_shim_derive::{Reflect, TypePath};

    pub mod std_traits {
        /// Named by what derives `Reflect`.
        pub struct ReflectDefault;
    }
}

pub mod log {
    pub use crate::warn;
}

/// Reads its arguments, and says nothing.
#[macro_export]
macro_rules! warn {
    ($($argument:tt)*) => {
        let _ = format_args!($($argument)*);
    };
}
