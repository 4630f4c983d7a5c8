//! Small scenes for tests and stability figures, and functions that read their results.

use crate::mode::ShadingMode;
use bevy::{
    math::{DAffine3, DVec2, DVec3, Vec3Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    diagnostics::RenderStatus,
    prelude::*,
    render::{VolumeTexture, VoxelMask},
    volume::{Intensities, Rescale, WORLD_UNITS_PER_MM},
};

use super::{headless::Headless, shapes::Triangles};

/// Size of the images that tests render.
pub const IMAGE: UVec2 = UVec2::splat(96);

/// A volume with folds, thin walls and hollows, 8 bits, spacing in mm.
pub fn folded_volume(dimensions: UVec3, spacing: DVec3) -> Volume {
    volume_from(dimensions, spacing, |p| {
        let r = p.length();
        let shell =
            1.0 - (r - 0.75 - 0.08 * (7.0 * p.x).sin() * (8.0 * p.y).sin() * (6.0 * p.z).sin()).abs() / 0.18;
        let rod = |across: DVec2| 1.0 - (across.length() - 0.1) / 0.15;
        let rods = rod(p.xy()).max(rod(p.yz())).max(rod(p.xz()));
        shell.max(rods)
    })
}

/// A volume of `value(p)` in [0, 1], `p` in [-1, 1]^3 over the grid.
pub fn volume_from(dimensions: UVec3, spacing: DVec3, value: impl Fn(DVec3) -> f64) -> Volume {
    let mut values = Vec::new();
    for z in 0..dimensions.z {
        for y in 0..dimensions.y {
            for x in 0..dimensions.x {
                let p = (UVec3::new(x, y, z).as_dvec3() + 0.5) / dimensions.as_dvec3() * 2.0 - 1.0;
                values.push((value(p).clamp(0.0, 1.0) * 255.0).round() as u8);
            }
        }
    }
    let grid_to_patient = DAffine3::from_scale(spacing);
    Volume::new(dimensions, grid_to_patient, Intensities::U8(values), Rescale::default())
        .expect("a valid volume")
}

/// A volume of 1 mm voxels, all of the highest intensity.
pub fn solid_volume(dimensions: UVec3) -> Volume {
    volume_from(dimensions, DVec3::ONE, |_| 1.0)
}

/// Whether an image shows the background alone: all its pixels are alike.
pub fn is_empty(image: &[u8]) -> bool {
    image.chunks(4).all(|pixel| *pixel == image[..4])
}

/// Ramp whose opacity rises around half the intensity range.
pub fn opaque_ramp() -> TransferFunction {
    TransferFunction::ramp(100.0, 160.0, 1.0, [0.9, 0.8, 0.7]).expect("a valid ramp")
}

/// Ramp that is translucent almost everywhere.
pub fn translucent_ramp() -> TransferFunction {
    TransferFunction::ramp(10.0, 240.0, 0.35, [0.6, 0.8, 0.9]).expect("a valid ramp")
}

/// Few and short rays: quick on a software driver.
pub const FEW_RAYS: OcclusionRays = OcclusionRays {
    pattern: RayPattern::Fibonacci(10),
    steps: 5,
    step_mm: Some(1.0),
    resolution: OcclusionResolution::Full,
};

/// Occlusion by few and short rays.
pub fn few_rays() -> AmbientOcclusion {
    AmbientOcclusion::by(FEW_RAYS)
}

/// Progressive occlusion by the same rays, one in every frame.
pub fn progressive_rays() -> OcclusionMethod {
    ProgressiveRays { rays: FEW_RAYS, ..default() }.into()
}

/// All methods; methods of rays use [`FEW_RAYS`].
pub fn methods_of_few_rays() -> impl Iterator<Item = OcclusionMethod> {
    OcclusionMethod::all().into_iter().map(|mut method| {
        if let Some(rays) = method.rays_mut() {
            *rays = FEW_RAYS;
        }
        method
    })
}

/// A headless app with one volume and a camera.
pub struct TestScene {
    pub headless: Headless,
    pub volume: Entity,
}

/// Number of voxels whose occlusion is known in both states and differs. Panics if almost no voxel is known in both:
/// the comparison would be empty.
pub fn count_different(a: &[Option<u8>], b: &[Option<u8>]) -> usize {
    let known = || a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
    assert!(known().count() > a.len() / 500, "of {} voxels {} are known in both", a.len(), known().count());
    known().filter(|(a, b)| a != b).count()
}

impl TestScene {
    /// Shows `volume` from three quarters.
    pub fn new(
        volume: Volume,
        function: TransferFunction,
        occlusion: AmbientOcclusion,
        mode: ShadingMode,
    ) -> Self {
        Self::with(volume, function, occlusion, mode, |_| {})
    }

    /// [`Self::new`] with more in the app.
    pub fn with(
        volume: Volume,
        function: TransferFunction,
        occlusion: AmbientOcclusion,
        mode: ShadingMode,
        setup: impl FnOnce(&mut App),
    ) -> Self {
        let headless = Headless::new(IMAGE, |app| {
            // Fine enough for volumes of 30 voxels, and quick on a software driver.
            app.insert_resource(ClipSettings { depth_map_size: 256, ..default() });
            setup(app);
        });
        Self::in_app(headless, volume, function, occlusion, mode)
    }

    /// [`Self::with`] in an existing app.
    pub fn in_app(
        mut headless: Headless,
        volume: Volume,
        function: TransferFunction,
        occlusion: AmbientOcclusion,
        mode: ShadingMode,
    ) -> Self {
        let size = (volume.dimensions().as_vec3() * volume.spacing_mm()).length();
        let camera = headless.camera();
        let world = headless.app.world_mut();
        let view = Vec3::new(0.6, 0.5, 1.2) * size * WORLD_UNITS_PER_MM;
        let near = Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() });
        world.spawn((camera, near, Transform::from_translation(view).looking_at(Vec3::ZERO, Vec3::Y)));
        let volume = world.resource_mut::<Assets<Volume>>().add(volume);
        let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
        let mut bundle = VolumeBundle::new(volume).with_transfer_function(function);
        bundle.occlusion = occlusion;
        mode.apply(&mut bundle.shading, &mut bundle.occlusion);
        // Images are compared with definitions.
        bundle.shading.ambient_scale = AmbientScale::Published;
        let volume = world.spawn(bundle).id();
        Self { headless, volume }
    }

    pub fn world(&mut self) -> &mut World {
        self.headless.app.world_mut()
    }

    /// Spawns a carver; the transform is in mm from the volume's centre.
    pub fn carve(&mut self, mesh: impl Into<Mesh>, clip_mesh: ClipMesh, transform_mm: Transform) -> Entity {
        let world = self.world();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh.into());
        world.spawn((clip_mesh, Mesh3d(mesh), in_world_units(transform_mm))).id()
    }

    /// Places the volume in the world.
    pub fn place_volume(&mut self, pose: Transform) {
        let volume = self.volume;
        self.world().entity_mut(volume).insert(pose);
    }

    pub fn move_carver(&mut self, carver: Entity, transform_mm: Transform) {
        self.world().entity_mut(carver).insert(in_world_units(transform_mm));
    }

    /// Spawns a carver made of triangles, in mm; the transform is in mm from the volume's centre.
    pub fn carve_with(&mut self, triangles: &Triangles, transform_mm: Transform) -> Entity {
        self.carve(triangles.mesh(), ClipMesh::default(), transform_mm)
    }

    /// Changes the settings of all clip cameras.
    pub fn set_clip(&mut self, change: impl FnOnce(&mut ClipSettings)) {
        change(&mut self.world().resource_mut::<ClipSettings>());
    }

    pub fn set_mode(&mut self, mode: ShadingMode) {
        self.headless.set_mode(self.volume, mode);
    }

    /// Runs frames until everything is computed.
    pub fn settle(&mut self) {
        self.headless.until_ready(self.volume).expect("the volume can be shown");
    }

    /// Occlusion of each voxel, if it is up to date and can be read; not at half resolution.
    pub fn occlusion(&self) -> Vec<Option<u8>> {
        let masks = [VoxelMask::Valid, VoxelMask::Hidden].map(|mask| self.headless.mask(self.volume, mask));
        let values = self.headless.voxels(self.volume, VolumeTexture::Occlusion).into_iter().enumerate();
        values.map(|(k, value)| (masks[0][k] && !masks[1][k]).then_some(value)).collect()
    }

    /// Whether each voxel is hidden: no drawn point reads it.
    pub fn hidden(&self) -> Vec<bool> {
        let hidden = self.headless.mask(self.volume, VoxelMask::Hidden);
        assert!(!hidden.is_empty(), "there is no volume");
        hidden
    }

    pub fn camera(&mut self) -> Entity {
        let world = self.world();
        let mut cameras = world.query_filtered::<Entity, With<Camera3d>>();
        cameras.iter(world).next().expect("the scene has a camera")
    }

    pub fn opacities(&self) -> Vec<u8> {
        let opacities = self.headless.voxels(self.volume, VolumeTexture::Opacities);
        assert!(!opacities.is_empty(), "there is no volume");
        opacities
    }

    pub fn status(&self) -> RenderStatus {
        self.headless.app.world().resource::<RenderStatus>().clone()
    }
}

/// Converts a transform in mm from a volume's centre to world units.
pub fn in_world_units(transform: Transform) -> Transform {
    Transform {
        translation: transform.translation * WORLD_UNITS_PER_MM,
        rotation: transform.rotation,
        scale: transform.scale * WORLD_UNITS_PER_MM,
    }
}
