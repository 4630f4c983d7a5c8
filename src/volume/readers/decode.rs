//! From a checked header and the data's bytes to a volume.

use std::borrow::Cow;
use std::io::{self, Read};

use flate2::bufread::{GzDecoder, ZlibDecoder};

use super::header::{ByteSkip, Components, DataLocation, Encoding, GridHeader, ScalarType, next_line};
use super::store::{Stored, store_floats, store_integers};
use crate::volume::{
    asset::{Intensities, Rescale, Volume},
    error::VolumeError,
};

/// Decodes the voxels of the component that `header` chose from `bytes`: all bytes of the file that they are in,
/// which is the header's own where they are attached.
///
/// Voxels that are NaN or infinite become background: see [`Volume::background_voxels`]. Bytes after the last
/// voxel are ignored. Memory grows with what the data really hold, whatever the
/// header claims.
pub(crate) fn decode(header: &GridHeader, bytes: &[u8]) -> Result<Volume, VolumeError> {
    let offset = match header.data {
        DataLocation::Attached { offset } => offset,
        DataLocation::Detached { .. } | DataLocation::NiftiPair => 0,
    };
    let data = skip_lines(bytes, offset, header)?;
    let gzip = data.starts_with(&[0x1f, 0x8b, 0x08]);
    let voxels = match header.encoding {
        Encoding::Ascii => Cow::Owned(super::ascii::parse(header, data)?),
        Encoding::Raw => one_component(header, raw(header, data)?.into()),
        Encoding::RawOrGzip if !gzip || is_exactly_raw(header, data) => {
            one_component(header, raw(header, data)?.into())
        }
        Encoding::Zlib if !gzip => one_component(header, inflate(header, ZlibDecoder::new(data))?.into()),
        Encoding::RawOrGzip | Encoding::Gzip | Encoding::Zlib => {
            one_component(header, inflate(header, Members::new(data))?.into())
        }
    };
    // Numbers from text were turned into bytes here, little end first.
    let big_endian = header.big_endian && header.encoding != Encoding::Ascii;
    let Rescale { slope, intercept } = header.rescale;
    let stored = store(header.scalar, big_endian, slope < 0.0, voxels)?;
    // file units = slope * (step * stored + base) + intercept
    let rescale = Rescale { slope: slope * stored.step, intercept: slope * stored.base + intercept };
    let volume = Volume::new(header.dimensions, header.grid_to_patient, stored.intensities, rescale)?;
    Ok(volume.with_background_voxels(stored.background))
}

/// The bytes from `offset` on, less the lines that the header says to skip.
fn skip_lines<'a>(bytes: &'a [u8], offset: usize, header: &GridHeader) -> Result<&'a [u8], VolumeError> {
    let missing = || truncated(header.data_bytes(), 0);
    let mut at = offset;
    for _ in 0..header.line_skip {
        // Ends with the bytes, however many lines are claimed.
        (_, at) = next_line(bytes, at).ok_or_else(missing)?;
    }
    bytes.get(at..).ok_or_else(missing)
}

fn truncated(expected_bytes: u64, found: usize) -> VolumeError {
    VolumeError::Truncated { expected_bytes, found_bytes: found as u64 }
}

/// Whether uncompressed data happen to begin with gzip's three bytes: only then is a separate file
/// exactly as long as its voxels.
fn is_exactly_raw(header: &GridHeader, data: &[u8]) -> bool {
    header.data == DataLocation::NiftiPair
        && header.byte_skip == ByteSkip::FromStart(0)
        && data.len() as u64 == header.data_bytes()
}

/// Where in the data of all components the bytes are that must be read for the chosen one: how many to skip, and
/// how many follow. Volumes that follow each other are skipped; of interleaved ones, and of those whose place is
/// known from the end alone, all are needed.
fn part(header: &GridHeader) -> (u64, u64) {
    if header.run() == header.voxels() && header.byte_skip != ByteSkip::FromEnd {
        (header.components.index * header.volume_bytes(), header.volume_bytes())
    } else {
        (0, header.data_bytes())
    }
}

/// The chosen component's bytes of the [`part`] that was read.
fn one_component<'a>(header: &GridHeader, part: Cow<'a, [u8]>) -> Cow<'a, [u8]> {
    let Components { count, index, .. } = header.components;
    let run_bytes = header.run() * header.scalar.bytes();
    if part.len() as u64 == header.volume_bytes() {
        return part;
    }
    // No longer than the part, whose bytes are there.
    let [run, round, start] = [run_bytes, run_bytes * count, run_bytes * index].map(|bytes| bytes as usize);
    let mut voxels = Vec::with_capacity(header.volume_bytes() as usize);
    part.chunks_exact(round).for_each(|round| voxels.extend_from_slice(&round[start..start + run]));
    voxels.into()
}

