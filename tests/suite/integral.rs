//! The volume rendering integral on the CPU, independent of the shaders. It sums emission and absorption along the ray
//! through a pixel's centre. It uses double precision, and steps much finer than the renderer's.

use bevy::{
    math::{DMat4, DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};

use crate::{field::Field, scene::TestScene};

/// Length of a step, as a share of the smallest distance between voxels.
const STEP: f64 = 1.0 / 16.0;
/// Transmittance below which nothing behind shows.
const DARK: f64 = 1e-4;

/// A volume, its carving, its shading, and the opaque objects in it.
pub struct Integral<'a> {
    pub geometry: VolumeGeometry,
    pub intensities: Field,
    /// Interpolation of intensities.
    pub filter: Reconstruction,
    pub function: TransferFunction,
    /// Volume space (mm) → world.
    pub world_from_local: DMat4,
    /// Whether a point of the world, mm, is clipped.
    pub is_clipped: &'a dyn Fn(DVec3) -> bool,
    /// The light that a sample sends.
    pub shade: &'a dyn Fn(&Sample) -> DVec3,
    /// Distance, mm, from a point of the world (mm) to the nearest opaque surface in a direction of unit length.
    pub opaque: &'a dyn Fn(DVec3, DVec3) -> f64,
}

/// A point of the volume that a ray meets.
pub struct Sample {
    /// Linear.
    pub color: DVec3,
    /// In volume space, mm.
    pub local: DVec3,
    /// Voxels from the first voxel's centre.
    pub voxel: DVec3,
    /// Direction of the ray, in volume space, of unit length.
    pub direction: DVec3,
}

/// The volume's part of a pixel: linear, premultiplied.
#[derive(Clone, Copy)]
pub struct Pixel {
    pub color: DVec3,
    pub transmittance: f64,
}

/// A camera.
pub struct View {
    view_from_clip: DMat4,
    world_from_view: DMat4,
    size: UVec2,
}

impl View {
    /// A camera of a scene that has been drawn; `size` is that of its viewport.
    pub fn of(scene: &mut TestScene, camera: Entity, size: UVec2) -> Self {
        let world = scene.world();
        let clip_from_view = world.get::<Camera>(camera).expect("a camera").clip_from_view();
        let place = world.get::<GlobalTransform>(camera).expect("a place").to_matrix();
        Self { view_from_clip: clip_from_view.as_dmat4().inverse(), world_from_view: place.as_dmat4(), size }
    }

    /// The ray through a place, pixels: where it starts on the near plane, and its direction, in the world.
    pub fn ray(&self, at: DVec2) -> (DVec3, DVec3) {
        let place = at / self.size.as_dvec2();
        let ndc = DVec2::new(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y);
        let at = |depth| {
            self.world_from_view.transform_point3(self.view_from_clip.project_point3(ndc.extend(depth)))
        };
        // Depth is reversed: 1 is on the near plane, less is beyond.
        (at(1.0), (at(0.5) - at(1.0)).normalize())
    }

    /// Whether the ray through a place, pixels, meets an opaque surface.
    pub fn meets(&self, at: DVec2, opaque: &dyn Fn(DVec3, DVec3) -> f64) -> bool {
        let (origin, direction) = self.ray(at);
        opaque(origin / f64::from(WORLD_UNITS_PER_MM), direction).is_finite()
    }
}

