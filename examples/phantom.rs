//! Writes the generated head, or the mask of its brain, as an NRRD file: `cargo run --example phantom -- [FILE] [--brain]`.

use bevy::math::UVec3;
use bevy_contextual_ao::volume::phantom::{HeadField, brain_mask, head_phantom};
use clap::Parser;
use flate2::{Compression, write::GzEncoder};
use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::PathBuf,
    process::ExitCode,
};

/// Writes the generated head as an NRRD file.
#[derive(Parser)]
struct Arguments {
    /// File to write.
    #[arg(default_value = "assets/head_phantom.nrrd")]
    file: PathBuf,
    /// Number of voxels from the neck to the vertex.
    #[arg(long, default_value_t = 160, value_parser = clap::value_parser!(u32).range(1..=1024))]
    voxels_high: u32,
    /// Writes the mask of the brain.
    #[arg(long)]
    brain: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let field = HeadField::new(arguments.voxels_high);
    let grid = (field.dimensions(), field.spacing_mm());
    let (kind, bytes) = if arguments.brain {
        ("uchar", brain_mask(arguments.voxels_high))
    } else {
        let values = head_phantom(arguments.voxels_high).values;
        ("short", values.iter().flat_map(|value| value.to_le_bytes()).collect())
    };
    let write = |file| write_nrrd(grid, kind, &bytes, BufWriter::new(file));
    match File::create(&arguments.file).and_then(write) {
        Ok(()) => {
            let size = grid.0;
            let name = arguments.file.display();
            println!("{name}: {} x {} x {} voxels", size.x, size.y, size.z);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{}: {error}", arguments.file.display());
            ExitCode::FAILURE
        }
    }
}

/// Writes header and data in one file, the head's centre at the origin.
fn write_nrrd((size, step): (UVec3, f32), kind: &str, bytes: &[u8], mut file: impl Write) -> io::Result<()> {
    // The origin of an NRRD file is the centre of its first voxel.
    let origin = (size.as_vec3() - 1.0) * (-0.5 * step);
    writeln!(file, "NRRD0005")?;
    writeln!(file, "type: {kind}")?;
    writeln!(file, "dimension: 3")?;
    writeln!(file, "space: right-anterior-superior")?;
    writeln!(file, "sizes: {} {} {}", size.x, size.y, size.z)?;
    writeln!(file, "space directions: ({step},0,0) (0,{step},0) (0,0,{step})")?;
    writeln!(file, "kinds: domain domain domain")?;
    writeln!(file, "endian: little")?;
    writeln!(file, "encoding: gzip")?;
    writeln!(file, "space origin: ({},{},{})", origin.x, origin.y, origin.z)?;
    writeln!(file)?;
    let mut encoder = GzEncoder::new(file, Compression::best());
    encoder.write_all(bytes)?;
    encoder.finish()?.flush()
}
