//! Settings of ray casts and pointers.

use bevy::{camera::visibility::RenderLayers, prelude::*};

/// Settings of a ray cast.
#[derive(Clone)]
#[non_exhaustive]
pub struct VolumeRayCastSettings<'a> {
    /// Share of the light that a volume stops up to a hit, 0.001 to 0.999. A lower one hits thinner matter.
    ///
    /// With 0.5, a volume that stops less than half of the light along the ray is not hit. Each volume counts by itself.
    pub stopped_light: f32,
    /// Distance from the ray's origin at which the ray ends, world units.
    pub max_distance: f32,
    /// Layers of which a volume must be on one; `None` for all.
    pub layers: Option<RenderLayers>,
    /// Whether volumes are hit that their [`Visibility`] hides.
    pub hits_hidden: bool,
    /// Whether the volume on an entity may be hit.
    pub filter: &'a dyn Fn(Entity) -> bool,
}

impl Default for VolumeRayCastSettings<'_> {
    /// Half of the light, at any distance, on all layers.
    fn default() -> Self {
        Self {
            stopped_light: 0.5,
            max_distance: f32::INFINITY,
            layers: None,
            hits_hidden: false,
            filter: &|_| true,
        }
    }
}

impl<'a> VolumeRayCastSettings<'a> {
    /// Sets the share of the light that is stopped up to a hit.
    pub fn with_stopped_light(self, stopped_light: f32) -> Self {
        Self { stopped_light, ..self }
    }

    /// Sets the distance at which the ray ends, world units.
    pub fn with_max_distance(self, max_distance: f32) -> Self {
        Self { max_distance, ..self }
    }

    /// Hits only volumes on one of these layers.
    pub fn with_layers(self, layers: RenderLayers) -> Self {
        Self { layers: Some(layers), ..self }
    }

    /// Hits only volumes on entities that the filter lets through.
    pub fn with_filter(self, filter: &'a dyn Fn(Entity) -> bool) -> Self {
        Self { filter, ..self }
    }

    /// Hits hidden volumes, too.
    pub fn with_hidden(self) -> Self {
        Self { hits_hidden: true, ..self }
    }

    /// Optical depth up to a hit.
    pub(super) fn optical_depth(&self) -> f64 {
        let valid = if self.stopped_light.is_nan() { 0.5 } else { self.stopped_light.clamp(0.001, 0.999) };
        -f64::from(-valid).ln_1p()
    }
}

/// Settings of pointers on volumes.
///
/// Without them a pointer hits a volume where the picture shows a surface. [`Pickable::IGNORE`] on a volume's entity lets
/// pointers through.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct VolumePickingSettings {
    /// Whether only cameras with a [`VolumePickingCamera`] and volumes with a [`Pickable`] count.
    pub require_markers: bool,
    /// [`VolumeRayCastSettings::stopped_light`] for pointers.
    pub stopped_light: f32,
}

impl Default for VolumePickingSettings {
    fn default() -> Self {
        Self { require_markers: false, stopped_light: VolumeRayCastSettings::default().stopped_light }
    }
}

/// Marks a camera whose pointers hit volumes, where [`VolumePickingSettings::require_markers`] asks for it.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumePickingCamera;
