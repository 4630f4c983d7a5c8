//! Pipelines that draw volumes, one for every kind of view and of volume. They come from Bevy's mesh pipeline, so that
//! they have the bindings and definitions of its materials.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    mesh::{MeshVertexBufferLayout, MeshVertexBufferLayouts, VertexBufferLayout},
    pbr::{MATERIAL_BIND_GROUP_INDEX, MeshPipeline, MeshPipelineKey},
    prelude::*,
    render::{
        render_resource::{
            BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindGroupLayoutEntry, BindingType,
            BufferBindingType, CompareFunction, DepthStencilState, Face, OwnedBindingResource,
            PrimitiveState, PrimitiveTopology, RenderPipelineDescriptor, ShaderStages,
            SpecializedMeshPipeline, SpecializedRenderPipeline, TextureSampleType, VertexState,
            binding_types::{
                storage_buffer_read_only_sized, storage_buffer_sized, texture_3d, uniform_buffer,
            },
        },
        renderer::RenderDevice,
    },
    shader::ShaderDefVal,
};

use super::merging::{MERGED_BIND_GROUP, merged_layout};
use crate::{
    occlusion::{AmbientOcclusion, OcclusionTexels, Reconstruction, VolumeLighting, VolumeShading},
    render::{
        ClipTextures, ExtractedVolume, Formats, MarchVariant, MarchedViewUniform, RUNS_BINDING,
        VolumeResources, volumes::layouts,
    },
};

/// Group of a volume's bindings, behind the two of Bevy's views.
pub(super) const VOLUME_BIND_GROUP: usize = 2;

/// Bindings of drawing alone: what orients surfaces, the occlusion, and the view.
pub(super) const ORIENTATIONS: u32 = 9;
pub(super) const OCCLUSION: u32 = 10;
pub(super) const VIEW_BINDING: u32 = 12;
/// Binding of the lists of pixels at outlines.
pub(super) const OUTLINES: u32 = 13;

/// Makes the pipelines.
#[derive(Resource, Clone)]
pub(super) struct DrawPipeline {
    meshes: MeshPipeline,
    shader: Handle<Shader>,
    pub layout: BindGroupLayoutDescriptor,
    /// Layout of what merged draws read besides.
    pub merged_layout: BindGroupLayoutDescriptor,
    /// Layouts for shading outlines: of the volume, and of the lists of outlines.
    pub of_outlines: [BindGroupLayoutDescriptor; 2],
    /// Storage buffers that a shader may have.
    most_storage_buffers: u32,
}

/// Properties of volumes that distinguish the pipelines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct DrawVariant {
    /// Definition for the content of the occlusion texture.
    texels: Option<&'static str>,
    /// Whether only an isosurface is drawn.
    is_isosurface: bool,
    reconstruction: Reconstruction,
    lighting: VolumeLighting,
    by_gradient: bool,
    /// Whether parts of rays are drawn, among volumes that share the space.
    is_merged: bool,
    pub rays: RaysDrawn,
    pub samples: SamplesDrawn,
}

/// The samples of multisampled pixels that a pipeline draws. An opaque mesh may hide some samples of a pixel, or end
/// their rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) enum SamplesDrawn {
    /// All samples of a pixel, but for those that `Far` draws.
    #[default]
    Near,
    /// Samples with a mesh much farther away than that of others.
    Far,
}

/// The view rays that a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum RaysDrawn {
    /// Those whose runs are all stored.
    Stored,
    /// The others: their rest is followed while they are drawn.
    CutOff,
    /// All, each followed on where its runs end.
    All,
}

impl RaysDrawn {
    fn shader_defs(self) -> &'static [&'static str] {
        match self {
            Self::Stored => &[],
            Self::CutOff => &["REST", "CUT_OFF_ALONE"],
            Self::All => &["REST"],
        }
    }
}

