//! The command line of `snapshot` and `measure`.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use clap::Parser;
use contextual_ao_kit::mode::ShadingMode;
use std::path::PathBuf;

use crate::{
    headless::{Headless, voxel_at},
    scene::is_empty,
};
use contextual_ao_kit::scene::SceneOptions;

#[derive(Parser)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
}

fn parse(arguments: &[&str]) -> Result<SceneOptions, String> {
    let arguments = ["test", "--size", "48x48"].iter().chain(arguments);
    Options::try_parse_from(arguments).map(|options| options.scene).map_err(|error| error.to_string())
}

/// Renders a scene.
fn render(arguments: &[&str]) -> Result<Vec<u8>, String> {
    let options = parse(arguments)?;
    let mut headless = Headless::new(options.size, |_| {});
    let scene = options.spawn(&mut headless)?;
    headless.set_mode(scene.volume, ShadingMode::Solid);
    headless.until_ready(scene.volume)?;
    Ok(headless.image())
}

/// Writes a ball of `voxels` voxels along each side, with values from 0 to 250.
fn write_ball(name: &str, voxels: u32, spacing_mm: f64) -> PathBuf {
    let path = std::env::temp_dir().join(format!("bevy_contextual_ao_{name}_{}.nrrd", std::process::id()));
    let header = format!(
        "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: {voxels} {voxels} {voxels}\nspacings: {spacing_mm} \
         {spacing_mm} {spacing_mm}\nencoding: raw\n\n"
    );
    let value = |index| {
        let away = (voxel_at(index, UVec3::splat(voxels)).as_vec3() + 0.5) / voxels as f32 - 0.5;
        (250.0 - 500.0 * away.length()).clamp(0.0, 250.0) as u8
    };
    let bytes = header.into_bytes().into_iter().chain((0..voxels.pow(3)).map(value));
    std::fs::write(&path, bytes.collect::<Vec<_>>()).expect("write");
    path
}

#[test]
fn a_volume_beyond_the_budget_is_halved_where_asked() {
    let path = write_ball("budget", 128, 1.0);
    let volume = ["--volume", path.to_str().expect("its name is text")];
    let with = |more: &[&str]| render(&[&volume[..], more].concat());
    // The volume takes 8 MiB, or 20 in wider formats. The depth maps take 21 MiB.
    let refused = with(&["--budget-mib", "25"]).expect_err("too large");
    assert!(refused.contains("25 MiB") && refused.ends_with("(option --halve)"), "{refused}");
    assert!(!is_empty(&with(&["--budget-mib", "25", "--halve"]).expect("half of it fits")));
    assert!(!is_empty(&with(&["--budget-mib", "45"]).expect("it fits")));
    let options = parse(&["--budget-mib", "3", "--halve"]).expect("both can be given");
    let budget = options.budget.budget();
    assert_eq!((budget.max_bytes, budget.halves), (3 << 20, true));
    assert_eq!(parse(&[]).expect("nothing need be given").budget.budget(), VolumeBudget::default());
}

#[test]
fn scenes_of_any_size_are_in_view() {
    for spacing_mm in [1e-3, 1.0, 1e3] {
        let path = write_ball("any_size", 24, spacing_mm);
        let image = render(&["--volume", path.to_str().expect("its name is text")]).expect("it can be shown");
        assert!(!is_empty(&image), "voxels of {spacing_mm} mm");
    }
}

#[test]
fn presets_are_chosen_by_name() {
    let path = write_ball("presets", 24, 1.0);
    let volume = ["--volume", path.to_str().expect("its name is text")];
    let options = parse(&[&volume[..], &["--preset", "mr_head"]].concat()).expect("a preset");
    let parts = options.parts().expect("the file can be read");
    assert_eq!(parts.transfer_function, Some(Preset::MrHead.transfer_function(&parts.volume)));
    let unknown = parse(&["--preset", "ct_brain"]).expect_err("no such preset");
    assert!(unknown.contains("ct_bone"), "{unknown}");
    assert!(parse(&["--preset", "ct_bone", "--transfer-function", "ramp:0,1,1"]).is_err());
}
