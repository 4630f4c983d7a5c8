//! Transfer functions for common examinations, by name.

use bevy::math::DVec3;
use std::{fmt, str::FromStr};

use super::{
    ControlPoint, PointsAtGradient, TransferFunction, Volume, VolumeGeometry, percentiles::Percentiles,
};

/// A transfer function for a common examination, fitted to a volume.
///
/// CT presets are in Hounsfield units (HU). A file without negative values is not in HU, since air and fat lie below
/// zero. Its air is then taken for -1000 HU, and the end of the soft-tissue peak in its histogram for 100. MR has no
/// units: MR presets lie between percentiles of the volume's intensities.
///
/// Opacity is per 350th of the volume's diagonal, about a millimetre for a head. So a mouse is as translucent
/// as a man, and a halved volume looks like the whole volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Preset {
    /// Bones and teeth alone, ivory.
    CtBone,
    /// Skin and flesh, translucent, over bones.
    CtSoftTissue,
    /// Vessels filled with contrast agent, red, and bones, ivory. Spongy bone is as dense as contrast agent, and
    /// red as well. Surfaces of bones pass through that density steeply, and are ivory.
    CtVessels,
    /// Lungs, airways and the vessels in them; the body around them is barely visible.
    CtLung,
    /// An MRI of a head, opaque: scalp and, once the scalp is carved away, grey and white matter.
    MrHead,
    /// Bright blood of an MR angiography (time of flight or contrast agent), in a faint brain.
    MrAngiography,
}

impl Preset {
    /// All presets, in the order of a menu.
    pub const ALL: [Self; 6] =
        [Self::CtBone, Self::CtSoftTissue, Self::CtVessels, Self::CtLung, Self::MrHead, Self::MrAngiography];

    /// The name used on command lines and in menus: `ct_bone`, `ct_soft_tissue`, `ct_vessels`, `ct_lung`,
    /// `mr_head`, `mr_angiography`.
    pub fn name(self) -> &'static str {
        match self {
            Self::CtBone => "ct_bone",
            Self::CtSoftTissue => "ct_soft_tissue",
            Self::CtVessels => "ct_vessels",
            Self::CtLung => "ct_lung",
            Self::MrHead => "mr_head",
            Self::MrAngiography => "mr_angiography",
        }
    }

    /// The preset's transfer function for a volume, in the units of the volume's file.
    pub fn transfer_function(&self, volume: &Volume) -> TransferFunction {
        let scale = self.scale(volume);
        let point =
            |&(value, color, opacity): &Point| ControlPoint { value: scale.at(value), color, opacity };
        let corners = VolumeGeometry::of(volume).corners();
        let diagonal = 2.0 * corners.map(DVec3::length).into_iter().fold(0.0, f64::max);
        let unit = (diagonal / UNITS_IN_DIAGONAL) as f32;
        let points = |points: &[Point]| points.iter().map(point).collect();
        let function =
            TransferFunction::of_values(points(self.points()), unit.clamp(f32::MIN_POSITIVE, f32::MAX));
        // The length of a gradient in file units per mm.
        let spacing_mm = f64::from(volume.spacing_mm().element_product()).cbrt();
        let gradient =
            |per_voxel: f64| (per_voxel * scale.unit / spacing_mm).clamp(0.0, f32::MAX.into()) as f32;
        let steep = self.steep().map(|([from, to], steep)| PointsAtGradient {
            from: gradient(from),
            to: gradient(to),
            points: points(steep),
        });
        TransferFunction { at_gradients: steep.into_iter().collect(), ..function }
    }

    fn points(self) -> &'static [Point] {
        match self {
            Self::CtBone => CT_BONE,
            Self::CtSoftTissue => CT_SOFT_TISSUE,
            Self::CtVessels => CT_VESSELS,
            Self::CtLung => CT_LUNG,
            Self::MrHead => MR_HEAD,
            Self::MrAngiography => MR_ANGIOGRAPHY,
        }
    }

    /// Points for longer gradients, and the range of gradients in which they take over, per voxel.
    fn steep(self) -> Option<([f64; 2], &'static [Point])> {
        (self == Self::CtVessels).then_some((VESSELS_END, CT_VESSELS_STEEP))
    }

    /// Scale from the preset's values to file units.
    fn scale(self, volume: &Volume) -> Scale {
        let values = Percentiles::of(volume);
        match self {
            Self::CtBone | Self::CtSoftTissue | Self::CtVessels | Self::CtLung => {
                if volume.range()[0] < 0.0 {
                    Scale { zero: 0.0, unit: 1.0 }
                } else {
                    Scale::through([(AIR_HU, values.dark(0.5)), (END_OF_TISSUE_HU, values.end_of_peak())])
                }
            }
            Self::MrHead => Scale::through([(0.0, values.dark(0.5)), (1.0, values.bright(0.5))]),
            Self::MrAngiography => Scale::through([(0.0, values.bright(0.5)), (1.0, values.bright(0.995))]),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown preset `{name}`: expected one of {names}")
        })
    }
}

