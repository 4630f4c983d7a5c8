//! What carvers leave of a ray.

use bevy::{
    ecs::system::SystemParam,
    math::{DAffine3, DVec3},
    prelude::*,
};

use super::crossings::{Crossing, Line, crossings, inside};
use crate::clip::{ClipCamera, ClipFrame, ClipMesh, ClipOperation, MAX_CARVERS, SpawnOrder, placed};

/// A cut, or a face of the grid, where a stretch begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    /// The carver; `None` for the grid.
    pub carver: Option<Entity>,
    /// Normal in the world, of any length, to either side.
    pub normal: DVec3,
}

/// A part of a ray, by distances from its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub begin: f64,
    pub end: f64,
    /// What it begins at, if anything.
    pub cut: Option<Cut>,
}

/// All carvers, with their meshes as they are now.
#[derive(SystemParam)]
pub(super) struct Carvers<'w, 's> {
    carvers: Query<
        'w,
        's,
        (&'static SpawnOrder, Entity, &'static ClipMesh, &'static ClipCamera, &'static GlobalTransform),
    >,
    meshes: Res<'w, Assets<Mesh>>,
}

impl Carvers<'_, '_> {
    /// What carvers leave of a stretch of a ray through a volume, in order.
    pub fn leave(&self, volume: Entity, ray: &Line, whole: Stretch) -> Vec<Stretch> {
        let mut left = vec![whole];
        let mut carvers: Vec<_> = self.carvers.iter().collect();
        if carvers.len() > MAX_CARVERS {
            // Those that carve on the GPU.
            carvers.sort_unstable_by_key(|(order, _, clip_mesh, ..)| (!clip_mesh.is_active, **order));
            carvers.truncate(MAX_CARVERS);
        }
        for (_, entity, clip_mesh, camera, transform) in carvers {
            if clip_mesh.carves(volume)
                && let Some(frame) = camera.frame
                && let Some(world_from_local) = placed(transform)
                && let Some(mesh) = self.meshes.get(camera.mesh)
            {
                let parts = inside_of(mesh, &frame, &world_from_local, ray);
                let Some(parts) = parts else {
                    warn_once!(
                        "rays ignore carvers whose vertices are not kept in the main world, such as {entity}"
                    );
                    continue;
                };
                let cut = |crossing: Crossing| Cut {
                    carver: Some(entity),
                    normal: world_from_local.matrix3.inverse().transpose() * crossing.normal,
                };
                left = remove(left, &removed(clip_mesh.operation, &parts, cut));
            }
        }
        left
    }
}

/// Parts of a ray's line inside a carver; `None` if its triangles are not known.
fn inside_of(
    mesh: &Mesh,
    frame: &ClipFrame,
    world_from_local: &DAffine3,
    ray: &Line,
) -> Option<Vec<[Crossing; 2]>> {
    let line = ray.transformed(&world_from_local.inverse());
    if !meets_box(frame, &line) {
        return Some(Vec::new());
    }
    Some(inside(&crossings(mesh, &line)?))
}

/// Whether a line meets the box that a clip camera sees. All of the mesh is in it.
fn meets_box(frame: &ClipFrame, line: &Line) -> bool {
    let clip = frame.clip_from_local();
    let clip = DAffine3 { matrix3: clip.matrix3.as_dmat3(), translation: clip.translation.as_dvec3() };
    let [begin, end] = through_box(&line.transformed(&clip), DVec3::ZERO, DVec3::ONE).0;
    begin <= end
}

/// Where a line enters and leaves a box, and the axis whose face it enters by. It begins behind its end if it passes by.
pub(super) fn through_box(line: &Line, low: DVec3, high: DVec3) -> ([f64; 2], usize) {
    let (mut begin, mut end, mut axis_of_face) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    for axis in 0..3 {
        let (origin, velocity) = (line.origin[axis], line.direction[axis]);
        if velocity == 0.0 {
            if origin < low[axis] || origin > high[axis] {
                return ([1.0, 0.0], axis);
            }
            continue;
        }
        let [first, second] = [low, high].map(|side| (side[axis] - origin) / velocity);
        if first.min(second) > begin {
            (begin, axis_of_face) = (first.min(second), axis);
        }
        end = end.min(first.max(second));
    }
    ([begin, end], axis_of_face)
}

