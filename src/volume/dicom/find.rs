//! Finds files: in folders, in zip archives, and by a DICOMDIR or a list of names.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use rawzip::{CompressionMethod, ZipArchive};

use super::{
    data_set::DataSet,
    left_out::{LeftOut, Reason},
    parse::{Unparsed, parse},
    source::{Entry, Source},
    tags,
};
use crate::volume::error::{VolumeError, VolumeFileError};

/// The class of a DICOMDIR.
const DIRECTORY_CLASS: &str = "1.2.840.10008.1.3.10";
/// Folders within folders.
const MAX_DEPTH: usize = 32;
/// Files of one call.
const MAX_FILES: usize = 1 << 20;
/// Largest index that is read: a DICOMDIR has about a kilobyte for each file.
const MAX_INDEX_BYTES: u64 = 1 << 28;

/// Files that were found, and those that were not.
#[derive(Default)]
pub(super) struct Found {
    pub sources: Vec<Source>,
    pub left_out: Vec<LeftOut>,
}

/// Finds the files of folders, DICOMDIRs and archives.
pub(super) fn find(paths: &[PathBuf]) -> Result<Found, VolumeFileError> {
    let mut found = Found::default();
    for path in paths {
        if path.is_dir() {
            found.folder(path, 0)?;
        } else {
            let source = Source::file(path)?;
            match Kind::of(&source).map_err(|cause| source.error(cause))? {
                Kind::Archive => found.archive(source)?,
                Kind::Directory(records) => found.records(path, &records),
                Kind::Image => found.add(source),
            }
        }
    }
    Ok(found)
}

/// Kind of a file, by its content.
pub(super) enum Kind {
    /// A zip archive.
    Archive,
    /// A DICOMDIR.
    Directory(Vec<Record>),
    /// Any other file.
    Image,
}

/// A file that a DICOMDIR names.
pub(super) struct Record {
    /// Names of folders, and the file's.
    pub names: Vec<String>,
    /// The identifier of the file's content.
    instance: Option<String>,
}

impl Kind {
    pub fn of(source: &Source) -> Result<Self, VolumeError> {
        let beginning = source.range(0, 1024)?;
        if beginning.starts_with(b"PK\x03\x04") || beginning.starts_with(b"PK\x05\x06") {
            return Ok(Self::Archive);
        }
        let class = DIRECTORY_CLASS.as_bytes();
        let is_directory = beginning.get(128..132) == Some(b"DICM")
            && beginning.windows(class.len()).any(|window| window == class);
        if !is_directory || source.length() > MAX_INDEX_BYTES {
            return Ok(Self::Image);
        }
        let bytes = source.all()?;
        Ok(match parse(&bytes, true) {
            Ok(parsed) if is_index(&parsed.fields) => Self::Directory(records(&parsed.fields)),
            _ => Self::Image,
        })
    }
}

/// Whether the fields are a DICOMDIR's.
pub(super) fn is_index(fields: &DataSet) -> bool {
    fields.text(tags::MEDIA_STORAGE_SOP_CLASS_UID) == Some(DIRECTORY_CLASS)
}

fn records(fields: &DataSet) -> Vec<Record> {
    let items = fields.items(tags::DIRECTORY_RECORD_SEQUENCE).iter();
    let record = |item: &DataSet| {
        let names: Vec<_> = item.words(tags::REFERENCED_FILE_ID).map(String::from).collect();
        // Names that leave the folder are none of the standard's.
        let stays = names.iter().all(|name| !name.is_empty() && name != ".." && !name.contains(['/', ':']));
        let instance = item.text(tags::REFERENCED_SOP_INSTANCE_UID_IN_FILE).map(String::from);
        (stays && !names.is_empty()).then_some(Record { names, instance })
    };
    items.filter_map(record).collect()
}

impl Found {
    fn add(&mut self, source: Source) {
        if self.sources.len() < MAX_FILES {
            self.sources.push(source);
        } else {
            self.left_out.push(LeftOut { path: source.path, reason: Reason::TooMany { max: MAX_FILES } });
        }
    }

