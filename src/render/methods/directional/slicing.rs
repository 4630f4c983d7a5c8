//! Places of a volume's slices in a view.

use bevy::{
    math::{DMat4, DVec2, DVec3, DVec4, Vec4Swizzles},
    prelude::*,
    render::render_resource::ShaderType,
};

use crate::{
    occlusion::DirectionalOcclusion,
    render::{extract::ExtractedVolume, windows::WindowUniform},
    volume::VolumeGeometry,
};

/// The slices of a volume in a view, as `Slicing` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct SlicingData {
    depth_from_local: Vec4,
    first_depth: f32,
    slice_depth: f32,
    slice_mm: f32,
    radius: f32,
    cone_slope: f32,
    pixels: Vec2,
    clip_w: Vec2,
    samples: u32,
    exact_distance: u32,
}

/// The slices, their number, and the distance of the volume's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slicing {
    pub data: SlicingData,
    pub count: u32,
    /// Depth of the volume's centre, along the view's axis.
    pub center_depth: f64,
}

impl Slicing {
    /// Slices of a volume in a window. `None` if nothing is in front of the camera, or a number is not finite.
    pub fn of(
        volume: &ExtractedVolume,
        settings: &DirectionalOcclusion,
        window: &WindowUniform,
    ) -> Option<Self> {
        let world_from_local = Mat4::from(volume.world_from_local).as_dmat4();
        Self::new(&volume.geometry, world_from_local, settings, window)
    }

