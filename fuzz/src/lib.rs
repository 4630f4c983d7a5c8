//! Properties that must hold for any file, for the fuzz targets.

pub mod volume;

#[path = "../../tests/suite/properties/peak_memory.rs"]
mod peak_memory;

use std::path::{Component, Path};

use peak_memory::with_peak;
use volume::{
    TransferFunction, TransferFunctionError, Volume, VolumeError, VolumeReadSettings,
    readers::{
        Format, data_file_candidates,
        decode::decode,
        header::{Encoding, GridHeader},
    },
};

/// Separator between a header and its data file in the input of a fuzz target, which is one file.
pub const DATA_FILE: &[u8] = b"\n<data file>\n";

/// Memory that does not depend on the file: a decompressor's state and the bytes that it reads at once.
const FIXED_BYTES: u64 = 1 << 18;
/// Memory per byte of a header or a transfer function. The worst texts are many tiny words. In a `.vp` such words
/// have two bytes each. In MetaImage they are `=` and a line's end, which become two strings' 48 bytes. The list of
/// strings may just have doubled its capacity.
const PER_TEXT_BYTE: u64 = 64;
/// Memory per byte of voxels. A list keeps at most twice the voxels at the end of a stream: it may just have doubled
/// its capacity. Next to the list lie up to sixteen bits per voxel.
const PER_DATA_BYTE: u64 = 6;

/// Checks the reader of a header called `name`. `bytes` are the header's file, or that file and its data file.
pub fn check_volume(name: &str, bytes: &[u8]) {
    let separator = bytes.windows(DATA_FILE.len()).position(|window| window == DATA_FILE);
    let (header_file, data_file) = match separator {
        Some(at) => (&bytes[..at], Some(&bytes[at + DATA_FILE.len()..])),
        None => (bytes, None),
    };
    let folder = Path::new("folder");
    let path = folder.join(name);
    let format = Format::of(&path).expect("a name that the readers know");
    let (header, peak) = with_peak(|| parse(format, header_file));
    assert!(peak <= FIXED_BYTES + PER_TEXT_BYTE * header_file.len() as u64, "the header took {peak} bytes");
    let Some(header) = checked(header) else { return };

    let candidates = data_file_candidates(&path, &header);
    for candidate in &candidates {
        let below = candidate.strip_prefix(folder).expect("a data file in the header's folder");
        assert!(below.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)));
    }
    let data = if candidates.is_empty() { header_file } else { data_file.unwrap_or(header_file) };
    let (volume, peak) = with_peak(|| decode(&header, data));
    let most = FIXED_BYTES + PER_DATA_BYTE * (data.len() as u64 + data_there(&header, data));
    assert!(peak <= most, "{header:?} took {peak} bytes, {most} at most were expected");
    let Some(volume) = checked(volume) else { return };
    check_read_volume(&header, &volume);
}

/// Reads a header; of several volumes it chooses the last.
fn parse(format: Format, file: &[u8]) -> Result<GridHeader, VolumeError> {
    let mut settings = VolumeReadSettings::default();
    match format.parse(file, &settings) {
        Err(VolumeError::Component { count, .. }) => {
            settings.component = u32::try_from(count - 1).ok();
            format.parse(file, &settings)
        }
        other => other,
    }
}

/// Bytes of voxels that `data` can hold, whatever its header claims.
fn data_there(header: &GridHeader, data: &[u8]) -> u64 {
    let expansion = match header.encoding {
        Encoding::Raw => 1,
        // A digit and a space become the eight bytes of a number.
        Encoding::Ascii => 4,
        // Deflate's limit.
        Encoding::RawOrGzip | Encoding::Gzip | Encoding::Zlib => 1032,
    };
    header.data_bytes().min(expansion * data.len() as u64)
}

/// Bytes that a DICOM volume may take on a device in [`check_dicom`].
const VOLUME_BYTES: u64 = 1 << 22;

