//! A long run: everything is spawned, moved, edited and despawned at random, for many frames. Nothing may be left
//! behind, and the image must be that of a fresh start.

use crate::mode::ShadingMode;
use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{diagnostics::GpuUsage, prelude::*};

use super::{
    super::{
        random::Random,
        shapes::Triangles,
        small_scene::{FEW_RAYS, TestScene, few_rays, folded_volume, opaque_ramp, translucent_ramp},
    },
    Figure,
};

/// The figure of the whole process: it says nothing where other scenes share the process.
pub const PROCESS_MEMORY: &str = "memory of the process grown since a quarter of it";

const MOST_CARVERS: usize = 6;
const MOST_VOLUMES: usize = 3;
const MOST_CAMERAS: usize = 3;

fn scene() -> TestScene {
    let mut scene = TestScene::new(volume(0), opaque_ramp(), few_rays(), ShadingMode::Cao);
    // The smaller the maps, the more frames run in an hour.
    scene.set_clip(|clip| clip.depth_map_size = 64);
    scene
}

fn volume(k: usize) -> Volume {
    let size = [UVec3::new(18, 16, 14), UVec3::new(9, 20, 12), UVec3::new(13, 7, 17)][k % 3];
    folded_volume(size, DVec3::new(1.0, 1.0 + 0.1 * k as f64, 1.0))
}

fn function(k: usize) -> TransferFunction {
    if k.is_multiple_of(2) { opaque_ramp() } else { translucent_ramp() }
}

fn mesh(k: usize) -> Triangles {
    match k % 4 {
        0 => Triangles::sphere(4.0, 12),
        1 => Triangles::cuboid(Vec3::new(5.0, 6.0, 7.0)),
        2 => Triangles::torus(5.0, 2.0, 24, 12).rotated(Quat::from_rotation_x(0.7)),
        _ => Triangles::two_spheres(2.0, 6.0, 8),
    }
}

fn pose(random: &mut Random) -> Transform {
    // Some poses are collapsed, mirrored or far too large.
    let scale = [1.0, 1.2, 0.7, -1.0, 0.0, 50.0][random.below(6)];
    Transform { translation: 8.0 * random.point(), rotation: random.rotation(3.0), scale: Vec3::splat(scale) }
}

/// Holdings that must be the same at the end as at the start.
#[derive(Debug, PartialEq)]
struct Holdings {
    usage: GpuUsage,
    entities: u32,
    meshes: usize,
    volumes: usize,
    functions: usize,
}

impl Holdings {
    fn of(scene: &mut TestScene) -> Self {
        let usage = scene.status().usage;
        let world = scene.world();
        Self {
            usage,
            entities: world.entities().count_spawned(),
            meshes: world.resource::<Assets<Mesh>>().len(),
            volumes: world.resource::<Assets<Volume>>().len(),
            functions: world.resource::<Assets<TransferFunction>>().len(),
        }
    }
}

/// The scene and the entities spawned into it.
struct Soak {
    scene: TestScene,
    random: Random,
    volumes: Vec<Entity>,
    carvers: Vec<Entity>,
    cameras: Vec<Entity>,
}

impl Soak {
    /// Makes one random change.
    fn change(&mut self) {
        let k = self.random.below(1000);
        match self.random.below(12) {
            0 if self.volumes.len() < MOST_VOLUMES => self.spawn_volume(k),
            1 => remove_one(&mut self.scene, &mut self.random, &mut self.volumes),
            2 if self.carvers.len() < MOST_CARVERS => {
                let pose = pose(&mut self.random);
                let carver = self.scene.carve_with(&mesh(k), pose);
                if k.is_multiple_of(5) {
                    self.scene.world().entity_mut(carver).insert(ClipMesh::intersect());
                }
                self.carvers.push(carver);
            }
            3 => remove_one(&mut self.scene, &mut self.random, &mut self.carvers),
            4 if self.cameras.len() < MOST_CAMERAS => {
                let camera = self.scene.headless.camera();
                let view = Transform::from_translation(0.05 * self.random.point());
                self.cameras.push(self.scene.world().spawn((camera, view)).id());
            }
            5 => remove_one(&mut self.scene, &mut self.random, &mut self.cameras),
            6 => self.edit_function(k),
            7 => self.set_mode(ShadingMode::ALL[k % 5]),
            8 => self
                .set_on_volume(AmbientOcclusion::by(OcclusionRays { steps: 1 + k as u32 % 6, ..FEW_RAYS })),
            9 => self.change_mesh(k),
            _ => {
                for carver in self.carvers.clone() {
                    let pose = pose(&mut self.random);
                    self.scene.move_carver(carver, pose);
                }
            }
        }
    }