/// Parts of a line that a carver removes, each with the cut behind it.
fn removed(
    operation: ClipOperation,
    parts: &[[Crossing; 2]],
    cut: impl Fn(Crossing) -> Cut,
) -> Vec<(f64, f64, Option<Cut>)> {
    match operation {
        ClipOperation::Subtract => {
            parts.iter().map(|[from, to]| (from.distance, to.distance, Some(cut(*to)))).collect()
        }
        ClipOperation::Intersect => {
            let begins = [f64::NEG_INFINITY].into_iter().chain(parts.iter().map(|part| part[1].distance));
            let ends = parts.iter().map(|part| Some(part[0])).chain([None]);
            let between = begins.zip(ends).map(|(begin, end)| {
                (begin, end.map_or(f64::INFINITY, |crossing| crossing.distance), end.map(&cut))
            });
            between.collect()
        }
    }
}

/// Stretches without the removed parts.
fn remove(stretches: Vec<Stretch>, removed: &[(f64, f64, Option<Cut>)]) -> Vec<Stretch> {
    let mut left = stretches;
    for &(begin, end, cut) in removed {
        let around = |stretch: Stretch| {
            if end <= stretch.begin || begin >= stretch.end {
                return [Some(stretch), None];
            }
            let before = (begin > stretch.begin).then_some(Stretch { end: begin, ..stretch });
            let behind = (end < stretch.end).then_some(Stretch { begin: end, cut, ..stretch });
            [before, behind]
        };
        left = left.into_iter().flat_map(around).flatten().collect();
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(begin: f64, end: f64) -> Stretch {
        Stretch { begin, end, cut: None }
    }

    fn bounds(stretches: &[Stretch]) -> Vec<[f64; 2]> {
        stretches.iter().map(|stretch| [stretch.begin, stretch.end]).collect()
    }

    #[test]
    fn what_is_removed_is_gone_and_the_rest_begins_at_its_cut() {
        let cut = Some(Cut { carver: Some(Entity::PLACEHOLDER), normal: DVec3::X });
        let left = remove(vec![stretch(0.0, 10.0)], &[(2.0, 3.0, cut), (-1.0, 1.0, cut), (9.0, 12.0, cut)]);
        assert_eq!(bounds(&left), [[1.0, 2.0], [3.0, 9.0]]);
        assert!(left.iter().all(|stretch| stretch.cut == cut));
        let left = remove(vec![stretch(0.0, 10.0)], &[(10.0, 11.0, cut), (-2.0, 0.0, cut)]);
        assert_eq!(left, [stretch(0.0, 10.0)]);
        assert_eq!(remove(vec![stretch(0.0, 10.0)], &[(-1.0, 11.0, cut)]), []);
    }

    #[test]
    fn a_line_meets_a_box_from_outside_inside_and_along_its_faces() {
        let through = |origin, direction| through_box(&Line { origin, direction }, DVec3::ZERO, DVec3::ONE);
        assert_eq!(through(DVec3::new(-2.0, 0.5, 0.5), DVec3::X), ([2.0, 3.0], 0));
        assert_eq!(through(DVec3::new(0.5, 0.25, 0.5), DVec3::NEG_Y).0, [-0.75, 0.25]);
        let ([begin, end], _) = through(DVec3::new(-2.0, 1.5, 0.5), DVec3::X);
        assert!(begin > end);
        let ([begin, end], _) = through(DVec3::new(-2.0, 1.0, 0.5), DVec3::X);
        assert!(begin < end);
    }
}