impl DrawVariant {
    pub fn of(occlusion: &AmbientOcclusion, shading: &VolumeShading, by_gradient: bool) -> Self {
        let texels = occlusion.texels();
        let draws_surface = occlusion.method.settings().drawing().draws_surface;
        Self {
            texels: texels.shader_def(),
            is_isosurface: draws_surface,
            reconstruction: shading.reconstruction,
            lighting: shading.lighting,
            by_gradient,
            is_merged: false,
            samples: default(),
            // Runs end where they would be opaque, but modulated ones are not.
            rays: if texels == OcclusionTexels::Modulated { RaysDrawn::All } else { RaysDrawn::Stored },
        }
    }

    /// The variant that draws the rays that this one leaves out, if any.
    pub fn of_the_others(self) -> Option<Self> {
        let leaves_out = self.rays == RaysDrawn::Stored && !self.is_isosurface;
        leaves_out.then_some(Self { rays: RaysDrawn::CutOff, ..self })
    }

    /// The variant that draws parts of rays.
    pub fn merged(self) -> Self {
        Self { is_merged: true, ..self }
    }

    /// The variant that differs in nothing that transmittance does not depend on.
    pub fn of_transmittance(self) -> Self {
        Self { lighting: VolumeLighting::Unlit, ..self }
    }

    /// Whether transmittance may change without a march.
    pub fn may_change_at_rest(self) -> bool {
        self.is_isosurface || self.texels == OcclusionTexels::Modulated.shader_def()
    }

    /// Rays without room for runs are few, and may be drawn with the others.
    fn rays_at_once(self) -> RaysDrawn {
        if self.is_isosurface { self.rays } else { RaysDrawn::All }
    }

    /// The variant that draws the samples that this one leaves out in views of this kind, if any.
    pub fn of_far_samples(self, view: MeshPipelineKey) -> Option<Self> {
        let has_samples = view.msaa_samples() > 1 && view.contains(MeshPipelineKey::DEPTH_PREPASS);
        has_samples.then_some(Self { samples: SamplesDrawn::Far, rays: self.rays_at_once(), ..self })
    }

    /// Whether a pass of its own may shade pixels at outlines in views of this kind. The lights of the scene are known to
    /// fragments alone.
    pub fn may_have_outlines(self, view: MeshPipelineKey) -> bool {
        view.msaa_samples() > 1 && !self.is_isosurface && !self.has_scene_lights()
    }

    /// Whether only an isosurface is drawn.
    pub fn is_surface(self) -> bool {
        self.is_isosurface
    }

    /// Whether the lights of the scene are.
    pub fn has_scene_lights(self) -> bool {
        self.lighting == VolumeLighting::SceneLights
    }

    /// Definitions for the shaders.
    pub fn shader_defs(self) -> impl Iterator<Item = ShaderDefVal> {
        let isosurface = self.is_isosurface.then_some("ISOSURFACE");
        let lit = match self.lighting {
            VolumeLighting::Unlit => None,
            VolumeLighting::Headlight => Some("LIT"),
            VolumeLighting::SceneLights => Some("SCENE_LIGHTS"),
        };
        let by_gradient = self.by_gradient.then_some("BY_GRADIENT");
        let far = (self.samples == SamplesDrawn::Far).then_some("FAR_SAMPLES");
        let merged = self.is_merged.then_some("MERGED");
        let outlines = (self.is_merged || self.has_scene_lights()).then_some("FOLLOWS_OUTLINES");
        let named = [self.texels, isosurface, lit, by_gradient, merged, outlines, far].into_iter().flatten();
        let listed = [self.reconstruction.shader_defs(), self.rays.shader_defs()].concat();
        named.chain(listed).map(ShaderDefVal::from)
    }
}

/// How rays are followed up to where they are stopped: as the march does, or up to an isosurface that is drawn alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct FollowedRays {
    march: MarchVariant,
    is_isosurface: bool,
}

impl FollowedRays {
    pub fn of(volume: &ExtractedVolume) -> Self {
        Self { march: MarchVariant::of(volume), is_isosurface: volume.draws_surface() }
    }

