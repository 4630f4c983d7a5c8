//! Voxels that are NaN or infinite become background, and are counted.

use bevy::math::UVec3;
use bevy_contextual_ao::volume::{Volume, VolumeError, read_volume_file};

use super::small_files::{Scratch, mha, nifti, nrrd, with};

const NAN: f32 = f32::NAN;
const INFINITY: f32 = f32::INFINITY;

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// All values along x.
fn values(volume: &Volume) -> Vec<f64> {
    (0..volume.dimensions().x).map(|x| volume.value_at(UVec3::new(x, 0, 0)).unwrap()).collect()
}

#[test]
fn what_is_no_number_is_background() {
    let scratch = Scratch::new("background");
    let float = |values: &[f32]| nifti(&[values.len() as i16, 1, 1], 16, &bytes(values));
    let slope = |slope: f32, file| with(file, 112, &slope.to_le_bytes());
    let big = |values: &[f64]| {
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        let fields = format!("type: double\nendian: big\nsizes: {} 1 1\n", values.len());
        nrrd(&fields, &data)
    };
    let text = nrrd("type: float\nencoding: text\nsizes: 4 1 1\n", b"nan -5.25 -inf 2.5");
    #[rustfmt::skip]
    let files = [
        // In Hounsfield units, the background is air.
        ("ct.nii", float(&[NAN, -1000.0, 40.5, NAN, 3000.0]), vec![-1000.0, -1000.0, 40.5, -1000.0, 3000.0], 2),
        // Infinities count as NaN.
        ("infinite.nii", float(&[INFINITY, 2.5, -INFINITY, 7.5]), vec![2.5, 2.5, 2.5, 7.5], 2),
        // Labels start at one, so the background is zero, not the first label.
        ("labels.nii", float(&[1.0, NAN, 2.0, 3.0]), vec![1.0, 0.0, 2.0, 3.0], 1),
        ("signed.nii", float(&[-2.0, NAN, 3.0]), vec![-2.0, -2.0, 3.0], 1),
        // Far from zero, the background is the lowest value. The range is not stretched to zero.
        ("far.nii", float(&[1e6, NAN, 1e6 + 1.0]), vec![1e6, 1e6, 1e6 + 1.0], 1),
        // The background is the lowest value in the file's unit, which falls as the stored numbers rise.
        ("falling.nii", slope(-2.0, float(&[1.0, NAN, 3.0])), vec![-2.0, -6.0, -6.0], 1),
        ("rising.nii", slope(2.0, float(&[1.5, NAN, 3.0])), vec![3.0, 3.0, 6.0], 1),
        ("one.nii", float(&[0.25, NAN]), vec![0.25, 0.25], 1),
        ("a.nrrd", big(&[f64::NAN, 0.5, 1.5]), vec![0.5, 0.5, 1.5], 1),
        ("text.nrrd", text, vec![-5.25, -5.25, -5.25, 2.5], 2),
        ("a.mha", mha("ElementType = MET_FLOAT\nDimSize = 3 1 1\n", &bytes(&[NAN, 0.5, 1.5])), vec![0.5, 0.5, 1.5], 1),
        ("none.nii", float(&[0.5, 1.5]), vec![0.5, 1.5], 0),
    ];
    for (name, file, expected, count) in files {
        let volume = read_volume_file(&scratch.write(name, &file)).unwrap_or_else(|error| panic!("{error}"));
        // Half a step, of 65535 steps over the values' range.
        let [low, high] = volume.range();
        let tolerance = (high - low) / 65_535.0 / 2.0 + 1e-9;
        for (found, expected) in values(&volume).into_iter().zip(expected) {
            assert!((found - expected).abs() <= tolerance, "{name}: {found}, not {expected}");
        }
        assert_eq!(volume.background_voxels(), count, "{name}");
    }
}

#[test]
fn nothing_but_nan_is_an_error() {
    let scratch = Scratch::new("only_nan");
    let file = nifti(&[3, 1, 1], 16, &bytes(&[NAN, INFINITY, NAN]));
    let error = read_volume_file(&scratch.write("a.nii", &file)).unwrap_err();
    assert!(matches!(error.cause, VolumeError::NotANumber { count: 3 }), "{error}");
    assert!(error.to_string().contains("all 3 voxels are NaN or infinite"), "{error}");
}
