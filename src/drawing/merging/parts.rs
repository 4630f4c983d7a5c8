//! Parts of view rays between translucent meshes. Bevy draws a mesh at the depth of its centre, so a plane there divides the
//! volumes that it is in.

/// Most parts in which a volume is drawn. Every part follows the rays anew.
const MOST_PARTS: usize = 8;
/// The depth at which the last part ends.
const FAR: f32 = f32::MAX;

/// A part of view rays. Depths are distances from the plane through the camera, world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::drawing) struct DrawnPart {
    pub begin_depth: f32,
    pub end_depth: f32,
    /// Depth by which it is sorted among translucent objects.
    pub sorted_depth: f32,
}

/// Depth by which volumes lie behind a mesh, as a share.
const BEHIND: f32 = 1e-5;

/// A whole group of volumes whose depths hide translucent meshes, pixel by pixel: it is drawn before those in it, whose depths
/// are given.
pub(in crate::drawing) fn whole_behind(meshes: &[f32], far: f32, whole_depth: f32) -> DrawnPart {
    let farthest =
        meshes.iter().filter(|depth| **depth < far).fold(whole_depth, |a, b| a.max(b * (1.0 + BEHIND)));
    DrawnPart { begin_depth: 0.0, end_depth: FAR, sorted_depth: farthest }
}

/// Parts of a group of volumes, farthest first. The planes are where the centres of translucent meshes are; beyond
/// [`MOST_PARTS`], those farthest away divide nothing. `whole_depth` sorts a group without planes.
pub(in crate::drawing) fn parts_of(
    mut planes: Vec<f32>,
    [near, far]: [f32; 2],
    whole_depth: f32,
) -> Vec<DrawnPart> {
    planes.retain(|depth| *depth > near.max(0.0) && *depth < far);
    planes.sort_by(f32::total_cmp);
    planes.dedup();
    planes.truncate(MOST_PARTS - 1);
    if planes.is_empty() {
        return vec![DrawnPart { begin_depth: 0.0, end_depth: FAR, sorted_depth: whole_depth }];
    }
    let begins = [near].into_iter().chain(planes.iter().copied());
    let ends = planes.iter().copied().chain([far]);
    let mut parts: Vec<_> = begins
        .zip(ends)
        .map(|(begin, end)| DrawnPart {
            begin_depth: begin,
            end_depth: end,
            sorted_depth: 0.5 * (begin + end),
        })
        .collect();
    if let Some(first) = parts.first_mut() {
        first.begin_depth = 0.0;
    }
    if let Some(last) = parts.last_mut() {
        last.end_depth = FAR;
    }
    parts.reverse();
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_reach_from_the_camera_to_infinity_and_lie_between_planes() {
        let parts = parts_of(vec![5.0, 3.0, 9.0, 3.0, -1.0], [2.0, 6.0], 4.0);
        let bounds: Vec<_> = parts.iter().map(|part| (part.begin_depth, part.end_depth)).collect();
        assert_eq!(bounds, [(5.0, FAR), (3.0, 5.0), (0.0, 3.0)]);
        let sorted: Vec<_> = parts.iter().map(|part| part.sorted_depth).collect();
        assert_eq!(sorted, [5.5, 4.0, 2.5], "before and behind the meshes");
    }

    #[test]
    fn planes_outside_of_the_volume_divide_nothing_and_their_number_is_bounded() {
        assert_eq!(
            parts_of(vec![1.0, 7.0], [2.0, 6.0], 4.5),
            [DrawnPart { begin_depth: 0.0, end_depth: FAR, sorted_depth: 4.5 }]
        );
        let many = parts_of((1..100).map(|k| k as f32).collect(), [0.5, 200.0], 0.0);
        assert_eq!(many.len(), MOST_PARTS);
        assert_eq!(many[0].begin_depth, (MOST_PARTS - 1) as f32, "the nearest planes divide");
    }
}