    /// Finds the files of a folder and of the folders in it, sorted by name.
    fn folder(&mut self, folder: &Path, depth: usize) -> Result<(), VolumeFileError> {
        let at = |error: std::io::Error| VolumeFileError { path: folder.to_owned(), cause: error.into() };
        let entries = fs::read_dir(folder).map_err(at)?;
        let mut paths = entries
            .map(|entry| entry.map(|entry| entry.path()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(at)?;
        paths.sort();
        for path in paths {
            if path.is_dir() {
                // A link may lead back to a folder around it.
                if depth < MAX_DEPTH && !path.is_symlink() {
                    self.folder(&path, depth + 1)?;
                }
            } else {
                match Source::file(&path) {
                    Ok(source) => self.add(source),
                    Err(error) => {
                        self.left_out.push(LeftOut { path, reason: Reason::Unreadable(error.cause) })
                    }
                }
            }
        }
        Ok(())
    }

    /// Finds the files of a zip archive.
    pub fn archive(&mut self, source: Source) -> Result<(), VolumeFileError> {
        let archive = Arc::new(source);
        let entries = entries(&archive).map_err(|cause| archive.error(cause))?;
        for (name, entry) in entries {
            self.add(Source::entry(&archive, &name, entry));
        }
        Ok(())
    }

    /// Finds the files that a DICOMDIR names.
    fn records(&mut self, directory: &Path, records: &[Record]) {
        let folder = directory.parent().unwrap_or(Path::new(""));
        let mut listed = HashMap::new();
        for record in records {
            let path = record.locate(folder, &mut listed);
            let source = path.as_deref().map(Source::file);
            match source {
                Some(Ok(source)) => self.add(source),
                _ => {
                    let path = record.names.iter().fold(folder.to_owned(), |path, name| path.join(name));
                    self.left_out.push(LeftOut { path, reason: Reason::NotThere });
                }
            }
        }
    }
}

/// Files by their names in capitals, of folders that were looked into.
type Listed = HashMap<PathBuf, HashMap<String, PathBuf>>;

impl Record {
    /// The record's file. Names may differ in upper and lower case.
    ///
    /// A DICOMDIR that was copied beside its files has names that begin too early: then the end of the names must do,
    /// unless the file's identifier is not the record's.
    fn locate(&self, folder: &Path, listed: &mut Listed) -> Option<PathBuf> {
        let whole = Self::walk(folder, &self.names, listed).filter(|path| path.is_file());
        whole.or_else(|| {
            let ends = (1..self.names.len()).filter_map(|skip| self.names.get(skip..));
            let mut paths = ends.filter_map(|names| Self::walk(folder, names, listed));
            paths.find(|path| path.is_file() && self.describes(path))
        })
    }

    fn walk(folder: &Path, names: &[String], listed: &mut Listed) -> Option<PathBuf> {
        names.iter().try_fold(folder.to_owned(), |path, name| {
            let children = listed.entry(path).or_insert_with_key(|path| {
                let entries = fs::read_dir(path).into_iter().flatten().flatten();
                let by_name = |entry: fs::DirEntry| {
                    let name = entry.file_name().to_string_lossy().to_uppercase();
                    (name, entry.path())
                };
                entries.map(by_name).collect()
            });
            children.get(&name.to_uppercase()).cloned()
        })
    }

    fn describes(&self, path: &Path) -> bool {
        let Some(instance) = &self.instance else { return true };
        let Ok(bytes) =
            Source::file(path).map_err(|error| error.cause).and_then(|file| file.range(0, 1 << 16))
        else {
            return false;
        };
        // The identifier is within the first kilobytes, in any encoding.
        bytes.windows(instance.len()).any(|window| window == instance.as_bytes())
    }
}

/// The files in a zip archive.
fn entries(archive: &Source) -> Result<Vec<(String, Entry)>, VolumeError> {
    let damaged = |error: rawzip::Error| VolumeError::Damaged { reason: format!("the archive: {error}") };
    let mut buffer = vec![0; rawzip::RECOMMENDED_BUFFER_SIZE];
    let reader = Positions(archive);
    let locator = rawzip::ZipLocator::new();
    let zip: ZipArchive<Positions> = locator
        .locate_in_reader(reader, &mut buffer, archive.length())
        .map_err(|(_, error)| damaged(error))?;
    let mut found = Vec::new();
    let mut places = Vec::new();
    let mut entries = zip.entries(&mut buffer);
    while let Some(entry) = entries.next_entry().map_err(damaged)? {
        if entry.is_dir() || found.len() + places.len() > MAX_FILES {
            continue;
        }
        let name = String::from_utf8_lossy(entry.file_path().as_ref()).into_owned();
        places.push((name, entry.wayfinder(), entry.compression_method(), entry.crc32()));
    }
    for (name, place, method, checksum) in places {
        let deflated = match method {
            CompressionMethod::STORE => false,
            CompressionMethod::DEFLATE => true,
            other => return Err(VolumeError::UnsupportedEncoding(format!("{other:?} in a zip archive"))),
        };
        let local = zip.get_entry(place).map_err(damaged)?;
        let (start, end) = local.compressed_data_range();
        let (stored_length, length) = (end.saturating_sub(start), place.uncompressed_size_hint());
        // Deflate cannot expand more.
        let most = stored_length.saturating_mul(if deflated { 1032 } else { 1 });
        if end > archive.length() || length > most.saturating_add(64) {
            return Err(VolumeError::Damaged { reason: "the archive's lengths do not fit".into() });
        }
        found.push((name, Entry { start, stored_length, length, deflated, checksum }));
    }
    // In the order of names, as a folder's files.
    found.sort_by(|(a, _), (b, _)| a.cmp(b));
    Ok(found)
}

struct Positions<'a>(&'a Source);

impl rawzip::ReaderAt for Positions<'_> {
    fn read_at(&self, buffer: &mut [u8], offset: u64) -> std::io::Result<usize> {
        let bytes = self.0.range(offset, buffer.len() as u64).map_err(std::io::Error::other)?;
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok(bytes.len())
    }
}

/// Reason for a file that is no image.
pub(super) fn reason(unparsed: Unparsed) -> Reason {
    match unparsed {
        Unparsed::NotDicom => Reason::NotDicom,
        Unparsed::Short => Reason::CutOff,
        Unparsed::Damaged(finding) => Reason::Unreadable(VolumeError::Damaged { reason: finding.into() }),
    }
}
