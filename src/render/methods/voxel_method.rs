//! What a method is that computes the occlusion of voxels. The core runs methods by this trait, and names none.

use bevy::{
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutDescriptor, PipelineCache, TextureFormat, TextureView,
    },
};

use crate::{
    occlusion::{AmbientOcclusion, MethodSettings, OcclusionMethod, Optimizations},
    render::{
        clipping::step::{ClipStep, Demand},
        extract::ExtractedVolume,
        gpu::{device::Gpu, formats::Formats, frame::Frame},
        volumes::{
            kept::MethodResources,
            layouts::bricks_layout,
            store::{VolumeGroups, VolumeResources},
        },
        windows::VolumeWindow,
    },
    volume::VolumeGeometry,
};

/// A method that computes the occlusion of voxels: its passes, and what they need.
///
/// [`VoxelMethodPlugin`](crate::render::VoxelMethodPlugin) adds it to an app; `docs/adding_a_method.md` shows one.
pub trait VoxelMethod: FromWorld + Send + Sync + 'static {
    /// What it keeps on the GPU for a volume.
    type Kept: MethodResources;
    /// Its passes over one volume in one frame, with what they bind.
    type Job: Send + Sync;

    /// Whether it computes what these settings ask for.
    fn computes(&self, method: &OcclusionMethod) -> bool;

    /// Whether its pipelines are there, for all settings of this type. They are compiled from the first time on that
    /// this is asked: in every frame, once a volume has wanted the method.
    fn is_ready(&self, method: &OcclusionMethod, cache: &PipelineCache) -> bool;

    /// Reads what it needs of the render world. Called first in a frame.
    fn read(&mut self, world: &World) {
        let _ = world;
    }

    /// Makes what it keeps for a volume, of what it kept before as much as will do. Called in every frame, whether
    /// anybody sees the volume or not.
    fn keep(&self, kept: Option<Self::Kept>, volume: &KeptVolume, gpu: &Gpu) -> Self::Kept;

    /// What it asks of clipping.
    #[doc(hidden)]
    fn demand(&self, volume: &KeptVolume, optimizations: &Optimizations) -> Demand {
        let _ = (volume, optimizations);
        default()
    }

    /// Writes and binds what its passes read; `None` where nothing has to be computed. Called in every frame in
    /// which the volume is seen.
    fn plan(&self, kept: &mut Self::Kept, volume: &VolumeFrame, gpu: &Gpu) -> Option<Self::Job>;

    /// Encodes the passes over all volumes.
    fn encode(&self, jobs: &[Self::Job], frame: &mut Frame, cache: &PipelineCache);
}

/// A volume of which a method keeps something.
pub struct KeptVolume<'a> {
    pub(crate) volume: &'a ExtractedVolume,
    pub(crate) resources: &'a VolumeResources,
}

impl KeptVolume<'_> {
    /// The settings of its method, if they are of this type.
    pub fn settings<S: MethodSettings>(&self) -> Option<&S> {
        self.volume.occlusion.method.get()
    }

    /// Its voxels along each axis.
    pub fn dimensions(&self) -> UVec3 {
        self.volume.geometry.dimensions
    }

    /// Its grid, with what converts lengths.
    pub fn geometry(&self) -> &VolumeGeometry {
        &self.volume.geometry
    }

    /// How its occlusion is computed.
    pub fn ambient_occlusion(&self) -> &AmbientOcclusion {
        &self.volume.occlusion
    }
}

/// A volume in a frame in which it is seen, with what [`KeptVolume`] tells.
#[derive(Deref)]
pub struct VolumeFrame<'a> {
    #[deref]
    pub(crate) of: KeptVolume<'a>,
    pub(crate) groups: &'a VolumeGroups,
    pub(crate) step: &'a ClipStep,
    pub(crate) windows: &'a [VolumeWindow],
    /// Whether it is drawn otherwise than before, for any reason.
    pub(crate) looks_different: bool,
    pub(crate) optimizations: &'a Optimizations,
}

impl VolumeFrame<'_> {
    /// Whether its samples are darkened by occlusion: what is not drawn need not be computed.
    pub fn uses_occlusion(&self) -> bool {
        self.volume.shading.ambient_occlusion
    }

    /// Whether anything changed on which opacities or settings depend: what was computed before does not hold.
    pub fn has_changed(&self) -> bool {
        self.step.has_changes()
    }

    /// The opacity of every voxel after clipping, of one occlusion step.
    pub fn opacities(&self) -> &TextureView {
        &self.resources.opacities.view
    }

    /// Where the occlusion is written.
    pub fn occlusion(&self) -> &TextureView {
        &self.resources.occlusion.view
    }

    /// What all passes over a volume bind as group 0 ([`volume_layout`]; `volumes/bindings.wgsl`).
    pub fn group(&self) -> &BindGroup {
        &self.groups.bricks
    }
}

/// The layout of [`VolumeFrame::group`].
pub fn volume_layout() -> BindGroupLayoutDescriptor {
    bricks_layout()
}

/// The format of occlusion textures that hold one factor a texel: `R8Unorm`, where shaders have the definition
/// `STORE_R8`, or else `Rgba8Unorm`. Once the app runs.
pub fn factor_format(world: &World) -> TextureFormat {
    world.resource::<Formats>().scalar
}
