//! Directional occlusion shading by plain loops: slices, two light buffers in turn, one grid of samples.

use bevy::{
    math::{DMat4, DVec2, DVec3, DVec4, UVec2, Vec4Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    occlusion::DirectionalOcclusion,
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};

use crate::field::Field;

/// A volume that fills its box, as the eye and the light see it.
pub struct Reference {
    geometry: VolumeGeometry,
    values: Field,
    function: TransferFunction,
    settings: DirectionalOcclusion,
}

/// Light of every pixel of a window; 1 outside of it.
struct Light {
    size: UVec2,
    values: Vec<f64>,
}

impl Light {
    fn new(size: UVec2) -> Self {
        Self { size, values: vec![1.0; size.element_product() as usize] }
    }

    fn at(&self, x: i64, y: i64) -> f64 {
        let is_inside = x >= 0 && y >= 0 && x < self.size.x.into() && y < self.size.y.into();
        if is_inside { self.values[(y * i64::from(self.size.x) + x) as usize] } else { 1.0 }
    }

    /// Interpolates bilinearly. Values are at the pixels' centres.
    fn sample(&self, place: DVec2) -> f64 {
        let place = place - 0.5;
        let base = place.floor();
        let f = place - base;
        let (x, y) = (base.x as i64, base.y as i64);
        let row = |y| self.at(x, y) * (1.0 - f.x) + self.at(x + 1, y) * f.x;
        row(y) * (1.0 - f.y) + row(y + 1) * f.y
    }
}

impl Reference {
    pub fn new(volume: &Volume, function: &TransferFunction, settings: DirectionalOcclusion) -> Self {
        let values = Field::of(volume);
        Self { geometry: VolumeGeometry::of(volume), values, function: function.clone(), settings }
    }

    /// Linear colour and opacity per mm at a point of the volume (mm); nothing outside of its box.
    fn classify(&self, local: DVec3) -> (DVec3, f64) {
        let voxel = self.geometry.local_from_voxel.inverse().transform_point3(local);
        let beyond = (voxel + 0.5).min(self.geometry.dimensions.as_dvec3() - 0.5 - voxel);
        if beyond.min_element() < 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let [r, g, b, opacity] = self.function.sample(self.values.at(voxel) as f32);
        let color = LinearRgba::from(Srgba::rgb(r, g, b));
        (Vec3::new(color.red, color.green, color.blue).as_dvec3(), opacity.into())
    }

    /// Linear colours of an image, rows downwards. The volume is at the world's centre.
    pub fn image(
        &mut self,
        clip_from_view: Mat4,
        pose: Transform,
        size: UVec2,
        background: LinearRgba,
    ) -> Vec<DVec3> {
        let settings = self.settings;
        let clip_from_view = clip_from_view.as_dmat4();
        let view_from_clip = clip_from_view.inverse();
        let scale = f64::from(WORLD_UNITS_PER_MM);
        let view_from_local = pose.to_matrix().as_dmat4().inverse() * DMat4::from_scale(DVec3::splat(scale));
        let local_from_view = view_from_local.inverse();

        // One of the slices passes through the middle.
        let corners = self.geometry.corners().map(|corner| view_from_local.transform_point3(corner));
        let near = view_from_clip.project_point3(DVec3::Z);
        let nearest = corners.iter().map(|corner| -corner.z).fold(f64::MAX, f64::min).max(-near.z);
        let farthest = corners.iter().map(|corner| -corner.z).fold(f64::MIN, f64::max);
        let middle = -view_from_local.transform_point3(DVec3::ZERO).z;
        let spacing_mm = self.geometry.spacing_mm.min_element() * f64::from(settings.slice_voxels);
        let spacing = spacing_mm * scale;
        let numbers =
            ((nearest - middle) / spacing).ceil() as i64..=((farthest - middle) / spacing).floor() as i64;

        // The window holds the box's pixels and one more on every side. It holds all pixels if the near plane cuts
        // the box.
        let pixels = corners.map(|corner| {
            let clip: DVec4 = clip_from_view * corner.extend(1.0);
            let is_behind = clip.w <= 0.0 || clip.z > clip.w;
            let ndc = clip.xy() / clip.w * DVec2::new(0.5, -0.5) + 0.5;
            (!is_behind).then(|| ndc * size.as_dvec2())
        });
        let (mut first, mut end) = (UVec2::ZERO, size);
        if pixels.iter().all(Option::is_some) {
            let pixels = || pixels.iter().copied().flatten();
            let (lower, upper) = (pixels().reduce(DVec2::min), pixels().reduce(DVec2::max));
            first = (lower.unwrap_or_default() - 1.0).floor().max(DVec2::ZERO).as_uvec2();
            end = (upper.unwrap_or_default() + 1.0).ceil().min(size.as_dvec2()).as_uvec2();
        }
        let window = end - first;

        let half_size = 0.5 * size.as_dvec2();
        let aperture = f64::from(settings.aperture_degrees).to_radians();
        // The paper's radius for slices a voxel apart; the mean of means is as wide for any slices.
        let voxel = spacing / f64::from(settings.slice_voxels);
        let radius = (spacing * voxel).sqrt() * aperture.tan();
        let side = i64::from(settings.samples);
        let centers = (0..side).map(|k| (2 * k + 1) as f64 / side as f64 - 1.0);
        let grid: Vec<DVec2> = centers
            .clone()
            .flat_map(|y| centers.clone().map(move |x| DVec2::new(x, y)))
            .filter(|p| p.length() <= 1.0)
            .map(|p| p * radius)
            .collect();

        let mut light = Light::new(window);
        let mut colors = vec![DVec3::ZERO; light.values.len()];
        let mut alphas = vec![0.0; light.values.len()];
        for number in numbers {
            let depth = middle + number as f64 * spacing;
            let mut next = Light::new(window);
            // Pixels per unit, after the division by w.
            let clip_w = (clip_from_view * DVec4::new(0.0, 0.0, -depth, 1.0)).w;
            let pixels = DVec2::new(clip_from_view.x_axis.x, clip_from_view.y_axis.y) * half_size / clip_w;
            for index in 0..light.values.len() {
                let place = UVec2::new(index as u32 % window.x, index as u32 / window.x);
                let center = place.as_dvec2() + 0.5;
                let ndc = ((first.as_dvec2() + center) / size.as_dvec2() * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
                // The ray through the pixel meets the slice.
                let start = view_from_clip.project_point3(ndc.extend(1.0));
                let is_parallel = clip_from_view.w_axis.w == 1.0;
                let along = if is_parallel { DVec3::NEG_Z } else { start / -start.z };
                let point = start + (depth + start.z) * along;
                let (color, opacity) = self.classify(local_from_view.transform_point3(point));
                if alphas[index] < 0.99 {
                    let share = 1.0 - (1.0 - opacity).powf(spacing_mm * along.length());
                    let share = (1.0 - alphas[index]) * share;
                    colors[index] += share * light.values[index] * color;
                    alphas[index] += share;
                    if alphas[index] >= 0.99 {
                        colors[index] /= alphas[index];
                        alphas[index] = 1.0;
                    }
                }
                let mut sum = 0.0;
                for p in &grid {
                    let across = p.length() / radius * aperture.tan();
                    let way = if settings.exact_distance { spacing * across.hypot(1.0) } else { spacing };
                    let transmittance = (1.0 - opacity).powf(way / scale);
                    sum += light.sample(center + *p * pixels) * transmittance;
                }
                next.values[index] = sum / grid.len() as f64;
            }
            light = next;
        }

        let background = Vec3::new(background.red, background.green, background.blue).as_dvec3();
        let mut image = vec![background; size.element_product() as usize];
        for (index, (color, alpha)) in colors.into_iter().zip(alphas).enumerate() {
            let place = first + UVec2::new(index as u32 % window.x, index as u32 / window.x);
            image[(place.y * size.x + place.x) as usize] = color + (1.0 - alpha) * background;
        }
        image
    }
}
