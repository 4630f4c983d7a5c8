//! Hashes of images and voxels of small scenes, by every method in every mode. Two commits that print the same lines
//! on one driver draw and compute the same, bit for bit.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{
        DensityEstimate, GeometryTerm, OcclusionFiltering, OcclusionResolution, OcclusionSweeping,
        OpacityModulation, SummedAreaOcclusion, SweepingSurface,
    },
    prelude::*,
    render::VolumeTexture,
};
use contextual_ao_kit::mode::ShadingMode;
use std::hash::{DefaultHasher, Hash, Hasher};

use contextual_ao_kit::small_scene::{FEW_RAYS, TestScene, folded_volume, opaque_ramp, translucent_ramp};

/// Settings of occlusion, with a name.
struct Setup {
    name: &'static str,
    occlusion: AmbientOcclusion,
}

fn setups() -> Vec<Setup> {
    use OcclusionMethod::{Directional, Filtering, Progressive, Rays, ScreenSpace, SummedArea, Sweeping};
    let setup = |name, method| Setup { name, occlusion: AmbientOcclusion::by(method) };
    let sweeping =
        |surface, geometry_term| Sweeping(OcclusionSweeping { surface, geometry_term, ..default() });
    let filtering =
        |estimate, modulation| Filtering(OcclusionFiltering { estimate, modulation, ..default() });
    let opacity = SweepingSurface::Opacity;
    let few = ProgressiveRays { rays: FEW_RAYS, ..default() };
    let kept = ProgressiveRays { rays_per_frame: 3, kept_on_change: 0.5, ..few };
    let mut all = vec![
        setup("rays", Rays(FEW_RAYS)),
        setup("progressive", Progressive(few)),
        setup("progressive_kept", Progressive(kept)),
        setup("sweeping", Sweeping(default())),
        setup("sweeping_cosine", sweeping(opacity, GeometryTerm::Cosine)),
        setup("sweeping_both_sides", sweeping(opacity, GeometryTerm::BothSides)),
        setup("sweeping_isovalue", sweeping(SweepingSurface::Isovalue(128.0), GeometryTerm::None)),
        setup("sweeping_isosurface", sweeping(SweepingSurface::Isosurface(128.0), GeometryTerm::Cosine)),
        setup("filtering", Filtering(default())),
        setup("filtering_gradient", filtering(DensityEstimate::Chebyshev, OpacityModulation::Gradient(0.1))),
        setup("filtering_variance", filtering(DensityEstimate::Power, OpacityModulation::Variance(0.05))),
        setup("filtering_gaussian", filtering(DensityEstimate::Gaussian, OpacityModulation::None)),
        setup("summed_area", SummedArea(SummedAreaOcclusion { shells: 1, ..default() })),
        setup("summed_area_shells", SummedArea(default())),
        setup("screen_space", ScreenSpace(default())),
        setup("directional", Directional(default())),
    ];
    let half = OcclusionRays { resolution: OcclusionResolution::Half, ..FEW_RAYS };
    all.push(setup("rays_half", Rays(half)));
    let sky = AmbientOcclusion { sky: Sky::above(Vec3::Y), ..AmbientOcclusion::by(FEW_RAYS) };
    all.push(Setup { name: "rays_sky", occlusion: sky.clone() });
    all.push(Setup {
        name: "sweeping_sky",
        occlusion: AmbientOcclusion { method: Sweeping(default()), ..sky },
    });
    all
}

/// Prints a line for every state of every scene.
pub fn run() -> Result<(), String> {
    for (look, function) in [("opaque", opaque_ramp()), ("translucent", translucent_ramp())] {
        for Setup { name, occlusion } in setups() {
            let volume = folded_volume(UVec3::new(31, 28, 26), DVec3::new(1.0, 1.1, 1.3));
            let mut scene = TestScene::new(volume, function.clone(), occlusion, ShadingMode::Cao);
            let at = |x: f32| Transform::from_xyz(x, 5.0, 9.0).with_scale(Vec3::splat(9.0));
            let carver = scene.carve(Sphere::new(1.0), ClipMesh::default(), at(4.0));
            let keeps = Transform::from_xyz(0.0, 0.0, 2.0).with_scale(Vec3::splat(34.0));
            scene.carve(Torus::new(0.2, 0.6), ClipMesh::intersect(), keeps);
            scene.settle();
            for mode in ShadingMode::ALL {
                scene.set_mode(mode);
                for (frame, x) in [4.0, 4.6, 5.9, 5.9].into_iter().enumerate() {
                    scene.move_carver(carver, at(x));
                    scene.headless.frame();
                    let headless = &scene.headless;
                    let of_voxels = |which| hash(&headless.texels(scene.volume, which));
                    println!(
                        "{look} {name} {} {frame}: image {:016x} opacities {:016x} occlusion {:016x}",
                        mode.name(),
                        hash(&headless.image()),
                        of_voxels(VolumeTexture::Opacities),
                        of_voxels(VolumeTexture::Occlusion),
                    );
                }
            }
        }
    }
    Ok(())
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}