    fn new(
        geometry: &VolumeGeometry,
        world_from_local: DMat4,
        settings: &DirectionalOcclusion,
        window: &WindowUniform,
    ) -> Option<Self> {
        let view_from_clip = window.view_from_clip.as_dmat4();
        let clip_from_view = view_from_clip.inverse();
        let view_from_local = window.world_from_view.as_dmat4().inverse() * world_from_local;
        // The camera looks along -z.
        let depth_from_local = -view_from_local.row(2);
        let depth = |p: DVec3| depth_from_local.dot(p.extend(1.0));
        let depths = geometry.corners().map(depth);
        let near = view_from_clip * DVec4::new(0.0, 0.0, 1.0, 1.0);
        let begin = depths.into_iter().fold(f64::MAX, f64::min).max(-near.z / near.w);
        let end = depths.into_iter().fold(f64::MIN, f64::max);
        let depth_per_mm = depth_from_local.truncate().length();
        let voxel_depth = geometry.spacing_mm.min_element() * depth_per_mm;
        let wanted = voxel_depth * f64::from(settings.slice_voxels);
        let slice_depth = wanted.max((end - begin) / f64::from(DirectionalOcclusion::MAX_SLICES - 1));
        // One slice goes through the volume's centre, so that a volume of any thickness has a slice. Slices thus keep
        // their places in the volume when the camera moves along its axis.
        let center_depth = depth(DVec3::ZERO);
        let first_depth = center_depth + ((begin - center_depth) / slice_depth).ceil() * slice_depth;
        let count = ((end - first_depth) / slice_depth).floor() + 1.0;
        let is_real = count >= 1.0 && first_depth.is_finite() && slice_depth > 0.0;
        let aperture = f64::from(settings.aperture_degrees).to_radians();
        // The projection's shift is left out: it moves all points of a slice alike.
        let half_size = 0.5 * window.viewport.as_dvec4().zw();
        let scale = DVec2::new(clip_from_view.x_axis.x, clip_from_view.y_axis.y);
        is_real.then(|| Self {
            data: SlicingData {
                depth_from_local: depth_from_local.as_vec4(),
                first_depth: first_depth as f32,
                slice_depth: slice_depth as f32,
                slice_mm: (slice_depth / depth_per_mm) as f32,
                radius: (aperture.tan() * (slice_depth * voxel_depth).sqrt()) as f32,
                cone_slope: aperture.tan() as f32,
                pixels: (scale * half_size).as_vec2(),
                clip_w: Vec2::new(-clip_from_view.z_axis.w as f32, clip_from_view.w_axis.w as f32),
                samples: settings.samples,
                exact_distance: settings.exact_distance.into(),
            },
            count: (count as u32).min(DirectionalOcclusion::MAX_SLICES),
            center_depth,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Intensities, Rescale, Volume};
    use bevy::math::DAffine3;

    fn geometry(dimensions: UVec3) -> VolumeGeometry {
        let values = vec![0; dimensions.element_product() as usize];
        let volume = Volume::new(dimensions, DAffine3::IDENTITY, Intensities::U8(values), Rescale::default());
        VolumeGeometry::of(&volume.expect("a volume"))
    }

    fn window(clip_from_view: Mat4) -> WindowUniform {
        WindowUniform {
            view_from_clip: clip_from_view.inverse(),
            world_from_view: Mat4::from_translation(Vec3::new(0.0, 0.0, 100.0)),
            viewport: Vec4::new(0.0, 0.0, 200.0, 100.0),
            ..default()
        }
    }

    #[test]
    fn slices_fill_the_volume_in_front_of_the_camera() {
        let settings = DirectionalOcclusion { aperture_degrees: 45.0, slice_voxels: 2.0, ..default() };
        let geometry = geometry(UVec3::splat(20));
        let orthographic = Mat4::orthographic_rh(-20.0, 20.0, -10.0, 10.0, 200.0, 0.1);
        let slicing = |volume: DMat4, window| Slicing::new(&geometry, volume, &settings, &window);
        let before = slicing(DMat4::IDENTITY, window(orthographic)).expect("slices");
        let SlicingData { first_depth, slice_depth, slice_mm, radius, pixels, clip_w, .. } = before.data;
        assert_eq!((first_depth, slice_depth, slice_mm, before.count), (90.0, 2.0, 2.0, 11));
        assert!(
            (radius - 2f32.sqrt()).abs() < 1e-6 && pixels.abs_diff_eq(Vec2::splat(5.0), 1e-5),
            "{radius} {pixels}"
        );
        assert!(clip_w.abs_diff_eq(Vec2::Y, 1e-6));
        let perspective = Mat4::perspective_infinite_reverse_rh(1.0, 2.0, 95.0);
        let within = slicing(DMat4::IDENTITY, window(perspective)).expect("slices");
        assert_eq!((within.data.first_depth, within.count), (96.0, 8));
        assert!(within.data.clip_w.abs_diff_eq(Vec2::X, 1e-6));
        let behind = DMat4::from_translation(DVec3::new(0.0, 0.0, 150.0));
        assert_eq!(slicing(behind, window(perspective)), None);
    }

    #[test]
    fn slices_are_bounded_and_at_least_one() {
        let window = window(Mat4::perspective_infinite_reverse_rh(1.0, 2.0, 0.1));
        let slicing = |dimensions, slice_voxels, scale| {
            let settings = DirectionalOcclusion { slice_voxels, ..default() }.clamped();
            let scale = DMat4::from_scale(DVec3::splat(scale));
            Slicing::new(&geometry(dimensions), scale, &settings, &window)
        };
        let count = |slicing: Option<Slicing>| slicing.map(|slicing| slicing.count);
        // The grid's second axis is the line of sight.
        let many = count(slicing(UVec3::new(1, 400, 1), 0.0, 0.1)).unwrap_or_default();
        assert!((4000..=DirectionalOcclusion::MAX_SLICES).contains(&many), "{many} slices");
        assert_eq!(count(slicing(UVec3::new(9, 9, 9), f32::INFINITY, 1.0)), Some(1));
        assert!(count(slicing(UVec3::new(9, 9, 9), f32::NAN, 1.0)).is_some_and(|count| count >= 9));
        assert_eq!(slicing(UVec3::new(9, 9, 9), 1.0, f64::NAN), None);
        assert_eq!(slicing(UVec3::new(9, 9, 9), 1.0, 0.0), None);
    }
}
