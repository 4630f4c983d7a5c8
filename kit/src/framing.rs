//! Lengths of a view that follow the size of its volume: a seed fills the picture as a body does.

use bevy::prelude::*;

/// Region that a view has to hold, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Centre of the box.
    pub center: Vec3,
    /// Half the diagonal of the box.
    pub radius: f32,
}

impl Framing {
    /// The visible part of a volume rarely reaches into all corners of its box.
    const FIT: f32 = 0.85;
    /// Near plane. A camera can come this near to a cut face before the plane slices the face open.
    const NEAR: f32 = 1e-3;
    /// Nearest and farthest distance of a camera from the point that it looks at.
    const NEAREST_VIEW: f32 = 0.1;
    const FARTHEST_VIEW: f32 = 12.0;
    /// Farthest distance from the volume's centre to the point that a camera looks at.
    const FARTHEST_FOCUS: f32 = 3.0;

    /// Framing of a whole box; `None` if the box has no size.
    pub fn of(corners: [Vec3; 8]) -> Option<Self> {
        let center = corners.iter().sum::<Vec3>() / 8.0;
        let radius = corners.iter().map(|corner| corner.distance(center)).fold(0.0, f32::max);
        (radius.is_finite() && radius > 0.0).then_some(Self { center, radius })
    }

    /// Distance from the centre at which all is in view. `fov` is vertical, radians; `aspect_ratio` is width over
    /// height.
    pub fn distance(&self, fov: f32, aspect_ratio: f32) -> f32 {
        let half_height = (fov / 2.0).tan();
        let half_angle = (half_height * aspect_ratio.min(1.0)).atan();
        Self::FIT * self.radius / half_angle.sin()
    }

    /// Nearest and farthest distance of a camera from the point that it looks at.
    pub fn distances(&self) -> [f32; 2] {
        [Self::NEAREST_VIEW, Self::FARTHEST_VIEW].map(|radii| radii * self.radius)
    }

    /// Farthest distance from the centre to the point that a camera looks at.
    pub fn farthest_focus(&self) -> f32 {
        Self::FARTHEST_FOCUS * self.radius
    }

    /// Sets the near plane, and the far plane beyond the volume, wherever the camera may go.
    pub fn set_planes(&self, projection: &mut PerspectiveProjection) {
        projection.near = Self::NEAR * self.radius;
        projection.far = (Self::FARTHEST_VIEW + Self::FARTHEST_FOCUS + 1.0) * self.radius;
    }
}
