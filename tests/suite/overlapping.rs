//! Volumes that share space, against the volume rendering integral of all of them. `panes`: translucent meshes in volumes.

mod panes;

use bevy::{
    camera::Exposure,
    diagnostic::{Diagnostic, DiagnosticPath},
    math::{DVec2, DVec3, Vec3Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    diagnostics::SPAN_TRANSMITTANCE,
    occlusion::{
        GeometryTerm, MethodKind, OcclusionFiltering, OcclusionSweeping, OpacityModulation, SweepingSurface,
    },
    prelude::*,
    volume::WORLD_UNITS_PER_MM,
};
use contextual_ao_kit::{mode::ShadingMode, shapes::Triangles};

use crate::{
    integral::{Integral, Pixel, View, merged_pixel},
    runs::{RUN_BYTES, slabs},
    scene::{
        FEW_RAYS, IMAGE, TestScene, folded_volume, methods_of_few_rays, opaque_ramp, solid_volume,
        translucent_ramp, volume_from,
    },
    views::{self, FAR_SHARE, assert_shows_within, in_front},
};

/// Farthest side of the scene from its centre, mm.
const FAR_MM: f32 = 62.0;
/// Half the size of the box that carves, mm.
const BOX_MM: DVec3 = DVec3::new(6.0, 9.0, 5.0);

fn box_pose() -> Transform {
    Transform::from_xyz(3.0, -2.0, 8.0).with_rotation(Quat::from_euler(EulerRot::XYZ, 0.4, 0.9, -0.3))
}

fn is_in_box(p: DVec3) -> bool {
    let p = box_pose().to_matrix().as_dmat4().inverse().transform_point3(p);
    p.abs().cmplt(BOX_MM).all()
}

/// A volume of a scene, with its pose; lengths in mm.
struct Placed {
    volume: Volume,
    function: TransferFunction,
    pose: Transform,
}

impl Placed {
    fn integral(&self) -> Integral<'static> {
        let pose = Transform { translation: self.pose.translation * WORLD_UNITS_PER_MM, ..self.pose };
        let mut integral = Integral { is_clipped: &is_in_box, ..Integral::of(&self.volume, &self.function) };
        integral.world_from_local = pose.to_matrix().as_dmat4() * integral.world_from_local;
        integral
    }
}

/// Three volumes: one translucent, one opaque and turned in it, one smaller and mirrored, which cuts both.
fn three() -> [Placed; 3] {
    let turned = Quat::from_euler(EulerRot::XYZ, 0.7, 0.3, -0.5);
    [
        Placed {
            volume: folded_volume(UVec3::new(24, 20, 26), DVec3::new(1.0, 1.2, 0.9)),
            function: translucent_ramp(),
            pose: default(),
        },
        Placed {
            volume: folded_volume(UVec3::new(18, 22, 16), DVec3::splat(0.8)),
            function: opaque_ramp(),
            pose: Transform::from_xyz(4.0, 2.0, -3.0).with_rotation(turned),
        },
        Placed {
            volume: solid_volume(UVec3::new(9, 30, 9)),
            function: TransferFunction::ramp(10.0, 240.0, 0.2, [0.9, 0.2, 0.3]).expect("a valid ramp"),
            pose: Transform::from_xyz(-6.0, 0.0, 4.0)
                .with_rotation(turned.inverse())
                .with_scale(Vec3::new(-0.8, 0.8, 0.8)),
        },
    ]
}

/// Adds a volume to a scene, with the settings of its first.
fn add(scene: &mut TestScene, placed: &Placed) -> Entity {
    let first = scene.volume;
    let world = scene.world();
    let volume = world.resource_mut::<Assets<Volume>>().add(placed.volume.clone());
    let function = world.resource_mut::<Assets<TransferFunction>>().add(placed.function.clone());
    let mut bundle = VolumeBundle::new(volume).with_transfer_function(function);
    bundle.shading = world.get::<VolumeShading>(first).expect("shading").clone();
    bundle.occlusion = world.get::<AmbientOcclusion>(first).expect("occlusion").clone();
    bundle.transform = Transform { translation: placed.pose.translation * WORLD_UNITS_PER_MM, ..placed.pose };
    world.spawn(bundle).id()
}

