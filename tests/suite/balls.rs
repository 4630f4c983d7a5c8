//! A ball of matter among translucent meshes, and what is seen of them by closed form.

use bevy::{
    math::{DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::{mode::ShadingMode, scene::view_from};

use crate::{
    integral::View,
    scene::{IMAGE, TestScene, in_world_units, volume_from},
};

const SIDE: u32 = 32;
pub const RADIUS_MM: f64 = 12.0;
/// Distance between samples, mm: a quarter of a voxel.
pub const STEP_MM: f64 = 0.25;
/// Linear.
pub const BALL: DVec3 = DVec3::new(0.6, 0.3, 0.1);
pub const SHEET: DVec3 = DVec3::new(0.05, 0.5, 0.2);
const SHEET_OPACITY: f64 = 0.5;
/// What is this near to an outline is not compared, mm.
const MARGIN_MM: f64 = 0.7;

/// An opaque, unlit ball in the world's centre, in a view of half floats. It may lack the half where x is positive.
pub struct Balls {
    pub scene: TestScene,
    is_halved: bool,
    sheets: Vec<Sheet>,
    sheet_opacity: f64,
}

/// A translucent rectangle.
#[derive(Clone, Copy)]
struct Sheet {
    entity: Entity,
    pose: Transform,
    half: DVec2,
}

/// What a ray meets: the distance of the ball, and of each sheet, mm; infinite if it meets none.
#[derive(PartialEq)]
struct Met {
    ball: f64,
    sheets: Vec<f64>,
}

impl Balls {
    pub fn new() -> Self {
        Self::with(|_| {})
    }

    /// [`Self::new`] with more in the app.
    pub fn with(setup: impl FnOnce(&mut App)) -> Self {
        let volume = volume_from(UVec3::splat(SIDE), DVec3::ONE, |p| {
            (RADIUS_MM - p.length() * f64::from(SIDE) / 2.0) / 4.0 + 0.5
        });
        let color = Color::linear_rgb(BALL.x as f32, BALL.y as f32, BALL.z as f32).to_srgba();
        let color = [color.red, color.green, color.blue];
        let function = TransferFunction::ramp(126.0, 129.0, 1.0, color).expect("a valid ramp");
        let mut scene = TestScene::with(volume, function, default(), ShadingMode::Solid, setup);
        let (camera, volume) = (scene.camera(), scene.volume);
        scene.headless.render_floats(camera, IMAGE);
        let world = scene.world();
        world.insert_resource(ClearColor(Color::BLACK));
        world.entity_mut(camera).insert(view_from(Vec3::new(0.0, 0.0, 60.0)));
        let mut shading = world.get_mut::<VolumeShading>(volume).expect("shading");
        (shading.step_voxels, shading.jitter) = (STEP_MM as f32, false);
        Self { scene, is_halved: false, sheets: Vec::new(), sheet_opacity: SHEET_OPACITY }
    }

    /// Carves the half where x is positive.
    pub fn halve(&mut self) {
        let place = Transform::from_xyz(20.0, 0.0, 0.0);
        self.scene.carve(Cuboid::new(40.0, 60.0, 60.0), ClipMesh::default(), place);
        self.is_halved = true;
    }

    /// Adds a translucent rectangle; the place of its middle is in mm.
    pub fn add_sheet(&mut self, pose: Transform, size_mm: Vec2) -> Entity {
        let world = self.scene.world();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::from_size(size_mm));
        let color = Color::linear_rgba(SHEET.x as f32, SHEET.y as f32, SHEET.z as f32, SHEET_OPACITY as f32);
        let material = StandardMaterial {
            base_color: color,
            unlit: true,
            alpha_mode: AlphaMode::Blend,
            cull_mode: None,
            ..default()
        };
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
        let place = in_world_units(pose);
        let entity = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place)).id();
        self.sheets.push(Sheet { entity, pose, half: size_mm.as_dvec2() / 2.0 });
        entity
    }

    /// Gives a sheet another material, which is opaque.
    pub fn set_opaque(&mut self, sheet: Entity, material: impl Bundle) {
        let mut sheet = self.scene.world().entity_mut(sheet);
        sheet.remove::<MeshMaterial3d<StandardMaterial>>().insert(material);
        self.sheet_opacity = 1.0;
    }

    /// Removes all sheets.
    pub fn clear(&mut self) {
        for sheet in core::mem::take(&mut self.sheets) {
            self.scene.world().despawn(sheet.entity);
        }
    }

    /// Draws some frames: shaders of meshes are read meanwhile, and a carver's maps made.
    pub fn settle(&mut self) {
        self.scene.settle();
        self.scene.headless.frames(4);
    }

    /// The view of the scene's camera.
    pub fn view(&mut self) -> View {
        let camera = self.scene.camera();
        View::of(&mut self.scene, camera, IMAGE)
    }

    /// Distance along a ray, mm, of the ball with another radius.
    fn ball_along(&self, origin: DVec3, direction: DVec3, radius: f64) -> f64 {
        let middle = -origin.dot(direction);
        let across = radius * radius - (origin + middle * direction).length_squared();
        if across <= 0.0 {
            return f64::INFINITY;
        }
        let [mut begin, mut end] = [middle - across.sqrt(), middle + across.sqrt()];
        if self.is_halved {
            let cut = -origin.x / direction.x;
            if direction.x > 0.0 { end = end.min(cut) } else { begin = begin.max(cut) }
        }
        if begin < end { begin } else { f64::INFINITY }
    }

    fn met(&self, view: &View, at: DVec2, radius: f64) -> Met {
        let (origin, direction) = view.ray(at);
        let origin = origin / f64::from(WORLD_UNITS_PER_MM);
        let along = |sheet: &Sheet| {
            let from_world = sheet.pose.to_matrix().as_dmat4().inverse();
            let (p, d) = (from_world.transform_point3(origin), from_world.transform_vector3(direction));
            let along = -p.z / d.z;
            let is_hit = along > 0.0 && (p + along * d).truncate().abs().cmplt(sheet.half).all();
            if is_hit { along } else { f64::INFINITY }
        };
        Met {
            ball: self.ball_along(origin, direction, radius),
            sheets: self.sheets.iter().map(along).collect(),
        }
    }

    /// Distance of the ball along the ray of a pixel, mm; infinite beside it. `None` near its outline.
    pub fn distance(&self, view: &View, pixel: UVec2) -> Option<f64> {
        let middle = pixel.as_dvec2() + 0.5;
        let around = neighbours(middle)
            .flat_map(|at| [-MARGIN_MM, MARGIN_MM].map(|margin| self.met(view, at, RADIUS_MM + margin).ball));
        let ball = self.met(view, middle, RADIUS_MM).ball;
        let is_clear = around.into_iter().all(|near| {
            near.is_finite() == ball.is_finite() && (ball.is_infinite() || (near - ball).abs() < 3.0)
        });
        is_clear.then_some(ball)
    }

    /// Light of a pixel: the sheets' over that of the ball, each where it is nearer. `None` near outlines, and where a sheet
    /// meets the ball.
    fn light(&self, view: &View, pixel: UVec2) -> Option<DVec3> {
        let middle = pixel.as_dvec2() + 0.5;
        self.distance(view, pixel)?;
        let met = self.met(view, middle, RADIUS_MM);
        let order = |met: &Met| -> Vec<_> {
            let near = |along: &f64| {
                (along.is_finite(), *along < met.ball - MARGIN_MM, *along < met.ball + MARGIN_MM)
            };
            met.sheets.iter().map(near).collect()
        };
        let expected = order(&met);
        let is_clear = neighbours(middle).all(|at| order(&self.met(view, at, RADIUS_MM)) == expected);
        if !is_clear || expected.iter().any(|(is_hit, before, behind)| *is_hit && before != behind) {
            return None;
        }
        let mut sheets = met.sheets;
        sheets.retain(|along| *along < met.ball);
        let base = if met.ball.is_finite() { BALL } else { DVec3::ZERO };
        Some(sheets.iter().fold(base, |behind, _| behind.lerp(SHEET, self.sheet_opacity)))
    }

    /// Largest difference of the image from closed form, as light, and the pixels that are compared: on the ball, how many of
    /// them a sheet is in front of, and how many it is behind.
    pub fn compare(&mut self) -> Difference {
        let view = self.view();
        let image = self.scene.headless.light();
        let mut difference = Difference::default();
        for (index, light) in (0..).zip(&image) {
            let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
            let Some(expected) = self.light(&view, pixel) else {
                continue;
            };
            let met = self.met(&view, pixel.as_dvec2() + 0.5, RADIUS_MM);
            let hits = met.sheets.iter().filter(|along| along.is_finite());
            difference.pixels += 1;
            difference.before +=
                usize::from(met.ball.is_finite() && hits.clone().any(|along| *along < met.ball));
            difference.behind +=
                usize::from(met.ball.is_finite() && hits.clone().any(|along| *along > met.ball));
            let off = (DVec3::from_array(*light) - expected).abs().max_element();
            difference.off += usize::from(off > 0.02);
            difference.largest = difference.largest.max(off);
        }
        println!("{difference:?}");
        difference
    }
}

/// An image beside closed form.
#[derive(Debug, Default)]
pub struct Difference {
    /// Largest difference of light.
    pub largest: f64,
    /// Pixels that differ by more than 0.02.
    pub off: usize,
    /// Pixels that are compared; those where a sheet is before the ball, and behind it.
    pub pixels: usize,
    pub before: usize,
    pub behind: usize,
}

/// A place and those around it, a pixel away.
fn neighbours(middle: DVec2) -> impl Iterator<Item = DVec2> {
    let steps = [-1.0, 0.0, 1.0];
    steps.into_iter().flat_map(move |y| steps.map(|x| middle + DVec2::new(x, y)))
}
