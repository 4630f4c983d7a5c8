//! The settings of fast occlusion sweeping (Singh, Yuksel, House: Fast Occlusion Sweeping, 2009).

use bevy::{math::DMat3, prelude::*, render::extract_resource::ExtractResource};

use super::{MethodBytes, MethodDrawing, MethodSettings, OcclusionTexels, TurnedGrid};
use crate::volume::VolumeGeometry;

/// Occlusion by light that enters the grid on all sides and goes on from voxel to voxel.
///
/// Each octant of directions has a diagonal sweep; [`Sky`](super::Sky) weights the eight octants. The whole volume
/// occludes, however far away. Every change sweeps the whole volume.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct OcclusionSweeping {
    /// The opacity or the surface that stops the light.
    pub surface: SweepingSurface,
    /// How an octant lights surfaces that are turned away from it.
    pub geometry_term: GeometryTerm,
    /// The paper's alpha of translucency (equation 8), 0 to 1. Lower values let more light through.
    pub opacity: f32,
    /// The light that reaches a point is raised to 1 / gamma. Values above 1 brighten, to stand for reflected light;
    /// the paper's pictures use 2. From 0.1 to 10.
    pub gamma: f32,
    /// Direction (volume space, any length) towards one large light, in place of the [`Sky`](super::Sky): it gives a soft
    /// shadow. Light comes from the octant of directions around it, by a sweep through a turned grid (section 4.1).
    /// One sweep takes the place of eight. The grid takes up to twelve bytes a voxel.
    pub light: Option<Vec3>,
}

impl Default for OcclusionSweeping {
    fn default() -> Self {
        Self {
            surface: SweepingSurface::default(),
            geometry_term: GeometryTerm::default(),
            opacity: 1.0,
            gamma: 2.0,
            light: None,
        }
    }
}

impl OcclusionSweeping {
    /// Diagnostics span of the passes over all swept volumes.
    pub const SPAN: &str = "contextual_ao/sweep";
    /// Voxels along each side of a tile, as in `sweep.wgsl`.
    pub(crate) const TILE: u32 = 8;

    /// Limits these settings to their valid ranges.
    pub(super) fn clamped(self) -> Self {
        let surface = match self.surface {
            // No voxel is inside such a surface.
            SweepingSurface::Isovalue(value) if value.is_nan() => SweepingSurface::Isovalue(f32::INFINITY),
            SweepingSurface::Isosurface(value) if value.is_nan() => {
                SweepingSurface::Isosurface(f32::INFINITY)
            }
            surface => surface,
        };
        Self {
            surface,
            opacity: if self.opacity.is_nan() { 1.0 } else { self.opacity.clamp(0.0, 1.0) },
            gamma: if self.gamma > 0.0 { self.gamma.clamp(0.1, 10.0) } else { 1.0 },
            // Scaled first, so that no square is too large or too small.
            light: self.light.and_then(|light| (light / light.abs().max_element()).try_normalize()),
            ..self
        }
    }

    /// The same settings without their geometry term; `None` if they have none.
    pub(super) fn without_geometry_term(self) -> Option<Self> {
        self.keeps_octants().then_some(Self { geometry_term: GeometryTerm::None, ..self })
    }

    /// Whether the light of each octant is kept, instead of the octants' mean.
    pub(crate) fn keeps_octants(&self) -> bool {
        self.geometry_term != GeometryTerm::None
    }

    /// Whether only a surface is drawn.
    pub(crate) fn draws_surface(&self) -> bool {
        matches!(self.surface, SweepingSurface::Isosurface(_))
    }

    /// The grid through which the light goes, if not that of the volume.
    pub(crate) fn turned_grid(&self, geometry: &VolumeGeometry) -> Option<TurnedGrid> {
        let [faces, cells] = Self::turned_columns_and_cells(geometry.dimensions);
        self.light.map(|light| {
            TurnedGrid::new(geometry, light.as_dvec3(), |turned| {
                turned.as_u64vec3().element_product() <= cells && columns(turned) <= faces
            })
        })
    }

