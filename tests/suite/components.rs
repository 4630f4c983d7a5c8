//! Images with more than one number per voxel are refused by their kind, or read one volume at a time.

use std::path::Path;

use bevy::math::UVec3;
use bevy_contextual_ao::volume::{
    Intensities, Volume, VolumeError, VolumeFileError, VolumeReadSettings, read_volume_file,
    read_volume_file_with,
};

use super::small_files::{Scratch, gzip, mha, nifti, nrrd, with, zlib};

/// Reads a component.
fn component(path: &Path, component: u32) -> Result<Volume, VolumeFileError> {
    read_volume_file_with(path, &VolumeReadSettings { component: Some(component), ..Default::default() })
}

/// Three volumes of 2x3x4 voxels, whose values count on from one volume to the next. In the file, `axes_before` axes
/// of the grid come before the axis of the volumes.
fn three_volumes(axes_before: usize) -> Vec<u8> {
    let run: usize = [2, 3, 4][..axes_before].iter().product();
    let runs = 24 / run;
    let voxel = |volume: usize, index: usize| (24 * volume + index) as u8;
    let run_of = |at: usize| (0..run).map(move |index| voxel(at % 3, at / 3 * run + index));
    (0..3 * runs).flat_map(run_of).collect()
}

#[test]
fn one_volume_of_several_is_chosen() {
    let scratch = Scratch::new("components");
    let [first, second, third, last] = [0, 1, 2, 3].map(three_volumes);
    let text: String = third.iter().map(|value| format!("{value} ")).collect();
    let junk = [&[9; 7], last.as_slice()].concat();
    let sizes = |sizes: &str| format!("dimension: 4\nsizes: {sizes}\n");
    let (before, after) = (sizes("3 2 3 4"), sizes("2 3 4 3"));
    let list = format!("{before}kinds: list domain domain domain\n");
    let directions = "space directions: none (1,0,0) (0,1,0) (0,0,1)\n";
    let meta = "NDims = 4\nDimSize = 2 3 4 3\n";
    let matrix =
        "TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nOffset = 0 0 0 0\nElementSpacing = 1 1 1 5\n";
    let nii = nifti(&[2, 3, 4, 3], 2, &last);
    #[rustfmt::skip]
    let files = [
        ("time.nii", nii.clone(), "time"),
        ("time.nii.gz", gzip(&nii), "time"),
        ("five.nii", nifti(&[2, 3, 4, 1, 3], 2, &last), "beyond the fourth"),
        ("list.nrrd", nrrd(&list, &first), "list"),
        ("none.nrrd", nrrd(&format!("{before}{directions}"), &first), "along axis 1"),
        ("time.nrrd", nrrd(&format!("{}kinds: space time space space\n", sizes("2 3 3 4")), &second), "time"),
        ("third.nrrd", nrrd(&format!("{}kinds: space space list space\n", sizes("2 3 3 4")), &third), "list"),
        ("last.nrrd", nrrd(&after, &last), "along axis 4"),
        ("kinds.nrrd", nrrd(&format!("{after}kinds: domain domain domain domain\n"), &last), "along axis 4"),
        ("single.nrrd", nrrd("dimension: 5\nsizes: 3 1 2 3 4\nkinds: list stub domain domain domain\n", &first), "list"),
        ("gz.nrrd", nrrd(&format!("{list}encoding: gzip\n"), &gzip(&first)), "list"),
        ("gzend.nrrd", nrrd(&format!("{after}encoding: gzip\nbyte skip: -1\n"), &gzip(&junk)), "along axis 4"),
        ("end.nrrd", nrrd(&format!("{after}byte skip: -1\n"), &junk), "along axis 4"),
        ("skip.nrrd", nrrd(&format!("{after}byte skip: 7\n"), &junk), "along axis 4"),
        ("text.nrrd", nrrd(&format!("{}kinds: space space list space\nencoding: text\n", sizes("2 3 3 4")), text.as_bytes()), "list"),
        ("time.mha", mha(meta, &last), "along the fourth axis"),
        ("zlib.mha", mha(&format!("{meta}{matrix}CompressedData = True\n"), &zlib(&last)), "along the fourth axis"),
    ];
    for (name, bytes, along) in files {
        let path = scratch.write(name, &bytes);
        let message = read_volume_file(&path).unwrap_err().to_string();
        for part in ["3 volumes", along, "choose one by its component, 0 to 2"] {
            assert!(message.contains(part), "{name}: {message}");
        }
        for index in 0..3u32 {
            let volume = component(&path, index).unwrap_or_else(|error| panic!("{error}"));
            let expected = (0..24).map(|voxel| (24 * index + voxel) as u8).collect();
            assert_eq!(volume.dimensions(), UVec3::new(2, 3, 4), "{name}");
            assert!(*volume.intensities() == Intensities::U8(expected), "{name}: component {index}");
        }
        let message = component(&path, 3).unwrap_err().to_string();
        assert!(
            message.contains("none of them component 3") && message.contains("0 to 2"),
            "{name}: {message}"
        );
    }
}

