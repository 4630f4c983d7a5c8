//! Settings of methods from outside of this crate.

use bevy::prelude::*;
use core::any::Any;
use std::sync::Arc;

use super::MethodSettings;

/// Settings of a method that a plugin brings, of any type:
/// [`OcclusionMethod::custom`](super::OcclusionMethod::custom).
#[derive(Reflect, Clone, Debug)]
#[reflect(opaque, Debug, Clone, PartialEq)]
pub struct CustomMethod {
    settings: Arc<dyn MethodSettings>,
    are_equal: fn(&dyn Any, &dyn Any) -> bool,
}

impl CustomMethod {
    pub(super) fn new<S: MethodSettings + PartialEq>(settings: S) -> Self {
        Self {
            settings: Arc::new(settings),
            are_equal: |a, b| matches!((a.downcast_ref::<S>(), b.downcast_ref::<S>()), (Some(a), Some(b)) if a == b),
        }
    }

    /// The settings.
    pub fn settings(&self) -> &dyn MethodSettings {
        &*self.settings
    }
}

impl PartialEq for CustomMethod {
    fn eq(&self, other: &Self) -> bool {
        // The pointers are compared because settings with NaN differ from themselves. They would change in every frame.
        Arc::ptr_eq(&self.settings, &other.settings) || (self.are_equal)(&*self.settings, &*other.settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq)]
    struct Weight(f32);

    #[derive(Debug, PartialEq)]
    struct Other(f32);

    impl MethodSettings for Weight {
        fn name(&self) -> &'static str {
            "weight"
        }
    }

    impl MethodSettings for Other {
        fn name(&self) -> &'static str {
            "other"
        }
    }

    #[test]
    fn settings_are_equal_by_type_and_value() {
        assert_eq!(CustomMethod::new(Weight(1.0)), CustomMethod::new(Weight(1.0)));
        assert_ne!(CustomMethod::new(Weight(1.0)), CustomMethod::new(Weight(2.0)));
        assert_ne!(CustomMethod::new(Weight(1.0)), CustomMethod::new(Other(1.0)));
        let no_number = CustomMethod::new(Weight(f32::NAN));
        assert_eq!(no_number, no_number.clone());
    }
}
