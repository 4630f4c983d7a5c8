//! The geometry term of an octant (equation 5): the cosine to a normal, where positive, integrated over the octant's
//! directions. It is exact. An octant is a spherical triangle, and its part above the surface is a spherical polygon.
//! Over such a polygon the cosine's integral is Lambert's sum over its edges.

use bevy::math::DVec3;

use crate::volume::LookupTable;

/// Number of normals along each side of the table, as in `octants.wgsl`. It is odd, so that some normals lie in the
/// planes between octants, where the term has its kinks.
pub(crate) const SIDE: usize = 63;
/// Terms of all octants for the normals of an octahedral map, as rows of the lookup table's texture.
pub(crate) fn geometry_term_table() -> Vec<[f32; 4]> {
    let place = |k: usize| 2.0 * k as f64 / (SIDE - 1) as f64 - 1.0;
    let terms: Vec<_> = (0..LookupTable::ENTRIES)
        .map(|k| geometry_terms(octahedral(place(k % SIDE), place((k / SIDE).min(SIDE - 1)))))
        .collect();
    let row = |first: usize| terms.iter().map(move |term| [0, 1, 2, 3].map(|k| term[first + k] as f32));
    row(0).chain(row(4)).collect()
}

/// Normal at a place of the map, a square of [-1, 1]. The map is the upper half of an octahedron, projected, and the
/// lower half folded over its sides.
fn octahedral(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - u.abs() - v.abs();
    let folded = DVec3::new((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v), z);
    if z < 0.0 { folded } else { DVec3::new(u, v, z) }.normalize()
}

/// Terms of all octants for a normal of unit length. Their sum is pi.
fn geometry_terms(normal: DVec3) -> [f64; 8] {
    core::array::from_fn(|octant| {
        let side = |axis: usize| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let corners = [DVec3::X * side(0), DVec3::Y * side(1), DVec3::Z * side(2)];
        let mut polygon = Vec::with_capacity(4);
        for (k, a) in corners.into_iter().enumerate() {
            let b = corners[(k + 1) % 3];
            let (height_a, height_b) = (a.dot(normal), b.dot(normal));
            if height_a >= 0.0 {
                polygon.push(a);
            }
            if (height_a >= 0.0) != (height_b >= 0.0) {
                polygon.push(a.lerp(b, height_a / (height_a - height_b)).normalize());
            }
        }
        let edge = |k: usize| {
            let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            let across = a.cross(b);
            let sine = across.length();
            if sine > 0.0 { sine.atan2(a.dot(b)) * normal.dot(across) / sine } else { 0.0 }
        };
        // The polygon's orientation depends on the octant.
        0.5 * (0..polygon.len()).map(edge).sum::<f64>().abs()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::volumes::gpu_table::METHOD_ROWS;
    use core::f64::consts::{FRAC_PI_4, PI};

    fn normals() -> impl Iterator<Item = DVec3> {
        (0..200).map(|k| crate::occlusion::fibonacci_direction(k, 200)).chain([
            DVec3::X,
            DVec3::NEG_Z,
            DVec3::new(1.0, -1.0, 0.0).normalize(),
        ])
    }

    #[test]
    fn octants_share_the_cosine_of_a_hemisphere() {
        for normal in normals() {
            let terms = geometry_terms(normal);
            assert!((terms.iter().sum::<f64>() - PI).abs() < 1e-9, "{normal} {terms:?}");
        }
        assert!(geometry_terms(DVec3::Y).iter().all(|term| *term < 1e-9 || (term - FRAC_PI_4).abs() < 1e-9));
    }

    #[test]
    fn terms_are_those_of_a_numeric_integral() {
        const COUNT: usize = 40_000;
        for normal in normals().step_by(7) {
            let mut sums = [0.0; 8];
            for k in 0..COUNT {
                let direction = crate::occlusion::fibonacci_direction(k as u32, COUNT as u32);
                let octant =
                    [0, 1, 2].map(|axis| usize::from(direction[axis] > 0.0) << axis).iter().sum::<usize>();
                sums[octant] += direction.dot(normal).max(0.0) * 4.0 * PI / COUNT as f64;
            }
            for (sum, term) in sums.iter().zip(geometry_terms(normal)) {
                // A row of directions at an edge belongs to one side or the other: about 1 / sqrt(COUNT).
                assert!((sum - term).abs() < 0.01, "{normal}: {sum}, {term}");
            }
        }
    }

    /// Terms as the shader finds them.
    fn interpolated(table: &[[f32; 4]], normal: DVec3) -> [f64; 8] {
        let n = normal / (normal.x.abs() + normal.y.abs() + normal.z.abs());
        let folded = |a: f64, b: f64| (1.0 - b.abs()).copysign(a);
        let (u, v) = if n.z < 0.0 { (folded(n.x, n.y), folded(n.y, n.x)) } else { (n.x, n.y) };
        let at = [u, v].map(|u| (0.5 * u + 0.5) * (SIDE - 1) as f64);
        let cell = at.map(|at| at.floor().min((SIDE - 2) as f64));
        let share = [0, 1].map(|k| at[k] - cell[k]);
        core::array::from_fn(|octant| {
            let mut sum = 0.0;
            for corner in 0..4 {
                let far = [corner % 2, corner / 2];
                let weight = |k: usize| if far[k] == 1 { share[k] } else { 1.0 - share[k] };
                let entry = (cell[1] as usize + far[1]) * SIDE + cell[0] as usize + far[0];
                let row = octant / 4 * LookupTable::ENTRIES;
                sum += weight(0) * weight(1) * f64::from(table[row + entry][octant % 4]);
            }
            sum
        })
    }

    #[test]
    fn the_table_gives_the_terms_between_its_normals() {
        let table = geometry_term_table();
        assert_eq!(table.len(), METHOD_ROWS as usize * LookupTable::ENTRIES);
        for normal in normals() {
            let found = interpolated(&table, normal);
            for (found, exact) in found.into_iter().zip(geometry_terms(normal)) {
                // Normals are 2/62 apart. Where the map is folded the term has a kink across a cell. The slopes there
                // differ by up to about 1. The error is an eighth of the spacing, a third of a byte when drawn.
                assert!((found - exact).abs() < 2.0 / 62.0 / 8.0, "{normal}: {found}, {exact}");
            }
        }
    }
}
