//! Lengths in any unit of any format become millimetres.

use bevy::math::DVec3;
use bevy_contextual_ao::volume::{VolumeReadSettings, read_volume_file, read_volume_file_with};

use super::small_files::{Scratch, counting, mha, nifti, nrrd, with};

/// Places of voxels (0, 0, 0) and (1, 1, 1), or the reader's error.
fn corners(scratch: &Scratch, name: &str, bytes: &[u8]) -> Result<[DVec3; 2], String> {
    let volume = read_volume_file(&scratch.write(name, bytes)).map_err(|error| error.to_string())?;
    Ok([DVec3::ZERO, DVec3::ONE].map(|voxel| volume.grid_to_patient().transform_point3(voxel)))
}

/// Checks places to a double's rounding error. Places and units are at most 1e10.
fn assert_corners(scratch: &Scratch, name: &str, bytes: &[u8], expected: [DVec3; 2]) {
    let found = corners(scratch, name, bytes).unwrap_or_else(|error| panic!("{error}"));
    for (found, expected) in found.into_iter().zip(expected) {
        let tolerance = 1e-12 * expected.abs().max_element();
        assert!(found.abs_diff_eq(expected, tolerance), "{name}: {found}, not {expected}");
    }
}

/// Every known spelling of a unit, and its length, mm.
const UNITS: [(&str, f64); 40] = [
    ("mm", 1.0),
    ("MM", 1.0),
    ("millimeter", 1.0),
    ("Millimetres", 1.0),
    ("cm", 10.0),
    ("centimeters", 10.0),
    ("centimetre", 10.0),
    ("dm", 100.0),
    ("decimetre", 100.0),
    ("m", 1e3),
    ("M", 1e3),
    ("meter", 1e3),
    ("metres", 1e3),
    ("km", 1e6),
    ("kilometers", 1e6),
    ("um", 1e-3),
    ("UM", 1e-3),
    ("\u{b5}m", 1e-3),
    ("\u{3bc}m", 1e-3),
    ("\u{3bc}M", 1e-3),
    ("micron", 1e-3),
    ("Microns", 1e-3),
    ("micrometer", 1e-3),
    ("MICROMETRES", 1e-3),
    ("nm", 1e-6),
    ("nanometers", 1e-6),
    ("nanometre", 1e-6),
    ("pm", 1e-9),
    ("picometres", 1e-9),
    ("\u{c5}", 1e-7),
    ("angstroms", 1e-7),
    ("\u{212b}", 1e-7),
    ("in", 25.4),
    ("Inch", 25.4),
    ("inches", 25.4),
    ("ft", 304.8),
    ("feet", 304.8),
    // These are no lengths, and count as if no unit were given.
    ("", 1.0),
    ("pixel", 1.0),
    ("???", 1.0),
];

#[test]
fn every_unit_of_length_is_honoured() {
    let scratch = Scratch::new("units");
    let (origin, step) = (DVec3::new(10.0, 20.0, 30.0), DVec3::new(1.0, 2.0, 3.0));
    for (unit, length) in UNITS {
        let expected = [origin, origin + step].map(|place| place * length);
        let space = "space: RAS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (10,20,30)\n";
        let fields = format!("{space}space units: \"{unit}\" \"{unit}\" \"{unit}\"\n");
        assert_corners(&scratch, "space.nrrd", &nrrd(&fields, &counting()), expected);
        let fields =
            format!("spacings: 1 2 3\nspace origin: (10,20,30)\nunits: \"{unit}\" \"{unit}\" \"{unit}\"\n");
        assert_corners(&scratch, "axes.nrrd", &nrrd(&fields, &counting()), expected);
        // MetaImage's space is LPS.
        let place = "Offset = -10 -20 30\nElementSpacing = 1 2 3\nTransformMatrix = -1 0 0 0 -1 0 0 0 1\n";
        let fields = format!("{place}DistanceUnits = {unit}\n");
        assert_corners(&scratch, "a.mha", &mha(&fields, &counting()), expected);
    }
}