/// A scene of volumes, spawned in the given order, in their own colours and carved by the box.
fn scene_of(placed: &[&Placed]) -> TestScene {
    let first = placed[0];
    let mut scene = views::scene_of(first.volume.clone(), first.function.clone(), ShadingMode::Solid);
    scene.place_volume(Transform { translation: first.pose.translation * WORLD_UNITS_PER_MM, ..first.pose });
    let others: Vec<_> = placed[1..].iter().map(|placed| add(&mut scene, placed)).collect();
    scene.carve_with(&Triangles::cuboid((2.0 * BOX_MM).as_vec3()), box_pose());
    scene.set_clip(|clip| clip.depth_map_size = 512);
    for other in others {
        scene.headless.until_ready(other).expect("the volume can be shown");
    }
    scene.settle();
    scene
}

fn look_from(scene: &mut TestScene, direction: Vec3) {
    let camera = scene.camera();
    let up = if direction.y.abs() > 0.9 { Vec3::X } else { Vec3::Y };
    let place =
        Transform::from_translation(FAR_MM * WORLD_UNITS_PER_MM * direction).looking_at(Vec3::ZERO, up);
    scene.world().entity_mut(camera).insert(place);
}

/// Directions to the 12 corners of an icosahedron.
fn sides() -> Vec<Vec3> {
    let golden = 0.5 * (1.0 + 5f32.sqrt());
    let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let of_signs = |(a, b): (f32, f32)| {
        let corner = Vec3::new(0.0, a, b * golden).normalize();
        [corner, corner.yzx(), corner.zxy()]
    };
    signs.into_iter().flat_map(of_signs).collect()
}

/// The middle of the image.
const MIDDLE: [UVec2; 2] = [UVec2::splat(26), UVec2::splat(44)];

/// Compares a picture with what a model says. Each of five draws or more rounds to bytes.
fn check(name: &str, most_far: f64, scene: &mut TestScene, pixel_at: &dyn Fn(&View, DVec2) -> Pixel) {
    let camera = scene.camera();
    let view = View::of(scene, camera, IMAGE);
    let first = MIDDLE[0].as_dvec2();
    assert_shows_within([1.2, most_far], name, scene, MIDDLE, |pixel| {
        in_front(pixel_at(&view, first + pixel.as_dvec2() + 0.5))
    });
}

#[test]
fn volumes_that_share_space_add_up_from_every_side_in_every_order() {
    let placed = three();
    let integrals = placed.each_ref().map(Placed::integral);
    let all = integrals.each_ref();
    let orders = [[0, 1, 2], [2, 0, 1], [1, 2, 0]];
    let mut scenes = orders.map(|order| scene_of(&order.map(|index| &placed[index])));
    for side in sides() {
        let images = scenes.each_mut().map(|scene| {
            look_from(scene, side);
            scene.headless.frame();
            scene.headless.image()
        });
        let name = format!("from {side:.1}");
        check(&name, FAR_SHARE, &mut scenes[0], &|view, at| merged_pixel(&all, view, at));
        for image in &images[1..] {
            let most = image.iter().zip(&images[0]).map(|(a, b)| a.abs_diff(*b)).max();
            // Sums of rounded bytes depend on their order.
            assert!(most.is_some_and(|most| most <= 3), "from {side}: the order of spawning shows, {most:?}");
        }
    }
}

