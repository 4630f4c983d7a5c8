//! Presets of transfer functions: named, valid for any volume, and fitted to its values and size.

use bevy::math::{DAffine3, DVec3, UVec3};
use bevy_contextual_ao::volume::{Intensities, Preset, Rescale, Volume};

/// A row of voxels with the given stored values.
fn volume(values: &[u16], rescale: Rescale, spacing_mm: f64) -> Volume {
    let size = UVec3::new(values.len() as u32, 1, 1);
    let grid = DAffine3::from_scale(DVec3::splat(spacing_mm));
    Volume::new(size, grid, Intensities::U16(values.to_vec()), rescale).unwrap()
}

/// A CT, mostly of air. Air is stored as 24. Tissue is stored as 1124, and bone as 2024.
fn ct(rescale: Rescale) -> Volume {
    let values: Vec<u16> = [24; 60].into_iter().chain([1124; 35]).chain([2024; 5]).collect();
    volume(&values, rescale, 1.0)
}

const HOUNSFIELD: Rescale = Rescale { slope: 1.0, intercept: -1024.0 };

#[test]
fn presets_are_found_by_name() {
    for preset in Preset::ALL {
        assert_eq!(preset.name().parse(), Ok(preset));
    }
    let error = "ct_bones".parse::<Preset>().unwrap_err();
    assert!(error.contains("`ct_bones`") && error.contains("ct_lung, mr_head"), "{error}");
}

#[test]
fn every_preset_is_valid_for_every_volume() {
    let rescales = [(1.0, 0.0), (-1.0, 0.0), (-2.0, 1e30), (1e-30, 0.0), (1e300, 0.0)]
        .map(|(slope, intercept)| Rescale { slope, intercept });
    for values in [&[0][..], &[7; 20], &[0, 65535], &[0, 0, 1, 2, 3, 65535]] {
        for rescale in rescales {
            for spacing in [1e-30, 1.0, 1e30] {
                let volume = volume(values, rescale, spacing);
                for preset in Preset::ALL {
                    let function = preset.transfer_function(&volume);
                    assert!(function.validate().is_ok(), "{preset} {values:?} {rescale:?}: {function:?}");
                }
            }
        }
    }
}

#[test]
fn ct_presets_show_what_they_say() {
    let volume = ct(HOUNSFIELD);
    // In HU: air, lung, fat, muscle, contrast agent, hard bone.
    let tissues = [-1000.0, -750.0, -90.0, 50.0, 300.0, 1200.0];
    for (preset, shown) in [
        (Preset::CtBone, [false, false, false, false, true, true]),
        (Preset::CtSoftTissue, [false, false, true, true, true, true]),
        (Preset::CtVessels, [false, false, false, false, true, true]),
        (Preset::CtLung, [false, true, false, false, false, true]),
    ] {
        let function = preset.transfer_function(&volume);
        assert_eq!(tissues.map(|value| function.sample(value)[3] > 0.0), shown, "{preset}");
    }
    let vessels = Preset::CtVessels.transfer_function(&volume);
    let [contrast, bone] = [300.0, 1200.0].map(|value| vessels.sample(value));
    // Contrast agent is red, bone is white.
    assert!(contrast[0] > 4.0 * contrast[1] && bone[0] < 1.2 * bone[1], "{contrast:?} {bone:?}");
}

#[test]
fn ct_without_negative_values_is_calibrated_by_its_air_and_tissue() {
    let in_hounsfield = Preset::CtBone.transfer_function(&ct(HOUNSFIELD));
    assert_eq!(in_hounsfield.points[0].value, 180.0);
    // Values are as stored, or squeezed as in eight bits.
    for (slope, intercept) in [(1.0, 0.0), (0.1, 5.0)] {
        let raw = Preset::CtBone.transfer_function(&ct(Rescale { slope, intercept }));
        for (raw, point) in raw.points.iter().zip(&in_hounsfield.points) {
            let expected = slope as f32 * (point.value + 1024.0) + intercept as f32;
            // A bin of the histogram is 900/64 HU wide. The value 1300 HU lies 2300/1100 times as far from air
            // as tissue.
            assert!((raw.value - expected).abs() < 30.0 * slope as f32, "{} is not {expected}", raw.value);
        }
    }
}

#[test]
fn ct_of_eight_bits_shows_its_bones_alone() {
    // Air is around 3. Fat and muscle are around 88, hardly any beyond 112. A little bone goes up to 240.
    let hill = |value: u16| 200u16.saturating_sub(value.abs_diff(88).pow(2) / 3);
    let tissue = (60..116).flat_map(|value| vec![value; hill(value).into()]);
    let values: Vec<u16> = [3; 9000].into_iter().chain(tissue).chain(120..240).collect();
    let bone = Preset::CtBone.transfer_function(&volume(&values, Rescale::default(), 1.0));
    assert_eq!([3.0, 88.0, 108.0].map(|value| bone.sample(value)[3]), [0.0; 3]);
    assert!(bone.sample(180.0)[3] > 0.9, "{bone:?}");
}

#[test]
fn mr_presets_follow_the_intensities() {
    let values: Vec<u16> = [2; 50].into_iter().chain((0..=400).map(|k| 100 + k)).collect();
    for preset in [Preset::MrHead, Preset::MrAngiography] {
        let [one, three] = [1.0, 3.0]
            .map(|slope| preset.transfer_function(&volume(&values, Rescale { slope, intercept: 0.0 }, 1.0)));
        for (one, three) in one.points.iter().zip(&three.points) {
            assert!((3.0 * one.value - three.value).abs() <= 1e-6 * three.value.abs());
        }
    }
    let angiography = Preset::MrAngiography.transfer_function(&volume(&values, Rescale::default(), 1.0));
    // Value 300 is the median of the bright values. Value 499 is next to the brightest.
    assert_eq!(angiography.sample(300.0)[3], 0.0);
    assert!(angiography.sample(499.0)[3] > 0.9);
}

#[test]
fn opacity_follows_the_size_of_the_volume() {
    let unit = |spacing_mm| {
        Preset::CtBone.transfer_function(&volume(&[0; 350], HOUNSFIELD, spacing_mm)).opacity_unit_distance_mm
    };
    // The diagonal of 350 voxels in a row is hardly longer than the row.
    assert!((unit(1.0) - 1.0).abs() < 1e-5 && (unit(0.004) - 0.004).abs() < 1e-7);
}
