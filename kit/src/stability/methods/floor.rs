//! A white, opaque floor with solids on it. A pixel's value in an image of the floor is the occlusion factor.

use crate::mode::ShadingMode;
use bevy::{
    camera::{CameraProjection, ScalingMode},
    math::{DAffine3, DQuat, DVec2, DVec3, Vec3Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{Intensities, Rescale, WORLD_UNITS_PER_MM},
};

use super::super::super::{
    headless::voxel_at,
    small_scene::{IMAGE, TestScene},
};

/// Size of the grid, voxels of 1 mm.
const SIZE: UVec3 = UVec3::new(48, 48, 32);
/// Height of the floor, mm from the volume's centre.
pub const FLOOR: f64 = -6.0;
/// Distance over which intensity falls from the highest to the lowest at surfaces, mm.
const EDGE_MM: f64 = 3.0;
/// Radius of the floor. The floor is a disk, so it is the same in a turned grid.
const RADIUS: f64 = 21.0;
/// Width of the world in a view from above, mm.
const WIDTH_MM: f64 = 44.0;
/// Distance of the camera, mm.
const DISTANCE_MM: f32 = 120.0;

/// Signed distance from the solids on the floor, mm. x and y lie along the floor, z points upwards.
pub type Solid<'a> = &'a dyn Fn(DVec3) -> f64;

/// Distance from a box.
pub fn cuboid(p: DVec3, center: DVec3, half: DVec3) -> f64 {
    let q = (p - center).abs() - half;
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

/// Distance from an upright cylinder on the floor.
pub fn post(p: DVec3, radius: f64, top: f64) -> f64 {
    (p.truncate().length() - radius).max(p.z - top)
}

/// No solid on the floor.
pub fn nothing(_: DVec3) -> f64 {
    f64::MAX
}

/// Scene with a floor.
pub struct Floor {
    pub scene: TestScene,
    occlusion: AmbientOcclusion,
}

impl Floor {
    /// Shows a floor from above, in a grid turned about the vertical.
    pub fn new(occlusion: &AmbientOcclusion, solid: Solid, turned_degrees: f64) -> Self {
        let turn = DQuat::from_rotation_z(turned_degrees.to_radians());
        let value = |index| {
            let p = turn * (voxel_at(index, SIZE).as_dvec3() - 0.5 * (SIZE.as_dvec3() - 1.0));
            let floor = (p.truncate().length() - RADIUS).max(p.z - FLOOR);
            // Blurs surfaces as scanners do.
            (255.0 * (0.5 - floor.min(solid(p)) / EDGE_MM).clamp(0.0, 1.0)).round() as u8
        };
        let values = (0..SIZE.element_product()).map(value).collect();
        let grid_to_patient = DAffine3::from_quat(turn);
        let volume = Volume::new(SIZE, grid_to_patient, Intensities::U8(values), Rescale::default());
        let white = TransferFunction::ramp(100.0, 160.0, 1.0, [1.0; 3]).expect("a valid ramp");
        let volume = volume.expect("a valid volume");
        let mut scene = TestScene::new(volume, white, occlusion.clone(), ShadingMode::Cao);
        let entity = scene.volume;
        scene.world().entity_mut(entity).insert(VolumeShading {
            jitter: false,
            step_voxels: 0.25,
            // Images are compared with definitions.
            ambient_scale: AmbientScale::Published,
            ..default()
        });
        let camera = scene.camera();
        scene.headless.render_floats(camera, IMAGE);
        let mut floor = Self { scene, occlusion: occlusion.clone() };
        floor.look_from_above();
        floor.scene.settle();
        floor.settle();
        floor
    }

    /// Spawns a carver that is a box. `center` and `half`, half its size, are in mm.
    pub fn carve(&mut self, center: DVec3, half: DVec3) -> Entity {
        let size = 2.0 * local(half).abs();
        let pose = Transform::from_translation(local(center));
        let carver = self.scene.carve(Cuboid::from_size(size), ClipMesh::default(), pose);
        self.scene.settle();
        self.settle();
        carver
    }

    /// Moves a carver; `center` is in mm.
    pub fn move_carver(&mut self, carver: Entity, center: DVec3) {
        self.scene.move_carver(carver, Transform::from_translation(local(center)));
    }

    /// Runs frames until methods that take several frames have converged.
    pub fn settle(&mut self) {
        let frames = match self.occlusion.method {
            OcclusionMethod::Progressive(settings) => {
                settings.rays.pattern.rays().div_ceil(settings.rays_per_frame) + 1
            }
            _ => 2,
        };
        self.scene.headless.frames(frames);
    }

    /// Changes the settings of occlusion.
    pub fn set_occlusion(&mut self, occlusion: AmbientOcclusion) {
        self.occlusion = occlusion.clone();
        let volume = self.scene.volume;
        self.scene.world().entity_mut(volume).insert(occlusion);
        self.settle();
    }

    /// Changes the distance between samples along view rays, voxels.
    pub fn set_view_step(&mut self, voxels: f32) {
        let volume = self.scene.volume;
        if let Some(mut shading) = self.scene.world().get_mut::<VolumeShading>(volume) {
            shading.step_voxels = voxels;
        }
    }

    fn look_from_above(&mut self) {
        let projection = OrthographicProjection {
            scaling_mode: ScalingMode::Fixed {
                width: WIDTH_MM as f32 * WORLD_UNITS_PER_MM,
                height: WIDTH_MM as f32 * WORLD_UNITS_PER_MM,
            },
            near: 1e-4,
            ..OrthographicProjection::default_3d()
        };
        self.look_at(DVec3::ZERO, 0.0, Projection::Orthographic(projection));
    }

    /// Looks down in perspective, tilted by `degrees` to a side.
    pub fn look_tilted(&mut self, degrees: f64) {
        let fov = 2.0 * (0.5 * WIDTH_MM as f32 / DISTANCE_MM).atan();
        let projection = PerspectiveProjection { near: 1e-4, fov, ..default() };
        self.look_at(DVec3::ZERO, degrees, Projection::Perspective(projection));
    }

    fn look_at(&mut self, target: DVec3, degrees: f64, projection: Projection) {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let away = local(DVec3::new(sin, 0.0, cos)) * DISTANCE_MM;
        let target = local(target);
        let place = Transform::from_translation((target + away) * WORLD_UNITS_PER_MM)
            .looking_at(target * WORLD_UNITS_PER_MM, local(DVec3::Y));
        let camera = self.scene.camera();
        self.scene.world().entity_mut(camera).insert((place, projection));
    }

    /// Factors that the last frame shows, from the camera's current place.
    pub fn shown(&mut self) -> Shown {
        let camera = self.scene.camera();
        let world = self.scene.headless.app.world();
        let place = world.get::<Transform>(camera).copied().unwrap_or_default();
        let clip_from_view = match world.get::<Projection>(camera) {
            Some(Projection::Orthographic(projection)) => {
                let mut projection = projection.clone();
                projection.update(IMAGE.x as f32, IMAGE.y as f32);
                projection.get_clip_from_view()
            }
            Some(projection) => projection.get_clip_from_view(),
            None => Mat4::IDENTITY,
        };
        Shown {
            values: self.scene.headless.light().iter().map(|[red, ..]| *red as f32).collect(),
            clip_from_world: clip_from_view * place.to_matrix().inverse(),
        }
    }

    /// Runs a frame and returns its factors.
    pub fn frame(&mut self) -> Shown {
        self.scene.headless.frame();
        self.shown()
    }
}

/// Converts patient space, in which volumes are made, to volume space.
fn local(p: DVec3) -> Vec3 {
    p.as_vec3().xzy() * Vec3::new(-1.0, 1.0, 1.0)
}

/// An image of occlusion factors.
#[derive(Clone)]
pub struct Shown {
    values: Vec<f32>,
    clip_from_world: Mat4,
}

impl Shown {
    /// Factor shown at a point (mm) that the camera sees, interpolated between pixels.
    pub fn at(&self, p: DVec3) -> f64 {
        let ndc = self.clip_from_world.project_point3(local(p) * WORLD_UNITS_PER_MM);
        let place = (ndc.xy() * Vec2::new(0.5, -0.5) + 0.5) * IMAGE.as_vec2() - 0.5;
        let (base, part) = (place.floor(), place.fract_gl().as_dvec2());
        let value = |dx, dy| {
            let pixel = (base.as_ivec2() + IVec2::new(dx, dy)).clamp(IVec2::ZERO, IMAGE.as_ivec2() - 1);
            f64::from(self.values[(pixel.y * IMAGE.x as i32 + pixel.x) as usize])
        };
        let row = |dy| value(0, dy) * (1.0 - part.x) + value(1, dy) * part.x;
        row(0) * (1.0 - part.y) + row(1) * part.y
    }

    /// Factors shown at points.
    pub fn at_all(&self, points: &[DVec3]) -> Vec<f64> {
        points.iter().map(|p| self.at(*p)).collect()
    }
}

/// Points of the floor in a ring around its middle, 1 mm apart.
pub fn floor_points(inner: f64, outer: f64) -> Vec<DVec3> {
    let places = (-20..=20).flat_map(|y| (-20..=20).map(move |x| DVec2::new(f64::from(x), f64::from(y))));
    let in_ring = places.filter(|p| (inner..outer).contains(&p.length()));
    in_ring.map(|p| p.extend(FLOOR)).collect()
}

/// RMS difference of two lists.
pub fn rms(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len().max(1) as f64).sqrt()
}