#[test]
fn rays_that_find_no_room_for_their_runs_are_merged() {
    const SLABS: u32 = 11;
    let [_, turned, _] = three();
    let function = TransferFunction::ramp(10.0, 240.0, 0.2, [0.9, 0.8, 0.3]).expect("a valid ramp");
    let placed = [Placed { volume: slabs(SLABS), function, pose: default() }, turned];
    let mut scene = scene_of(&placed.each_ref());
    look_from(&mut scene, Vec3::new(0.1, 0.9, 0.2).normalize());
    scene.headless.frames(3);
    let integrals = placed.each_ref().map(Placed::integral);
    // Curves have 14 nodes for 22 edges.
    check("across slabs", 0.05, &mut scene, &|view, at| merged_pixel(&integrals.each_ref(), view, at));
    let image = scene.headless.image();
    let shown = image.chunks(4).filter(|pixel| pixel[..3] != image[..3]).count() as u64;
    let room = scene.status().usage.view_bytes / RUN_BYTES;
    println!("there is room for {room} runs of two volumes, in {shown} pixels");
    assert!(room < shown * u64::from(SLABS) / 2, "there is room for {room} runs, in {shown} pixels");
}

/// A share of a volume's matter: every second one of the cubes of a checkerboard, with gaps, or all of them.
fn checkers(cubes_a_side: u32, parity: Option<u32>) -> Volume {
    volume_from(UVec3::splat(24), DVec3::ONE, |p| {
        let cell = (p + 1.0) * 0.5 * f64::from(cubes_a_side);
        let within = (cell.fract() - 0.5).abs().max_element();
        let sum = cell.floor().element_sum() as u32;
        if within < 0.28 && parity.is_none_or(|parity| sum % 2 == parity) { 1.0 } else { 0.0 }
    })
}

/// Largest and mean difference between two images, bytes.
fn difference(a: &[u8], b: &[u8]) -> (f64, f64) {
    let differences = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)));
    let (most, sum) = differences.fold((0.0, 0.0), |(most, sum), one| (f64::max(most, one), sum + one));
    (most, sum / a.len() as f64)
}

/// Images of a checkerboard, as two volumes and as the one that they make up, from all sides.
fn as_two_and_as_one(
    cubes_a_side: u32,
    function: &TransferFunction,
    set_up: impl Fn(&mut TestScene),
    mut check: impl FnMut(Vec3, (f64, f64)),
) {
    let of = |parity| Placed {
        volume: checkers(cubes_a_side, parity),
        function: function.clone(),
        pose: default(),
    };
    let (even, odd, all) = (of(Some(0)), of(Some(1)), of(None));
    let mut two = scene_of(&[&even, &odd]);
    let mut one = scene_of(&[&all]);
    for scene in [&mut two, &mut one] {
        set_up(scene);
        scene.headless.frames(4);
    }
    for side in sides() {
        let [a, b] = [&mut two, &mut one].map(|scene| {
            look_from(scene, side);
            scene.headless.frame();
            scene.headless.image()
        });
        check(side, difference(&a, &b));
    }
}

#[test]
fn two_volumes_are_drawn_as_the_one_that_they_make_up() {
    for (name, function) in [("opaque", opaque_ramp()), ("translucent", translucent_ramp())] {
        as_two_and_as_one(
            4,
            &function,
            |_| {},
            |side, (most, mean)| {
                println!("{name} from {side:.1}: off by {mean:.4} bytes, at most {most}");
                // Three draws more that round to bytes, and curves off by a quarter of a byte.
                assert!(mean < 0.1 && most <= 3.0, "{name} from {side}: {mean} {most}");
            },
        );
    }
}

#[test]
fn their_outlines_are_smooth_in_multisampled_views() {
    for lighting in [VolumeLighting::Unlit, VolumeLighting::SceneLights] {
        let several = |scene: &mut TestScene| {
            scene.world().insert_resource(GlobalAmbientLight { brightness: 1000.0, ..default() });
            let camera = scene.camera();
            scene.world().entity_mut(camera).insert((Msaa::Sample4, Exposure { ev100: 9.0 }));
            let world = scene.world();
            for mut shading in world.query::<&mut VolumeShading>().iter_mut(world) {
                (shading.outline_rays, shading.lighting) = (8, lighting);
            }
        };
        // Lists of outlines have no room for more cubes.
        as_two_and_as_one(2, &opaque_ramp(), several, |side, (most, mean)| {
            println!("{lighting:?} from {side:.1}: off by {mean:.4} bytes, at most {most}");
            // In the few pixels where outlines of both meet, each is taken to hide the same share of all of the other's rays.
            assert!(mean < 0.02 && most <= 20.0, "{lighting:?} from {side}: {mean} {most}");
        });
    }
}

