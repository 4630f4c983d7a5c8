//! The material: binds the textures and buffers that the passes keep for a volume.

use bevy::{
    asset::embedded_path,
    ecs::system::{SystemParam, SystemParamItem},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MaterialPipeline, MaterialPipelineKey, MeshPipelineKey},
    prelude::*,
    render::{
        render_resource::{
            AsBindGroup, AsBindGroupError, BindGroupLayout, BindGroupLayoutEntry, BindingResources,
            CompareFunction, Face, OwnedBindingResource, RenderPipelineDescriptor, ShaderStages,
            SpecializedMeshPipelineError, TextureSampleType, TextureViewDimension, UnpreparedBindGroup,
            binding_types::texture_3d,
        },
        renderer::RenderDevice,
        sync_world::MainEntity,
    },
    shader::{ShaderDefVal, ShaderRef},
};

use crate::{
    occlusion::OcclusionTexels,
    render::{ClipMaps, Formats, VolumeStore, volumes::layouts},
};

/// Material that draws the volume of an entity. The plugin makes it and keeps it up to date.
///
/// It holds no data of its own: it binds the textures that the passes keep for the volume. So changes by a carver
/// are drawn in the frame of the change.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct VolumeMaterial {
    /// The entity with the [`Volume3d`](crate::volume::Volume3d).
    pub(super) volume: Entity,
    pub(super) variant: MaterialVariant,
}

/// Properties that distinguish the pipelines that draw volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialVariant {
    /// Whether the transform from the box to the world mirrors.
    pub(super) is_mirrored: bool,
    /// Content of the occlusion texture.
    pub(super) texels: OcclusionTexels,
    /// Whether only an isosurface is drawn.
    pub(super) is_isosurface: bool,
}

impl MaterialVariant {
    /// Whether the same pipelines draw another variant.
    pub(super) fn has_pipelines_of(&self, other: &Self) -> bool {
        self.texels.shader_def() == other.texels.shader_def()
            && (self.is_mirrored, self.is_isosurface) == (other.is_mirrored, other.is_isosurface)
    }
}

/// The bind group of materials in Bevy: group 3.
const MATERIAL_BIND_GROUP: u32 = bevy::pbr::MATERIAL_BIND_GROUP_INDEX as u32;

impl Material for VolumeMaterial {
    fn fragment_shader() -> ShaderRef {
        let path = bevy::asset::AssetPath::from_path_buf(embedded_path!("volume.wgsl"));
        path.with_source("embedded").into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        AlphaMode::Premultiplied
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        // Back faces are drawn whatever is in front of them: the camera may be inside the box. The shader
        // itself stops at opaque geometry.
        let variant = key.bind_group_data;
        let is_inside_out = variant.is_mirrored != key.mesh_key.contains(MeshPipelineKey::INVERT_CULLING);
        descriptor.primitive.cull_mode = Some(if is_inside_out { Face::Back } else { Face::Front });
        if let Some(depth_stencil) = &mut descriptor.depth_stencil {
            depth_stencil.depth_compare = Some(CompareFunction::Always);
        }
        let group = ShaderDefVal::UInt("VOLUME_BIND_GROUP".into(), MATERIAL_BIND_GROUP);
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader_defs.push(group);
            let isosurface = variant.is_isosurface.then_some("ISOSURFACE");
            let defs = variant.texels.shader_def().into_iter().chain(isosurface);
            fragment.shader_defs.extend(defs.map(ShaderDefVal::from));
        }
        Ok(())
    }
}

/// Resources of the passes that the material binds.
#[derive(SystemParam)]
pub struct PassResources<'w> {
    volumes: Res<'w, VolumeStore>,
    clip_maps: Res<'w, ClipMaps>,
    formats: Res<'w, Formats>,
}

impl AsBindGroup for VolumeMaterial {
    type Data = MaterialVariant;
    type Param = PassResources<'static>;

    fn label() -> &'static str {
        "volume_material"
    }

    fn bind_group_data(&self) -> Self::Data {
        self.variant
    }

    fn unprepared_bind_group(
        &self,
        _: &BindGroupLayout,
        _: &RenderDevice,
        passes: &mut SystemParamItem<Self::Param>,
        _: bool,
    ) -> Result<UnpreparedBindGroup, AsBindGroupError> {
        let bindings = (|| {
            let volume = passes.volumes.0.get(&MainEntity::from(self.volume))?;
            let clip = passes.clip_maps.textures.as_ref()?;
            let mut bindings = volume.bindings(clip, &passes.formats)?;
            bindings.retain(|(binding, _)| *binding != layouts::DILATION_MAPS);
            for (binding, view) in [(9, volume.orientations()), (10, &volume.occlusion.view)] {
                let view = OwnedBindingResource::TextureView(TextureViewDimension::D3, view.clone());
                bindings.push((binding, view));
            }
            Some(bindings)
        })();
        bindings
            .map(|bindings| UnpreparedBindGroup { bindings: BindingResources(bindings) })
            .ok_or(AsBindGroupError::RetryNextUpdate)
    }

    fn bind_group_layout_entries(_: &RenderDevice, _: bool) -> Vec<BindGroupLayoutEntry> {
        let stages = ShaderStages::FRAGMENT;
        let volume = texture_3d(TextureSampleType::Float { filterable: true });
        let mut entries = layouts::brick_layout_entries(stages);
        // Drawing does not read the dilation maps, and fragment shaders get 16 textures, Bevy's included.
        entries.retain(|entry| entry.binding != layouts::DILATION_MAPS);
        entries.extend([9, 10].map(|binding| volume.build(binding, stages)));
        entries
    }
}
