//! Decodes a volume from a checked header and the data's bytes.

use std::borrow::Cow;
use std::io::{self, Read};

use flate2::bufread::{GzDecoder, ZlibDecoder};

use super::header::{ByteSkip, Components, DataLocation, Encoding, GridHeader, ScalarType, next_line};
use super::store::{Stored, store_floats, store_integers};
use crate::volume::{
    asset::{Intensities, Rescale, Volume},
    error::VolumeError,
};

/// Decodes the voxels of the component that `header` chose from `bytes`.
///
/// `bytes` are all bytes of the file with the voxels. For attached data, this is the header's own file.
///
/// Voxels that are NaN or infinite become background: see [`Volume::background_voxels`]. Bytes after the last
/// voxel are ignored. Memory grows with the data themselves, whatever the header claims.
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
    // Numbers from text have become little-endian bytes.
    let big_endian = header.big_endian && header.encoding != Encoding::Ascii;
    let Rescale { slope, intercept } = header.rescale;
    let stored = store(header.scalar, big_endian, slope < 0.0, voxels)?;
    // file units = slope * (step * stored + base) + intercept
    let rescale = Rescale { slope: slope * stored.step, intercept: slope * stored.base + intercept };
    let volume = Volume::new(header.dimensions, header.grid_to_patient, stored.intensities, rescale)?;
    Ok(volume.with_background_voxels(stored.background))
}

/// The bytes from `offset` on, without the lines that the header skips.
fn skip_lines<'a>(bytes: &'a [u8], offset: usize, header: &GridHeader) -> Result<&'a [u8], VolumeError> {
    let missing = || truncated(header.data_bytes(), 0);
    let mut at = offset;
    for _ in 0..header.line_skip {
        // The loop ends with the bytes, however many lines the header claims.
        (_, at) = next_line(bytes, at).ok_or_else(missing)?;
    }
    bytes.get(at..).ok_or_else(missing)
}

fn truncated(expected_bytes: u64, found: usize) -> VolumeError {
    VolumeError::Truncated { expected_bytes, found_bytes: found as u64 }
}

/// Whether data that begin with gzip's three bytes are uncompressed: only then is a separate file
/// exactly as long as its voxels.
fn is_exactly_raw(header: &GridHeader, data: &[u8]) -> bool {
    header.data == DataLocation::NiftiPair
        && header.byte_skip == ByteSkip::FromStart(0)
        && data.len() as u64 == header.data_bytes()
}

/// Number of bytes to skip and to read, in the data of all components, for the chosen component.
///
/// Of volumes that follow each other, only the chosen volume is read. Interleaved volumes are read together,
/// and so are volumes whose place is known only from the end of the data.
fn part(header: &GridHeader) -> (u64, u64) {
    if header.run() == header.voxels() && header.byte_skip != ByteSkip::FromEnd {
        (header.components.index * header.volume_bytes(), header.volume_bytes())
    } else {
        (0, header.data_bytes())
    }
}

/// The chosen component's bytes in the [`part`] that was read.
fn one_component<'a>(header: &GridHeader, part: Cow<'a, [u8]>) -> Cow<'a, [u8]> {
    let Components { count, index, .. } = header.components;
    let run_bytes = header.run() * header.scalar.bytes();
    if part.len() as u64 == header.volume_bytes() {
        return part;
    }
    // Each length is at most the part's, whose bytes are in memory.
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

/// The bytes of the [`part`] of a compressed stream. Memory grows with the stream itself.
fn inflate(header: &GridHeader, mut stream: impl Read) -> Result<Vec<u8>, VolumeError> {
    let (skip, expected) = part(header);
    let mut voxels = Vec::new();
    match header.byte_skip {
        ByteSkip::FromStart(first) => {
            let skipped = io::copy(&mut stream.by_ref().take(first.saturating_add(skip)), &mut io::sink());
            let result = skipped.and_then(|_| stream.by_ref().take(expected).read_to_end(&mut voxels));
            damaged_unless_short(result)?;
            if voxels.len() as u64 == expected {
                // Reading a little further makes the decoder compare the checksum, if the stream ends there.
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

/// Keeps the last `count` bytes of a stream, or fewer if the stream is shorter.
fn keep_last(voxels: &mut Vec<u8>, count: u64, mut stream: impl Read) -> Result<(), VolumeError> {
    loop {
        // Memory holds at most about twice as many bytes.
        let result = stream.by_ref().take(count.max(1 << 16)).read_to_end(voxels);
        // The last bytes of a stream that is cut off are not the last bytes of the data.
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

/// `None` if a stream ends too early, which the number of bytes read shows; an error if it is damaged.
fn damaged_unless_short<T>(result: io::Result<T>) -> Result<Option<T>, VolumeError> {
    match result {
        Ok(read) => Ok(Some(read)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
        Err(error) if error.kind() == io::ErrorKind::OutOfMemory => Err(VolumeError::Io(error)),
        Err(error) => Err(VolumeError::Damaged { reason: error.to_string() }),
    }
}

/// Reads consecutive gzip members, and ends at the first bytes that begin no member:
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

/// Turns the file's numbers into stored values. `falling` says that the slope to file units is negative.
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
