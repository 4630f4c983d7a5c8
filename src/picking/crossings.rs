//! All crossings of a line with a mesh. Bevy's ray casts find the nearest crossing alone.

use bevy::{
    math::{DAffine3, DVec2, DVec3},
    mesh::{PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// A line in the world. Places on it are distances from `origin`, also behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub origin: DVec3,
    /// Of length 1 in the world.
    pub direction: DVec3,
}

impl Line {
    /// The line in another space. Places on it stay the same; its direction has any length there.
    pub fn transformed(&self, space_from_world: &DAffine3) -> Self {
        Self {
            origin: space_from_world.transform_point3(self.origin),
            direction: space_from_world.transform_vector3(self.direction),
        }
    }

    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }
}

/// A place where a line crosses a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    pub distance: f64,
    /// Normal of the triangle in the mesh's space, of any length.
    pub normal: DVec3,
    /// 1 or -1: the side from which the line crosses.
    side: i32,
}

/// Crossings of a line with a mesh, in order. The line is in the mesh's space. `None` if the mesh's triangles are not kept
/// in the main world, or if it has none.
///
/// A line through a common corner or edge of triangles crosses as many of them as one beside it. So a closed mesh is left
/// as often as it is entered.
pub(super) fn crossings(mesh: &Mesh, line: &Line) -> Option<Vec<Crossing>> {
    let Some(VertexAttributeValues::Float32x3(positions)) =
        mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION).ok()?
    else {
        return None;
    };
    let indices = mesh.try_indices_option().ok()?;
    let at: Box<dyn Fn(usize) -> Option<usize>> = match indices {
        Some(bevy::mesh::Indices::U16(indices)) => Box::new(|k| indices.get(k).map(|&index| index.into())),
        Some(bevy::mesh::Indices::U32(indices)) => Box::new(|k| indices.get(k).map(|&index| index as usize)),
        None => Box::new(Some),
    };
    let count = indices.map_or(positions.len(), |indices| indices.len());
    let is_strip = match mesh.primitive_topology() {
        PrimitiveTopology::TriangleList => false,
        PrimitiveTopology::TriangleStrip => true,
        _ => return None,
    };
    let triangles = if is_strip { count.saturating_sub(2) } else { count / 3 };
    let across = Across::new(line)?;
    let seen: Vec<_> = positions.iter().map(|&position| across.see(position)).collect();
    let mut crossings = Vec::new();
    for triangle in 0..triangles {
        let corners = match is_strip {
            false => [0, 1, 2].map(|corner| 3 * triangle + corner),
            // Every other triangle of a strip is turned over.
            true if triangle % 2 == 1 => [triangle + 1, triangle, triangle + 2],
            true => [triangle, triangle + 1, triangle + 2],
        };
        let corners = corners.map(|corner| at(corner).filter(|&index| index < seen.len()));
        if let [Some(a), Some(b), Some(c)] = corners
            && let Some((distance, side)) = cross([seen[a], seen[b], seen[c]])
        {
            let [a, b, c] = [a, b, c].map(|index| Vec3::from(positions[index]).as_dvec3());
            crossings.push(Crossing { distance, normal: (b - a).cross(c - a), side });
        }
    }
    crossings.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    Some(crossings)
}

/// A corner as seen along the line: its place beside the line, and its place along it.
#[derive(Clone, Copy)]
struct Seen {
    beside: DVec2,
    along: f64,
}

/// The frame of a line.
struct Across {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    along: DVec3,
}

impl Across {
    fn new(line: &Line) -> Option<Self> {
        let forward = line.direction.try_normalize()?;
        let (x, y) = forward.any_orthonormal_pair();
        Some(Self { origin: line.origin, x, y, along: line.direction / line.direction.length_squared() })
    }

    fn see(&self, position: [f32; 3]) -> Seen {
        let p = Vec3::from(position).as_dvec3() - self.origin;
        Seen { beside: DVec2::new(self.x.dot(p), self.y.dot(p)), along: self.along.dot(p) }
    }
}

/// Where the line crosses a triangle, and from which side.
fn cross(corners: [Seen; 3]) -> Option<(f64, i32)> {
    let [a, b, c] = corners;
    // Twice the areas that the line's place makes with the edges. An edge gives its two triangles the same but for the sign.
    let areas = [(b, c), (c, a), (a, b)].map(|(from, to): (Seen, Seen)| from.beside.perp_dot(to.beside));
    let passes = |from: Seen, to: Seen, area: f64| match (from.beside.y > 0.0, to.beside.y > 0.0) {
        (false, true) => area > 0.0,
        (true, false) => area < 0.0,
        _ => false,
    };
    // A half-line from the place passes an odd number of edges.
    let is_inside = passes(b, c, areas[0]) ^ passes(c, a, areas[1]) ^ passes(a, b, areas[2]);
    let sum: f64 = areas.iter().sum();
    if !is_inside || sum == 0.0 || !sum.is_finite() {
        return None;
    }
    let distance = (areas[0] * a.along + areas[1] * b.along + areas[2] * c.along) / sum;
    Some((distance, if sum > 0.0 { 1 } else { -1 }))
}