    /// Definitions for the shaders.
    pub fn shader_defs(self) -> impl Iterator<Item = ShaderDefVal> {
        let isosurface = self.is_isosurface.then_some("ISOSURFACE");
        self.march.shader_defs().chain(isosurface).map(ShaderDefVal::from)
    }
}

/// Kind of a view, and of a volume.
pub(super) type DrawKey = (MeshPipelineKey, DrawVariant);

impl FromWorld for DrawPipeline {
    fn from_world(world: &mut World) -> Self {
        Self {
            meshes: world.resource::<MeshPipeline>().clone(),
            shader: load_embedded_asset!(world, "volume.wgsl"),
            layout: drawn_layout(),
            merged_layout: merged_layout(),
            most_storage_buffers: world
                .resource::<RenderDevice>()
                .limits()
                .max_storage_buffers_per_shader_stage,
            of_outlines: outline_layouts(),
        }
    }
}

/// Bindings of a volume for drawing.
fn drawn_layout() -> BindGroupLayoutDescriptor {
    let mut entries = layout_entries(ShaderStages::FRAGMENT);
    entries.push(storage_buffer_read_only_sized(false, None).build(OUTLINES, ShaderStages::FRAGMENT));
    // The vertices are those of the volume's box in a view.
    let of_vertices = entries.iter_mut().filter(|entry| [0, VIEW_BINDING].contains(&entry.binding));
    of_vertices.for_each(|entry| entry.visibility = ShaderStages::VERTEX_FRAGMENT);
    BindGroupLayoutDescriptor::new("contextual_ao_drawn_volume", &entries)
}

/// The same for shading outlines, with their lists in another group: these are written.
fn outline_layouts() -> [BindGroupLayoutDescriptor; 2] {
    let stages = ShaderStages::COMPUTE;
    let lists = BindGroupLayoutEntries::single(stages, storage_buffer_sized(false, None));
    [
        BindGroupLayoutDescriptor::new("contextual_ao_shaded_volume", &layout_entries(stages)),
        BindGroupLayoutDescriptor::new("contextual_ao_outline_lists", &lists),
    ]
}

/// Bindings of both.
fn layout_entries(stages: ShaderStages) -> Vec<BindGroupLayoutEntry> {
    let mut entries = marched_layout_entries(stages);
    entries.push(texture_3d(TextureSampleType::Float { filterable: true }).build(OCCLUSION, stages));
    entries.push(storage_buffer_read_only_sized(false, None).build(RUNS_BINDING, stages));
    entries
}

/// Bindings of what follows rays of a view while it draws. Drawing does not read the dilation maps, and fragment shaders get
/// 16 textures, Bevy's included.
pub(super) fn marched_layout_entries(stages: ShaderStages) -> Vec<BindGroupLayoutEntry> {
    let mut entries = layouts::brick_layout_entries(stages);
    entries.retain(|entry| entry.binding != layouts::DILATION_MAPS);
    entries.push(texture_3d(TextureSampleType::Float { filterable: true }).build(ORIENTATIONS, stages));
    entries.push(uniform_buffer::<MarchedViewUniform>(true).build(VIEW_BINDING, stages));
    entries
}

/// Shared bindings of a volume, but for those that drawing does not read. `None` before its buffers were first written.
pub(super) fn drawn_bindings(
    resources: &VolumeResources,
    clip: &ClipTextures,
    formats: &Formats,
) -> Option<Vec<(u32, OwnedBindingResource)>> {
    let mut bindings = resources.bindings(clip, formats)?;
    bindings.retain(|(binding, _)| *binding != layouts::DILATION_MAPS);
    Some(bindings)
}

/// Depth that a shader tells, in front of what is there.
pub(super) fn depth_of_shader() -> DepthStencilState {
    DepthStencilState {
        format: CORE_3D_DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::GreaterEqual),
        stencil: default(),
        bias: default(),
    }
}

