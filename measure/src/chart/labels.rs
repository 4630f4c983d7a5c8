//! Places of the labels of marks: near the marks, and not over each other.

use bevy::math::{Rect, Vec2};

/// Half the width of a mark, with some room.
const MARK: f32 = 8.0;
/// Distances from its mark at which a label may begin.
const DISTANCES: [f32; 11] = [9.0, 14.0, 22.0, 32.0, 45.0, 60.0, 78.0, 100.0, 125.0, 155.0, 190.0];
const ANGLES: u16 = 24;
/// Number of rounds in which all labels look for a better place.
const ROUNDS: usize = 6;

/// Finds a place for each label, given its mark and its size. Labels stay off lines if possible, and within the
/// bounds.
pub fn place(labels: &[(Vec2, Vec2)], lines: &[[Vec2; 2]], bounds: Rect) -> Vec<Rect> {
    let mut placed: Vec<Option<Rect>> = vec![None; labels.len()];
    for _ in 0..ROUNDS {
        for index in 0..labels.len() {
            let (mark, size) = labels[index];
            let best = candidates(mark, size)
                .filter(|candidate| bounds.contains(candidate.min) && bounds.contains(candidate.max))
                .map(|candidate| {
                    let on_lines = lines.iter().filter(|[a, b]| crosses_rect(*a, *b, candidate)).count();
                    let cost = cost(index, candidate, labels, &placed) + 7.0 * on_lines.min(2) as f32;
                    (cost, candidate)
                })
                .min_by(|(a, _), (b, _)| a.total_cmp(b));
            placed[index] = best.map(|(_, candidate)| candidate);
        }
    }
    placed.into_iter().map(Option::unwrap_or_default).collect()
}

/// End of the line between a mark and its label.
pub fn leader_end(mark: Vec2, label: Rect) -> Vec2 {
    mark.clamp(label.min, label.max)
}

fn candidates(mark: Vec2, size: Vec2) -> impl Iterator<Item = Rect> {
    DISTANCES.into_iter().flat_map(move |distance| {
        (0..ANGLES).map(move |k| {
            let direction = Vec2::from_angle(f32::from(k) / f32::from(ANGLES) * std::f32::consts::TAU);
            Rect::from_center_size(mark + direction * (distance + 0.5 * size), size)
        })
    })
}

fn cost(index: usize, candidate: Rect, labels: &[(Vec2, Vec2)], placed: &[Option<Rect>]) -> f32 {
    let mark = labels[index].0;
    let end = leader_end(mark, candidate);
    let mut cost = 0.12 * mark.distance(end);
    for (other, (other_mark, _)) in labels.iter().enumerate() {
        if candidate.inflate(MARK - 2.0).contains(*other_mark) {
            cost += 40.0;
        }
        if other == index {
            continue;
        }
        if distance_to_segment(*other_mark, mark, end) < MARK - 2.0 && mark.distance(*other_mark) > MARK {
            cost += 6.0;
        }
        let Some(label) = placed[other] else {
            continue;
        };
        if !label.inflate(2.0).intersect(candidate).is_empty() {
            cost += 100.0;
        }
        let other_end = leader_end(*other_mark, label);
        cost += 25.0 * f32::from(u8::from(crosses_rect(mark, end, label)));
        cost += 25.0 * f32::from(u8::from(crosses_rect(*other_mark, other_end, candidate)));
        cost += 12.0 * f32::from(u8::from(cross(mark, end, *other_mark, other_end)));
    }
    cost
}

fn distance_to_segment(p: Vec2, from: Vec2, to: Vec2) -> f32 {
    let way = to - from;
    let share = ((p - from).dot(way) / way.length_squared().max(1e-6)).clamp(0.0, 1.0);
    p.distance(from + share * way)
}

/// Whether two segments cross.
fn cross(a: Vec2, b: Vec2, c: Vec2, d: Vec2) -> bool {
    let side = |from: Vec2, to: Vec2, p: Vec2| (to - from).perp_dot(p - from);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn crosses_rect(from: Vec2, to: Vec2, rect: Rect) -> bool {
    let (Rect { min, max }, far) = (rect, rect.size());
    rect.contains(from)
        || rect.contains(to)
        || cross(from, to, min, max)
        || cross(from, to, min + far * Vec2::X, min + far * Vec2::Y)
}
