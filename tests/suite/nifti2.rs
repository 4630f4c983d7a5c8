//! NIfTI-2, which has the fields of NIfTI-1 in other places.

use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::volume::{Intensities, VolumeReadSettings, read_volume_file, read_volume_file_with};

use super::readers::outcome;
use super::small_files::{Scratch, counting, gzip, nifti, with};

/// A file in either byte order, with spacings 1, 2, 3 and neither sform nor qform. The layout is that of `nifti2.h`;
/// nibabel reads these files as expected here.
pub(crate) struct Nifti2 {
    pub(crate) bytes: Vec<u8>,
    big_endian: bool,
}

impl Nifti2 {
    pub(crate) fn new(big_endian: bool, sizes: &[i64], data_type: i16) -> Self {
        let mut file = Self { bytes: vec![0; 544], big_endian };
        file.put(0, 540i32.to_le_bytes());
        file.bytes[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        file.put(12, data_type.to_le_bytes());
        file.put(16, (sizes.len() as i64).to_le_bytes());
        for (axis, size) in sizes.iter().enumerate() {
            file.put(24 + 8 * axis, size.to_le_bytes());
            file.put(112 + 8 * axis, (axis as f64 + 1.0).to_le_bytes());
        }
        file.put(168, 544i64.to_le_bytes());
        file
    }

    /// Writes a number at a byte, from the number's little-endian bytes.
    pub(crate) fn put<const N: usize>(&mut self, at: usize, mut number: [u8; N]) {
        if self.big_endian {
            number.reverse();
        }
        self.bytes[at..at + N].copy_from_slice(&number);
    }

    fn with_data(&self, data: &[u8]) -> Vec<u8> {
        [self.bytes.as_slice(), data].concat()
    }
}

#[test]
fn nifti_2_is_read_in_both_byte_orders() {
    let scratch = Scratch::new("nifti2");
    for big_endian in [false, true] {
        let data =
            [-1000i16, 3000].map(|v| if big_endian { v.to_be_bytes() } else { v.to_le_bytes() }).concat();
        let mut file = Nifti2::new(big_endian, &[2, 1, 1], 4);
        file.put(176, 2f64.to_le_bytes());
        file.put(184, 5f64.to_le_bytes());
        let plain = file.with_data(&data);
        let mut header = file.bytes.clone();
        header[4..7].copy_from_slice(b"ni2");
        header[168..176].fill(0);
        scratch.write("pair.img", &data);
        for (name, bytes) in
            [("a.nii", plain.clone()), ("a.nii.gz", gzip(&plain)), ("pair.hdr", header[..540].to_vec())]
        {
            let volume =
                read_volume_file(&scratch.write(name, &bytes)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(volume.dimensions(), UVec3::new(2, 1, 1));
            assert_eq!(volume.range(), [-1995.0, 6005.0], "{name}");
            let place = volume.grid_to_patient().transform_point3(DVec3::ONE);
            assert_eq!(place, DVec3::new(1.0, 2.0, 3.0), "{name}");
        }
    }
}

#[test]
fn nifti_2_means_what_nifti_1_means() {
    let scratch = Scratch::new("nifti2_fields");
    let data = counting();
    // Each field has its place in version 1, its place in version 2, and little-endian numbers of both widths.
    let f = |value: f32| (value.to_le_bytes().to_vec(), f64::from(value).to_le_bytes().to_vec());
    let i = |value: i16| (value.to_le_bytes().to_vec(), i32::from(value).to_le_bytes().to_vec());
    let srow: Vec<_> = [0.0f32, 3.0, 0.5, 4.0, -2.0, 0.25, 0.0, 5.0, 0.0, 0.0, 7.0, 6.0]
        .into_iter()
        .enumerate()
        .map(|(k, value)| (280 + 4 * k, 400 + 8 * k, f(value)))
        .collect();
    let qform = vec![
        (252, 344, i(1)),
        (76, 104, f(-1.0)),
        (256, 352, f(0.5)),
        (260, 360, f(-0.25)),
        (264, 368, f(0.125)),
        (268, 376, f(10.0)),
        (272, 384, f(20.0)),
        (276, 392, f(30.0)),
    ];
    let sform = [srow, vec![(254, 348, i(2))], qform.clone()].concat();
    let units = vec![(123, 500, (vec![3], 3i32.to_le_bytes().to_vec()))];
    let scaled = vec![(112, 176, f(-0.5)), (116, 184, f(7.0))];
    for (case, fields) in [("qform", qform), ("sform", sform), ("units", units), ("scaled", scaled)] {
        let mut first = nifti(&[2, 3, 4], 2, &data);
        let mut second = Nifti2::new(false, &[2, 3, 4], 2).with_data(&data);
        for (at_1, at_2, (bytes_1, bytes_2)) in fields {
            first = with(first, at_1, &bytes_1);
            second = with(second, at_2, &bytes_2);
        }
        let [first, second] = [("1.nii", first), ("2.nii", second)].map(|(name, file)| {
            read_volume_file(&scratch.write(name, &file)).unwrap_or_else(|error| panic!("{error}"))
        });
        assert!(first == second, "{case}: {first:?} {second:?}");
        let plain = read_volume_file(&scratch.write("plain.nii", &nifti(&[2, 3, 4], 2, &data))).unwrap();
        assert!(first != plain, "{case}: the fields say nothing");
    }
}

#[test]
fn nifti_2_holds_components_and_vectors() {
    let scratch = Scratch::new("nifti2_components");
    let data: Vec<u8> = (0..48).collect();
    let mut file = Nifti2::new(true, &[2, 3, 4, 1, 2], 2);
    let path = scratch.write("a.nii", &file.with_data(&data));
    assert_eq!(outcome(&path), "component");
    let second =
        read_volume_file_with(&path, &VolumeReadSettings { component: Some(1), ..Default::default() })
            .unwrap();
    assert!(*second.intensities() == Intensities::U8((24..48).collect()));
    file.put(504, 1007i32.to_le_bytes());
    assert_eq!(outcome(&scratch.write("a.nii", &file.with_data(&data))), "not scalar");
}

#[test]
fn broken_nifti_2_is_refused_for_the_right_reason() {
    let scratch = Scratch::new("nifti2_broken");
    let file = Nifti2::new(false, &[2, 3, 4], 2).with_data(&counting());
    let huge = Nifti2::new(false, &[1 << 40, 1 << 40, 1 << 40], 2).with_data(&counting());
    let many = Nifti2::new(true, &[2, 3, 4, i64::MAX, i64::MAX], 2).with_data(&counting());
    #[rustfmt::skip]
    let files = [
        ("short.nii", file[..539].to_vec(), "truncated"),
        ("data.nii", file[..file.len() - 1].to_vec(), "truncated"),
        // A program took the file for text, and replaced the line's end.
        ("text.nii", with(file.clone(), 8, b"\n\n"), "format"),
        ("magic.nii", with(file.clone(), 4, b"n+1"), "format"),
        ("negative.nii", with(file.clone(), 24, &(-2i64).to_le_bytes()), "dimensions"),
        ("count.nii", with(file.clone(), 16, &8i64.to_le_bytes()), "dimensions"),
        ("huge.nii", huge, "dimensions"),
        ("many.nii", many, "dimensions"),
        ("offset.nii", with(file.clone(), 168, &352i64.to_le_bytes()), "field"),
        ("far.nii", with(file.clone(), 168, &i64::MAX.to_le_bytes()), "field"),
        ("unit.nii", with(file.clone(), 500, &5i32.to_le_bytes()), "field"),
        ("type.nii", with(file.clone(), 12, &77i16.to_le_bytes()), "type"),
    ];
    for (name, bytes, expected) in files {
        assert_eq!(outcome(&scratch.write(name, &bytes)), expected, "{name}");
    }
}
