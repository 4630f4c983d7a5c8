//! The readers on real files. The expected values come from nibabel, pynrrd and numpy.

use std::path::Path;

use bevy::math::{DVec3, UVec3, Vec3};
use bevy_contextual_ao::volume::{Intensities, Volume, VolumeError, read_volume_file};

use crate::needs::shared_volumes;

fn read(path: &Path) -> Volume {
    read_volume_file(path).unwrap_or_else(|error| panic!("{error}"))
}

/// The name of an outcome, for tables.
pub(crate) fn outcome(path: &Path) -> &'static str {
    match read_volume_file(path).map_err(|error| error.cause) {
        Ok(_) => "read",
        Err(VolumeError::UnknownExtension { .. }) => "extension",
        Err(VolumeError::NotThisFormat { .. }) => "format",
        Err(VolumeError::Truncated { .. }) => "truncated",
        Err(VolumeError::Dimensions { .. }) => "dimensions",
        Err(VolumeError::Field { .. }) => "field",
        Err(VolumeError::NotScalar { .. }) => "not scalar",
        Err(VolumeError::Component { .. }) => "component",
        Err(VolumeError::UnsupportedType(_)) => "type",
        Err(VolumeError::UnsupportedEncoding(_)) => "encoding",
        Err(VolumeError::Damaged { .. }) => "damaged",
        Err(VolumeError::NotANumber { .. }) => "not a number",
        Err(VolumeError::Io(_)) => "io",
        Err(_) => "other",
    }
}

/// Sum of the stored values.
fn stored_sum(volume: &Volume) -> u64 {
    match volume.intensities() {
        Intensities::U8(values) => values.iter().map(|&value| u64::from(value)).sum(),
        Intensities::U16(values) => values.iter().map(|&value| u64::from(value)).sum(),
    }
}

struct Expected {
    file: &'static str,
    dimensions: [u32; 3],
    spacing: [f32; 3],
    range: [f64; 2],
    /// Sum of the file's numbers, before any slope.
    sum: u64,
    /// Added to the file's numbers to store them.
    offset: u64,
    /// A voxel and its value in file units.
    voxel: ([u32; 3], f64),
}

#[test]
fn real_volumes_are_as_other_readers_see_them() {
    let Some(folder) = shared_volumes() else { return };
    #[rustfmt::skip]
    let table = [
        Expected { file: "engine.nii.gz", dimensions: [256, 256, 128], spacing: [1.0; 3], range: [0.0, 255.0], sum: 173_590_544, offset: 0, voxel: ([128, 128, 64], 136.0) },
        Expected { file: "bonsai.nii.gz", dimensions: [256; 3], spacing: [1.0; 3], range: [0.0, 255.0], sum: 225_901_147, offset: 0, voxel: ([128, 128, 128], 69.0) },
        Expected { file: "fuel.nii.gz", dimensions: [64, 33, 32], spacing: [1.0; 3], range: [0.0, 255.0], sum: 509_815, offset: 0, voxel: ([32, 16, 16], 189.0) },
        Expected { file: "mr_head.nii.gz", dimensions: [160, 232, 160], spacing: [1.0, 0.898_437, 0.898_437], range: [0.0, 512.000_030_279_159_5], sum: 330_743_732, offset: 0, voxel: ([80, 116, 80], 102.400_006_055_831_91) },
        Expected { file: "mr_brain_t1.nii.gz", dimensions: [124, 160, 140], spacing: [1.0; 3], range: [0.0, 252.0], sum: 123_430_146, offset: 0, voxel: ([62, 80, 70], 158.0) },
        Expected { file: "beetle/beetle.nhdr", dimensions: [138, 138, 82], spacing: [1.0; 3], range: [0.0, 2716.0], sum: 43_357_070, offset: 0, voxel: ([60, 70, 40], 387.0) },
        Expected { file: "tooth/tooth.nhdr", dimensions: [103, 94, 161], spacing: [1.0; 3], range: [0.0, 1300.0], sum: 821_287_590, offset: 0, voxel: ([50, 40, 80], 832.0) },
        Expected { file: "ct_head.nrrd", dimensions: [256, 256, 94], spacing: [0.9375, 0.9375, 1.5], range: [0.0, 4095.0], sum: 3_106_404_771, offset: 32_768, voxel: ([85, 85, 47], 1616.0) },
        Expected { file: "ct_torso_half.nrrd", dimensions: [256, 132, 225], spacing: [2.0; 3], range: [0.0, 248.0], sum: 416_856_532, offset: 0, voxel: ([128, 66, 112], 80.0) },
        Expected { file: "cases/meta_image/HeadMRVolume.mhd", dimensions: [48, 62, 42], spacing: [4.0; 3], range: [0.0, 255.0], sum: 3_058_332, offset: 0, voxel: ([24, 31, 21], 79.0) },
        Expected { file: "cases/meta_image/frogtissue.mhd", dimensions: [500, 470, 136], spacing: [1.0, 1.0, 1.5], range: [0.0, 29.0], sum: 12_279_472, offset: 0, voxel: ([250, 235, 68], 6.0) },
    ];
    for expected in table {
        let file = expected.file;
        let volume = read(&folder.join(file));
        let spacing = Vec3::from_array(expected.spacing);
        assert_eq!(volume.dimensions(), UVec3::from_array(expected.dimensions), "{file}");
        assert!(volume.spacing_mm().abs_diff_eq(spacing, 1e-5), "{file}: {}", volume.spacing_mm());
        for (found, expected) in volume.range().into_iter().zip(expected.range) {
            assert!((found - expected).abs() < 1e-6, "{file}: {found}");
        }
        let sum = stored_sum(&volume) - expected.offset * volume.voxel_count();
        assert_eq!(sum, expected.sum, "{file}");
        let (voxel, value) = expected.voxel;
        let found = volume.value_at(UVec3::from_array(voxel)).unwrap();
        assert!((found - value).abs() < 1e-6, "{file}: {found}");
        assert_eq!(volume.value_at(volume.dimensions()), None, "{file}");
    }
}