#[test]
fn a_volume_of_any_method_hides_another_one_behind_it() {
    let size = UVec3::splat(20);
    // The patient's front is +z of the world.
    let near = volume_from(size, DVec3::ONE, |p| if p.y > 0.2 { 1.0 } else { 0.0 });
    let far = volume_from(size, DVec3::ONE, |p| if p.y < -0.2 { 1.0 } else { 0.0 });
    let red = TransferFunction::ramp(100.0, 160.0, 1.0, [0.9, 0.1, 0.1]).expect("a valid ramp");
    let far = Placed { volume: far, function: red, pose: default() };
    // Frames until progressive rays are all cast.
    let settled = FEW_RAYS.pattern.rays() + 4;
    let cosine = OcclusionSweeping { geometry_term: GeometryTerm::Cosine, ..default() };
    let isosurface = OcclusionSweeping { surface: SweepingSurface::Isosurface(130.0), ..cosine };
    let modulated = OcclusionFiltering { modulation: OpacityModulation::Variance(0.02), ..default() };
    let more = [
        OcclusionMethod::Sweeping(cosine),
        OcclusionMethod::Sweeping(isosurface),
        OcclusionMethod::Filtering(modulated),
    ];
    let methods = methods_of_few_rays().chain(more);
    for method in methods.filter(|method| method.kind() != MethodKind::DrawingViews) {
        let name = format!("{method:?}");
        let occlusion = AmbientOcclusion::by(method);
        let mut scene = TestScene::new(near.clone(), opaque_ramp(), occlusion, ShadingMode::Cao);
        scene.settle();
        look_from(&mut scene, Vec3::Z);
        scene.headless.frames(settled);
        let alone = scene.headless.image();
        let second = add(&mut scene, &far);
        scene.headless.until_ready(second).expect("the volume can be shown");
        scene.headless.frames(settled);
        let image = scene.headless.image();
        let is_shown = |pixel: &[u8]| pixel != &alone[..4];
        let in_front = || alone.chunks(4).zip(image.chunks(4)).filter(|(alone, _)| is_shown(alone));
        let differs = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 2);
        let (count, differ) = (in_front().count(), in_front().filter(differs).count());
        println!("{name}: {differ} of {count} pixels differ");
        assert!(count > 500 && differ == 0, "{name}: {differ} of {count} pixels differ");
        look_from(&mut scene, Vec3::NEG_Z);
        scene.headless.frames(settled);
        let is_red = |pixel: &&[u8]| f64::from(pixel[0]) > 3.0 * f64::from(pixel[1]) + 20.0;
        let red = scene.headless.image().chunks(4).filter(is_red).count();
        assert!(red > 500, "{name}: {red} pixels show the other volume from its side");
    }
}

#[test]
fn at_rest_no_transmittance_is_found_and_after_a_carve_it_is() {
    let placed = three();
    let mut scene = scene_of(&placed.each_ref());
    let path = DiagnosticPath::from_components(["render", SPAN_TRANSMITTANCE, "elapsed_cpu"]);
    let latest = |scene: &TestScene| {
        scene.headless.diagnostics().get(&path).and_then(Diagnostic::measurement).map(|latest| latest.time)
    };
    // Spans arrive some frames later.
    scene.headless.frames(8);
    let at_rest = latest(&scene);
    assert!(at_rest.is_some(), "the pass has run");
    scene.headless.frames(8);
    assert_eq!(latest(&scene), at_rest, "the pass runs at rest");
    let carver = scene.carve_with(&Triangles::cuboid(Vec3::splat(4.0)), Transform::from_xyz(0.0, 5.0, 5.0));
    scene.settle();
    scene.headless.frames(8);
    let carved = latest(&scene);
    assert_ne!(carved, at_rest, "the pass runs after a carve");
    scene.move_carver(carver, Transform::from_xyz(0.0, 4.0, 5.0));
    scene.headless.frames(8);
    assert_ne!(latest(&scene), carved, "the pass runs as the carver moves");
}
