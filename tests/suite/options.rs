//! The command line of `snapshot` and `measure`.

use bevy::prelude::*;
use bevy_contextual_ao::{
    prelude::*,
    volume::dicom::{DicomProgress, DicomReadSettings, read_dicom},
};
use clap::Parser;
use contextual_ao_kit::mode::ShadingMode;
use std::path::PathBuf;

use crate::{dicom::study, small_files::Scratch};
use crate::{
    headless::{Headless, voxel_at},
    scene::is_empty,
};
use contextual_ao_kit::{dicom::settings, scene::SceneOptions};

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

#[test]
fn series_of_dicom_are_chosen_by_number() {
    let scratch = Scratch::new("options_dicom");
    study::write(&scratch.0);
    let folder = scratch.0.to_str().expect("its name is text");
    let parts = |more: &[&str]| parse(&[&["--volume", folder], more].concat())?.parts();
    let name = |more: &[&str]| parts(more).map(|parts| (parts.name, parts.volume.dimensions().to_array()));
    // The MR has more slices in all, the CT more voxels.
    assert_eq!(name(&[]), Ok(("CT series 7".into(), [12, 8, 3])));
    assert_eq!(name(&["--series", "0"]), Ok(("MR series 7, echo time 5".into(), [6, 5, 4])));
    let echo = ["--series", "0", "--component", "1"];
    assert_eq!(name(&echo), Ok(("MR series 7, echo time 9".into(), [6, 5, 4])));
    // The files' first look is the transfer function, unless another is asked for.
    let function = |more: &[&str]| parts(more).expect("it can be read").transfer_function;
    assert!(function(&[]).is_some() && function(&[]) != function(&["--preset", "ct_bone"]));
    for (more, words) in [
        (&["--series", "2"][..], "--series 2: there are 2, counted from 0"),
        (&["--component", "1"], "--component 1: the series has 1, counted from 0"),
        (&["--budget-mib", "0", "--series", "1"], "max_bytes allows 0 MiB"),
    ] {
        let error = name(more).expect_err(words);
        assert!(error.starts_with(folder) && error.matches(folder).count() == 1, "{error}");
        assert!(error.contains(words), "{error}");
    }
    let nowhere = parse(&["--volume", "nowhere"]).and_then(|options| options.parts().map(|parts| parts.name));
    assert!(nowhere.clone().is_err_and(|error| error.starts_with("nowhere: ")), "{nowhere:?}");
}

#[test]
fn a_series_beyond_the_budget_is_halved_where_asked() {
    let scratch = Scratch::new("options_halved");
    study::write(&scratch.0);
    let listed = read_dicom(&[&scratch.0]).expect("a folder");
    let volume = &listed.series[1].volumes[0];
    let fits = |max_bytes: u64| volume.grid(&DicomReadSettings { max_bytes, ..default() }).is_ok();
    let needed = (0..1 << 20).collect::<Vec<_>>().partition_point(|&bytes| !fits(bytes)) as u64;
    let with = |max_bytes, halves| settings(volume, &VolumeBudget { max_bytes, halves });
    assert_eq!(with(needed, true).map(|settings| settings.halvings), Ok(0));
    let halved = with(needed - 1, true).expect("half of it fits");
    assert_eq!(halved.halvings, 1);
    let read = volume.read(&halved, &DicomProgress::default()).expect("it can be read");
    assert_eq!(read.dimensions(), UVec3::new(6, 4, 2));
    let refused = with(needed - 1, false).expect_err("too large");
    assert!(refused.ends_with("(option --halve)"), "{refused}");
    let refused = with(0, true).expect_err("nothing fits");
    assert!(!refused.contains("--halve"), "{refused}");
}
