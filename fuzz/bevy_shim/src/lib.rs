//! The part of Bevy that the readers name.

pub use glam as math;

pub mod asset {
    pub use bevy_shim_derive::Asset;
}

pub mod reflect {
    pub use bevy_shim_derive::{Reflect, TypePath};

    pub mod std_traits {
        /// Named by sources that derive `Reflect`.
        pub struct ReflectDefault;
    }
}

pub mod log {
    pub use crate::warn;
}

/// Takes its arguments and logs nothing.
#[macro_export]
macro_rules! warn {
    ($($argument:tt)*) => {
        let _ = format_args!($($argument)*);
    };
}