/// Checks the DICOM reader on files, with [`DATA_FILE`] between them, or on an archive.
pub fn check_dicom(bytes: &[u8]) {
    // A codec's panic is caught and becomes an error. The fuzzer's own hook would end the run.
    static QUIET: std::sync::Once = std::sync::Once::new();
    QUIET.call_once(|| std::panic::set_hook(Box::new(|panic| eprintln!("{panic}"))));
    let files = split(bytes);
    let (listed, peak) = with_peak(|| volume::dicom::list(&files));
    // An archive's files are as long as deflate can make them, and their beginnings are read four times longer each time.
    let expansion = if bytes.starts_with(b"PK") { 4 * 1032 } else { PER_TEXT_BYTE };
    let most = (FIXED_BYTES << 2) + expansion * bytes.len() as u64;
    assert!(peak <= most, "the list took {peak} bytes, {most} at most were expected");
    listed.left_out.iter().for_each(|one| assert!(one.to_string().len() < 4096, "{one}"));
    let settings = volume::dicom::DicomReadSettings { max_bytes: VOLUME_BYTES, ..Default::default() };
    for listed in listed.series.iter().flat_map(|series| &series.volumes) {
        let (read, peak) = with_peak(|| listed.read(&settings, &Default::default()));
        // Slices that are fitted to the budget are there at once with their files and with what a codec makes of one.
        let most = (FIXED_BYTES << 6) + 8 * VOLUME_BYTES + 32 * expansion * bytes.len() as u64;
        assert!(peak <= most, "{listed:?} took {peak} bytes, {most} at most were expected");
        match read {
            Ok(volume) => {
                assert_eq!(volume.voxel_count(), volume.intensities().len() as u64);
                let [low, high] = volume.range();
                assert!(low.is_finite() && high.is_finite() && low <= high);
                TransferFunction::for_volume(&volume).validate().expect("a usable first look");
            }
            Err(error) => assert!(error.to_string().len() < 4096, "{error}"),
        }
    }
}

/// Files, apart at [`DATA_FILE`].
fn split(mut bytes: &[u8]) -> Vec<&[u8]> {
    let mut files = Vec::new();
    while let Some(at) = bytes.windows(DATA_FILE.len()).position(|window| window == DATA_FILE) {
        files.push(&bytes[..at]);
        bytes = &bytes[at + DATA_FILE.len()..];
    }
    files.push(bytes);
    files
}

/// The result, if it was read. Otherwise the error must be of a readable length, whatever it cites.
fn checked<T>(result: Result<T, VolumeError>) -> Option<T> {
    result.map_err(|error| assert!(error.to_string().len() < 4096, "{error}")).ok()
}

fn check_read_volume(header: &GridHeader, volume: &Volume) {
    assert_eq!(volume.dimensions(), header.dimensions);
    assert_eq!(volume.voxel_count(), volume.intensities().len() as u64);
    assert!(volume.background_voxels() < volume.voxel_count());
    assert!(volume.spacing_mm().is_finite() && volume.spacing_mm().min_element() > 0.0);
    let [low, high] = volume.range();
    assert!(low.is_finite() && high.is_finite() && low <= high);
    let last = volume.value_at(volume.dimensions() - 1).expect("the last voxel");
    assert!(low <= last && last <= high);
    let function = TransferFunction::for_volume(volume);
    function.validate().expect("a usable first look");
    check_samples(&function, [low, high]);
}

/// Checks a reader of transfer functions on a text.
pub fn check_transfer_function(
    text: &str,
    read: fn(&str) -> Result<TransferFunction, TransferFunctionError>,
) {
    let (function, peak) = with_peak(|| read(text));
    assert!(peak <= FIXED_BYTES + PER_TEXT_BYTE * text.len() as u64, "it took {peak} bytes");
    let function = match function {
        Ok(function) => function,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    function.validate().expect("what was read is valid");
    let values = [function.points.first(), function.points.last()].map(|point| point.map(|p| p.value));
    let [Some(first), Some(last)] = values else { unreachable!("a valid function has points") };
    check_samples(&function, [first.into(), last.into()]);
    let written = function.to_ron().expect("every function can be written");
    assert_eq!(TransferFunction::from_ron(&written).expect("and read again"), function);
}

/// Checks that colours and opacities are shares: at every control point, over a range and beyond it.
fn check_samples(function: &TransferFunction, range: [f64; 2]) {
    let values = function.points.iter().map(|point| point.value);
    let samples = values.chain([f32::MIN, f32::MAX]).map(|value| function.sample(value));
    for share in samples.chain(function.lookup_table(range, 64)).flatten() {
        assert!((0.0..=1.0).contains(&share), "{share}");
    }
}
