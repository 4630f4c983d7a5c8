//! Draws boxes: of volumes, of what clip cameras see, of reaches and of listed bricks.

use bevy::{
    math::{Affine3A, DAffine3, DVec3},
    prelude::*,
};

use super::{
    ShowVolumeGizmos, VolumeGizmoConfigGroup,
    listed_bricks::{BRICK_SIDE, ListedBricks},
};
use crate::{
    clip::{ClipCamera, ClipMesh, ClipOperation, placed},
    occlusion::ShownOcclusion,
    volume::{LookupTable, WORLD_UNITS_PER_MM},
};

/// Voxels of a brick along each axis.
const BRICK: f64 = BRICK_SIDE as f64;

type VolumeGizmos<'w, 's> = Gizmos<'w, 's, VolumeGizmoConfigGroup>;

/// Volume space (mm) to the world, unless the volume is collapsed.
fn world_from_mm(transform: &GlobalTransform) -> Option<DAffine3> {
    Some(placed(transform)? * DAffine3::from_scale(DVec3::splat(WORLD_UNITS_PER_MM.into())))
}

/// Draws an axis-aligned box of another space.
fn draw_box(gizmos: &mut VolumeGizmos, world_from_space: &DAffine3, [low, high]: [DVec3; 2], color: Color) {
    let unit = DAffine3::from_translation(0.5 * (low + high)) * DAffine3::from_scale(high - low);
    let DAffine3 { matrix3, translation } = *world_from_space * unit;
    gizmos.cube(Affine3A::from_mat3_translation(matrix3.as_mat3(), translation.as_vec3()), color);
}

/// Draws the boxes of volumes and their listed bricks.
pub(super) fn draw_volumes(
    volumes: Query<(
        &LookupTable,
        &GlobalTransform,
        &InheritedVisibility,
        Option<&ShowVolumeGizmos>,
        Option<&ListedBricks>,
    )>,
    mut gizmos: VolumeGizmos,
    mut leaves_out: Local<bool>,
) {
    let group = gizmos.config_ext;
    let mut most_listed = 0;
    for (table, transform, visibility, show, listed) in &volumes {
        let Some(world_from_mm) = world_from_mm(transform).filter(|_| visibility.get()) else {
            continue;
        };
        let world_from_voxel = world_from_mm * table.geometry.local_from_voxel;
        let end = table.geometry.dimensions.as_dvec3();
        let of_voxels = |first: DVec3, end: DVec3| [first - 0.5, end - 0.5];
        if let Some(color) = group.color(group.volume_boxes, show) {
            draw_box(&mut gizmos, &world_from_voxel, of_voxels(DVec3::ZERO, end), color);
        }
        if let (Some(color), Some(listed)) = (group.color(group.listed_bricks, show), listed) {
            most_listed = most_listed.max(listed.bricks.len());
            for brick in listed.bricks.iter().take(group.most_bricks as usize) {
                let first = BRICK * brick.as_dvec3();
                let of_brick = of_voxels(first, (first + BRICK).min(end));
                draw_box(&mut gizmos, &world_from_voxel, of_brick, color);
            }
        }
    }
    let leaves_out_now = most_listed > group.most_bricks as usize;
    if leaves_out_now && !*leaves_out {
        warn!(
            "of {most_listed} listed bricks {} are drawn: VolumeGizmoConfigGroup::most_bricks",
            group.most_bricks
        );
    }
    *leaves_out = leaves_out_now;
}

/// Draws the clip cameras of carvers, and their reaches in the volumes that they carve.
pub(super) fn draw_carvers(
    carvers: Query<(&ClipMesh, &ClipCamera, &GlobalTransform, Option<&ShowVolumeGizmos>)>,
    volumes: Query<(Entity, &LookupTable, &ShownOcclusion, &GlobalTransform, &InheritedVisibility)>,
    mut gizmos: VolumeGizmos,
) {
    let group = gizmos.config_ext;
    for (clip_mesh, camera, transform, show) in &carvers {
        let (Some(frame), Some(world_from_carver)) = (camera.frame, placed(transform)) else {
            continue;
        };
        let clip = frame.clip_from_local();
        let clip_from_carver =
            DAffine3 { matrix3: clip.matrix3.as_dmat3(), translation: clip.translation.as_dvec3() };
        let world_from_clip = world_from_carver * clip_from_carver.inverse();
        if let Some(color) = group.color(group.clip_cameras, show) {
            draw_box(&mut gizmos, &world_from_clip, [DVec3::ZERO, DVec3::ONE], color);
            let middle_at = |depth| world_from_clip.transform_point3(DVec3::new(0.5, 0.5, depth)).as_vec3();
            gizmos.arrow(middle_at(0.0), middle_at(1.0), color);
        }
        let reaches = group.color(group.reaches, show);
        let Some(color) = reaches.filter(|_| clip_mesh.operation == ClipOperation::Subtract) else {
            continue;
        };
        for (entity, table, shown, transform, visibility) in &volumes {
            let Some(world_from_mm) = world_from_mm(transform).filter(|_| visibility.get()) else {
                continue;
            };
            if clip_mesh.carves(entity) {
                // A ball in the volume is as wide along a clip map axis as the axis' row is long.
                let rows = (world_from_clip.inverse() * world_from_mm).matrix3.transpose();
                let lengths = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
                let margin = shown.fitted.occlusion.reach_mm(&table.geometry) * lengths;
                draw_box(&mut gizmos, &world_from_clip, [-margin, 1.0 + margin], color);
            }
        }
    }
}