#[test]
fn float_volume_is_quantised_within_half_a_step() {
    let Some(folder) = shared_volumes() else { return };
    let volume = read(&folder.join("cases/nifti/zstat1.nii.gz"));
    assert_eq!(volume.dimensions(), UVec3::new(64, 64, 21));
    // The qform of this file mirrors x.
    let x = volume.grid_to_patient().matrix3.x_axis;
    assert!(x.abs_diff_eq(DVec3::new(-4.0, 0.0, 0.0), 1e-6), "{x}");
    let range = [-8.710_750_579_833_984, 18.582_529_067_993_164];
    let half_step = (range[1] - range[0]) / 65_535.0 / 2.0 + 1e-9;
    let voxels = [
        ([32, 32, 10], -1.285_267_353_057_861_3),
        ([21, 21, 10], 0.712_809_622_287_750_2),
        ([40, 20, 5], 1.494_624_019_168_629),
    ];
    for (voxel, value) in voxels {
        let found = volume.value_at(UVec3::from_array(voxel)).unwrap();
        assert!((found - value).abs() < half_step, "{voxel:?}: {found}");
    }
    for (found, expected) in volume.range().into_iter().zip(range) {
        assert!((found - expected).abs() < 1e-9, "{found}");
    }
}

#[test]
fn axis_orders_show_the_same_head() {
    let Some(folder) = shared_volumes() else { return };
    // Places in the patient, and the stored values that nibabel finds there.
    let places = [([0.0, 10.0, 20.0], 201), ([-20.0, -30.0, 10.0], 183), ([30.0, 20.0, -10.0], 159)];
    for order in ["RAS", "LPI", "ASR", "SAL"] {
        let volume = read(&folder.join(format!("cases/axis_orders/{order}.nii.gz")));
        for (place, stored) in places {
            let to_grid = volume.grid_to_patient().inverse();
            let voxel = to_grid.transform_point3(DVec3::from_array(place)).round();
            let value = volume.value_at(voxel.as_uvec3()).unwrap();
            let found = volume.to_stored(value).round();
            assert_eq!(found, f64::from(stored), "{order} at {place:?}");
        }
    }
}

#[test]
fn labels_lie_on_their_head() {
    let Some(folder) = shared_volumes() else { return };
    // The head is a NIfTI file in RAS. Its label map is a NRRD file in LPS, which runs the other way along x and y.
    // Opposite corners of the grids are one place in the patient.
    let head = read(&folder.join("mr_head.nii.gz"));
    let brain = read(&folder.join("mr_head_labels/Brain.nrrd"));
    assert_eq!(head.dimensions(), brain.dimensions());
    assert_eq!(brain.range(), [0.0, 1.0]);
    let corner = DVec3::new(159.0, 231.0, 0.0);
    for (of_head, of_brain) in [(DVec3::ZERO, corner), (corner, DVec3::ZERO)] {
        let head = head.grid_to_patient().transform_point3(of_head);
        let brain = brain.grid_to_patient().transform_point3(of_brain);
        assert!(head.abs_diff_eq(brain, 1e-3), "{head} {brain}");
    }
}

#[test]
fn every_encoding_of_the_ball_is_the_same_volume() {
    let Some(folder) = shared_volumes() else { return };
    let ball = |name: &str| {
        read(
            &folder.join("cases/nrrd/BallBinary30x30x30").with_file_name(format!("BallBinary30x30x30{name}")),
        )
    };
    let first = ball(".nrrd");
    assert_eq!(first.dimensions(), UVec3::splat(30));
    assert_eq!(stored_sum(&first) - 32_768 * 27_000, 3_682_296);
    assert_eq!(first.value_at(UVec3::splat(15)), Some(257.0));
    assert_eq!(first.value_at(UVec3::new(5, 10, 20)), Some(257.0));
    assert_eq!(first.value_at(UVec3::ZERO), Some(0.0));
    for name in [
        ".nhdr",
        "_byteskip_minus_one.nhdr",
        "_byteskip_minus_one_nifti.nhdr",
        "_gz.nrrd",
        "_gz_byteskip_minus_one.nrrd",
        "_gz_lineskip.nrrd",
        ".nii.gz",
    ] {
        assert!(ball(name) == first, "{name}");
    }
}