    fn spawn_volume(&mut self, k: usize) {
        let world = self.scene.world();
        let volume = world.resource_mut::<Assets<Volume>>().add(volume(k));
        let function = world.resource_mut::<Assets<TransferFunction>>().add(function(k));
        let mut bundle = VolumeBundle::new(volume).with_transfer_function(function);
        bundle.occlusion = few_rays();
        // As that of the scene it is compared with.
        bundle.shading.ambient_scale = AmbientScale::Published;
        self.volumes.push(self.scene.world().spawn(bundle).id());
    }

    /// Edits the transfer function of a volume in place.
    fn edit_function(&mut self, k: usize) {
        let Some(&volume) = self.volumes.get(k % MOST_VOLUMES) else { return };
        let world = self.scene.world();
        let handle = world.get::<VolumeTransferFunction>(volume).expect("a volume").0.clone();
        let _ = world.resource_mut::<Assets<TransferFunction>>().insert(&handle, function(k / 3));
    }

    fn set_mode(&mut self, mode: ShadingMode) {
        if let Some(&volume) = self.volumes.first() {
            self.scene.headless.set_mode(volume, mode);
        }
    }

    fn set_on_volume(&mut self, component: impl Component) {
        if let Some(&volume) = self.volumes.first() {
            self.scene.world().entity_mut(volume).insert(component);
        }
    }

    /// Gives a carver another mesh, or changes its own.
    fn change_mesh(&mut self, k: usize) {
        let Some(&carver) = self.carvers.first() else { return };
        let world = self.scene.world();
        let handle = world.get::<Mesh3d>(carver).expect("a carver").0.clone();
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        if k.is_multiple_of(2) {
            let _ = meshes.insert(&handle, mesh(k / 2).mesh());
        } else {
            let other = meshes.add(mesh(k / 2).mesh());
            world.entity_mut(carver).insert(Mesh3d(other));
        }
    }
}

fn remove_one(scene: &mut TestScene, random: &mut Random, entities: &mut Vec<Entity>) {
    if !entities.is_empty() {
        let entity = entities.swap_remove(random.below(entities.len()));
        scene.world().despawn(entity);
    }
}

/// Runs for `frames` frames. A panic or a validation message of the renderer ends the run.
pub fn run(frames: u32, report: &mut impl FnMut(Figure)) {
    let mut fresh = scene();
    fresh.settle();
    rest(&mut fresh);
    let (start, expected) = (Holdings::of(&mut fresh), fresh.headless.image());

    let scene = scene();
    let mut soak =
        Soak { volumes: vec![scene.volume], scene, random: Random(7), carvers: vec![], cameras: vec![] };
    let mut settled = None;
    for frame in 0..frames {
        if frame > 0 && frame.is_multiple_of(500) {
            eprintln!("soak: {frame} of {frames} frames");
        }
        soak.change();
        soak.scene.headless.frame();
        // In the first quarter pipelines are compiled and pools fill.
        if frame == frames / 4 {
            settled = resident_bytes();
        }
    }
    let grown = resident_bytes().zip(settled).map(|(now, settled)| now.saturating_sub(settled));
    for entity in soak.volumes.drain(..).chain(soak.carvers.drain(..)).chain(soak.cameras.drain(..)) {
        soak.scene.world().despawn(entity);
    }
    soak.spawn_volume(0);
    let mut scene = soak.scene;
    scene.volume = soak.volumes[0];
    scene.settle();
    rest(&mut scene);
    let end = Holdings::of(&mut scene);
    if end != start {
        eprintln!("at the start {start:?}, at the end {end:?}");
    }
    let different = scene.headless.image().iter().zip(&expected).filter(|(a, b)| a != b).count();
    let figures = [
        ("holdings that are not as at the start", "yes 1, no 0", f64::from(u8::from(end != start))),
        (
            "textures more than at the start",
            "textures",
            f64::from(end.usage.textures) - f64::from(start.usage.textures),
        ),
        (
            "bytes on the device more than at the start",
            "bytes",
            end.usage.bytes as f64 - start.usage.bytes as f64,
        ),
        ("different from a fresh start", "bytes of the image", different as f64),
    ];
    let mut figure = |figure, unit, bound, value| {
        let case = format!("soak, {frames} frames");
        report(Figure { case, method: "cao".into(), figure, unit, bound: Some(bound), value });
    };
    for (name, unit, value) in figures {
        figure(name, unit, 0.0, value);
    }
    if let Some(grown) = grown {
        // Allowance for allocators. A leak of 10 KiB a frame would show in 10,000 frames.
        figure(PROCESS_MEMORY, "MiB", 64.0, grown as f64 / f64::from(1 << 20));
    }
}

/// The process's memory, bytes; `None` where the system does not tell.
fn resident_bytes() -> Option<u64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(pages.split(' ').nth(1)?.parse::<u64>().ok()? * 4096)
}

/// Runs frames in which released resources are freed.
fn rest(scene: &mut TestScene) {
    scene.headless.frames(4);
}
