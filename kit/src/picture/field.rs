//! Values that a scanner finds in a body made of solids, or in the head phantom, at any point.

use bevy::math::{DAffine3, DVec3, UVec3, Vec3};
use bevy_contextual_ao::volume::{Intensities, Rescale, Volume, VolumeError, phantom::HeadField};
use std::sync::Arc;

use super::{color, edge, solid::Solid};

/// Matter of one kind. Where solids overlap, their values add up.
#[derive(Clone, Copy, Debug)]
pub struct Tissue {
    /// Place of the matter.
    pub solid: Solid,
    /// Value inside, far from the surface.
    pub value: f64,
}

/// What the scanner looks at.
#[derive(Clone, Debug)]
pub enum Body {
    /// Matter of several kinds.
    Solids(Vec<Tissue>),
    /// The head phantom, by its own distance functions.
    Head(Arc<HeadField>),
}

/// A point of a transfer function.
#[derive(Clone, Copy, Debug)]
pub struct ColorPoint {
    /// The value.
    pub value: f64,
    /// Red, green and blue, 0 to 1, as displayed (sRGB-encoded).
    pub color: DVec3,
    /// Opacity over a voxel's length.
    pub opacity: f64,
}

/// A body, the scanner that looks at it, and the way it is shown.
#[derive(Clone, Debug)]
pub struct Field {
    /// The body.
    pub body: Body,
    /// Colour and opacity of values, sorted by value.
    pub points: Vec<ColorPoint>,
    /// Solids that are cut away from the picture, not from the scanned values.
    pub cuts: Vec<Solid>,
    /// Voxels along x, y and z of the grid.
    pub dimensions: UVec3,
    /// Distance between voxels, mm.
    pub voxel_mm: f64,
    /// Distance from all solids, mm, from which on nothing is seen.
    clear_mm: f64,
}

/// Standard deviation of the scanner's blur of solids, voxels.
pub const BLUR_VOXELS: f64 = 0.9;
/// Half the distance over which the gradient of the head is found, voxels: its values have 24 bits.
const HALF_REACH: f64 = 0.1;
/// Value of the head that its volume stores as 0.
const LEAST_OF_HEAD: f64 = -1024.0;

impl Field {
    /// A field without cuts. The first of the points is transparent.
    pub fn new(tissues: Vec<Tissue>, points: Vec<ColorPoint>, voxels: u32, voxel_mm: f64) -> Self {
        let sum: f64 = tissues.iter().map(|tissue| tissue.value).sum();
        let clear_mm = edge::distance_of(points[0].value / sum) * BLUR_VOXELS * voxel_mm;
        let body = Body::Solids(tissues);
        Self { body, points, cuts: Vec::new(), dimensions: UVec3::splat(voxels), voxel_mm, clear_mm }
    }

    /// The head phantom with so many voxels along its height, without cuts.
    pub fn of_head(points: Vec<ColorPoint>, voxels_high: u32) -> Self {
        let head = HeadField::new(voxels_high);
        let UVec3 { x, y, z } = head.dimensions();
        Self {
            voxel_mm: head.spacing_mm().into(),
            body: Body::Head(Arc::new(head)),
            points,
            cuts: Vec::new(),
            dimensions: UVec3::new(x, z, y),
            // Its distances are no bounds.
            clear_mm: 0.0,
        }
    }

    /// Standard deviation of the scanner's blur, mm.
    pub fn blur_mm(&self) -> f64 {
        BLUR_VOXELS * self.voxel_mm
    }

    /// Half the extent of the grid, with the whole of its outermost voxels, mm.
    pub fn half_extent_mm(&self) -> DVec3 {
        0.5 * self.voxel_mm * self.dimensions.as_dvec3()
    }

    /// The value at a point.
    pub fn value(&self, p: DVec3) -> f64 {
        let of = |tissue: &Tissue| tissue.value * tissue.solid.profile_at(p, self.blur_mm(), edge::share);
        match &self.body {
            Body::Solids(tissues) => tissues.iter().map(of).sum(),
            Body::Head(head) => head.value(Vec3::new(-p.x as f32, p.z as f32, p.y as f32)).into(),
        }
    }

