//! Bytes of a file: on disk, in memory, or in a zip archive.

use std::{
    fmt,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::Arc,
};

use flate2::{CrcReader, read::DeflateDecoder};

use crate::volume::error::{VolumeError, VolumeFileError};

/// A file whose bytes are read when they are needed.
#[derive(Clone)]
pub(super) struct Source {
    /// The name for errors; within an archive, the archive's path comes first.
    pub path: PathBuf,
    bytes: Bytes,
}

#[derive(Clone)]
enum Bytes {
    File { length: u64 },
    Memory(Arc<Vec<u8>>),
    Entry { archive: Arc<Source>, entry: Entry },
}

/// Place of a file in a zip archive.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub start: u64,
    pub stored_length: u64,
    pub length: u64,
    pub deflated: bool,
    pub checksum: u32,
}

impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} bytes)", self.path.display(), self.length())
    }
}

impl Source {
    /// A file on disk.
    pub fn file(path: &Path) -> Result<Self, VolumeFileError> {
        let at = |error: io::Error| VolumeFileError { path: path.to_owned(), cause: error.into() };
        let length = std::fs::metadata(path).map_err(at)?.len();
        Ok(Self { path: path.to_owned(), bytes: Bytes::File { length } })
    }

    /// A file whose bytes are there already.
    pub fn memory(path: &Path, bytes: Vec<u8>) -> Self {
        Self { path: path.to_owned(), bytes: Bytes::Memory(Arc::new(bytes)) }
    }

    /// A file in an archive.
    pub fn entry(archive: &Arc<Source>, name: &str, entry: Entry) -> Self {
        let archive = archive.clone();
        Self { path: archive.path.join(name), bytes: Bytes::Entry { archive, entry } }
    }

    /// Number of bytes; for a compressed file, as the archive claims.
    pub fn length(&self) -> u64 {
        match &self.bytes {
            Bytes::File { length } => *length,
            Bytes::Memory(bytes) => bytes.len() as u64,
            Bytes::Entry { entry, .. } => entry.length,
        }
    }

    /// Adds the file's name to an error.
    pub fn error(&self, cause: impl Into<VolumeError>) -> VolumeFileError {
        VolumeFileError { path: self.path.clone(), cause: cause.into() }
    }

    /// All bytes.
    pub fn all(&self) -> Result<Vec<u8>, VolumeError> {
        self.range(0, self.length())
    }

    /// Whether bytes in the middle are reached only through those before them.
    pub fn is_deflated(&self) -> bool {
        matches!(self.bytes, Bytes::Entry { entry: Entry { deflated: true, .. }, .. })
    }

    /// The bytes from `start` on; fewer than `length` only at the file's end.
    ///
    /// Memory grows with the bytes that are there.
    pub fn range(&self, start: u64, length: u64) -> Result<Vec<u8>, VolumeError> {
        let mut bytes = Vec::new();
        match &self.bytes {
            Bytes::File { .. } => {
                let mut file = File::open(&self.path)?;
                file.seek(SeekFrom::Start(start))?;
                reserve(&mut bytes, length.min(self.length().saturating_sub(start)))?;
                file.take(length).read_to_end(&mut bytes)?;
            }
            Bytes::Memory(memory) => {
                let end = start.saturating_add(length).min(memory.len() as u64) as usize;
                let there = usize::try_from(start).ok().and_then(|start| memory.get(start..end));
                bytes.extend_from_slice(there.unwrap_or_default());
            }
            Bytes::Entry { archive, entry } => {
                let stored = entry.start..entry.start.saturating_add(entry.stored_length);
                if entry.deflated {
                    let stream = io::BufReader::new(Stream { archive, at: stored });
                    let mut stream = CrcReader::new(DeflateDecoder::new(stream));
                    io::copy(&mut stream.by_ref().take(start), &mut io::sink()).map_err(damaged)?;
                    // No file grows without end: the archive names its length.
                    let length = length.min(entry.length.saturating_sub(start));
                    stream.by_ref().take(length).read_to_end(&mut bytes).map_err(damaged)?;
                    if start + length == entry.length && stream.crc().sum() != entry.checksum {
                        let reason = "the archive's checksum does not match".into();
                        return Err(VolumeError::Damaged { reason });
                    }
                } else {
                    let from = entry.start.saturating_add(start);
                    return archive.range(from, length.min(stored.end.saturating_sub(from)));
                }
            }
        }
        Ok(bytes)
    }
}

/// Room for bytes that are there.
fn reserve(bytes: &mut Vec<u8>, count: u64) -> io::Result<()> {
    let count = usize::try_from(count).map_err(|_| io::ErrorKind::OutOfMemory)?;
    bytes.try_reserve_exact(count).map_err(|_| io::ErrorKind::OutOfMemory.into())
}

fn damaged(error: io::Error) -> VolumeError {
    match error.kind() {
        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
            VolumeError::Damaged { reason: "the archive's compressed data are damaged".into() }
        }
        _ => error.into(),
    }
}

/// The bytes of an archive in a range, read piece by piece.
struct Stream<'a> {
    archive: &'a Source,
    at: std::ops::Range<u64>,
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = (buffer.len() as u64).min(self.at.end.saturating_sub(self.at.start));
        let bytes = self.archive.range(self.at.start, count).map_err(io::Error::other)?;
        buffer[..bytes.len()].copy_from_slice(&bytes);
        self.at.start += bytes.len() as u64;
        Ok(bytes.len())
    }
}
