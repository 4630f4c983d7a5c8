//! The scenes, for the truth and for the renderer.

use bevy::{
    math::{DQuat, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::ControlPoint};

use super::{
    edge,
    field::{BLUR_VOXELS, ColorPoint, Field, Tissue},
    solid::Solid,
    truth::Eye,
};
use crate::{
    carver::{Carver, Shape},
    scene::SceneParts,
};

/// Voxels along each side of the grids: half as many, as is, twice as many.
pub const RESOLUTIONS: [u32; 3] = [48, 96, 192];
/// Value of matter. That of its surface is half of it.
pub const MATTER: f64 = 1000.0;
/// The one colour of most scenes, sRGB-encoded: so dark that no highlight is cut off.
pub const GREY: f64 = 0.85;

/// Direction from the origin to the camera.
const VIEW: DVec3 = DVec3::new(0.55, 0.35, 0.8);
/// Distance of the camera, as a share of the grid's extent.
const DISTANCE: f64 = 5.0 / 3.0;

/// A ramp of opacity, as parts of the highest value: transparent up to the first, opaque from the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp(pub f64, pub f64);

/// A soft ramp, and one that shows the surface alone.
pub const SOFT: Ramp = Ramp(0.3, 0.7);
pub const SHARP: Ramp = Ramp(0.499, 0.501);

/// A scene at one resolution.
#[derive(Clone, Debug)]
pub struct PictureScene {
    /// The scene: `ball`, `slab`, `wall_0.3mm` and so on.
    pub name: String,
    /// The transfer function.
    pub transfer: String,
    pub field: Field,
    /// The same cuts for the renderer.
    pub carvers: Vec<Carver>,
    pub eye: Eye,
    /// Whether all is of one colour, [`GREY`].
    pub is_grey: bool,
}

impl PictureScene {
    /// All scenes with grids of `voxels` along each side; of the head, along its height. Pictures have `pixels` along each
    /// side; those of the ball twice as many, because its truth takes little time, those of the head half as many.
    pub fn all(voxels: u32, pixels: u32) -> Result<Vec<Self>, String> {
        let new =
            |name: &str, ramp, extent_mm, solid| Self::grey(name, ramp, extent_mm, solid, voxels, pixels);
        let turn = DQuat::from_euler(bevy::math::EulerRot::YXZ, 0.35, 0.2, 0.1);
        let block = Solid::Box { size: DVec3::new(56.0, 46.0, 42.0), turn };
        let slab = |thickness| Solid::Slab { normal: DVec3::new(0.3, 0.8, 0.5).normalize(), thickness };
        let ball = Solid::Ball { center: DVec3::ZERO, radius: 36.3 };
        let mut scenes = vec![
            Self::grey("ball", SOFT, 96.0, ball, voxels, 2 * pixels),
            Self::grey("ball", SHARP, 96.0, ball, voxels, 2 * pixels),
            new("slab", SOFT, 96.0, slab(24.0)).near(),
            new("box", SOFT, 96.0, block),
            Self::two_tissues(voxels, pixels),
        ];
        // The voxels are of 1.5 mm where there are 96.
        for (name, thickness) in [("wall_0.3mm", 0.3), ("wall_0.7mm", 0.7), ("wall_1.5mm", 1.5)] {
            scenes.push(new(name, SOFT, 144.0, slab(thickness)).near());
        }
        let center = 26.0 * VIEW.normalize();
        let ball_cut = Solid::Ball { center, radius: 22.0 };
        let ring_turn = DQuat::from_rotation_arc(DVec3::Y, VIEW.normalize());
        let ring = Solid::Torus { center, ring: 17.0, tube: 8.0, turn: ring_turn };
        scenes.push(new("box_cut_by_ball", SOFT, 96.0, block).cut_by(ball_cut));
        scenes.push(new("box_cut_by_torus", SOFT, 96.0, block).cut_by(ring));
        let head = Self::head(voxels, pixels / 2)?;
        let head_cut = Solid::Ball { center: DVec3::new(35.0, 75.0, 65.0), radius: 60.0 };
        scenes.push(Self { name: "head_cut_by_ball".to_owned(), ..head.clone() }.cut_by(head_cut));
        scenes.push(head);
        Ok(scenes)
    }

    /// A scene of one solid and one colour.
    fn grey(name: &str, ramp: Ramp, extent_mm: f64, solid: Solid, voxels: u32, pixels: u32) -> Self {
        let voxel_mm = extent_mm / f64::from(voxels);
        // The blur lowers a wall that is thinner than it.
        let peak = match solid {
            Solid::Slab { thickness, .. } => {
                1.0 - 2.0 * edge::share(0.5 * thickness / (BLUR_VOXELS * voxel_mm))
            }
            _ => 1.0,
        };
        let color = DVec3::splat(GREY);
        let [from, to] = [ramp.0, ramp.1].map(|part| part * peak * MATTER);
        let points = vec![
            ColorPoint { value: from, color, opacity: 0.0 },
            ColorPoint { value: to, color, opacity: 1.0 },
        ];
        let field = Field::new(vec![Tissue { solid, value: MATTER }], points, voxels, voxel_mm);
        let eye = Eye::looking_from(VIEW, DISTANCE * extent_mm, pixels);
        let round = |value: f64| (10.0 * value).round() / 10.0;
        let transfer = format!("{}-{}", round(from), round(to));
        Self { name: name.to_owned(), transfer, field, carvers: Vec::new(), eye, is_grey: true }
    }

    /// Bone in translucent soft tissue.
    fn two_tissues(voxels: u32, pixels: u32) -> Self {
        let soft = Solid::Ball { center: DVec3::ZERO, radius: 36.3 };
        let bone = Solid::Ball { center: DVec3::new(7.0, 3.0, 9.0), radius: 17.2 };
        let grey = Self::grey("two_tissues", SOFT, 96.0, soft, voxels, pixels);
        let tissues =
            vec![Tissue { solid: soft, value: 400.0 }, Tissue { solid: bone, value: MATTER - 400.0 }];
        let (red, white) = (DVec3::new(0.8, 0.4, 0.35), DVec3::new(0.88, 0.85, 0.78));
        let point = |value, color, opacity| ColorPoint { value, color, opacity };
        let points = vec![
            point(150.0, red, 0.0),
            point(250.0, red, 0.04),
            point(600.0, red, 0.04),
            point(800.0, white, 1.0),
        ];
        let field = Field::new(tissues, points, voxels, grey.field.voxel_mm);
        Self { transfer: "150-250-600-800".to_owned(), field, is_grey: false, ..grey }
    }

    /// The head phantom by the values of its own transfer function, without the gradients. Opacities are of a voxel's
    /// length.
    fn head(voxels_high: u32, pixels: u32) -> Result<Self, String> {
        let function = TransferFunction::from_bytes(include_bytes!("../../../assets/head_phantom.tf.ron"));
        let point = |point: &ControlPoint| ColorPoint {
            value: point.value.into(),
            color: Vec3::from_array(point.color).as_dvec3(),
            opacity: point.opacity.into(),
        };
        let points = function.map_err(|error| error.to_string())?.points.iter().map(point).collect();
        let field = Field::of_head(points, voxels_high);
        let height_mm = 2.0 * field.half_extent_mm().y;
        Ok(Self {
            name: "head".to_owned(),
            transfer: "head_phantom".to_owned(),
            field,
            carvers: Vec::new(),
            eye: Eye::looking_from(VIEW, DISTANCE * height_mm, pixels),
            is_grey: false,
        })
    }

    /// The scene seen through a narrow field of view: what is seen reaches beyond the picture.
    fn near(mut self) -> Self {
        self.eye.fov = 15f64.to_radians();
        self
    }

    /// The scene with a solid cut away.
    fn cut_by(mut self, cut: Solid) -> Self {
        self.carvers.push(carver_of(&cut));
        self.field.cuts.push(cut);
        self
    }

    /// The scene for the renderer. It is shown with these settings.
    pub fn parts(&self, shading: VolumeShading, occlusion: AmbientOcclusion) -> Result<SceneParts, String> {
        let of = |point: &ColorPoint| ControlPoint {
            value: point.value as f32,
            color: point.color.as_vec3().to_array(),
            opacity: point.opacity as f32,
        };
        let points = self.field.points.iter().map(of).collect();
        let function = TransferFunction::new(points, self.field.voxel_mm as f32);
        Ok(SceneParts {
            name: self.name.clone(),
            volume: self.field.volume().map_err(|error| error.to_string())?,
            transfer_function: Some(function.map_err(|error| error.to_string())?),
            budget: default(),
            occlusion,
            // The truth is that of the definition.
            shading: VolumeShading { ambient_scale: AmbientScale::Published, ..shading },
            carvers: self.carvers.clone(),
            camera: self.eye.position.as_vec3(),
            fov: self.eye.fov.to_degrees() as f32,
        })
    }
}

/// The carver of a solid. Its mesh lies within 0.02 mm of the solid's surface.
fn carver_of(solid: &Solid) -> Carver {
    let new = |shape, center: DVec3, turn: DQuat| Carver {
        rotation: turn.as_quat(),
        ..Carver::new(shape, center.as_vec3())
    };
    match *solid {
        Solid::Ball { center, radius } => {
            new(Shape::Sphere { radius: radius as f32 }, center, DQuat::IDENTITY)
        }
        Solid::Torus { center, ring, tube, turn } => {
            new(Shape::Torus { ring: ring as f32, tube: tube as f32 }, center, turn)
        }
        Solid::Box { size, turn } => new(Shape::Box { size: size.as_vec3() }, DVec3::ZERO, turn),
        Solid::Slab { normal, thickness } => {
            let turn = DQuat::from_rotation_arc(DVec3::Z, normal);
            new(Shape::Box { size: Vec3::new(1e3, 1e3, thickness as f32) }, DVec3::ZERO, turn)
        }
    }
}