    /// Direction in which the value changes, of any length.
    fn gradient(&self, p: DVec3) -> DVec3 {
        let of = |tissue: &Tissue| {
            let steepness = tissue.solid.profile_at(p, self.blur_mm(), edge::steepness);
            tissue.value * steepness * tissue.solid.normal(p)
        };
        let along = |axis: DVec3| {
            let reach = HALF_REACH * self.voxel_mm * axis;
            self.value(p + reach) - self.value(p - reach)
        };
        match &self.body {
            Body::Solids(tissues) => tissues.iter().map(of).sum(),
            Body::Head(_) => DVec3::from_array(DVec3::AXES.map(along)),
        }
    }

    /// Normal of the surface at a point, a unit vector of either sign: the direction in which the value changes most.
    /// There is no surface where the opacity does not change within a voxel in that direction.
    pub fn normal(&self, p: DVec3) -> Option<DVec3> {
        let normal = self.gradient(p).try_normalize()?;
        let here = self.opacity(p);
        let changes = |side: f64| (self.opacity(p + side * self.voxel_mm * normal) - here).abs() > 1e-6;
        (changes(1.0) || changes(-1.0)).then_some(normal)
    }

    /// Light (linear RGB) and opacity over a voxel's length of a value: linear between points, constant beyond.
    pub fn classify(&self, value: f64) -> (DVec3, f64) {
        let above = self.points.partition_point(|point| point.value <= value);
        let a = self.points[above.saturating_sub(1)];
        let b = self.points[above.min(self.points.len() - 1)];
        let share =
            if b.value > a.value { ((value - a.value) / (b.value - a.value)).clamp(0.0, 1.0) } else { 0.0 };
        let light = a.color.lerp(b.color, share).to_array().map(|shown| color::light_of(255.0 * shown));
        (light.into(), a.opacity + share * (b.opacity - a.opacity))
    }

    /// Opacity over a voxel's length, without the grid's end and without cuts.
    pub fn opacity(&self, p: DVec3) -> f64 {
        let value = self.value(p);
        // The colour takes longer.
        let above = self.points.partition_point(|point| point.value <= value);
        if above == 0 {
            return self.points[0].opacity;
        }
        let (a, b) = (self.points[above - 1], self.points[above.min(self.points.len() - 1)]);
        let width = b.value - a.value;
        if width > 0.0 { a.opacity + (value - a.value) / width * (b.opacity - a.opacity) } else { a.opacity }
    }

    /// Distance from the nearest cut, mm, negative inside it; infinite without cuts.
    pub fn distance_from_cuts(&self, p: DVec3) -> f64 {
        self.cuts.iter().map(|cut| cut.distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Whether a point is in the grid and not cut away.
    pub fn is_shown(&self, p: DVec3) -> bool {
        p.abs().cmple(self.half_extent_mm()).all() && self.distance_from_cuts(p) >= 0.0
    }

    /// Length, mm, of a way on which nothing is seen, in whichever direction; 0 near a surface and inside.
    pub fn clear_way_mm(&self, p: DVec3) -> f64 {
        let Body::Solids(tissues) = &self.body else { return 0.0 };
        let distances = tissues.iter().map(|tissue| tissue.solid.distance(p));
        (distances.fold(f64::INFINITY, f64::min) - self.clear_mm).max(0.0)
    }

    /// The values at the voxels, rounded: a volume of 16 bits. Its grid has the axes of volume space.
    pub fn volume(&self) -> Result<Volume, VolumeError> {
        let least = match self.body {
            Body::Solids(_) => 0.0,
            Body::Head(_) => LEAST_OF_HEAD,
        };
        let UVec3 { x: width, y: height, z: depth } = self.dimensions;
        let mut values = Vec::with_capacity((width * height * depth) as usize);
        for z in 0..depth {
            for y in 0..height {
                for x in 0..width {
                    let p = (UVec3::new(x, y, z).as_dvec3() + 0.5) * self.voxel_mm - self.half_extent_mm();
                    values.push((self.value(p) - least).round() as u16);
                }
            }
        }
        // Volume space in the axes of a patient.
        let [x, y, z] = [DVec3::NEG_X, DVec3::Z, DVec3::Y].map(|axis| axis * self.voxel_mm);
        let grid_to_patient = DAffine3::from_cols(x, y, z, DVec3::ZERO);
        let rescale = Rescale { intercept: least, ..Rescale::default() };
        Volume::new(self.dimensions, grid_to_patient, Intensities::U16(values), rescale)
    }
}
