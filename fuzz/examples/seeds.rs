//! Writes the seeds: random, well-formed files, the same in every run.

#[allow(dead_code, reason = "the seeds need fewer choices than the tests")]
#[path = "../../kit/src/random.rs"]
mod random;
#[path = "../../tests/suite/properties/random_functions.rs"]
mod random_functions;
#[path = "../../tests/suite/properties/random_volumes.rs"]
mod random_volumes;

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
    Ok(())
}

fn save(target: &str, number: usize, bytes: &[u8]) -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join(format!("{number:02}")), bytes)
}