#[test]
fn a_single_volume_is_its_only_component() {
    let scratch = Scratch::new("single");
    let data: Vec<u8> = (0..24).collect();
    let files = [
        ("a.nii", nifti(&[2, 3, 4], 2, &data)),
        ("a.nrrd", nrrd("dimension: 4\nsizes: 1 2 3 4\nkinds: vector domain domain domain\n", &data)),
        ("a.mha", mha("NDims = 4\nDimSize = 2 3 4 1\n", &data)),
    ];
    for (name, bytes) in files {
        let path = scratch.write(name, &bytes);
        let volume = read_volume_file(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(component(&path, 0).unwrap() == volume, "{name}");
        let refused = component(&path, 1).unwrap_err().cause;
        assert!(
            matches!(refused, VolumeError::Component { count: 1, chosen: Some(1), .. }),
            "{name}: {refused}"
        );
    }
}

#[test]
fn claims_of_more_than_a_file_can_hold_are_refused() {
    let scratch = Scratch::new("many");
    let files = [
        ("a.nrrd", nrrd("dimension: 4\nsizes: 2 3 4 18446744073709551615\n", &[0; 24])),
        ("a.mha", mha("NDims = 4\nDimSize = 2 3 4 18446744073709551615\n", &[0; 24])),
    ];
    for (name, bytes) in files {
        let error = component(&scratch.write(name, &bytes), 0).unwrap_err();
        assert!(matches!(error.cause, VolumeError::Dimensions { .. }), "{error}");
    }
}

#[test]
fn numbers_have_their_width_in_every_component() {
    let scratch = Scratch::new("wide_components");
    // Two volumes of 2x1x1 voxels, interleaved and big-endian.
    let data = [1u16, 1000, 2, 2000].map(u16::to_be_bytes).concat();
    let fields = "type: ushort\nendian: big\ndimension: 4\nsizes: 2 2 1 1\nkinds: list space space space\n";
    let path = scratch.write("a.nrrd", &nrrd(fields, &data));
    for (index, expected) in [(0, vec![1, 2]), (1, vec![1000, 2000])] {
        assert!(*component(&path, index).unwrap().intensities() == Intensities::U16(expected));
    }
    // A truncated file still holds the components before the cut.
    let last: Vec<u8> = (0..60).collect();
    let path = scratch.write("cut.nii", &nifti(&[2, 3, 4, 3], 2, &last));
    assert_eq!(component(&path, 1).unwrap().value_at(UVec3::ZERO), Some(24.0));
    let error = component(&path, 2).unwrap_err();
    assert!(matches!(error.cause, VolumeError::Truncated { expected_bytes: 24, found_bytes: 12 }), "{error}");
}

#[test]
fn images_of_several_values_per_voxel_are_refused_by_what_they_are() {
    let scratch = Scratch::new("kinds");
    let data = [0; 600];
    let kinds = |kind: &str, size: u32| {
        let fields = format!("dimension: 4\nsizes: {size} 2 3 4\nkinds: {kind} domain domain domain\n");
        nrrd(&fields, &data)
    };
    let last = nrrd("dimension: 4\nsizes: 2 3 4 3\nkinds: space space space RGB-color\n", &data);
    let flat = nrrd("sizes: 4 8 9\nkinds: RGBA-color domain domain\n", &data);
    // The intent at byte 68 says that an axis holds vectors.
    let intent = |code: i16, sizes: &[i16]| with(nifti(sizes, 16, &data), 68, &code.to_le_bytes());
    #[rustfmt::skip]
    let files = [
        ("color.nrrd", kinds("RGB-color", 3), "a colour image (NRRD kind RGB-color), 3 values"),
        ("hsv.nrrd", kinds("hsv-color", 3), "a colour image (NRRD kind hsv-color), 3 values"),
        ("four.nrrd", kinds("4-color", 4), "a colour image (NRRD kind 4-color), 4 values"),
        ("last.nrrd", last, "a colour image (NRRD kind RGB-color), 3 values"),
        ("flat.nrrd", flat, "a colour image (NRRD kind RGBA-color), 4 values"),
        ("complex.nrrd", kinds("complex", 2), "an image of complex numbers (NRRD kind complex), 2 values"),
        ("vector.nrrd", kinds("vector", 7), "an image of vectors (NRRD kind vector), 7 values"),
        ("covariant.nrrd", kinds("covariant-vector", 3), "an image of vectors (NRRD kind covariant-vector), 3 values"),
        ("normal.nrrd", kinds("3-normal", 3), "an image of vectors (NRRD kind 3-normal), 3 values"),
        ("point.nrrd", kinds("point", 3), "an image of points (NRRD kind point), 3 values"),
        ("quaternion.nrrd", kinds("quaternion", 4), "an image of quaternions (NRRD kind quaternion), 4 values"),
        ("tensor.nrrd", kinds("3D-masked-symmetric-matrix", 7), "an image of matrices (NRRD kind 3D-masked-symmetric-matrix), 7 values"),
        ("rgb.nii", nifti(&[2, 3, 4], 128, &data), "a colour image (RGB) (NIfTI datatype 128), 3 values"),
        ("rgba.nii", nifti(&[2, 3, 4], 2304, &data), "a colour image (RGBA) (NIfTI datatype 2304), 4 values"),
        ("complex.nii", nifti(&[2, 3, 4], 32, &data), "an image of complex numbers (NIfTI datatype 32), 2 values"),
        ("flat.nii", nifti(&[8, 3], 1792, &data), "an image of complex numbers (NIfTI datatype 1792), 2 values"),
        ("vector.nii", intent(1007, &[2, 3, 4, 1, 3]), "an image of vectors (NIfTI intent 1007), 3 values"),
        ("warp.nii", intent(2006, &[2, 3, 4, 3]), "an image of vectors (NIfTI intent 2006), 3 values"),
        ("tensor.nii", intent(1005, &[2, 3, 4, 1, 6]), "an image of matrices (NIfTI intent 1005), 6 values"),
        ("color.nii", intent(2003, &[2, 3, 4, 1, 3]), "a colour image (RGB) (NIfTI intent 2003), 3 values"),
        ("channels.mha", mha("ElementNumberOfChannels = 3\n", &data), "an image of several channels (ElementNumberOfChannels), 3 values"),
    ];
    for (name, bytes, expected) in files {
        let path = scratch.write(name, &bytes);
        // A colour image stays refused even if a component is chosen.
        for message in
            [read_volume_file(&path), component(&path, 0)].map(|read| read.unwrap_err().to_string())
        {
            assert!(message.contains(expected), "{name}: {message}");
            assert!(message.contains("not a volume of one number per voxel"), "{name}: {message}");
        }
    }
    // A single value with such an intent is a scalar.
    read_volume_file(&scratch.write("one.nii", &intent(1007, &[2, 3, 4, 1, 1]))).unwrap();
}
