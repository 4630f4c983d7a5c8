//! Volumes whose values are a closed form of the place, and an app without a renderer that casts rays at them.

use bevy::{
    camera::visibility::VisibilityPlugin,
    ecs::system::SystemState,
    math::{DAffine3, DMat3, DMat4, DVec3},
    mesh::MeshPlugin,
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{Intensities, Rescale},
};

use crate::scene::in_world_units;

/// Length of a drawing step in a grid whose smallest spacing is 1 mm, at the default of half a voxel.
pub const STEP_MM: f64 = 0.5;

/// A grid and its directions in the patient.
pub struct Grid {
    pub size: UVec3,
    pub axes: DMat3,
}

impl Grid {
    pub fn even() -> Self {
        Self { size: UVec3::splat(36), axes: DMat3::IDENTITY }
    }

    pub fn uneven() -> Self {
        Self { size: UVec3::new(34, 27, 19), axes: DMat3::from_diagonal(DVec3::new(1.0, 1.3, 1.9)) }
    }

    pub fn sheared() -> Self {
        let axes = DMat3::from_cols(
            DVec3::new(1.0, 0.1, -0.1),
            DVec3::new(0.3, 1.1, 0.0),
            DVec3::new(0.2, -0.3, 1.2),
        );
        Self { size: UVec3::new(40, 36, 34), axes }
    }

    /// 64 mm along x.
    pub fn long() -> Self {
        Self { size: UVec3::new(64, 40, 40), axes: DMat3::IDENTITY }
    }

    /// Place of a voxel in volume space: x to the left, y up, z to the front. The patient's axes are right, front, up.
    fn place(&self, voxel: DVec3) -> DVec3 {
        let p = self.axes * (voxel - 0.5 * (self.size.as_dvec3() - 1.0));
        DVec3::new(-p.x, p.z, p.y)
    }

    pub fn voxel_at(&self, p: DVec3) -> DVec3 {
        self.axes.inverse() * DVec3::new(-p.x, p.z, p.y) + 0.5 * (self.size.as_dvec3() - 1.0)
    }

    /// Half the size of the box that the voxels fill, for a grid of right angles.
    pub fn half_mm(&self) -> DVec3 {
        let half = 0.5 * (self.axes * self.size.as_dvec3());
        DVec3::new(half.x, half.z, half.y)
    }

    fn volume(&self, value: impl Fn(DVec3) -> f64) -> Volume {
        let mut values = Vec::new();
        for z in 0..self.size.z {
            for y in 0..self.size.y {
                for x in 0..self.size.x {
                    let value = value(self.place(UVec3::new(x, y, z).as_dvec3()));
                    values.push((value.clamp(0.0, 1.0) * 65_535.0).round() as u16);
                }
            }
        }
        let grid_to_patient = DAffine3::from_mat3(self.axes);
        Volume::new(self.size, grid_to_patient, Intensities::U16(values), Rescale::default())
            .expect("a volume")
    }
}

/// A ball about the middle. Its value falls from 1 to 0 over 8 mm, and is half at the radius.
#[derive(Clone, Copy)]
pub struct Ball {
    pub radius_mm: f64,
}

const EDGE_MM: f64 = 8.0;

impl Ball {
    pub fn value(&self, p: DVec3) -> f64 {
        0.5 - (p.length() - self.radius_mm) / EDGE_MM
    }

    /// Radius at which the value is this one.
    pub fn radius_of(&self, value: f64) -> f64 {
        self.radius_mm + (0.5 - value) * EDGE_MM
    }

    /// Where a ray enters and leaves the ball, mm.
    pub fn enter(&self, from: DVec3, to: DVec3) -> Option<[f64; 2]> {
        let way = (to - from).normalize();
        let nearest = -from.dot(way);
        let half = self.radius_mm.powi(2) - (from + nearest * way).length_squared();
        (half > 0.0).then(|| [nearest - half.sqrt(), nearest + half.sqrt()])
    }
}

