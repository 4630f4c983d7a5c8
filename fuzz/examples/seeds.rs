//! Writes the seeds: random, well-formed files, the same in every run.

#[allow(dead_code, reason = "the seeds need fewer choices than the tests")]
#[path = "../../kit/src/random.rs"]
mod random;
#[path = "../../tests/suite/properties/random_functions.rs"]
mod random_functions;
#[path = "../../tests/suite/properties/random_volumes.rs"]
mod random_volumes;

#[allow(dead_code, reason = "the seeds need fewer kinds of fields")]
#[path = "../../tests/suite/dicom/written.rs"]
mod written;

use std::path::Path;

use bevy_contextual_ao_fuzz::DATA_FILE;
use random::Random;
use random_functions::{points, ron, slicer_json, slicer_vp};
use random_volumes::{FORMATS, Grid};

const SEEDS_PER_TARGET: usize = 20;

fn main() -> std::io::Result<()> {
    let mut random = Random(0);
    for number in 0..SEEDS_PER_TARGET {
        for (format, write) in FORMATS {
            let grid = Grid::random(&mut random);
            let files: Vec<_> = write(&mut random, &grid).into_iter().map(|(_, bytes)| bytes).collect();
            save(format, number, &files.join(DATA_FILE))?;
        }
        let points = points(&mut random);
        save("ron", number, ron(&mut random, &points).as_bytes())?;
        save("slicer_vp", number, slicer_vp(&mut random, &points).as_bytes())?;
        save("slicer_json", number, slicer_json(&mut random, &points).as_bytes())?;
    }
    let mut random = Random(1);
    for number in 0..SEEDS_PER_TARGET {
        save("dicom", number, &dicom(&mut random))?;
    }
    Ok(())
}

/// Three slices, each in a file.
fn dicom(random: &mut Random) -> Vec<u8> {
    use written::{file, numbers, short, text};
    let syntax = random.pick(&written::Syntax::ALL);
    let slice = |z: u32| {
        let fields = vec![
            text(0x0008_0018, "UI", &format!("1.2.{z}")),
            text(0x0008_0060, "CS", "CT"),
            text(0x0020_000e, "UI", "1.2"),
            numbers(0x0020_0032, &[0.0, 0.0, f64::from(z * z)]),
            numbers(0x0020_0037, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
            numbers(0x0028_0030, &[1.0, 2.0]),
            numbers(0x0028_1053, &[f64::from(1 + z % 2)]),
            short(0x0028_0010, 3),
            short(0x0028_0011, 4),
            short(0x0028_0100, 16),
            short(0x0028_0101, 12),
            short(0x0028_0102, 11),
            short(0x0028_0103, 1),
            short(0x0028_0120, 7),
        ];
        file(syntax, fields, &[(0..24).map(|byte| byte * (z as u8 + 1)).collect()], 2)
    };
    (0..3).map(slice).collect::<Vec<_>>().join(DATA_FILE)
}

fn save(target: &str, number: usize, bytes: &[u8]) -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join(format!("{number:02}")), bytes)
}
