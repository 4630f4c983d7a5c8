//! Ray patterns: the directions of a voxel's rays, and their weights.

use bevy::{math::DVec3, prelude::*};
use core::{f64::consts::PI, fmt, str::FromStr};

/// One ray of a pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDirection {
    /// Unit vector, volume space.
    pub direction: DVec3,
    /// Share of the occlusion factor; the weights of a pattern add up to 1.
    pub weight: f64,
}

/// The directions of the spherical ray cast.
///
/// The first five are the paper's (section 4). Each direction of the first four is jittered by a fixed pattern.
/// [`Fibonacci`](RayPattern::Fibonacci) has a lower error for the same number of rays.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum RayPattern {
    /// The 6 face neighbours of a voxel.
    Neighborhood6,
    /// The 6 face and 8 corner neighbours.
    Neighborhood14,
    /// All 26 neighbours.
    Neighborhood26,
    /// The centres of the 54 face squares of a Rubik's cube.
    Rubik54,
    /// 512 directions of a Fibonacci lattice: the paper's ground truth.
    Sphere512,
    /// This many directions of a Fibonacci lattice (1 to 4096), without jitter.
    Fibonacci(u32),
}

impl Default for RayPattern {
    // The fewest rays that are closer to the truth than the paper's 54 in all tested scenes (`docs/measurements.md`).
    fn default() -> Self {
        Self::Fibonacci(36)
    }
}

/// Largest number of rays of a pattern.
const MAX_RAYS: u32 = 4096;

/// Largest angle, radians, by which the paper's patterns are jittered: 1.7 degrees. The paper gives no figure. Its
/// authors' package moves the ends of its vectors, which are 1 to 2 long, by up to 0.025 along each axis.
const JITTER: f64 = 0.03;

impl RayPattern {
    /// Number of rays.
    pub fn rays(self) -> u32 {
        match self {
            Self::Neighborhood6 => 6,
            Self::Neighborhood14 => 14,
            Self::Neighborhood26 => 26,
            Self::Rubik54 => 54,
            Self::Sphere512 => 512,
            Self::Fibonacci(rays) => rays.clamp(1, MAX_RAYS),
        }
    }

    /// The rays, in a fixed order.
    pub fn directions(self) -> Vec<RayDirection> {
        let directions: Vec<DVec3> = match self {
            Self::Neighborhood6 => jittered(neighbours(&[1])),
            Self::Neighborhood14 => jittered(neighbours(&[1, 3])),
            Self::Neighborhood26 => jittered(neighbours(&[1, 2, 3])),
            Self::Rubik54 => jittered(rubik_faces()),
            Self::Sphere512 | Self::Fibonacci(_) => {
                (0..self.rays()).map(|k| fibonacci_direction(k, self.rays())).collect()
            }
        };
        let weight = 1.0 / directions.len() as f64;
        directions.into_iter().map(|direction| RayDirection { direction, weight }).collect()
    }
}

/// Direction `index` of a Fibonacci lattice of `count` points on the unit sphere
/// (Keinert et al. 2015, equation 1: heights at bin centres, golden-angle turns).
pub fn fibonacci_direction(index: u32, count: u32) -> DVec3 {
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let z = 1.0 - (2.0 * index as f64 + 1.0) / count as f64;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * (index as f64 * golden).fract()).sin_cos();
    DVec3::new(radius * cos, radius * sin, z)
}

/// Directions to the neighbours at the given Manhattan distances.
fn neighbours(distances: &[i32]) -> Vec<DVec3> {
    let mut directions = Vec::new();
    for z in -1..=1i32 {
        for y in -1..=1i32 {
            for x in -1..=1i32 {
                if distances.contains(&(x.abs() + y.abs() + z.abs())) {
                    directions.push(DVec3::new(x as f64, y as f64, z as f64).normalize());
                }
            }
        }
    }
    directions
}

/// Directions to the centres of the squares of a Rubik's cube.
fn rubik_faces() -> Vec<DVec3> {
    let mut directions = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            for u in -1..=1 {
                for v in -1..=1 {
                    let mut p = [0.0; 3];
                    p[axis] = side;
                    p[(axis + 1) % 3] = u as f64 * 2.0 / 3.0;
                    p[(axis + 2) % 3] = v as f64 * 2.0 / 3.0;
                    directions.push(DVec3::from_array(p).normalize());
                }
            }
        }
    }
    directions
}

