//! The lengths of a view that follow the size of its volume: a seed fills the picture as a body does.

use bevy::prelude::*;

/// What a view has to hold, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The middle.
    pub center: Vec3,
    /// Half the diagonal.
    pub radius: f32,
}

impl Framing {
    /// What is seen of a volume rarely reaches into all corners of its box.
    const FIT: f32 = 0.85;
    /// The near plane. A camera comes this near to a face that was cut before it slices it open.
    const NEAR: f32 = 1e-3;
    /// How near a camera may come to what it looks at, and how far away.
    const NEAREST_VIEW: f32 = 0.1;
    const FARTHEST_VIEW: f32 = 12.0;
    /// How far from the volume's middle a camera may look.
    const FARTHEST_FOCUS: f32 = 3.0;

    /// All of a box; `None` where it has no size.
    pub fn of(corners: [Vec3; 8]) -> Option<Self> {
        let center = corners.iter().sum::<Vec3>() / 8.0;
        let radius = corners.iter().map(|corner| corner.distance(center)).fold(0.0, f32::max);
        (radius.is_finite() && radius > 0.0).then_some(Self { center, radius })
    }

    /// The distance from the middle from which all is in view; `fov` is vertical, radians, and
    /// `aspect_ratio` the width over the height.
    pub fn distance(&self, fov: f32, aspect_ratio: f32) -> f32 {
        let half_height = (fov / 2.0).tan();
        let half_angle = (half_height * aspect_ratio.min(1.0)).atan();
        Self::FIT * self.radius / half_angle.sin()
    }

    /// How near a camera may come to what it looks at, and how far away.
    pub fn distances(&self) -> [f32; 2] {
        [Self::NEAREST_VIEW, Self::FARTHEST_VIEW].map(|radii| radii * self.radius)
    }

    /// How far from the middle a camera may look.
    pub fn farthest_focus(&self) -> f32 {
        Self::FARTHEST_FOCUS * self.radius
    }

    /// Sets the near plane, and the far one beyond the volume, wherever the camera may go.
    pub fn set_planes(&self, projection: &mut PerspectiveProjection) {
        projection.near = Self::NEAR * self.radius;
        projection.far = (Self::FARTHEST_VIEW + Self::FARTHEST_FOCUS + 1.0) * self.radius;
    }
}