    /// Most columns of a turned grid, over all tiles, and most cells.
    fn turned_columns_and_cells(dimensions: UVec3) -> [u64; 2] {
        let voxels = dimensions.as_u64vec3().element_product();
        [voxels + columns(UVec3::ONE), 2 * voxels]
    }

    /// Bytes of the light between tiles, of the light at the voxels or cells, and of the voxels' distances.
    pub(crate) fn buffer_bytes(&self, dimensions: UVec3) -> [u64; 3] {
        let voxels = dimensions.as_u64vec3().element_product();
        let distances = if self.surface.isovalue().is_some() { 4 * voxels } else { 0 };
        if self.light.is_some() {
            let [faces, cells] = Self::turned_columns_and_cells(dimensions);
            return [4 * faces, 4 * cells, distances];
        }
        let found = if self.keeps_octants() { 8 } else { 4 };
        [4 * columns(dimensions), found * voxels, distances]
    }
}

impl MethodSettings for OcclusionSweeping {
    fn name(&self) -> &'static str {
        "sweeping"
    }

    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        let buffers = MethodBytes::of_buffers(&self.buffer_bytes(dimensions));
        let surface = if self.draws_surface() { 8 } else { 0 };
        MethodBytes { total: buffers.total + surface * dimensions.as_u64vec3().element_product(), ..buffers }
    }

    fn drawing(&self) -> MethodDrawing {
        MethodDrawing {
            texels: if self.keeps_octants() { OcclusionTexels::Octants } else { OcclusionTexels::Factors },
            draws_surface: self.draws_surface(),
            power: self.gamma.recip(),
            both_sides: self.geometry_term == GeometryTerm::BothSides,
        }
    }

    fn light_axes(&self, geometry: &VolumeGeometry) -> Option<DMat3> {
        self.turned_grid(geometry).map(|grid| grid.axes())
    }
}

/// Number of columns of whole tiles along each axis of a grid, together.
fn columns(dimensions: UVec3) -> u64 {
    let size = dimensions.map(|count| count.div_ceil(OcclusionSweeping::TILE)) * OcclusionSweeping::TILE;
    let size = size.as_u64vec3();
    size.y * size.z + size.x * size.z + size.x * size.y
}

/// Whether sweeps find distances alone, without light. This serves to measure what the occlusion of an isosurface
/// costs beyond its distance field. The occlusion stays as it was.
#[derive(Resource, ExtractResource, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct SweepDistancesAlone(pub bool);

/// The opacity or surface that stops light on its way through a volume.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SweepingSurface {
    /// The opacity of every voxel, over the mean of the three spacings: light takes as many steps along each axis.
    /// Ways along the axes are 1.5 times as long as straight ones, and the opacity is lower by as much.
    #[default]
    Opacity,
    /// The surface at an intensity, in the file's units, as in the paper. The same sweeps find its signed distance
    /// field (equations 1 and 7; h in equation 7 is the smallest spacing). Clipped points lie outside.
    Isovalue(f32),
    /// The same surface, which alone is drawn, in every shading mode. It is opaque, with the transfer function's
    /// colours; its normals are the distance field's gradients. View rays leap by the distances. Costs eight bytes a
    /// voxel more.
    Isosurface(f32),
}

impl SweepingSurface {
    /// Intensity of the surface, in the file's units; `None` for [`SweepingSurface::Opacity`].
    pub fn isovalue(self) -> Option<f32> {
        match self {
            Self::Opacity => None,
            Self::Isovalue(value) | Self::Isosurface(value) => Some(value),
        }
    }
}

/// How the light of an octant depends on the surface's normal.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum GeometryTerm {
    /// No dependence: the octants' mean is kept, a byte a voxel.
    #[default]
    None,
    /// By the cosine, integrated over the octant (equation 5), at every drawn sample. Costs eight bytes a voxel, and
    /// a gradient for every sample.
    Cosine,
    /// By the cosine on both sides of a surface (section 4.2), for translucency. Light from all around is 1, as with
    /// one side: a lit side is half as bright, so that light from behind shows how thick the matter is.
    BothSides,
}