/// Value in the preset's own scale, colour and opacity.
type Point = (f64, [f32; 3], f32);

/// Number of opacity unit distances in the volume's diagonal.
const UNITS_IN_DIAGONAL: f64 = 350.0;

const AIR_HU: f64 = -1000.0;
/// End of soft tissue; bone and contrast agent lie above it.
const END_OF_TISSUE_HU: f64 = 100.0;

const SKIN: [f32; 3] = [0.90, 0.70, 0.58];
const FAT: [f32; 3] = [0.95, 0.83, 0.60];
const FLESH: [f32; 3] = [0.74, 0.36, 0.30];
const SPONGY_BONE: [f32; 3] = [0.84, 0.70, 0.52];
const BONE_SURFACE: [f32; 3] = [0.93, 0.86, 0.74];
const BONE: [f32; 3] = [0.97, 0.94, 0.86];
const ENAMEL: [f32; 3] = [1.0, 1.0, 0.98];
const BLOOD: [f32; 3] = [0.86, 0.10, 0.07];
/// Surface of scalp and cortex in an MRI, which have the same value.
const ROSE: [f32; 3] = [0.94, 0.73, 0.64];
const GREY_MATTER: [f32; 3] = [0.90, 0.74, 0.68];
const WHITE_MATTER: [f32; 3] = [0.98, 0.94, 0.88];

const CT_BONE: &[Point] =
    &[(180.0, SPONGY_BONE, 0.0), (260.0, BONE_SURFACE, 0.35), (450.0, BONE, 0.95), (1300.0, ENAMEL, 1.0)];

const CT_SOFT_TISSUE: &[Point] = &[
    (-600.0, SKIN, 0.0),
    (-350.0, SKIN, 0.1),
    (-150.0, SKIN, 0.03),
    (-100.0, FAT, 0.012),
    (-20.0, FLESH, 0.02),
    (80.0, FLESH, 0.045),
    (200.0, SPONGY_BONE, 0.12),
    (420.0, BONE, 0.9),
    (1300.0, ENAMEL, 1.0),
];

const CT_VESSELS: &[Point] = &[
    (130.0, BLOOD, 0.0),
    (210.0, BLOOD, 0.1),
    (290.0, BLOOD, 0.22),
    (370.0, BLOOD, 0.22),
    (440.0, BONE, 0.4),
    (650.0, BONE, 0.95),
    (1500.0, ENAMEL, 1.0),
];

/// A bone's surface passes through the values of blood within a voxel or two, and must not look red.
const CT_VESSELS_STEEP: &[Point] = &[
    (130.0, BONE_SURFACE, 0.0),
    (210.0, BONE_SURFACE, 0.1),
    (290.0, BONE_SURFACE, 0.22),
    (370.0, BONE_SURFACE, 0.22),
    (440.0, BONE, 0.4),
    (650.0, BONE, 0.95),
    (1500.0, ENAMEL, 1.0),
];

/// The surface of a vessel of 400 HU in flesh, as wide as a scanner makes it, has at most 160 HU per voxel.
const VESSELS_END: [f64; 2] = [160.0, 240.0];

const CT_LUNG: &[Point] = &[
    (-860.0, SKIN, 0.0),
    (-720.0, SKIN, 0.05),
    (-500.0, FLESH, 0.3),
    (-280.0, FLESH, 0.0),
    (300.0, BONE, 0.0),
    (1000.0, BONE, 0.12),
];

/// Value 0 is the median of the dark values, 1 the median of the bright values.
const MR_HEAD: &[Point] = &[
    (0.25, ROSE, 0.0),
    (0.5, ROSE, 0.6),
    (0.75, GREY_MATTER, 0.9),
    (1.0, GREY_MATTER, 0.95),
    (1.25, WHITE_MATTER, 0.95),
    (1.8, FAT, 0.95),
    (2.4, FAT, 1.0),
];

/// Value 0 is the median of the bright values, 1 their 99.5th percentile.
const MR_ANGIOGRAPHY: &[Point] =
    &[(0.0, FLESH, 0.0), (0.5, FLESH, 0.01), (0.8, BLOOD, 0.5), (1.0, BLOOD, 0.95), (1.3, BLOOD, 1.0)];

/// A linear scale: the place of its zero and the length of its unit, in file units.
struct Scale {
    zero: f64,
    unit: f64,
}

impl Scale {
    /// The scale with `low` at `at_low` and `high` at `at_high`; with the file's unit if `at_high` is not above.
    fn through([(low, at_low), (high, at_high)]: [(f64, f64); 2]) -> Self {
        let unit = (at_high - at_low) / (high - low);
        let unit = if unit > 0.0 { unit } else { 1.0 };
        Self { zero: at_low - low * unit, unit }
    }

    fn at(&self, value: f64) -> f32 {
        (self.zero + self.unit * value).clamp(f32::MIN.into(), f32::MAX.into()) as f32
    }
}
