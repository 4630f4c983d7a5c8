//! The readers on small files, written here in every way.

use std::io::Write;
use std::path::{Path, PathBuf};

use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::volume::{Intensities, Volume, read_volume_file};

/// A folder for one test's files, removed with it.
pub(crate) struct Scratch(pub(crate) PathBuf);

impl Scratch {
    pub(crate) fn new(test: &str) -> Self {
        let name = format!("contextual_ao_{}_{test}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub(crate) fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A little-endian NIfTI-1 file with spacings 1, 2, 3 and neither sform nor qform.
pub(crate) fn nifti(sizes: &[i16], data_type: i16, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, &348i32.to_le_bytes());
    put(40, &(sizes.len() as i16).to_le_bytes());
    for (axis, size) in sizes.iter().enumerate() {
        put(42 + 2 * axis, &size.to_le_bytes());
        put(80 + 4 * axis, &(axis as f32 + 1.0).to_le_bytes());
    }
    put(70, &data_type.to_le_bytes());
    put(108, &352f32.to_le_bytes());
    put(344, b"n+1\0");
    bytes.extend_from_slice(data);
    bytes
}

/// The file with `value` at byte `at`.
pub(crate) fn with(mut file: Vec<u8>, at: usize, value: &[u8]) -> Vec<u8> {
    file[at..at + value.len()].copy_from_slice(value);
    file
}

/// A NRRD file of 2x3x4 bytes, unless `fields` say otherwise: a field given again replaces the first.
pub(crate) fn nrrd(fields: &str, data: &[u8]) -> Vec<u8> {
    let header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n";
    [header.as_bytes(), fields.as_bytes(), b"\n", data].concat()
}

/// A MetaImage file of 2x3x4 bytes, unless `fields` say otherwise.
pub(crate) fn mha(fields: &str, data: &[u8]) -> Vec<u8> {
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\n";
    let end = "ElementDataFile = LOCAL\n";
    [header.as_bytes(), fields.as_bytes(), end.as_bytes(), data].concat()
}

/// The bytes 0 to 23.
pub(crate) fn counting() -> Vec<u8> {
    (0..24).collect()
}

fn read(path: &Path) -> Volume {
    read_volume_file(path).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn small_files_read_in_every_way_to_write_them() {
    let scratch = Scratch::new("small");
    let data = counting();
    let text: String = data.iter().map(|value| format!("{value}, ")).collect();
    scratch.write("data.raw", &data);
    std::fs::create_dir_all(scratch.0.join("below")).unwrap();
    scratch.write("below/data.raw", &data);
    let with_junk = [b"junk\nmore\n12345".as_slice(), &data].concat();
    let two_members = [gzip(&data[..10]), gzip(&data[10..])].concat();
    let plain = nifti(&[2, 3, 4], 2, &data);
    let files = [
        ("a.nii", plain.clone()),
        ("b.nii", gzip(&plain)),
        ("c.nii.gz", plain.clone()),
        ("four.nii", nifti(&[2, 3, 4, 1], 2, &data)),
        ("extra.nii", [plain.clone(), vec![9; 100]].concat()),
        ("a.nrrd", nrrd("", &data)),
        ("crlf.nrrd", {
            let text = "NRRD0005\r\ntype: uint8\r\ndimension: 3\r\nsizes: 2 3 4\r\nencoding: raw\r\n\r\n";
            [text.as_bytes(), &data].concat()
        }),
        ("text.nrrd", nrrd("encoding: ascii\n", text.as_bytes())),
        ("gz.nrrd", nrrd("encoding: gz\n", &gzip(&data))),
        ("members.nrrd", nrrd("encoding: gzip\n", &[two_members, vec![0; 9]].concat())),
        ("skip.nrrd", nrrd("line skip: 2\nbyte skip: 5\n", &with_junk)),
        ("end.nrrd", nrrd("byte skip: -1\n", &with_junk)),
        ("gzend.nrrd", nrrd("encoding: gzip\nbyte skip: -1\n", &gzip(&with_junk))),
        ("axis.nrrd", nrrd("dimension: 4\nsizes: 1 2 3 4\n", &data)),
        ("last.nrrd", nrrd("dimension: 4\nsizes: 2 3 4 1\nspacings: nan 1 1 1\n", &data)),
        ("a.nhdr", nrrd("data file: below/data.raw\n", &[])),
        ("a.mha", mha("", &data)),
        ("zlib.mha", mha("CompressedData = True\n", &zlib(&data))),
        ("gzip.mha", mha("CompressedData = True\n", &gzip(&data))),
        ("text.mha", mha("BinaryData = False\n", text.as_bytes())),
        ("end.mha", mha("HeaderSize = -1\n", &with_junk)),
        ("a.mhd", mha("ElementDataFile = data.raw\n", &[])),
    ];
    for (name, bytes) in files {
        let volume = read(&scratch.write(name, &bytes));
        assert_eq!(volume.dimensions(), UVec3::new(2, 3, 4), "{name}");
        assert_eq!(volume.intensities(), &Intensities::U8(data.clone()), "{name}");
        assert_eq!(volume.value_at(UVec3::new(1, 2, 3)), Some(23.0), "{name}");
    }
}

#[test]
fn geometry_is_patient_millimetres() {
    let scratch = Scratch::new("geometry");
    let data = counting();
    // The expected places are those of voxel (1, 1, 1) in RAS.
    let lps = "space: LPS\nspace directions: (0,2,0) (1,0,0) (0,0,3)\nspace origin: (10,20,30)\n";
    let matrix = "TransformMatrix = 0 1 0 1 0 0 0 0 1\nElementSpacing = 2 1 3\nOffset = 10 20 30\n";
    let nifti = nifti(&[2, 3, 4], 2, &data);
    let files = [
        ("lps.nrrd", nrrd(lps, &data), [-11.0, -22.0, 33.0]),
        ("las.nrrd", nrrd(&lps.replace("LPS", "left-anterior-superior"), &data), [-11.0, 22.0, 33.0]),
        ("ras.nrrd", nrrd(&lps.replace("LPS", "RAS"), &data), [11.0, 22.0, 33.0]),
        ("no_space.nrrd", nrrd("spacings: 1 2 nan\n", &data), [1.0, 2.0, 1.0]),
        ("lps.mha", mha(matrix, &data), [-11.0, -22.0, 33.0]),
        ("spacing.nii", nifti.clone(), [1.0, 2.0, 3.0]),
        ("metre.nii", with(nifti.clone(), 123, &[1]), [1e3, 2e3, 3e3]),
        // Half a turn around z, and the third axis reversed.
        (
            "qform.nii",
            with(with(with(nifti, 252, &[1]), 264, &1f32.to_le_bytes()), 76, &(-1f32).to_le_bytes()),
            [-1.0, -2.0, -3.0],
        ),
    ];
    for (name, bytes, expected) in files {
        let volume = read(&scratch.write(name, &bytes));
        let place = volume.grid_to_patient().transform_point3(DVec3::ONE);
        assert!(place.abs_diff_eq(DVec3::from_array(expected), 1e-9), "{name}: {place}");
    }
}

#[test]
fn wide_numbers_keep_their_values() {
    let scratch = Scratch::new("wide");
    let check = |name: &str, data_type: i16, data: &[u8], expected: &[f64], tolerance: f64| {
        let file = nifti(&[expected.len() as i16, 1, 1], data_type, data);
        let volume = read(&scratch.write(name, &file));
        for (x, value) in expected.iter().enumerate() {
            let found = volume.value_at(UVec3::new(x as u32, 0, 0)).unwrap();
            assert!((found - value).abs() <= tolerance, "{name} {x}: {found}");
        }
        volume
    };
    let i8s = [-128i8, 0, 127].map(|v| v as u8);
    check("i8.nii", 256, &i8s, &[-128.0, 0.0, 127.0], 0.0);
    let i16s = [-32_768i16, 0, 32_767].map(i16::to_le_bytes).concat();
    check("i16.nii", 4, &i16s, &[-32_768.0, 0.0, 32_767.0], 0.0);
    let i32s = [1_000_000i32, 1_065_535].map(i32::to_le_bytes).concat();
    check("i32.nii", 8, &i32s, &[1e6, 1_065_535.0], 0.0);
    let i64s = [i64::MIN, 0, i64::MAX].map(i64::to_le_bytes).concat();
    check("i64.nii", 1024, &i64s, &[-(2f64.powi(63)), 0.0, 2f64.powi(63)], 2f64.powi(48));
    let u64s = [0, u64::MAX].map(u64::to_le_bytes).concat();
    check("u64.nii", 1280, &u64s, &[0.0, 2f64.powi(64)], 2f64.powi(48));
    let f32s = [-0.5f32, 0.25, 1.5].map(f32::to_le_bytes).concat();
    check("f32.nii", 16, &f32s, &[-0.5, 0.25, 1.5], 2.0 / 65_535.0);
    let one = [0.769f64; 2].map(f64::to_le_bytes).concat();
    check("one.nii", 64, &one, &[0.769; 2], 0.0);
    let far = [-8e307, 0.0, 8e307].map(f64::to_le_bytes).concat();
    check("far.nii", 64, &far, &[-8e307, 0.0, 8e307], 2e303);
    let small = check("small.nii", 16, &[7f32, 262.0].map(f32::to_le_bytes).concat(), &[7.0, 262.0], 0.0);
    assert_eq!(small.intensities(), &Intensities::U8(vec![0, 255]));
    // With a falling slope, the range is still in order.
    let falling = with(nifti(&[2, 1, 1], 2, &[0, 10]), 112, &(-2f32).to_le_bytes());
    let falling = read(&scratch.write("falling.nii", &falling));
    assert_eq!(falling.range(), [-20.0, 0.0]);
    assert_eq!(falling.to_stored(-20.0), 10.0);
}