/// Parts of a line inside a mesh, each between two crossings. The rule is that of `peel.wgsl`: a point is inside if the
/// surface winds around it. Where flipped or missing triangles do not balance, crossings lead in and out in turn.
pub(super) fn inside(crossings: &[Crossing]) -> Vec<[Crossing; 2]> {
    let is_balanced = crossings.iter().map(|crossing| crossing.side).sum::<i32>() == 0;
    let (mut winding, mut entered) = (0, None);
    let mut parts = Vec::new();
    for crossing in crossings {
        winding += if is_balanced { crossing.side } else { 1 };
        let is_inside = if is_balanced { winding != 0 } else { winding % 2 == 1 };
        match entered {
            None if is_inside => entered = Some(*crossing),
            Some(from) if !is_inside => {
                parts.push([from, *crossing]);
                entered = None;
            }
            _ => {}
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::asset::RenderAssetUsages;

    fn line(origin: DVec3, towards: DVec3) -> Line {
        Line { origin, direction: (towards - origin).normalize() }
    }

    fn distances(mesh: &Mesh, line: &Line) -> Vec<[f64; 2]> {
        let crossings = crossings(mesh, line).expect("triangles");
        inside(&crossings).iter().map(|part| part.map(|crossing| crossing.distance)).collect()
    }

    #[test]
    fn a_line_through_corners_and_edges_enters_and_leaves_once() {
        let cube = Mesh::from(Cuboid::from_length(2.0));
        for towards in [
            DVec3::ZERO,
            // Corners, edges, and the diagonals between the triangles of a face.
            DVec3::ONE,
            DVec3::new(1.0, -1.0, 1.0),
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(1.0, 0.5, 0.5),
            DVec3::new(1.0, -0.25, 0.25),
        ] {
            // The line goes through the middle.
            let origin = if towards == DVec3::ZERO { DVec3::Z * 3.0 } else { towards * -4.0 };
            let line = line(origin, towards);
            let parts = distances(&cube, &line);
            assert_eq!(parts.len(), 1, "towards {towards}");
            for distance in parts[0] {
                let on_face = line.at(distance).abs().max_element();
                assert!((on_face - 1.0).abs() < 1e-9, "{on_face} towards {towards}");
            }
        }
    }

    #[test]
    fn lines_beside_or_along_faces_are_harmless() {
        let cube = Mesh::from(Cuboid::from_length(2.0));
        let beside = Line { origin: DVec3::new(-5.0, 1.000_001, 0.0), direction: DVec3::X };
        assert_eq!(distances(&cube, &beside), Vec::<[f64; 2]>::new());
        for y in [-1.0, 1.0] {
            let along = Line { origin: DVec3::new(-5.0, y, 0.2), direction: DVec3::X };
            assert!(distances(&cube, &along).len() <= 1);
        }
        let still = Line { origin: DVec3::ZERO, direction: DVec3::ZERO };
        assert_eq!(crossings(&cube, &still), None);
    }

    #[test]
    fn concave_and_overlapping_shells_follow_the_winding() {
        let ring = Mesh::from(Torus { minor_radius: 0.5, major_radius: 2.0 });
        let through = Line { origin: DVec3::new(-5.0, 0.01, 0.02), direction: DVec3::X };
        assert_eq!(distances(&ring, &through).len(), 2);
        let mut two = Mesh::from(Cuboid::from_length(2.0));
        two.merge(&Mesh::from(Cuboid::from_length(2.0)).translated_by(Vec3::X * 0.5)).expect("alike");
        let [[from, to]] = distances(&two, &through)[..] else { panic!("they are one") };
        assert!((from - 4.0).abs() < 1e-9 && (to - 6.5).abs() < 1e-9);
        // Triangles that face anywhere.
        let mut flipped = Mesh::from(Cuboid::from_length(2.0));
        let mut indices: Vec<_> = flipped.indices().expect("indices").iter().map(|k| k as u32).collect();
        for triangle in indices.chunks_mut(3).take(4) {
            triangle.swap(0, 1);
        }
        flipped.insert_indices(bevy::mesh::Indices::U32(indices));
        assert_eq!(distances(&flipped, &through).len(), 1);
    }

    #[test]
    fn meshes_of_any_kind_cause_no_panic() {
        let through = Line { origin: DVec3::new(-5.0, 0.1, 0.2), direction: DVec3::X };
        let empty = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
        assert_eq!(crossings(&empty, &through), None);
        let wrong = Mesh::from(Cuboid::from_length(2.0))
            .with_inserted_indices(bevy::mesh::Indices::U32(vec![0, 1, 99, 3, 4]));
        assert_eq!(crossings(&wrong, &through), Some(vec![]));
        let strip = Mesh::new(PrimitiveTopology::TriangleStrip, RenderAssetUsages::default())
            .with_inserted_attribute(
                Mesh::ATTRIBUTE_POSITION,
                vec![[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, -1.0, 1.0], [0.0, 1.0, 1.0]],
            );
        assert_eq!(crossings(&strip, &through).map(|crossings| crossings.len()), Some(1));
    }
}