/// The bytes of the [`part`] of uncompressed data.
fn raw<'a>(header: &GridHeader, data: &'a [u8]) -> Result<&'a [u8], VolumeError> {
    let (skip, expected) = part(header);
    let first = match header.byte_skip {
        ByteSkip::FromStart(first) => first,
        ByteSkip::FromEnd => {
            (data.len() as u64).checked_sub(expected).ok_or_else(|| truncated(expected, data.len()))?
        }
    };
    let start = usize::try_from(first.saturating_add(skip)).ok();
    let rest = start.and_then(|start| data.get(start..)).unwrap_or(&[]);
    usize::try_from(expected)
        .ok()
        .and_then(|expected| rest.get(..expected))
        .ok_or_else(|| truncated(expected, rest.len()))
}

/// The bytes of the [`part`] of a compressed stream. Memory grows with what the stream really holds.
fn inflate(header: &GridHeader, mut stream: impl Read) -> Result<Vec<u8>, VolumeError> {
    let (skip, expected) = part(header);
    let mut voxels = Vec::new();
    match header.byte_skip {
        ByteSkip::FromStart(first) => {
            let skipped = io::copy(&mut stream.by_ref().take(first.saturating_add(skip)), &mut io::sink());
            let result = skipped.and_then(|_| stream.by_ref().take(expected).read_to_end(&mut voxels));
            damaged_unless_short(result)?;
            if voxels.len() as u64 == expected {
                // A little further, the decoder compares the checksum, if the stream ends there.
                damaged_unless_short(io::copy(&mut stream.take(1 << 16), &mut io::sink()))?;
            }
        }
        ByteSkip::FromEnd => keep_last(&mut voxels, expected, stream)?,
    }
    if (voxels.len() as u64) < expected {
        return Err(truncated(expected, voxels.len()));
    }
    Ok(voxels)
}

/// The last `count` bytes of a stream; fewer where it is shorter.
fn keep_last(voxels: &mut Vec<u8>, count: u64, mut stream: impl Read) -> Result<(), VolumeError> {
    loop {
        // Only about twice as many are ever kept.
        let result = stream.by_ref().take(count.max(1 << 16)).read_to_end(voxels);
        // The last bytes of a stream that is cut off are not the data's.
        let Some(read) = damaged_unless_short(result)? else {
            let reason = "the compressed stream is cut off".into();
            return Err(VolumeError::Damaged { reason });
        };
        let extra = (voxels.len() as u64).saturating_sub(count);
        voxels.drain(..usize::try_from(extra).unwrap_or(0));
        if read == 0 {
            return Ok(());
        }
    }
}

/// `None` where a stream ends too early, which shows in how much was read; an error where it is damaged.
fn damaged_unless_short<T>(result: io::Result<T>) -> Result<Option<T>, VolumeError> {
    match result {
        Ok(read) => Ok(Some(read)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
        Err(error) if error.kind() == io::ErrorKind::OutOfMemory => Err(VolumeError::Io(error)),
        Err(error) => Err(VolumeError::Damaged { reason: error.to_string() }),
    }
}

/// Reads gzip members one after the other, and ends at the first bytes that begin none:
/// some programs pad the file.
pub(super) struct Members<'a> {
    member: GzDecoder<&'a [u8]>,
}

impl<'a> Members<'a> {
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { member: GzDecoder::new(data) }
    }
}

impl Read for Members<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.member.read(buffer)?;
            let rest = *self.member.get_ref();
            if read > 0 || buffer.is_empty() || !rest.starts_with(&[0x1f, 0x8b]) {
                return Ok(read);
            }
            self.member = GzDecoder::new(rest);
        }
    }
}

/// Turns the file's numbers into stored ones. `falling` says that the file's unit has the opposite sign.
fn store(
    scalar: ScalarType,
    big_endian: bool,
    falling: bool,
    voxels: Cow<'_, [u8]>,
) -> Result<Stored, VolumeError> {
    /// The numbers of `voxels` in either byte order.
    macro_rules! numbers {
        ($number:ty) => {
            voxels.as_chunks().0.iter().map(|&bytes| {
                if big_endian { <$number>::from_be_bytes(bytes) } else { <$number>::from_le_bytes(bytes) }
            })
        };
    }
    Ok(match scalar {
        ScalarType::U8 => Stored::exactly(Intensities::U8(voxels.into_owned()), 0),
        ScalarType::I8 => {
            let mut bytes = voxels.into_owned();
            bytes.iter_mut().for_each(|byte| *byte ^= 0x80);
            Stored::exactly(Intensities::U8(bytes), -128)
        }
        ScalarType::U16 => Stored::exactly(Intensities::U16(numbers!(u16).collect()), 0),
        ScalarType::I16 => {
            // Flipping the sign bit adds 32768.
            let values = numbers!(u16).map(|value| value ^ 0x8000).collect();
            Stored::exactly(Intensities::U16(values), -32_768)
        }
        ScalarType::U32 => store_integers(numbers!(u32).map(i128::from)),
        ScalarType::I32 => store_integers(numbers!(i32).map(i128::from)),
        ScalarType::U64 => store_integers(numbers!(u64).map(i128::from)),
        ScalarType::I64 => store_integers(numbers!(i64).map(i128::from)),
        ScalarType::F32 => store_floats(numbers!(f32).map(f64::from), falling)?,
        ScalarType::F64 => store_floats(numbers!(f64), falling)?,
    })
}
