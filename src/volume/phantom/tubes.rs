//! A set of tapered tubes with a quick distance look-up.

use super::sdf::{at, capsule};
use bevy::math::{IVec3, Vec3};

/// Edge length of the search grid's cells.
const CELL: f32 = 8.0;
/// Distances beyond this one are cut off: they cannot touch a voxel.
const REACH: f32 = 3.0;
/// Cells along each axis; the grid is centred on the head.
const CELLS: IVec3 = IVec3::new(26, 30, 34);

/// One tapered piece of a vessel.
#[derive(Debug)]
struct Segment {
    start: (Vec3, f32),
    end: (Vec3, f32),
}

/// Tubes, sorted into a grid so that a look-up visits only near tubes.
#[derive(Debug)]
pub(super) struct Tubes {
    segments: Vec<Segment>,
    cells: Vec<Vec<u32>>,
    thinnest: f32,
}

impl Tubes {
    /// Makes an empty set. No tube will get a radius below `thinnest`.
    pub(super) fn new(thinnest: f32) -> Self {
        Self {
            segments: Vec::new(),
            cells: vec![Vec::new(); (CELLS.x * CELLS.y * CELLS.z) as usize],
            thinnest,
        }
    }

    /// Distance to the nearest tube's wall, or [`REACH`] if no tube is near.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        cell_index(cell_of(p))
            .and_then(|index| self.cells.get(index))
            .into_iter()
            .flatten()
            .filter_map(|&segment| self.segments.get(segment as usize))
            .map(|segment| capsule(p, segment.start, segment.end))
            .fold(REACH, f32::min)
    }

    /// Adds a straight tube between two points of (position, radius).
    pub(super) fn add(&mut self, start: (Vec3, f32), end: (Vec3, f32)) {
        let start = (start.0, start.1.max(self.thinnest));
        let end = (end.0, end.1.max(self.thinnest));
        let margin = Vec3::splat(start.1.max(end.1) + REACH);
        let low = cell_of(start.0.min(end.0) - margin).max(IVec3::ZERO);
        let high = cell_of(start.0.max(end.0) + margin).min(CELLS - IVec3::ONE);
        let number = self.segments.len() as u32;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let cell = cell_index(IVec3::new(x, y, z));
                    if let Some(list) = cell.and_then(|index| self.cells.get_mut(index)) {
                        list.push(number);
                    }
                }
            }
        }
        self.segments.push(Segment { start, end });
    }

    /// Adds a smooth tube through `points`, given for the right side and put on `side`.
    pub(super) fn path(&mut self, side: f32, points: &[(Vec3, f32)]) {
        let get = |i: usize| points[i.min(points.len() - 1)];
        for i in 1..points.len() {
            let (before, from, to, after) = (get(i.max(2) - 2), get(i - 1), get(i), get(i + 1));
            let mut last = from;
            for step in 1..=4 {
                let t = step as f32 / 4.0;
                // Catmull-Rom spline: no kinks at the given points.
                let position = from.0
                    + (to.0 - before.0) * (0.5 * t)
                    + (2.0 * before.0 - 5.0 * from.0 + 4.0 * to.0 - after.0) * (0.5 * t * t)
                    + (3.0 * from.0 - before.0 - 3.0 * to.0 + after.0) * (0.5 * t * t * t);
                let next = (position, from.1 + (to.1 - from.1) * t);
                self.add((mirror(last.0, side), last.1), (mirror(next.0, side), next.1));
                last = next;
            }
        }
    }
}

/// Mirrors `p` from the right side to `side`: 1 for right, -1 for left.
pub(super) fn mirror(p: Vec3, side: f32) -> Vec3 {
    at(p.x * side, p.y, p.z)
}

fn cell_of(p: Vec3) -> IVec3 {
    (p / CELL).floor().as_ivec3() + CELLS / 2
}

fn cell_index(cell: IVec3) -> Option<usize> {
    let inside = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(CELLS).all();
    inside.then(|| ((cell.z * CELLS.y + cell.y) * CELLS.x + cell.x) as usize)
}