/// Where a ray enters and leaves a cuboid, mm, with the normals there.
pub fn through_cuboid(
    pose: Transform,
    half: DVec3,
    from: DVec3,
    to: DVec3,
) -> Option<([f64; 2], [DVec3; 2])> {
    let turn = pose.rotation.as_dquat();
    let back = turn.inverse();
    let (origin, way) = (back * (from - pose.translation.as_dvec3()), back * (to - from).normalize());
    let mut range = [f64::NEG_INFINITY, f64::INFINITY];
    let mut normals = [DVec3::X; 2];
    for axis in 0..3 {
        let sides = [-half[axis], half[axis]].map(|side| (side - origin[axis]) / way[axis]);
        let [near, far] = [sides[0].min(sides[1]), sides[0].max(sides[1])];
        if near > range[0] {
            (range[0], normals[0]) = (near, turn * DVec3::AXES[axis]);
        }
        if far < range[1] {
            (range[1], normals[1]) = (far, turn * DVec3::AXES[axis]);
        }
    }
    (range[0] < range[1]).then_some((range, normals))
}

/// Parts of a ray: in matter, and in a carver that keeps or removes it.
pub struct Parts {
    pub matter: Option<[f64; 2]>,
    pub cut: Option<[f64; 2]>,
    pub keeps: bool,
}

impl Parts {
    /// Where the first of what is left begins, mm, and whether that is at a cut. `None` where something is within `margin`
    /// of something else: too close to call.
    pub fn first(&self, margin: f64) -> Option<Option<(f64, bool)>> {
        let matter = match self.matter {
            None => return Some(None),
            Some([near, far]) if far - near < 4.0 * margin => return None,
            Some(matter) => matter,
        };
        let Some(cut) = self.cut else {
            return Some((!self.keeps).then_some((matter[0], false)));
        };
        let close = matter.iter().any(|a| cut.iter().any(|b| (a - b).abs() < 2.0 * margin));
        if close || cut[1] - cut[0] < margin {
            return None;
        }
        Some(if self.keeps {
            let begin = matter[0].max(cut[0]);
            (begin < matter[1].min(cut[1])).then_some((begin, cut[0] > matter[0]))
        } else if matter[0] < cut[0] || matter[0] > cut[1] {
            Some((matter[0], false))
        } else {
            (cut[1] < matter[1]).then_some((cut[1], true))
        })
    }
}

/// Shows what has at least this share of the highest value, opaque within a hundredth of a step.
pub fn opaque_from(share: f32) -> TransferFunction {
    let point = |value: f32, opacity| ControlPoint { value, color: [1.0; 3], opacity };
    let at = share * 65_535.0;
    TransferFunction::new(vec![point(at, 0.0), point(at, 0.999)], 0.05).expect("a step")
}

/// Of a volume whose value is linear in x over 64 mm: a translucent layer, and a wall.
pub const LAYER: [f64; 2] = [20.0, 32.0];
pub const WALL: f64 = 40.0;
/// 0.045 of the light is stopped over a mm.
pub const EXTINCTION_PER_MM: f64 = 0.046_043_938_5;

pub fn slabs() -> TransferFunction {
    let at =
        |mm: f64, opacity| ControlPoint { value: (mm / 64.0 * 65_535.0) as f32, color: [1.0; 3], opacity };
    let [near, far] = LAYER;
    let points =
        vec![at(near, 0.0), at(near, 0.045), at(far, 0.045), at(far, 0.0), at(WALL, 0.0), at(WALL, 1.0)];
    TransferFunction::new(points, 1.0).expect("steps")
}

/// A ray from one place to another, both in volume space, mm.
pub fn world_ray(world_from_mm: &DAffine3, from: DVec3, to: DVec3) -> Ray3d {
    let [from, to] = [from, to].map(|p| world_from_mm.transform_point3(p));
    Ray3d::new(from.as_vec3(), Dir3::new((to - from).as_vec3()).expect("a way"))
}