#[test]
fn every_number_type_reads_the_same() {
    let Some(folder) = shared_volumes() else { return };
    for name in
        ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"]
    {
        let volume = read(&folder.join(format!("cases/nifti/{name}.nii")));
        let values: Vec<f64> = (0..27u32)
            .map(|at| UVec3::new(at % 3, at / 3 % 3, at / 9))
            .map(|voxel| volume.value_at(voxel).unwrap())
            .collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let expected: Vec<f64> = (0..27).map(f64::from).collect();
        assert_eq!(sorted, expected, "{name}");
        assert_eq!((values[13], values[26]), (13.0, 26.0), "{name}");
    }
}

#[test]
fn every_case_has_its_outcome() {
    let Some(folder) = shared_volumes() else { return };
    let not_read = [
        ("nifti/3D.nii", "not scalar"),
        ("nifti/4D.nii", "not scalar"),
        ("nifti/complex32.nii", "not scalar"),
        ("nifti/complex64.nii", "not scalar"),
        ("nifti/minimal_extended_hdr.nii", "dimensions"),
        ("nifti/avg152T1_LR_nifti.hdr.gz", "io"),
        ("nifti/crash-1.nii", "format"),
        ("nifti/crash-ed7d46344d7efb3b9f0c374d66d2e02f66cc447d.nii", "format"),
        ("nrrd/BallBinary30x30x30_bz2.nrrd", "encoding"),
        ("nrrd/BallBinary30x30x30_byteskip_minus_five.nhdr", "field"),
        ("nrrd/test1d_ascii.nrrd", "dimensions"),
        ("nrrd/test2d_ascii.nrrd", "dimensions"),
        ("nrrd/test_customFields.nrrd", "dimensions"),
        ("found/eltype_rgb_u8.nrrd", "not scalar"),
    ];
    let data_only = [".raw", ".zraw", ".img", ".img.gz"];
    let mut cases = 0;
    for format in ["axis_orders", "found", "meta_image", "nifti", "nrrd"] {
        for entry in std::fs::read_dir(folder.join("cases").join(format)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let name = format!("{format}/{name}");
            let known = not_read.iter().find(|(case, _)| *case == name);
            let expected = match known {
                Some((_, outcome)) => outcome,
                None if data_only.iter().any(|ending| name.ends_with(ending)) => "extension",
                None if !name.contains('.') => "extension",
                None => "read",
            };
            assert_eq!(outcome(&path), expected, "{name}");
            cases += 1;
        }
    }
    assert!(cases >= 40, "only {cases} cases found");
}

#[test]
fn files_that_were_read_wrongly_are_read_rightly() {
    let Some(folder) = shared_volumes() else { return };
    let stack = read(&folder.join("cases/found/fiji-stack-microns-16bit.nrrd"));
    let spacing = Vec3::new(0.0004, 0.0004, 0.002);
    // Spacings are rounded to f32.
    assert!(stack.spacing_mm().abs_diff_eq(spacing, 1e-9), "{}", stack.spacing_mm());

    let moved = read(&folder.join("cases/found/resampled_anat_moved.nii"));
    assert_eq!(moved.dimensions(), UVec3::new(17, 21, 3));
    assert_eq!(moved.background_voxels(), 153);
    let range = [409.300_445_556_640_6, 13_360.961_914_062_5];
    for (found, expected) in moved.range().into_iter().zip(range) {
        assert!((found - expected).abs() < 1e-9, "{found}");
    }
    assert_eq!(moved.value_at(UVec3::ZERO), Some(moved.range()[0]));
    let half_step = (range[1] - range[0]) / 65_535.0 / 2.0 + 1e-9;
    let value = moved.value_at(UVec3::new(8, 10, 1)).unwrap();
    assert!((value - 10_849.904_296_875).abs() < half_step, "{value}");

    let colors = read_volume_file(&folder.join("cases/found/eltype_rgb_u8.nrrd")).unwrap_err().to_string();
    assert!(colors.contains("a colour image (NRRD kind RGB-color), 3 values per voxel"), "{colors}");
}

#[test]
fn crash_files_are_refused_under_every_name() {
    let Some(folder) = shared_volumes() else { return };
    let scratch = super::small_files::Scratch::new("crash");
    let mut cases = 0;
    for entry in std::fs::read_dir(folder.join("cases/nifti")).unwrap() {
        let path = entry.unwrap().path();
        if !path.to_string_lossy().contains("crash-") {
            continue;
        }
        let bytes = std::fs::read(&path).unwrap();
        cases += 1;
        for name in ["a.nii", "a.nii.gz", "a.hdr", "a.nrrd", "a.mha"] {
            assert_eq!(outcome(&scratch.write(name, &bytes)), "format", "{path:?} as {name}");
        }
    }
    assert!(cases >= 2, "only {cases} files found");
}
