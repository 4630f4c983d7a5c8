//! The readers refuse broken files, each for the right reason.

use bevy_contextual_ao::volume::read_volume_file;

use super::readers::outcome;
use super::small_files::{Scratch, counting, gzip, mha, nifti, nrrd, with, zlib};
use contextual_ao_kit::random::Random;

#[test]
fn broken_files_are_refused_for_the_right_reason() {
    let scratch = Scratch::new("broken");
    let data = counting();
    let nii = nifti(&[2, 3, 4], 2, &data);
    let incompressible = Random(1).bytes(512);
    let gz = gzip(&nifti(&[8, 8, 8], 2, &incompressible));
    let corrupt = {
        let mut gz = gz.clone();
        let at = gz.len() - 100;
        gz[at] ^= 0xff;
        gz
    };
    let nan = [f32::NAN, f32::INFINITY].map(f32::to_le_bytes).concat();
    let huge = [2000i16; 3];
    let directions = "space directions: (1,0,0) (2,0,0) (0,0,1)\n";
    let long = "1 ".repeat(9999);
    scratch.write("short.raw", &data[..23]);
    let text = |fields: &str| nrrd(fields, &data);
    let meta = |fields: &str| mha(fields, &data);
    #[rustfmt::skip]
    let files = [
        ("truncated.nii", nii[..nii.len() - 1].to_vec(), "truncated"),
        ("header.nii", nii[..352].to_vec(), "truncated"),
        ("half.nii", nii[..200].to_vec(), "truncated"),
        ("empty.nii", Vec::new(), "truncated"),
        ("truncated.nii.gz", gz[..gz.len() - 60].to_vec(), "truncated"),
        ("stub.nii.gz", gz[..12].to_vec(), "truncated"),
        ("corrupt.nii.gz", corrupt, "damaged"),
        ("png.nii", [b"\x89PNG\r\n\x1a\n".to_vec(), vec![7; 500]].concat(), "format"),
        ("magic.nii", with(nii.clone(), 344, b"n+7\0"), "format"),
        ("size.nii", with(nii.clone(), 0, &[0; 4]), "format"),
        ("version2.nii", with(nii.clone(), 0, &540i32.to_le_bytes()), "truncated"),
        ("zero.nii", nifti(&[2, 0, 4], 2, &data), "dimensions"),
        ("negative.nii", nifti(&[2, -3, 4], 2, &data), "dimensions"),
        ("flat.nii", nifti(&[4, 6], 2, &data), "dimensions"),
        ("time.nii", nifti(&[2, 3, 2, 2], 2, &data), "component"),
        ("absurd.nii", nifti(&[32_767; 3], 64, &data), "dimensions"),
        ("huge.nii", nifti(&huge, 64, &data), "truncated"),
        ("huge.nii.gz", gzip(&nifti(&huge, 64, &data)), "truncated"),
        ("width.nii", nifti(&[2, 1, 1], 64, &[f64::MIN, f64::MAX].map(f64::to_le_bytes).concat()), "field"),
        ("nan.nii", nifti(&[2, 1, 1], 16, &nan), "not a number"),
        ("spacing.nii", with(nii.clone(), 84, &f32::NAN.to_le_bytes()), "field"),
        ("sform.nii", with(nii.clone(), 254, &[1]), "field"),
        ("qform.nii", with(with(nii.clone(), 252, &[1]), 256, &9f32.to_le_bytes()), "field"),
        ("slope.nii", with(nii.clone(), 112, &f32::INFINITY.to_le_bytes()), "field"),
        ("offset.nii", with(nii.clone(), 108, &100f32.to_le_bytes()), "field"),
        ("far.nii", with(nii.clone(), 108, &1e30f32.to_le_bytes()), "field"),
        ("code.nii", nifti(&[2, 3, 4], 77, &data), "type"),
        ("rgb.nii", nifti(&[2, 3, 4], 128, &data), "not scalar"),
        ("float128.nii", nifti(&[2, 3, 4], 1536, &data), "type"),
        ("unit.nii", with(nii.clone(), 123, &[4]), "field"),
        ("no_image.hdr", with(nii.clone(), 344, b"ni1\0"), "io"),
        ("empty.nrrd", Vec::new(), "format"),
        ("version.nrrd", b"NRRD0009\n".to_vec(), "format"),
        ("header.nrrd", nrrd("", &[]), "truncated"),
        ("magic_only.nrrd", b"NRRD0004".to_vec(), "field"),
        ("truncated.nrrd", nrrd("", &data[..23]), "truncated"),
        ("gz.nrrd", nrrd("encoding: gzip\n", &gzip(&data)[..20]), "truncated"),
        ("not_gz.nrrd", text("encoding: gzip\n"), "damaged"),
        ("hex.nrrd", text("encoding: hex\n"), "encoding"),
        ("zero.nrrd", text("sizes: 2 0 4\n"), "dimensions"),
        ("absurd.nrrd", text("sizes: 65535 65535 65535\n"), "dimensions"),
        ("wrap.nrrd", text("sizes: 18446744073709551615 2 2\n"), "dimensions"),
        ("huge.nrrd", text("encoding: gzip\nsizes: 2000 2000 2000\n"), "damaged"),
        ("hugetext.nrrd", nrrd("encoding: text\nsizes: 2000 2000 2000\n", b"1 2 3"), "truncated"),
        ("sizes.nrrd", text("sizes: 2 -3 4\n"), "field"),
        ("count.nrrd", text("dimension: 4\n"), "field"),
        ("four.nrrd", text("dimension: 4\nsizes: 2 3 2 2\n"), "component"),
        ("five.nrrd", text("dimension: 5\nsizes: 2 3 2 2 2\n"), "dimensions"),
        ("none.nrrd", text("dimension: 4\nsizes: 2 3 4 0\n"), "dimensions"),
        ("volumes.nrrd", text("dimension: 4\nsizes: 2 3 4 18446744073709551615\n"), "component"),
        ("kind.nrrd", text("kinds: domain domain strange\n"), "field"),
        ("kinds.nrrd", text("kinds: domain domain\n"), "field"),
        ("unit.nrrd", text("space units: \"mm\" \"mm\" \"furlong\"\n"), "field"),
        ("units.nrrd", text("space units: \"mm\" \"mm\"\n"), "field"),
        ("axis_unit.nrrd", text("units: mm mm furlong\n"), "field"),
        ("origin.nrrd", text("units: mm mm cm\nspace origin: (1,2,3)\n"), "field"),
        ("type.nrrd", text("type: block\n"), "type"),
        ("long_type.nrrd", text(&format!("type: {long}\n")), "type"),
        ("long_encoding.nrrd", text(&format!("encoding: {long}\n")), "encoding"),
        ("long_line.nrrd", text(&long), "field"),
        ("endian.nrrd", text("type: short\n"), "field"),
        ("skip.nrrd", text("byte skip: -5\n"), "field"),
        ("far.nrrd", text("byte skip: 9223372036854775807\n"), "truncated"),
        ("lines.nrrd", text("line skip: 9223372036854775807\n"), "truncated"),
        ("end.nrrd", nrrd("byte skip: -1\n", &data[..9]), "truncated"),
        ("plane.nrrd", text(directions), "field"),
        ("direction.nrrd", text("space directions: none (1,0,0) (0,1,0)\n"), "field"),
        ("spacing.nrrd", text("spacings: 1 0 1\n"), "field"),
        ("inf.nrrd", text("spacings: 1 inf 1\n"), "field"),
        ("space.nrrd", text("space: upside-down\n"), "field"),
        ("line.nrrd", text("what is this\n"), "field"),
        ("text.nrrd", nrrd("encoding: text\n", b"1 2 x"), "damaged"),
        ("above.nrrd", text("type: float\nencoding: text\nsizes: 1 1 1\n").into_iter().chain(*b" nan").collect(), "damaged"),
        ("nan.nrrd", nrrd("type: float\nencoding: text\nsizes: 1 1 2\n", b"inf nan"), "not a number"),
        ("short.nhdr", text("data file: short.raw\n"), "truncated"),
        ("missing.nhdr", text("data file: missing.raw\n"), "io"),
        ("folder.nhdr", text("data file: .\n"), "io"),
        ("up.nhdr", text("data file: ../short.raw\n"), "field"),
        ("up2.nhdr", text("data file: a\\..\\..\\short.raw\n"), "field"),
        ("root.nhdr", text("data file: /etc/passwd\n"), "field"),
        ("drive.nhdr", text("data file: C:\\secret\n"), "field"),
        ("source.nhdr", text("data file: https://host/secret\n"), "field"),
        ("list.nhdr", text("data file: LIST\nshort.raw\n"), "encoding"),
        ("pattern.nhdr", text("data file: slice%03d.raw 1 4 1\n"), "encoding"),
        ("empty.mha", Vec::new(), "format"),
        ("png.mha", [b"\x89PNG\r\n\x1a\n".to_vec(), vec![7; 500]].concat(), "format"),
        ("header.mha", mha("", &[]), "truncated"),
        ("no_data.mha", b"NDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\n".to_vec(), "field"),
        ("zlib.mha", mha("CompressedData = True\n", &zlib(&data)[..9]), "truncated"),
        ("not_zlib.mha", mha("CompressedData = True\n", b"12345678"), "damaged"),
        ("absurd.mha", meta("DimSize = 65535 65535 65535\n"), "dimensions"),
        ("axes.mha", meta(&format!("NDims = 9999\nDimSize = {long}\n")), "field"),
        ("long_type.mha", meta(&format!("ElementType = {long}\n")), "type"),
        ("flat.mha", meta("NDims = 2\nDimSize = 4 6\n"), "dimensions"),
        ("object.mha", meta("ObjectType = Scene\n"), "field"),
        ("type.mha", meta("ElementType = MET_STRING\n"), "type"),
        ("channels.mha", meta("ElementNumberOfChannels = 3\n"), "not scalar"),
        ("no_channels.mha", meta("ElementNumberOfChannels = many\n"), "field"),
        ("four.mha", meta("NDims = 4\nDimSize = 2 3 2 2\n"), "component"),
        ("none.mha", meta("NDims = 4\nDimSize = 2 3 4 0\n"), "dimensions"),
        ("many.mha", meta("NDims = 5\nDimSize = 2 3 4 4294967296 4294967296\n"), "dimensions"),
        ("unit.mha", meta("DistanceUnits = furlong\n"), "field"),
        ("spacing.mha", meta("ElementSpacing = 1 nan 1\n"), "field"),
        ("matrix.mha", meta("TransformMatrix = 1 0 0\n"), "field"),
        ("flag.mha", meta("CompressedData = perhaps\n"), "field"),
        ("skip.mha", meta("HeaderSize = -2\n"), "field"),
        ("up.mhd", meta("ElementDataFile = ../short.raw\n"), "field"),
        ("missing.mhd", meta("ElementDataFile = missing.raw\n"), "io"),
        ("list.mhd", meta("ElementDataFile = LIST\n"), "encoding"),
        ("a.dcm", data.clone(), "extension"),
    ];
    for (name, bytes, expected) in files {
        let path = scratch.write(name, &bytes);
        assert_eq!(outcome(&path), expected, "{name}");
        let message = read_volume_file(&path).unwrap_err().to_string();
        let folder = scratch.0.to_string_lossy();
        assert!(message.contains(&*folder) && message.len() < 1000, "{name}: {message}");
    }
    let missing = scratch.0.join("missing.nii");
    assert_eq!(outcome(&missing), "io");
}
