//! Bevy's effects that read the depth of the main pass, and gizmos, with volumes that have a depth.

use bevy::{
    light::{FogVolume, VolumetricFog, VolumetricLight},
    math::DVec3,
    post_process::dof::{DepthOfField, DepthOfFieldMode},
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    balls::{BALL, Balls, RADIUS_MM},
    scene::{IMAGE, TestScene, few_rays, folded_volume, opaque_ramp},
    volume_shadows::near_cascade,
};

/// Mean difference of light between two pictures.
fn mean_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let differences =
        a.iter().zip(b).map(|(a, b)| (DVec3::from_array(*a) - DVec3::from_array(*b)).abs().max_element());
    differences.sum::<f64>() / a.len() as f64
}

#[test]
fn a_volume_is_blurred_where_it_is_out_of_focus() {
    let volume = folded_volume(UVec3::splat(24), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::PhongCao);
    let (camera, volume) = (scene.camera(), scene.volume);
    scene.headless.render_floats(camera, IMAGE);
    scene.world().insert_resource(ClearColor(Color::BLACK));
    scene.world().entity_mut(volume).insert(VolumeDepth::default());
    scene.settle();
    scene.headless.frames(2);
    let sharp = scene.headless.light();
    let distance = scene.world().get::<Transform>(camera).expect("a place").translation.length();
    // Circles of confusion are half a pixel wide 5 mm from the focus, and 4 pixels at a quarter of the focal distance.
    let mut blur = |focal_distance| {
        let mode = DepthOfFieldMode::Gaussian;
        let lens = DepthOfField { mode, focal_distance, aperture_f_stops: 10.0, ..default() };
        scene.world().entity_mut(camera).insert(lens);
        scene.headless.frames(4);
        mean_difference(&scene.headless.light(), &sharp)
    };
    let [in_focus, out_of_focus] = [distance, 4.0 * distance].map(&mut blur);
    println!("differs from the sharp picture by {in_focus:.4} in focus, {out_of_focus:.4} out of focus");
    assert!(out_of_focus > 0.001, "{out_of_focus} out of focus");
    assert!(in_focus < 0.4 * out_of_focus, "{in_focus} in focus, {out_of_focus} out of focus");
}

#[test]
fn volumetric_fog_ends_at_a_volume_as_at_a_mesh() {
    let mut balls = Balls::new();
    let (camera, volume) = (balls.scene.camera(), balls.scene.volume);
    let world = balls.scene.world();
    let mesh = world
        .resource_mut::<Assets<Mesh>>()
        .add(Sphere::new(RADIUS_MM as f32 * WORLD_UNITS_PER_MM).mesh().uv(96, 48));
    let [r, g, b] = BALL.as_vec3().to_array();
    let material = StandardMaterial { base_color: Color::linear_rgb(r, g, b), unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    let ball = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Visibility::Hidden)).id();
    // Fog is shown where there is a light for it.
    let light = DirectionalLight { illuminance: 100.0, shadow_maps_enabled: true, ..default() };
    world.spawn((
        light,
        VolumetricLight,
        near_cascade(),
        Transform::from_xyz(0.1, 0.3, 0.2).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    // It lies around the ball, and hides half of what is 5 cm in it.
    let fog = FogVolume { density_factor: 25.0, fog_color: Color::linear_rgb(0.3, 0.5, 1.0), ..default() };
    world.spawn((fog, Transform::from_scale(Vec3::splat(0.08))));
    world.entity_mut(camera).insert(VolumetricFog { ambient_intensity: 2.0, step_count: 64, ..default() });
    let picture = |balls: &mut Balls, shown: Entity, hidden: Entity| {
        balls.scene.world().entity_mut(shown).insert(Visibility::Inherited);
        balls.scene.world().entity_mut(hidden).insert(Visibility::Hidden);
        balls.scene.headless.frames(4);
        balls.scene.headless.light()
    };
    balls.settle();
    let expected = picture(&mut balls, ball, volume);
    balls.scene.world().entity_mut(volume).insert(VolumeDepth::default());
    let with = picture(&mut balls, volume, ball);
    balls.scene.world().entity_mut(volume).remove::<VolumeDepth>();
    let without = picture(&mut balls, volume, ball);
    let view = balls.view();
    let is_ball = |index: usize| {
        let pixel = UVec2::new(index as u32 % IMAGE.x, index as u32 / IMAGE.x);
        balls.distance(&view, pixel).is_some_and(f64::is_finite)
    };
    let largest = |picture: &[[f64; 3]]| {
        let on_ball = picture.iter().zip(&expected).enumerate().filter(|(index, _)| is_ball(*index));
        let off =
            on_ball.map(|(_, (a, b))| (DVec3::from_array(*a) - DVec3::from_array(*b)).abs().max_element());
        let off: Vec<_> = off.collect();
        assert!(off.len() > 500, "{} pixels of the ball", off.len());
        off.iter().copied().fold(0.0, f64::max)
    };
    let [with, without] = [largest(&with), largest(&without)];
    println!("fog differs from that before a mesh by {with:.4}, without a depth by {without:.4}");
    // Fog over half a drawing step.
    assert!(with < 0.01 && without > 5.0 * with, "off by {with}, without a depth by {without}");
}

/// A line that gizmos draw, mm.
#[derive(Resource, Default)]
struct Line([Vec3; 2]);

const LINE: [f32; 3] = [0.0, 1.0, 0.0];

#[test]
fn gizmos_show_in_front_of_a_volume_alone() {
    let mut balls = Balls::new();
    let app = &mut balls.scene.headless.app;
    app.init_resource::<Line>().add_systems(Update, |line: Res<Line>, mut gizmos: Gizmos| {
        let [from, to] = line.0.map(|end| end * WORLD_UNITS_PER_MM);
        gizmos.line(from, to, Color::linear_rgb(LINE[0], LINE[1], LINE[2]));
    });
    // Pixels of the line on the left and on the right half of the ball.
    let mut shown = |line: [Vec3; 2]| {
        balls.scene.world().resource_mut::<Line>().0 = line;
        balls.settle();
        let view = balls.view();
        let image = balls.scene.headless.light();
        let mut counts = [0, 0];
        for (index, light) in (0..).zip(&image) {
            let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
            let is_ball = balls.distance(&view, pixel).is_some_and(f64::is_finite);
            let is_line = light[1] > 0.5 && light[0] < 0.4;
            counts[usize::from(pixel.x >= IMAGE.x / 2)] += usize::from(is_ball && is_line);
        }
        counts
    };
    let at = |left: f32, right: f32| [Vec3::new(-11.0, 2.0, left), Vec3::new(11.0, 2.0, right)];
    let [before, behind, through] = [at(20.0, 20.0), at(-20.0, -20.0), at(24.0, -24.0)].map(&mut shown);
    println!(
        "pixels of the line, left and right: {before:?} before, {behind:?} behind, {through:?} through the ball"
    );
    assert!(before[0] > 10 && before[1] > 10, "{before:?}");
    assert_eq!(behind, [0, 0]);
    assert!(through[0] > 5 && through[1] == 0, "{through:?}");
}
