//! Random, well-formed volume files, in every way to write them.

use std::io::Write;

use flate2::{Compression, write::GzEncoder, write::ZlibEncoder};

use super::random::Random;

/// A number type of voxels: its names, its range as far as doubles are exact, its little-endian bytes.
#[derive(Clone, Copy)]
pub(crate) struct Scalar {
    nifti: i16,
    nrrd: &'static str,
    meta_image: &'static str,
    range: [f64; 2],
    fraction: bool,
    bytes: fn(f64) -> Vec<u8>,
}

macro_rules! scalar {
    ($number:ty, $fraction:literal, $nifti:literal, $nrrd:literal, $meta_image:literal) => {
        Scalar {
            nifti: $nifti,
            nrrd: $nrrd,
            meta_image: $meta_image,
            range: [(<$number>::MIN as f64).max(-9e15), (<$number>::MAX as f64).min(9e15)],
            fraction: $fraction,
            bytes: |value| (value as $number).to_le_bytes().to_vec(),
        }
    };
}

const SCALARS: [Scalar; 10] = [
    scalar!(u8, false, 2, "uchar", "MET_UCHAR"),
    scalar!(i8, false, 256, "signed char", "MET_CHAR"),
    scalar!(u16, false, 512, "unsigned  short", "MET_USHORT"),
    scalar!(i16, false, 4, "int16_t", "MET_SHORT"),
    scalar!(u32, false, 768, "uint", "MET_UINT"),
    scalar!(i32, false, 8, "int", "MET_LONG"),
    scalar!(u64, false, 1280, "unsigned long long int", "met_ulong_long"),
    scalar!(i64, false, 1024, "longlong", "MET_LONG_LONG"),
    scalar!(f32, true, 16, "float", "MET_FLOAT"),
    scalar!(f64, true, 64, "Double", "MET_DOUBLE"),
];

/// Contents of a volume file.
#[derive(Clone)]
pub(crate) struct Grid {
    pub(crate) sizes: [u16; 3],
    pub(crate) spacing: [f32; 3],
    pub(crate) values: Vec<f64>,
    /// Slope and intercept; NRRD has neither.
    pub(crate) rescale: [f32; 2],
    scalar: Scalar,
}

impl Grid {
    /// A small random grid that every format can hold.
    pub(crate) fn random(random: &mut Random) -> Self {
        let sizes = [(); 3].map(|()| 1 + random.below(5) as u16);
        let count: u16 = sizes.iter().product();
        let scalar = random.pick(&SCALARS);
        let [low, high] = scalar.range;
        // Narrow ranges are kept exactly, wide ones in steps.
        let width = random.pick(&[0f64, 1.0, 255.0, 65_535.0, 1e6, 1e12]).min(high - low);
        let first = (low + (high - low - width) * f64::from(random.share())).round();
        let value = |random: &mut Random| {
            let value = first + width * f64::from(random.share());
            // The value is rounded as the type holds it.
            if scalar.fraction { f64::from(value as f32) } else { value.round() }
        };
        Self {
            sizes,
            spacing: [(); 3].map(|()| random.pick(&[0.25, 1.0, 1.5, 300.0])),
            values: (0..count).map(|_| value(random)).collect(),
            rescale: random.pick(&[[1.0, 0.0], [2.0, -1024.0], [-0.5, 3.0]]),
            scalar,
        }
    }

    fn data(&self, big_endian: bool) -> Vec<u8> {
        let number = |&value: &f64| {
            let mut bytes = (self.scalar.bytes)(value);
            if big_endian {
                bytes.reverse();
            }
            bytes
        };
        self.values.iter().flat_map(number).collect()
    }
}

