//! Properties of every file. A valid file is read as written. A broken file is only refused.

mod peak_memory;
mod random_functions;
mod random_volumes;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use bevy::math::{UVec3, Vec3};
use bevy_contextual_ao::volume::{ControlPoint, TransferFunction, Volume, VolumeFileError, read_volume_file};

use self::peak_memory::with_peak;
use self::random_functions::{points, ron, slicer_json, slicer_vp};
use self::random_volumes::{FORMATS, Files, Grid};
use super::small_files::Scratch;
use contextual_ao_kit::random::{self, Random};

/// Bytes of memory, more than any file here needs. The files have a few kilobytes, and decompress to little more.
const MEMORY: u64 = 1 << 20;

fn write(scratch: &Scratch, files: &Files) -> PathBuf {
    let paths: Vec<_> = files.iter().map(|(name, bytes)| scratch.write(name, bytes)).collect();
    paths[0].clone()
}

/// Reads a file, and checks the time, the memory, the volume's consistency and the error's file name.
fn read(scratch: &Scratch, files: &Files) -> Result<Volume, VolumeFileError> {
    let path = write(scratch, files);
    let start = Instant::now();
    let (result, peak) = with_peak(|| read_volume_file(&path));
    assert!(start.elapsed() < Duration::from_secs(5), "{files:?}");
    assert!(peak < MEMORY, "{peak} bytes for {files:?}");
    match &result {
        Ok(volume) => {
            assert_eq!(volume.voxel_count(), volume.intensities().len() as u64);
            TransferFunction::for_volume(volume).validate().unwrap();
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.contains(&*scratch.0.to_string_lossy()), "{message}");
        }
    }
    result
}

#[test]
fn volumes_are_read_as_written() {
    let scratch = Scratch::new("as_written");
    let mut random = Random(1);
    for (format, write) in FORMATS.repeat(300) {
        let grid = Grid::random(&mut random);
        let files = write(&mut random, &grid);
        let volume = read(&scratch, &files).unwrap_or_else(|error| panic!("{error}: {files:?}"));
        assert_eq!(volume.dimensions().to_array(), grid.sizes.map(u32::from));
        assert!(volume.spacing_mm().abs_diff_eq(Vec3::from_array(grid.spacing), 1e-4), "{files:?}");
        let [slope, intercept] = if format == "nrrd" { [1.0, 0.0] } else { grid.rescale.map(f64::from) };
        let [low, high] = volume.range();
        // Values that do not fit in 65536 steps are rounded to the nearest step. Doubles are rounded too.
        let exact = high - low <= 65_535.0 * slope.abs() && grid.values.iter().all(|v| v.fract() == 0.0);
        let step = if exact { 0.0 } else { (high - low) / 65_535.0 };
        let tolerance = 0.5 * step + 1e-14 * low.abs().max(high.abs());
        let [x, y, _] = grid.sizes.map(u32::from);
        for (at, value) in (0..).zip(&grid.values) {
            let found = volume.value_at(UVec3::new(at % x, at / x % y, at / x / y)).unwrap();
            let expected = slope * value + intercept;
            assert!((found - expected).abs() <= tolerance, "{at}: {found}, not {expected}: {files:?}");
        }
    }
}

#[test]
fn what_a_header_claims_takes_no_memory() {
    let scratch = Scratch::new("claims");
    let mut random = Random(2);
    for (_, write) in FORMATS.repeat(100) {
        let mut grid = Grid::random(&mut random);
        grid.sizes = [(); 3].map(|()| 200 + random.below(1800) as u16);
        let files = write(&mut random, &grid);
        assert!(read(&scratch, &files).is_err(), "{files:?}");
    }
}

/// Mutates bytes: changes, cuts out or doubles some, or replaces them by those of another file.
fn mutate(random: &mut Random, bytes: &mut Vec<u8>, other: &[u8]) {
    for _ in 0..random.below(4) {
        let from = random.below(bytes.len() + 1);
        let to = (from + random.below(12)).min(bytes.len());
        let replacement = match random.below(6) {
            // Digits and signs break text headers in more ways than any byte does.
            0 => vec![random.pick(b"0123456789-.:,()n \n")],
            1 => random.bytes(1),
            2 => bytes[from..to].iter().map(|byte| byte ^ 1 << (to % 8)).collect(),
            3 => Vec::new(),
            4 => bytes[from..to].repeat(2),
            _ => other[from.min(other.len())..].to_vec(),
        };
        let to = if replacement.len() == 1 { (from + 1).min(bytes.len()) } else { to };
        bytes.splice(from..to, replacement);
    }
}

#[test]
fn no_mutation_makes_a_reader_panic() {
    let scratch = Scratch::new("mutations");
    let mut random = Random(3);
    let mut count = 0;
    for (_, write) in FORMATS.repeat(100) {
        let [grid, other] = [(); 2].map(|()| Grid::random(&mut random));
        let [written, other] = [&grid, &other].map(|grid| write(&mut random, grid));
        for _ in 0..10 {
            let mut files = written.clone();
            for (file, other) in files.iter_mut().zip(other.iter().rev()) {
                mutate(&mut random, &mut file.1, &other.1);
            }
            count += u32::from(read(&scratch, &files).is_ok());
        }
    }
    // Some files must be read, or nothing beyond the headers was tried.
    assert!((500..2500).contains(&count), "{count} were read");
}

#[test]
fn transfer_functions_are_read_as_written() {
    let mut random = Random(4);
    for _ in 0..300 {
        let points = points(&mut random);
        let expected: Vec<_> = points
            .iter()
            .map(|&[value, r, g, b, opacity]| ControlPoint { value, color: [r, g, b], opacity })
            .collect();
        let from_ron = TransferFunction::from_ron(&ron(&mut random, &points)).unwrap();
        assert_eq!(from_ron.points, expected);
        let from_vp = TransferFunction::from_slicer_vp(&slicer_vp(&mut random, &points)).unwrap();
        let from_json = TransferFunction::from_slicer_vp(&slicer_json(&mut random, &points)).unwrap();
        assert_eq!(from_json.points, from_vp.points);
        for function in [&from_ron, &from_vp, &from_json] {
            let again = TransferFunction::from_bytes(function.to_ron().unwrap().as_bytes()).unwrap();
            assert_eq!(&again, function);
        }
        // Of more than two points at one value, only the outer ones count.
        for point in &expected {
            assert_eq!(from_vp.sample(point.value), from_ron.sample(point.value));
        }
    }
}

#[test]
fn no_mutation_makes_a_transfer_function_panic() {
    let mut random = Random(5);
    let mut count = 0;
    for _ in 0..2000 {
        let points = points(&mut random);
        let files =
            [ron(&mut random, &points), slicer_vp(&mut random, &points), slicer_json(&mut random, &points)];
        for (at, file) in files.iter().enumerate() {
            let mut bytes = file.clone().into_bytes();
            mutate(&mut random, &mut bytes, files[(at + 1) % files.len()].as_bytes());
            let (result, peak) = with_peak(|| TransferFunction::from_bytes(&bytes));
            assert!(peak < MEMORY);
            let Ok(function) = result else { continue };
            count += 1;
            function.validate().unwrap();
            let samples = function.lookup_table([-2000.0, 2000.0], 9).into_iter().flatten();
            assert!(samples.into_iter().all(|share| (0.0..=1.0).contains(&share)));
        }
    }
    assert!((1000..3000).contains(&count), "{count} were read");
}
