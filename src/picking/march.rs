//! Follows a ray through one volume to the place where it is stopped, and tells what is there.

use bevy::math::{DAffine3, DVec3};

use super::{
    carved::{Cut, Stretch},
    crossings::Line,
    field::Field,
    optical_depths::OpticalDepths,
};
use crate::volume::VolumeGeometry;

/// Most samples of a ray.
const MOST_SAMPLES: f64 = 1e6;
/// Halvings of a step to find the place in it.
const HALVINGS: u32 = 40;
/// Change of opacity over a voxel, as a share of the opacity, from which on there is a whole surface (`orientation.wgsl`).
const SURFACE_CHANGE: f64 = 0.05;
/// A cut shows this many voxels behind it, or more where there is no other surface (`orientation.wgsl`).
const CUT_FADES: f64 = 1.0;
const CUT_FADES_INSIDE: f64 = 4.0;

/// What stops a ray.
#[derive(Clone, Copy)]
pub(super) enum Stops {
    /// The first place with a stored intensity beyond this one: above it if the flag is set, else below it.
    Surface { stored: f64, is_above: bool },
    /// The place up to which matter has this optical depth.
    Depth(f64),
}

/// A volume and a ray through it.
pub(super) struct March<'a> {
    pub field: Field<'a>,
    pub depths: &'a OpticalDepths,
    pub geometry: &'a VolumeGeometry,
    pub voxel_from_world: DAffine3,
    /// The ray in the world, and in voxels.
    pub ray: Line,
    pub in_voxels: Line,
    pub mm_per_world_unit: f64,
    pub step_mm: f64,
}

impl<'a> March<'a> {
    /// `None` if the volume is collapsed along the ray.
    pub fn new(
        field: Field<'a>,
        depths: &'a OpticalDepths,
        geometry: &'a VolumeGeometry,
        world_from_local: &DAffine3,
        ray: Line,
        step_voxels: f64,
    ) -> Option<Self> {
        let local_from_world = world_from_local.inverse();
        let voxel_from_world = geometry.local_from_voxel.inverse() * local_from_world;
        let mm_per_world_unit = local_from_world.transform_vector3(ray.direction).length();
        let in_voxels = ray.transformed(&voxel_from_world);
        let step_mm = geometry.spacing_mm.min_element() * step_voxels;
        (mm_per_world_unit > 0.0 && mm_per_world_unit.is_finite()).then_some(Self {
            field,
            depths,
            geometry,
            voxel_from_world,
            ray,
            in_voxels,
            mm_per_world_unit,
            step_mm,
        })
    }

    /// Where a ray through these stretches is stopped, and the stretch.
    pub fn stop(&self, stretches: &[Stretch], stops: Stops) -> Option<(f64, Stretch)> {
        let length: f64 = stretches.iter().map(|stretch| stretch.end - stretch.begin).sum();
        let step = (self.step_mm / self.mm_per_world_unit).max(length / MOST_SAMPLES);
        if !(step > 0.0 && length > 0.0 && length.is_finite()) {
            return None;
        }
        let mut depth = 0.0;
        stretches.iter().find_map(|stretch| {
            let stop = match stops {
                Stops::Surface { stored, is_above } => {
                    self.surface_in(stretch, step, |intensity| (intensity > stored) == is_above)
                }
                Stops::Depth(most) => self.depth_in(stretch, step, &mut depth, most),
            };
            Some((stop?, *stretch))
        })
    }

    fn intensity(&self, distance: f64) -> f64 {
        self.field.at(self.in_voxels.at(distance))
    }

    /// Ends of the slices of a stretch. The last one may be shorter.
    fn samples(stretch: &Stretch, step: f64) -> impl Iterator<Item = f64> {
        let &Stretch { begin, end, .. } = stretch;
        let slices = ((end - begin) / step).ceil() as u64;
        (1..=slices).map(move |slice| (begin + slice as f64 * step).min(end))
    }

    /// First place in a stretch that lies inside.
    fn surface_in(&self, stretch: &Stretch, step: f64, is_in: impl Fn(f64) -> bool) -> Option<f64> {
        let is_inside = |distance: f64| is_in(self.intensity(distance));
        let mut outside = stretch.begin;
        if is_inside(outside) {
            return Some(outside);
        }
        for distance in Self::samples(stretch, step) {
            if is_inside(distance) {
                let [_, inside] = halve([outside, distance], is_inside);
                return Some(inside);
            }
            outside = distance;
        }
        None
    }

