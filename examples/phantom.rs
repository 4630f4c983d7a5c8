//! Writes the generated head as an NRRD file: `cargo run --example phantom -- [FILE]`.

use bevy_contextual_ao::volume::phantom::{HeadPhantom, head_phantom};
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
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let head = head_phantom(arguments.voxels_high);
    match File::create(&arguments.file).and_then(|file| write_nrrd(&head, BufWriter::new(file))) {
        Ok(()) => {
            let size = head.dimensions;
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
fn write_nrrd(head: &HeadPhantom, mut file: impl Write) -> io::Result<()> {
    let (size, step) = (head.dimensions, head.spacing_mm);
    // The origin of an NRRD file is the centre of its first voxel.
    let origin = (size.as_vec3() - 1.0) * (-0.5 * step);
    writeln!(file, "NRRD0005")?;
    writeln!(file, "type: short")?;
    writeln!(file, "dimension: 3")?;
    writeln!(file, "space: right-anterior-superior")?;
    writeln!(file, "sizes: {} {} {}", size.x, size.y, size.z)?;
    writeln!(file, "space directions: ({step},0,0) (0,{step},0) (0,0,{step})")?;
    writeln!(file, "kinds: domain domain domain")?;
    writeln!(file, "endian: little")?;
    writeln!(file, "encoding: gzip")?;
    writeln!(file, "space origin: ({},{},{})", origin.x, origin.y, origin.z)?;
    writeln!(file)?;
    let bytes: Vec<u8> = head.values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut encoder = GzEncoder::new(file, Compression::best());
    encoder.write_all(&bytes)?;
    encoder.finish()?.flush()
}