/// An app without a renderer, with a volume in it.
pub struct Bench {
    pub app: App,
    pub volume: Entity,
    world_from_mm: DAffine3,
}

impl Bench {
    /// The volume is in the innermost of the places.
    pub fn new(
        grid: &Grid,
        places: &[Transform],
        value: impl Fn(DVec3) -> f64,
        function: TransferFunction,
    ) -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin)).add_plugins((
            MeshPlugin,
            VisibilityPlugin,
            ContextualAoPlugin,
        ));
        let world = app.world_mut();
        let volume = world.resource_mut::<Assets<Volume>>().add(grid.volume(value));
        let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
        let bundle = VolumeBundle::new(volume).with_transfer_function(function);
        let mut world_from_mm = DMat4::IDENTITY;
        let mut parent = None;
        for place in places {
            let entity = world.spawn((*place, Visibility::default())).id();
            if let Some(parent) = parent {
                world.entity_mut(entity).insert(ChildOf(parent));
            }
            parent = Some(entity);
            let turn = DMat4::from_quat(place.rotation.as_dquat());
            world_from_mm *= DMat4::from_translation(place.translation.as_dvec3())
                * turn
                * DMat4::from_scale(place.scale.as_dvec3());
        }
        let volume = parent.expect("a place");
        let transform = *places.last().expect("a place");
        world.entity_mut(volume).insert(bundle.with_transform(transform));
        let world_from_mm = DAffine3::from_mat4(world_from_mm * DMat4::from_scale(DVec3::splat(0.001)));
        Self { app, volume, world_from_mm }
    }

    pub fn world_from_mm(&self) -> DAffine3 {
        self.world_from_mm
    }

    pub fn to_mm(&self, position: Vec3) -> DVec3 {
        self.world_from_mm.inverse().transform_point3(position.as_dvec3())
    }

    pub fn insert(&mut self, bundle: impl Bundle) {
        let volume = self.volume;
        self.app.world_mut().entity_mut(volume).insert(bundle);
    }

    /// Spawns a carver; the transform is in mm from the volume's centre.
    pub fn carve(&mut self, mesh: Mesh, clip: ClipMesh, pose_mm: Transform) -> Entity {
        let volume = self.volume;
        let world = self.app.world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        world.spawn((clip, Mesh3d(mesh), in_world_units(pose_mm), ChildOf(volume))).id()
    }

    pub fn cast(&mut self, ray: Ray3d) -> Option<VolumeHit> {
        self.cast_by(ray, &VolumeRayCastSettings::default())
    }

    /// Casts a ray after a frame.
    pub fn cast_by(&mut self, ray: Ray3d, settings: &VolumeRayCastSettings) -> Option<VolumeHit> {
        self.app.update();
        hit_by(self.app.world_mut(), ray, settings)
    }

    pub fn cast_all(&mut self, ray: Ray3d) -> Vec<VolumeHit> {
        self.app.update();
        let world = self.app.world_mut();
        let mut state = SystemState::<VolumeRayCast>::new(world);
        let settings = VolumeRayCastSettings::default();
        state.get(world).expect("all that it needs").cast_all(ray, &settings)
    }

    /// Angle between a normal in the world and one in volume space, turned towards the ray's origin.
    pub fn degrees_between(&self, normal: Dir3, local: DVec3, ray: Ray3d) -> f64 {
        let world = (self.world_from_mm.matrix3.inverse().transpose() * local).normalize();
        let facing = if world.dot(ray.direction.as_dvec3()) > 0.0 { -world } else { world };
        normal.as_dvec3().normalize().dot(facing).clamp(-1.0, 1.0).acos().to_degrees()
    }
}

/// What a ray hits as the world is now.
pub fn hit_by(world: &mut World, ray: Ray3d, settings: &VolumeRayCastSettings) -> Option<VolumeHit> {
    let mut state = SystemState::<VolumeRayCast>::new(world);
    state.get(world).expect("all that it needs").cast(ray, settings)
}
