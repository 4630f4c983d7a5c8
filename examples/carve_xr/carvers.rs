//! The carver in each hand, and those that are left in the volume.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use core::f32::consts::FRAC_PI_2;

use super::{
    controls::{Controls, LeaveHere},
    shapes::{Shapes, add_shapes},
};

/// Place of a carver in its hand, whose fingers point along -z.
const IN_HAND: Vec3 = Vec3::new(0.0, 0.0, -0.1);
/// Depth bias, metres. Carvers are drawn after the volume, so that they are seen in it, too.
const IN_FRONT: f32 = 100.0;
/// The shaft from the hand to the carver.
const SHAFT_RADIUS: f32 = 0.003;
const REMOVING: Srgba = Srgba::rgb(0.42, 0.78, 1.0);
const KEEPING: Srgba = Srgba::rgb(0.55, 1.0, 0.45);
/// Opacity of body and outline: at rest, and while it carves.
const OPACITIES: [[f32; 2]; 2] = [[0.06, 0.5], [0.03, 0.9]];

pub struct CarversPlugin;

impl Plugin for CarversPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PreStartup, add_shapes)
            .add_observer(give_carver)
            .add_observer(leave)
            .add_observer(remove_all)
            .add_systems(PostUpdate, (hide_lost_hands, carve_always, follow_shapes, paint).after(HandSystems))
            .add_systems(PostUpdate, remember_cuts.after(HandSystems));
    }
}

/// Asks to remove the carvers that were left in volumes.
#[derive(Event, Clone, Copy, Debug)]
pub struct RemoveAll;

/// A carver that was left in a volume.
#[derive(Component)]
pub struct Left;

/// The part of a carver's look, whose colours follow what the carver does.
#[derive(Component, Clone, Copy)]
enum Coat {
    Body,
    Outline,
}

/// The last cut of a carver, and the volume that it was in.
#[derive(Component, Clone, Debug)]
pub struct LastCut {
    volume: Entity,
    /// Place in the volume.
    place: Transform,
    mesh: Handle<Mesh>,
    operation: ClipOperation,
}

/// Gives each hand a carver.
fn give_carver(
    hand: On<Add, Controls>,
    mut commands: Commands,
    shapes: Res<Shapes>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let shaft = Mesh::from(Cylinder::new(SHAFT_RADIUS, IN_HAND.length()));
    let shaft = shaft.rotated_by(Quat::from_rotation_x(FRAC_PI_2)).translated_by(0.2 * IN_HAND);
    let steel = materials.add(Color::srgb(0.55, 0.57, 0.6));
    commands.entity(hand.entity).with_child((Mesh3d(meshes.add(shaft)), MeshMaterial3d(steel)));
    let mut coat = || {
        let material =
            StandardMaterial { alpha_mode: AlphaMode::Blend, unlit: true, depth_bias: IN_FRONT, ..default() };
        MeshMaterial3d(materials.add(material))
    };
    let [first, ..] = &shapes.0;
    let held = HeldCarver {
        shapes: shapes.0.iter().map(|shape| shape.body.clone()).collect(),
        min_scale: 0.2,
        max_scale: 5.0,
        ..default()
    };
    let outline = (Mesh3d(first.outline.clone()), coat(), Coat::Outline);
    commands.entity(hand.entity).with_child((
        held,
        Mesh3d(first.body.clone()),
        coat(),
        Coat::Body,
        Transform::from_translation(IN_HAND),
        children![outline],
    ));
}

/// Lets carvers that always carve rest while their hands are not tracked.
fn carve_always(mut carvers: Query<(&HeldCarver, &ChildOf, &mut ClipMesh)>, hands: Query<&Controls>) {
    for (held, hand, mut clip_mesh) in &mut carvers {
        let Ok(controls) = hands.get(hand.parent()) else {
            continue;
        };
        if held.carves == CarveWhile::Active && clip_mesh.is_active != controls.is_tracked {
            clip_mesh.is_active = controls.is_tracked;
        }
    }
}

/// Hides what is in hands that are not tracked.
fn hide_lost_hands(mut hands: Query<(&Controls, &mut Visibility)>) {
    for (controls, mut visibility) in &mut hands {
        visibility.set_if_neq(if controls.is_tracked { Visibility::Inherited } else { Visibility::Hidden });
    }
}

/// Gives outlines the shape of their bodies.
fn follow_shapes(
    carvers: Query<(&Mesh3d, &Children), With<HeldCarver>>,
    mut outlines: Query<&mut Mesh3d, (With<Coat>, Without<HeldCarver>)>,
    shapes: Res<Shapes>,
) {
    for (body, children) in &carvers {
        let mut outlines = outlines.iter_many_mut(children);
        while let (Some(mut outline), Some(shape)) = (outlines.fetch_next(), shapes.of(&body.0)) {
            outline.set_if_neq(Mesh3d(shape.outline.clone()));
        }
    }
}

/// Colours carvers by their operation; one that carves is brighter.
fn paint(
    carvers: Query<(Entity, &ClipMesh, &Children), With<HeldCarver>>,
    coats: Query<(&Coat, &MeshMaterial3d<StandardMaterial>)>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (entity, clip_mesh, outline) in &carvers {
        let color = match clip_mesh.operation {
            ClipOperation::Subtract => REMOVING,
            _ => KEEPING,
        };
        let [body, line] = OPACITIES[usize::from(clip_mesh.is_active)];
        for (coat, material) in coats.iter_many(outline.iter().chain([entity])) {
            let opacity = match coat {
                Coat::Body => body,
                Coat::Outline => line,
            };
            let wanted = Color::from(color.with_alpha(opacity));
            if let Some(mut material) = materials.get_mut(&material.0)
                && material.base_color != wanted
            {
                material.base_color = wanted;
            }
        }
    }
}

/// Remembers where carvers cut while they do.
fn remember_cuts(
    mut commands: Commands,
    carvers: Query<(Entity, &ClipMesh, &Mesh3d), With<HeldCarver>>,
    volumes: Query<Entity, With<Volume3d>>,
    places: TransformHelper,
) {
    let Some((volume, in_world)) =
        volumes.iter().find_map(|volume| Some((volume, places.compute_global_transform(volume).ok()?)))
    else {
        return;
    };
    for (carver, clip_mesh, mesh) in carvers.iter().filter(|(_, clip_mesh, _)| clip_mesh.is_active) {
        if let Ok(place) = places.compute_global_transform(carver) {
            let place = place.reparented_to(&in_world);
            let cut = LastCut { volume, place, mesh: mesh.0.clone(), operation: clip_mesh.operation };
            commands.entity(carver).insert(cut);
        }
    }
}

/// Leaves a copy of a hand's carver in the volume, where it cut last.
fn leave(
    leave: On<LeaveHere>,
    mut commands: Commands,
    hands: Query<&Children, With<Controls>>,
    cuts: Query<&LastCut>,
) {
    let Ok(children) = hands.get(leave.entity) else {
        return;
    };
    for LastCut { volume, place, mesh, operation } in cuts.iter_many(children).cloned() {
        // The volume may be gone by now.
        if let Ok(mut volume) = commands.get_entity(volume) {
            volume.with_child((Left, ClipMesh { operation, ..default() }, Mesh3d(mesh), place));
        }
    }
}

fn remove_all(_: On<RemoveAll>, mut commands: Commands, left: Query<Entity, With<Left>>) {
    for carver in &left {
        commands.entity(carver).despawn();
    }
}