/// Files of one volume by name: the header first, then the data if it is apart.
pub(crate) type Files = Vec<(&'static str, Vec<u8>)>;

/// Writes a grid in one of many ways.
type Writer = fn(&mut Random, &Grid) -> Files;

/// The formats by name.
pub(crate) const FORMATS: [(&str, Writer); 3] =
    [("nifti", nifti), ("nrrd", nrrd), ("meta_image", meta_image)];

/// Units of length: NIfTI's number, the other formats' name, and how many make a millimetre.
const UNITS: [(u8, &str, f32); 4] = [(0, "", 1.0), (1, "m", 0.001), (2, "mm", 1.0), (3, "um", 1000.0)];

fn nifti(random: &mut Random, grid: &Grid) -> Files {
    let (big_endian, attached, version_2) = (random.flip(), random.flip(), random.flip());
    let start = if version_2 { 544 } else { 352 };
    let offset = if attached { random.pick(&[0, start, start + 16]) } else { random.pick(&[0, 16]) };
    let fields = if version_2 { nifti_2(random, grid, offset) } else { nifti_1(random, grid, offset) };
    let mut header = vec![0; start];
    for (at, mut bytes) in fields {
        if big_endian {
            bytes.reverse();
        }
        header[at..at + bytes.len()].copy_from_slice(&bytes);
    }
    let (at, magic): (_, &[u8]) = if version_2 { (4, b"n+2\0\r\n\x1a\n") } else { (344, b"n+1\0") };
    header[at..at + magic.len()].copy_from_slice(magic);
    if !attached {
        header[at + 1] = b'i';
    }
    let data = [vec![0; if attached { 0 } else { offset }], grid.data(big_endian)].concat();
    let mut perhaps_gzip = |bytes: Vec<u8>| if random.flip() { gzip(&bytes) } else { bytes };
    if attached {
        header.resize(offset.max(start), 0);
        return vec![("a.nii", perhaps_gzip([header, data].concat()))];
    }
    let header = perhaps_gzip(header);
    vec![("a.hdr", header), ("a.img", perhaps_gzip(data))]
}

/// Places of fields, and their little-endian bytes.
type Fields = Vec<(usize, Vec<u8>)>;

fn nifti_1(random: &mut Random, grid: &Grid, offset: usize) -> Fields {
    let (unit, _, per_mm) = random.pick(&UNITS);
    let mut fields: Fields = vec![
        (0, 348i32.to_le_bytes().into()),
        (40, random.pick(&[3i16, 4, 7]).to_le_bytes().into()),
        (70, grid.scalar.nifti.to_le_bytes().into()),
        (108, (offset as f32).to_le_bytes().into()),
        (112, grid.rescale[0].to_le_bytes().into()),
        (116, grid.rescale[1].to_le_bytes().into()),
        (123, vec![unit]),
        // The qform, if there is one, is half a turn around x.
        (252, random.pick(&[0i16, 1]).to_le_bytes().into()),
        (256, 1f32.to_le_bytes().into()),
    ];
    for axis in 0..7 {
        let (size, spacing) = (grid.sizes.get(axis).unwrap_or(&1), grid.spacing.get(axis).unwrap_or(&1.0));
        fields.push((42 + 2 * axis, size.to_le_bytes().into()));
        fields.push((80 + 4 * axis, (spacing * per_mm).to_le_bytes().into()));
    }
    fields
}

/// The fields of `nifti_1`, in the second version's places and widths.
fn nifti_2(random: &mut Random, grid: &Grid, offset: usize) -> Fields {
    let (unit, _, per_mm) = random.pick(&UNITS);
    let mut fields: Fields = vec![
        (0, 540i32.to_le_bytes().into()),
        (12, grid.scalar.nifti.to_le_bytes().into()),
        (16, random.pick(&[3i64, 4, 7]).to_le_bytes().into()),
        (168, (offset as i64).to_le_bytes().into()),
        (176, f64::from(grid.rescale[0]).to_le_bytes().into()),
        (184, f64::from(grid.rescale[1]).to_le_bytes().into()),
        (344, random.pick(&[0i32, 1]).to_le_bytes().into()),
        (352, 1f64.to_le_bytes().into()),
        (500, i32::from(unit).to_le_bytes().into()),
    ];
    for axis in 0..7 {
        let (size, spacing) = (grid.sizes.get(axis).unwrap_or(&1), grid.spacing.get(axis).unwrap_or(&1.0));
        fields.push((24 + 8 * axis, i64::from(*size).to_le_bytes().into()));
        fields.push((112 + 8 * axis, f64::from(spacing * per_mm).to_le_bytes().into()));
    }
    fields
}

fn nrrd(random: &mut Random, grid: &Grid) -> Files {
    let (big_endian, attached) = (random.flip(), random.flip());
    let encoding = random.pick(&["raw", "gzip", "gz", "ascii", "text"]);
    let is_text = matches!(encoding, "ascii" | "text");
    let (line_skip, byte_skip) = (random.below(3), random.pick(if is_text { &[0, 3] } else { &[0, 3, -1] }));
    let [x, y, z] = grid.sizes;
    let (_, unit, per_mm) = random.pick(&UNITS);
    let [dx, dy, dz] = grid.spacing.map(|spacing| spacing * per_mm);
    let units = format!("units: \"{unit}\" \"{unit}\" \"{unit}\"\n");
    let geometry = match random.below(3) {
        0 => format!("dimension: 3\nsizes: {x} {y} {z}\nspacings: {dx} {dy} {dz}\n{units}"),
        kind => {
            let (dimension, size, none, kinds) = match kind {
                1 => (3, "", "", "domain domain space"),
                _ => (4, "1 ", "none ", "list space space space"),
            };
            format!(
                "dimension: {dimension}\nspace: LPS\nsizes: {size}{x} {y} {z}\nkinds: {kinds}\n\
                 space directions: {none}(0,{dx},0) (-{dy},0,0) (0,0,{dz})\nspace origin: (1,2e1,-3)\n\
                 space {units}"
            )
        }
    };
    let version = 1 + random.below(5);
    let scalar = grid.scalar.nrrd;
    let endian = if big_endian { "big" } else { "little" };
    let mut header = format!(
        "NRRD000{version}\n# a comment\ntype: {scalar}\n{geometry}encoding: {encoding}\nendian: {endian}\n\
         line skip: {line_skip}\nbyteskip: {byte_skip}\nkey:=value\n"
    );
    header += if attached { "\n" } else { "data file: a.raw\n" };
    if random.flip() {
        header = header.replace('\n', "\r\n");
    }
    let voxels = if is_text { text(random, grid) } else { grid.data(big_endian) };
    let mut data = "skipped\n".repeat(line_skip).into_bytes();
    let body = between_junk(random, voxels, byte_skip);
    data.extend(if encoding.starts_with('g') { gzip(&body) } else { body });
    one_or_two_files(attached, ["a.nhdr", "a.raw"], header, data)
}

fn meta_image(random: &mut Random, grid: &Grid) -> Files {
    let (big_endian, attached) = (random.flip(), random.flip());
    let encoding = random.pick(&["raw", "zlib", "gzip", "text"]);
    let is_text = encoding == "text";
    let skip = random.pick(if is_text { &[0, 3] } else { &[0, 3, -1] });
    let [x, y, z] = grid.sizes;
    let (_, unit, per_mm) = random.pick(&UNITS);
    let [dx, dy, dz] = grid.spacing.map(|spacing| spacing * per_mm);
    let [slope, intercept] = grid.rescale;
    let scalar = grid.scalar.meta_image;
    let compressed = matches!(encoding, "zlib" | "gzip");
    let file = if attached { "LOCAL" } else { "a.raw" };
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = {}\nBinaryDataByteOrderMSB = {big_endian}\n\
         CompressedData = {compressed}\nTransformMatrix = 0 1 0 1 0 0 0 0 -1\nOffset = 1 -2 3.5\n\
         ElementSpacing = {dx} {dy} {dz}\nDistanceUnits = {unit}\nDimSize = {x} {y} {z}\nHeaderSize = {skip}\n\
         ElementToIntensityFunctionSlope = {slope}\nElementToIntensityFunctionOffset = {intercept}\n\
         ElementType = {scalar}\nElementDataFile = {file}\n",
        !is_text
    );
    let voxels = if is_text { text(random, grid) } else { grid.data(big_endian) };
    let body = between_junk(random, voxels, skip);
    let data = match encoding {
        "zlib" => zlib(&body),
        "gzip" => gzip(&body),
        _ => body,
    };
    one_or_two_files(attached, ["a.mhd", "a.raw"], header, data)
}

/// The voxels as numbers in text.
fn text(random: &mut Random, grid: &Grid) -> Vec<u8> {
    let numbers = grid.values.iter().map(|value| format!("{value}{}", random.pick(&[" ", "\n", ", "])));
    numbers.collect::<String>().into_bytes()
}

/// The voxels between bytes to skip and other bytes. If the skip is -1, the voxels come last.
fn between_junk(random: &mut Random, voxels: Vec<u8>, byte_skip: i32) -> Vec<u8> {
    let before = usize::try_from(byte_skip).unwrap_or(random.below(9));
    let after = if byte_skip < 0 { 0 } else { random.below(9) };
    [random.bytes(before), voxels, random.bytes(after)].concat()
}

fn one_or_two_files(attached: bool, names: [&'static str; 2], header: String, data: Vec<u8>) -> Files {
    let header = header.into_bytes();
    if attached {
        vec![(names[0], [header, data].concat())]
    } else {
        vec![(names[0], header), (names[1], data)]
    }
}

/// Compresses in two members, as some programs do, and pads.
fn gzip(bytes: &[u8]) -> Vec<u8> {
    let (first, second) = bytes.split_at(bytes.len() / 2);
    let member = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    [member(first), member(second), vec![0; 5]].concat()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}
