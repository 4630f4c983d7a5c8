//! Trait of the methods that compute the occlusion of voxels. The core runs methods by this trait, and names none.

use bevy::{
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupLayoutDescriptor, PipelineCache, TextureFormat, TextureView,
    },
};

use crate::{
    occlusion::{AmbientOcclusion, CastBudget, CastPacing, MethodSettings, OcclusionMethod, Optimizations},
    render::{
        clipping::step::{ClipStep, Demand},
        extract::ExtractedVolume,
        gpu::{device::Gpu, formats::Formats, frame::Frame},
        views::runs::ViewRuns,
        volumes::{
            kept::MethodResources,
            layouts::bricks_layout,
            store::{VolumeGroups, VolumeResources},
        },
        windows::VolumeWindow,
    },
    volume::VolumeGeometry,
};

/// A method that computes the occlusion of voxels: its passes, and their resources.
///
/// [`VoxelMethodPlugin`](crate::render::VoxelMethodPlugin) adds it to an app; `docs/adding_a_method.md` has an example.
pub trait VoxelMethod: FromWorld + Send + Sync + 'static {
    /// Resources that the method keeps on the GPU for a volume.
    type Kept: MethodResources;
    /// The passes over one volume in one frame, with their bind groups.
    type Job: Send + Sync;

    /// Whether the method computes the occlusion of these settings.
    fn computes(&self, method: &OcclusionMethod) -> bool;

    /// Whether the method's pipelines are ready, for all settings of this type. The first call starts their
    /// compilation. Called in every frame, once a volume has wanted the method.
    fn is_ready(&self, method: &OcclusionMethod, cache: &PipelineCache) -> bool;

    /// Reads the method's inputs from the render world. Called first in a frame.
    fn read(&mut self, world: &World) {
        let _ = world;
    }

    /// Makes the resources for a volume, and reuses `kept` as far as possible. Called in every frame, whether or not
    /// a view shows the volume.
    fn keep(&self, kept: Option<Self::Kept>, volume: &KeptVolume, gpu: &Gpu) -> Self::Kept;

    /// Demand of the method on clipping.
    #[doc(hidden)]
    fn demand(&self, volume: &KeptVolume, optimizations: &Optimizations) -> Demand {
        let _ = (volume, optimizations);
        default()
    }

    /// Writes and binds the inputs of the passes. `None` if nothing has to be computed. Called in every frame in
    /// which the volume is seen.
    fn plan(&self, kept: &mut Self::Kept, volume: &VolumeFrame, gpu: &Gpu) -> Option<Self::Job>;

    /// Encodes the passes over all volumes.
    fn encode(&self, jobs: &[Self::Job], frame: &mut Frame, cache: &PipelineCache);
}

/// A volume for which a method keeps resources.
pub struct KeptVolume<'a> {
    pub(crate) volume: &'a ExtractedVolume,
    pub(crate) resources: &'a VolumeResources,
}

impl KeptVolume<'_> {
    /// Settings of the volume's method, if they are of this type.
    pub fn settings<S: MethodSettings>(&self) -> Option<&S> {
        self.volume.occlusion.method.get()
    }

    /// Number of voxels along each axis.
    pub fn dimensions(&self) -> UVec3 {
        self.volume.geometry.dimensions
    }

    /// Grid of the volume, with conversions of lengths.
    pub fn geometry(&self) -> &VolumeGeometry {
        &self.volume.geometry
    }

    /// Settings of the volume's occlusion.
    pub fn ambient_occlusion(&self) -> &AmbientOcclusion {
        &self.volume.occlusion
    }
}

/// A volume in a frame in which it is seen. Dereferences to [`KeptVolume`].
#[derive(Deref)]
pub struct VolumeFrame<'a> {
    #[deref]
    pub(crate) of: KeptVolume<'a>,
    pub(crate) groups: &'a VolumeGroups,
    pub(crate) step: &'a ClipStep,
    pub(crate) windows: &'a [VolumeWindow],
    /// What these views see.
    pub(crate) runs: &'a ViewRuns,
    /// Whether the volume is drawn differently than before, for any reason.
    pub(crate) looks_different: bool,
    pub(crate) optimizations: &'a Optimizations,
    pub(crate) cast_budget: CastBudget,
    pub(crate) cast_pacing: Option<CastPacing>,
    /// Time of the frame before, milliseconds.
    pub(crate) frame_ms: f32,
}

impl VolumeFrame<'_> {
    /// Whether occlusion darkens the volume's samples. If not, it need not be computed.
    pub fn uses_occlusion(&self) -> bool {
        self.volume.shading.ambient_occlusion
    }

    /// Whether anything changed that opacities or settings depend on. If so, earlier results are invalid.
    pub fn has_changed(&self) -> bool {
        self.step.has_changes()
    }

    /// Opacity of every voxel after clipping, per occlusion step.
    pub fn opacities(&self) -> &TextureView {
        &self.resources.opacities.view
    }

    /// Texture into which the occlusion is written.
    pub fn occlusion(&self) -> &TextureView {
        &self.resources.occlusion.view
    }

    /// Bind group 0 of all passes over a volume ([`volume_layout`]; `volumes/bindings.wgsl`).
    pub fn group(&self) -> &BindGroup {
        &self.groups.bricks
    }
}

/// Layout of [`VolumeFrame::group`].
pub fn volume_layout() -> BindGroupLayoutDescriptor {
    bricks_layout()
}

/// Format of occlusion textures that hold one factor a texel: `R8Unorm`, where shaders have the definition
/// `STORE_R8`, else `Rgba8Unorm`. It is known once the app runs.
pub fn factor_format(world: &World) -> TextureFormat {
    world.resource::<Formats>().scalar
}