impl Integral<'_> {
    /// Integral of a volume at the world's centre, with nothing in the way, in its own colours.
    pub fn of(volume: &Volume, function: &TransferFunction) -> Self {
        Self {
            geometry: VolumeGeometry::of(volume),
            intensities: Field::of(volume),
            filter: default(),
            function: function.clone(),
            world_from_local: DMat4::from_scale(DVec3::splat(WORLD_UNITS_PER_MM.into())),
            is_clipped: &|_| false,
            shade: &|sample| sample.color,
            opaque: &|_, _| f64::INFINITY,
        }
    }

    /// Linear colour, and opacity per mm, at a place (voxels).
    fn classify(&self, voxel: DVec3) -> (DVec3, f64) {
        let field = &self.intensities;
        let opaque = match self.filter {
            Reconstruction::Tricubic => field.spline_at(voxel),
            _ => field.at(voxel),
        };
        // Most points are transparent, and most functions have no need of a gradient.
        let gradient = if self.function.last_gradient().is_some() { self.gradient_at(voxel) } else { 0.0 };
        let [.., opacity] = self.function.sample_at(opaque as f32, gradient);
        if opacity <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let colored = match self.filter {
            Reconstruction::Trilinear => opaque,
            _ => field.sharp_at(voxel),
        };
        let [r, g, b, _] = self.function.sample_at(colored as f32, gradient);
        let color = LinearRgba::from(Srgba::rgb(r, g, b));
        let transmittance = 1.0 - f64::from(opacity);
        let per_mm = 1.0 - transmittance.powf(f64::from(self.function.opacity_unit_distance_mm).recip());
        (Vec3::new(color.red, color.green, color.blue).as_dvec3(), per_mm)
    }

    /// Length of the intensity's gradient at a place (voxels), per mm, by differences over two voxels.
    fn gradient_at(&self, voxel: DVec3) -> f32 {
        let field = &self.intensities;
        let slopes = DVec3::AXES.map(|axis| 0.5 * (field.at(voxel + axis) - field.at(voxel - axis)));
        // A plane wave's gradient turns with the grid's inverse transpose.
        let voxel_from_local = self.geometry.local_from_voxel.matrix3.inverse();
        (voxel_from_local.transpose() * DVec3::from(slopes)).length() as f32
    }

    /// The volume's part of a pixel in a view.
    pub fn pixel(&self, view: &View, pixel: UVec2) -> Pixel {
        self.pixel_at(view, pixel.as_dvec2() + 0.5)
    }

    /// The same by the ray through a place, pixels.
    pub fn pixel_at(&self, view: &View, at: DVec2) -> Pixel {
        merged_pixel(&[self], view, at)
    }

    /// The course of a ray through the volume.
    fn course(&self, (origin, direction): (DVec3, DVec3)) -> Course {
        let world_per_mm = f64::from(WORLD_UNITS_PER_MM);
        let local_from_world = self.world_from_local.inverse();
        let voxel_from_local = self.geometry.local_from_voxel.inverse();
        let local =
            (local_from_world.transform_point3(origin), local_from_world.transform_vector3(direction));
        let voxel = (voxel_from_local.transform_point3(local.0), voxel_from_local.transform_vector3(local.1));
        // Ray parameters at the planes of the box that the voxels fill.
        let low = (DVec3::splat(-0.5) - voxel.0) / voxel.1;
        let high = (self.geometry.dimensions.as_dvec3() - 0.5 - voxel.0) / voxel.1;
        let opaque = (self.opaque)(origin / world_per_mm, direction) * world_per_mm;
        Course {
            begin: low.min(high).max_element().max(0.0),
            end: low.max(high).min_element().min(opaque),
            local,
            voxel,
            mm: local.1.length(),
        }
    }

    /// Light of a part of a ray, and its optical depth.
    fn light(&self, ray: (DVec3, DVec3), course: &Course, [begin, end]: [f64; 2]) -> Option<(DVec3, f64)> {
        let world_per_mm = f64::from(WORLD_UNITS_PER_MM);
        let is_clipped = |t: f64| (self.is_clipped)((ray.0 + t * ray.1) / world_per_mm);
        let [begin, end] = [begin.max(course.begin), end.min(course.end)];
        if begin >= end {
            return None;
        }
        let at = |part: f64| begin + part * (end - begin);
        let (from, to) = match [is_clipped(begin), is_clipped(end)] {
            [true, true] => return None,
            [false, false] => (0.0, 1.0),
            [starts_clipped, _] => {
                let cut = halve(|part| is_clipped(at(part)) == starts_clipped);
                if starts_clipped { (cut, 1.0) } else { (0.0, cut) }
            }
        };
        let t = at(0.5 * (from + to));
        let voxel = course.voxel.0 + t * course.voxel.1;
        let (color, per_mm) = self.classify(voxel);
        // Lengths are those in the volume, whatever its scale in the world. Opaque matter has no finite depth.
        let depth = -(1.0 - per_mm).max(f64::MIN_POSITIVE).ln() * course.mm * (at(to) - at(from));
        let local = course.local.0 + t * course.local.1;
        let direction = course.local.1 / course.mm;
        (per_mm > 0.0).then(|| ((self.shade)(&Sample { color, local, voxel, direction }), depth))
    }
}

/// A ray through a volume. Places are ray parameters.
struct Course {
    begin: f64,
    end: f64,
    /// Origin and direction in volume space, and in voxels.
    local: (DVec3, DVec3),
    voxel: (DVec3, DVec3),
    /// Length of the direction in the volume.
    mm: f64,
}

/// The part that some volumes have in a pixel, by the ray through a place. Where they share space, extinctions add up.
pub fn merged_pixel(volumes: &[&Integral], view: &View, at: DVec2) -> Pixel {
    merged_pixel_up_to(&|_, _| f64::INFINITY, volumes, view, at)
}

/// The same up to a surface: its distance from a point of the world (mm) in a direction of unit length, mm.
pub fn merged_pixel_up_to(
    surface: &dyn Fn(DVec3, DVec3) -> f64,
    volumes: &[&Integral],
    view: &View,
    at: DVec2,
) -> Pixel {
    let ray = view.ray(at);
    let world_per_mm = f64::from(WORLD_UNITS_PER_MM);
    let surface = surface(ray.0 / world_per_mm, ray.1) * world_per_mm;
    let courses: Vec<_> = volumes.iter().map(|volume| volume.course(ray)).collect();
    let met = || volumes.iter().zip(&courses).filter(|(_, course)| course.begin < course.end);
    let begin = met().map(|(_, course)| course.begin).fold(f64::INFINITY, f64::min);
    let end = met().map(|(_, course)| course.end).fold(0.0, f64::max).min(surface);
    let longest = met().map(|(volume, course)| STEP * volume.geometry.spacing_mm.min_element() / course.mm);
    let longest = longest.fold(f64::INFINITY, f64::min);
    let mut pixel = Pixel { color: DVec3::ZERO, transmittance: 1.0 };
    if begin >= end {
        return pixel;
    }
    let steps = ((end - begin) / longest).ceil();
    for k in 0..steps as u32 {
        let place = |part: f64| begin + (f64::from(k) + part) / steps * (end - begin);
        let lights = met().filter_map(|(volume, course)| volume.light(ray, course, [place(0.0), place(1.0)]));
        let (mut light, mut depth) = (DVec3::ZERO, 0.0);
        for (color, own) in lights {
            light += own * color;
            depth += own;
        }
        if depth <= 0.0 {
            continue;
        }
        let opacity = 1.0 - (-depth).exp();
        pixel.color += pixel.transmittance * opacity * light / depth;
        pixel.transmittance *= 1.0 - opacity;
        if pixel.transmittance < DARK {
            break;
        }
    }
    pixel
}

/// Place in [0, 1] up to which a condition holds.
fn halve(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// sRGB byte of a linear value, not rounded.
pub fn srgb_byte(linear: f64) -> f64 {
    let encoded = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    255.0 * encoded.clamp(0.0, 1.0)
}