#[test]
fn every_axis_has_a_unit_of_its_own() {
    let scratch = Scratch::new("axis_units");
    let data = counting();
    // Units of the space's axes scale the parts of each direction. Here the grid's first axis is the space's second.
    let space = "space: LPS\nspace directions: (0,2,0) (1,0,0) (0,0,3)\nspace origin: (10,20,30)\n\
                 space units: \"cm\" \"um\" m\n";
    let first = DVec3::new(-100.0, -0.02, 30_000.0);
    let expected = [first, first + DVec3::new(-10.0, -0.002, 3000.0)];
    assert_corners(&scratch, "space.nrrd", &nrrd(space, &data), expected);
    // Units of the grid's axes scale its steps.
    let axes = "spacings: 1 2 3\nunits: \"cm\" \"um\" \"m\"\n";
    let expected = [DVec3::ZERO, DVec3::new(10.0, 0.002, 3000.0)];
    assert_corners(&scratch, "axes.nrrd", &nrrd(axes, &data), expected);
    // The unit of an axis outside of the grid is no length.
    let time = "dimension: 4\nsizes: 2 3 4 1\nkinds: space space space time\nspacings: 1 2 3 0.5\n\
                units: \"cm\" \"um\" \"m\" \"s\"\n";
    assert_corners(&scratch, "time.nrrd", &nrrd(time, &data), expected);
    // Without spacings, the positions of the axes' ends give them.
    let ends = "axis mins: 0 1 -4\naxis maxs: 2 5 5\ncenters: cell none node\nunits: mm cm mm\n";
    let expected = [DVec3::ZERO, DVec3::new(1.0, 40.0 / 3.0, 3.0)];
    assert_corners(&scratch, "ends.nrrd", &nrrd(ends, &data), expected);
}

#[test]
fn nifti_units_are_honoured() {
    let scratch = Scratch::new("nifti_units");
    let file = nifti(&[2, 3, 4], 2, &counting());
    // Milliseconds are in the same byte.
    for (code, length) in [(0, 1.0), (1, 1e3), (2, 1.0), (3, 1e-3), (16 + 3, 1e-3)] {
        let expected = [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0) * length];
        assert_corners(&scratch, "a.nii", &with(file.clone(), 123, &[code]), expected);
        // The sform has an origin.
        let row = [[2f32, 0.0, 0.0, 10.0], [0.0, 3.0, 0.0, 20.0], [0.0, 0.0, 4.0, 30.0]];
        let row = row.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let sform = with(with(with(file.clone(), 254, &[1]), 280, &row), 123, &[code]);
        let expected =
            [DVec3::new(10.0, 20.0, 30.0), DVec3::new(12.0, 23.0, 34.0)].map(|place| place * length);
        assert_corners(&scratch, "sform.nii", &sform, expected);
    }
}

#[test]
fn latin_1_writes_microns_too() {
    let scratch = Scratch::new("latin");
    let fields = [b"space units: \"\xb5m\" \"".as_slice(), b"\xb5m\" \"\xb5m\"\n"].concat();
    let header = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n";
    let file = [header.as_slice(), &fields, b"\n", &counting()].concat();
    assert_corners(&scratch, "a.nrrd", &file, [DVec3::ZERO, DVec3::splat(1e-3)]);
}

#[test]
fn unknown_units_are_named() {
    let scratch = Scratch::new("unknown_units");
    let data = counting();
    let files = [
        ("space.nrrd", nrrd("space units: \"mm\" \"parsec\" \"mm\"\n", &data), ["space units", "\"parsec\""]),
        ("axes.nrrd", nrrd("units: mm mm seconds\n", &data), ["units", "\"seconds\""]),
        ("a.mha", mha("DistanceUnits = smoot\n", &data), ["DistanceUnits", "\"smoot\""]),
        ("a.nii", with(nifti(&[2, 3, 4], 2, &data), 123, &[7]), ["xyzt_units", "\"7\""]),
    ];
    for (name, bytes, parts) in files {
        let error = corners(&scratch, name, &bytes).unwrap_err();
        for part in parts.into_iter().chain([name, "not a known unit of length"]) {
            assert!(error.contains(part), "{name}: {error}");
        }
    }
}

#[test]
fn lengths_are_scaled_and_volumes_halved_as_set() {
    let scratch = Scratch::new("length_scale");
    let fields = "space: RAS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nspace origin: (10,20,30)\n\
                  space units: \"m\" \"m\" \"m\"\n";
    let path = scratch.write("a.nrrd", &nrrd(fields, &counting()));
    let read = |settings: VolumeReadSettings| read_volume_file_with(&path, &settings);
    let millimetres = VolumeReadSettings { length_scale: 1e-3, ..Default::default() };
    let volume = read(millimetres.clone()).expect("a volume");
    let found = volume.grid_to_patient().transform_point3(DVec3::ONE);
    assert!(found.abs_diff_eq(DVec3::new(11.0, 22.0, 33.0), 1e-9), "{found}");
    let half = read(VolumeReadSettings { halvings: 1, ..millimetres }).expect("a volume");
    assert_eq!(half.dimensions(), volume.halved().dimensions());
    assert!(half.intensities() == volume.halved().intensities(), "the voxels differ");
    for length_scale in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        assert!(read(VolumeReadSettings { length_scale, ..Default::default() }).is_err(), "{length_scale}");
    }
}