/// Shader definitions of the group that a volume is bound to.
pub(super) fn bind_group_defs(group: usize) -> [ShaderDefVal; 2] {
    ["VOLUME_BIND_GROUP", "RUNS_BIND_GROUP"].map(|name| ShaderDefVal::UInt(name.into(), group as u32))
}

/// How the box of a volume is drawn (`drawn_box.wgsl`): by its back faces, as the camera may be inside.
pub(super) fn box_primitive() -> PrimitiveState {
    PrimitiveState { topology: PrimitiveTopology::TriangleStrip, cull_mode: Some(Face::Front), ..default() }
}

impl DrawPipeline {
    /// Whether shaders may have the storage buffers of a view and of a volume, which sorted fragments and an atmosphere together
    /// do not leave room for within the web's limits.
    pub fn has_room_in(&self, view: MeshPipelineKey) -> bool {
        let of_view = self.meshes.get_view_layout(view.into());
        let layouts = [&of_view.main_layout, &of_view.binding_array_layout, &self.layout];
        let entries = layouts.into_iter().flat_map(|layout| &layout.entries);
        let is_storage = |entry: &&BindGroupLayoutEntry| {
            let is_buffer =
                matches!(entry.ty, BindingType::Buffer { ty: BufferBindingType::Storage { .. }, .. });
            is_buffer && entry.visibility.contains(ShaderStages::FRAGMENT)
        };
        entries.filter(is_storage).count() as u32 <= self.most_storage_buffers
    }

    /// A pipeline that draws the box of a volume into a view, with the bindings of both. The shader tells depths, or none count.
    pub fn describe(
        &self,
        label: &'static str,
        shader: &Handle<Shader>,
        view: MeshPipelineKey,
        own_defs: impl IntoIterator<Item = ShaderDefVal>,
    ) -> RenderPipelineDescriptor {
        let no_vertices = MeshVertexBufferLayout::new(Vec::new(), VertexBufferLayout::default());
        let no_vertices = MeshVertexBufferLayouts::default().insert(no_vertices);
        let key = view | MeshPipelineKey::BLEND_PREMULTIPLIED_ALPHA;
        let mut descriptor = match self.meshes.specialize(key, &no_vertices) {
            Ok(descriptor) => descriptor,
            Err(error) => unreachable!("no vertex attribute is asked for: {error}"),
        };
        descriptor.label = Some(label.into());
        descriptor.layout.truncate(VOLUME_BIND_GROUP);
        descriptor.layout.push(self.layout.clone());
        let mut defs = core::mem::take(&mut descriptor.vertex.shader_defs);
        defs.extend(bind_group_defs(VOLUME_BIND_GROUP).into_iter().chain(own_defs));
        // Bevy's lights are in one module with what reads the bindings of its materials.
        defs.push(ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), MATERIAL_BIND_GROUP_INDEX as u32));
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader = shader.clone();
            fragment.shader_defs = defs.clone();
        }
        descriptor.vertex = VertexState { shader: shader.clone(), shader_defs: defs, ..default() };
        descriptor.primitive = box_primitive();
        descriptor
    }
}

impl SpecializedRenderPipeline for DrawPipeline {
    type Key = DrawKey;

    fn specialize(&self, (view, variant): DrawKey) -> RenderPipelineDescriptor {
        // Bevy itself has no premultiplied colours in its lists of transparent fragments.
        let in_lists = view.contains(MeshPipelineKey::OIT_ENABLED).then_some("OIT_ENABLED");
        let own = variant.shader_defs().chain(in_lists.map(ShaderDefVal::from));
        let mut descriptor = self.describe("contextual_ao_volume", &self.shader, view, own);
        // The depth stays: that of a volume is drawn apart (`depth.rs`).
        descriptor.depth_stencil =
            Some(DepthStencilState { depth_write_enabled: Some(false), ..depth_of_shader() });
        if variant.is_merged {
            debug_assert_eq!(descriptor.layout.len(), MERGED_BIND_GROUP);
            descriptor.layout.push(self.merged_layout.clone());
        }
        descriptor
    }
}