    /// The place in a stretch up to which matter has an optical depth. Adds to that of what is in front.
    fn depth_in(&self, stretch: &Stretch, step: f64, depth: &mut f64, most: f64) -> Option<f64> {
        let per_length = self.mm_per_world_unit / self.depths.unit_mm;
        let mut near = stretch.begin;
        let mut before = self.depths.entry(self.intensity(near));
        for far in Self::samples(stretch, step) {
            let behind = self.depths.entry(self.intensity(far));
            let gradient = self.gradient_between(near, far);
            let length = (far - near) * per_length;
            // The intensity is taken to change evenly in a slice.
            let up_to = |part: f64| {
                part * length * self.depths.mean_between(before, before + part * (behind - before), gradient)
            };
            let whole = up_to(1.0);
            if *depth + whole >= most {
                let [_, part] = halve([0.0, 1.0], |part| *depth + up_to(part) >= most);
                return Some(near + part * (far - near));
            }
            *depth += whole;
            (near, before) = (far, behind);
        }
        None
    }

    /// Length of the gradient in the middle of a slice, stored intensities per mm; 0 if it has no effect.
    fn gradient_between(&self, near: f64, far: f64) -> f64 {
        if !self.depths.is_by_gradient() {
            return 0.0;
        }
        self.per_mm(self.field.differences(self.in_voxels.at(0.5 * (near + far))))
    }

    /// Length per mm of a gradient per voxel.
    fn per_mm(&self, per_voxel: DVec3) -> f64 {
        (self.geometry.local_from_voxel.matrix3.inverse().transpose() * per_voxel).length()
    }

    /// Unit normal of what stopped the ray at a distance, in the world, on the side that the ray comes from, and the cut
    /// if it lies on one.
    pub fn surface_at(&self, distance: f64, stretch: &Stretch, stops: Stops) -> (DVec3, Option<Cut>) {
        let place = self.in_voxels.at(distance);
        let differences = self.field.differences(place);
        let along = differences.normalize_or_zero();
        let on_cut = stretch.cut.filter(|_| {
            let voxels =
                (distance - stretch.begin) * self.mm_per_world_unit / self.geometry.spacing_mm.min_element();
            let strength = match stops {
                Stops::Surface { .. } => 1.0,
                Stops::Depth(_) => self.surface_strength(place, along, self.per_mm(differences)),
            };
            let inside = (1.0 - strength) * (1.0 - voxels / CUT_FADES_INSIDE);
            inside.max(1.0 - voxels / CUT_FADES) >= 0.5
        });
        let normal = match on_cut {
            Some(cut) => cut.normal,
            None => {
                let gradient = self.field.gradient(self.steepest(place, along));
                self.voxel_from_world.matrix3.transpose() * gradient
            }
        };
        let normal = normal.try_normalize().unwrap_or(-self.ray.direction);
        (if normal.dot(self.ray.direction) > 0.0 { -normal } else { normal }, on_cut)
    }

    /// The place up to a voxel away where an edge is steepest. In the foot of an edge, the gradient follows the voxels.
    fn steepest(&self, place: DVec3, along: DVec3) -> DVec3 {
        let [before, here, behind] = self.across(place, along);
        // Exact for an edge that is a normal distribution of 0.9 voxels.
        let way = 2.0 * (before + behind - 2.0 * here) / (behind - before).max(1e-9);
        place + way.clamp(-1.0, 1.0) * along
    }

    /// How much of a surface there is: 1, or 0 where opacity does not change.
    fn surface_strength(&self, place: DVec3, along: DVec3, gradient: f64) -> f64 {
        let opacity = |intensity: f64| self.depths.opacity_at(self.depths.entry(intensity), gradient);
        let [before, here, behind] = self.across(place, along).map(opacity);
        let change = (here - before).abs().max((behind - here).abs());
        let most = before.max(here).max(behind);
        (change / (SURFACE_CHANGE * most).max(1e-9)).min(1.0)
    }

    /// Intensities a voxel before a place, there, and a voxel behind.
    fn across(&self, place: DVec3, along: DVec3) -> [f64; 3] {
        [place - along, place, place + along].map(|place| self.field.trilinear(place))
    }
}

/// Halves a range until its ends are as good as one: its first end does not hold, its second does.
fn halve([mut before, mut behind]: [f64; 2], holds: impl Fn(f64) -> bool) -> [f64; 2] {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + behind);
        if holds(middle) {
            behind = middle;
        } else {
            before = middle;
        }
    }
    [before, behind]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_and_cuts_are_told_apart_as_by_the_shader() {
        let shader = include_str!("../render/views/orientation.wgsl");
        for (name, value) in [
            ("SURFACE_CHANGE", SURFACE_CHANGE),
            ("CUT_FADES", CUT_FADES),
            ("CUT_FADES_INSIDE", CUT_FADES_INSIDE),
        ] {
            let line = format!("const {name}: f32 = {value:?};");
            assert!(shader.contains(&line), "`{line}` is not in the shader");
        }
    }
}