/// Turns each direction by up to [`JITTER`], the same way every time.
fn jittered(directions: Vec<DVec3>) -> Vec<DVec3> {
    let count = directions.len() as u32;
    directions
        .into_iter()
        .enumerate()
        .map(|(k, direction)| {
            // Offsets from a lattice of twice the size are well spread. Those of opposite directions do not cancel. No
            // pattern's size has the factor 11, so that no two offsets are the same.
            let offset = fibonacci_direction((k as u32 * 11 + 3) % (2 * count), 2 * count);
            (direction + offset * JITTER.tan()).normalize()
        })
        .collect()
}

impl fmt::Display for RayPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Neighborhood6 => f.write_str("neighborhood6"),
            Self::Neighborhood14 => f.write_str("neighborhood14"),
            Self::Neighborhood26 => f.write_str("neighborhood26"),
            Self::Rubik54 => f.write_str("rubik54"),
            Self::Sphere512 => f.write_str("sphere512"),
            Self::Fibonacci(rays) => write!(f, "fibonacci:{rays}"),
        }
    }
}

impl FromStr for RayPattern {
    type Err = String;

    /// Reads the names that [`Display`](fmt::Display) writes, such as `rubik54` or `fibonacci:26`.
    fn from_str(name: &str) -> Result<Self, String> {
        if let Some(rays) = name.strip_prefix("fibonacci:") {
            return match rays.parse() {
                Ok(rays @ 1..=MAX_RAYS) => Ok(Self::Fibonacci(rays)),
                _ => Err(format!("`{name}`: the number of rays must be 1 to {MAX_RAYS}")),
            };
        }
        let named =
            [Self::Neighborhood6, Self::Neighborhood14, Self::Neighborhood26, Self::Rubik54, Self::Sphere512];
        named.into_iter().find(|pattern| pattern.to_string() == name).ok_or_else(|| {
            let names = named.map(|pattern| pattern.to_string()).join(", ");
            format!("unknown ray pattern `{name}`: expected {names} or fibonacci:N")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [RayPattern; 8] = [
        RayPattern::Neighborhood6,
        RayPattern::Neighborhood14,
        RayPattern::Neighborhood26,
        RayPattern::Rubik54,
        RayPattern::Sphere512,
        RayPattern::Fibonacci(1),
        RayPattern::Fibonacci(26),
        RayPattern::Fibonacci(54),
    ];

    #[test]
    fn patterns_hold_unit_vectors_and_weights_of_one() {
        for pattern in ALL {
            let rays = pattern.directions();
            assert_eq!(rays.len(), pattern.rays() as usize, "{pattern}");
            let total: f64 = rays.iter().map(|ray| ray.weight).sum();
            assert!((total - 1.0).abs() < 1e-12, "{pattern}");
            for ray in &rays {
                assert!((ray.direction.length() - 1.0).abs() < 1e-12, "{pattern}");
            }
            assert_eq!(pattern.to_string().parse(), Ok(pattern));
        }
    }

    #[test]
    fn patterns_cover_the_sphere_evenly() {
        for pattern in ALL.into_iter().filter(|pattern| pattern.rays() > 1) {
            let mean: DVec3 = pattern.directions().iter().map(|ray| ray.direction * ray.weight).sum();
            // The mean of a lattice of n rays is of the order 1/n. The jitter moves it by at most sin(JITTER).
            assert!(mean.length() < 0.1, "{pattern}: {mean}");
        }
    }

    #[test]
    fn no_two_rays_are_jittered_alike() {
        for regular in [neighbours(&[1]), neighbours(&[1, 3]), neighbours(&[1, 2, 3]), rubik_faces()] {
            let turned: Vec<_> = jittered(regular.clone())
                .into_iter()
                .zip(&regular)
                .map(|(ray, regular)| ray - regular)
                .collect();
            for (k, offset) in turned.iter().enumerate() {
                assert!(offset.length() < 0.0301, "at most 1.7 degrees");
                assert!(turned[..k].iter().all(|other| other.distance(*offset) > 1e-3), "{offset}");
            }
        }
    }

    #[test]
    fn unknown_names_are_refused_by_name() {
        assert!("rubik".parse::<RayPattern>().unwrap_err().contains("rubik54"));
        assert!("fibonacci:0".parse::<RayPattern>().unwrap_err().contains("1 to 4096"));
    }
}
