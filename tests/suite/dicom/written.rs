//! Writes DICOM files: field by field, in any syntax. `oracles` has another reader check them.

/// Storage of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Syntax {
    Implicit,
    Explicit,
    BigEndian,
    Rle,
}

impl Syntax {
    pub const ALL: [Self; 4] = [Self::Implicit, Self::Explicit, Self::BigEndian, Self::Rle];

    fn uid(self) -> &'static str {
        match self {
            Self::Implicit => "1.2.840.10008.1.2",
            Self::Explicit => "1.2.840.10008.1.2.1",
            Self::BigEndian => "1.2.840.10008.1.2.2",
            Self::Rle => "1.2.840.10008.1.2.5",
        }
    }
}

/// A field: its tag, its representation and its value in little endian, or the items of a sequence.
#[derive(Clone, Debug)]
pub enum Field {
    Value(u32, &'static str, Vec<u8>),
    Items(u32, Vec<Vec<Field>>),
}

pub fn text(tag: u32, representation: &'static str, text: &str) -> Field {
    let mut bytes = text.as_bytes().to_vec();
    if bytes.len() % 2 == 1 {
        bytes.push(if representation == "UI" { 0 } else { b' ' });
    }
    Field::Value(tag, representation, bytes)
}

pub fn numbers(tag: u32, numbers: &[f64]) -> Field {
    // Sixteen characters are the standard's limit; most programs write more.
    let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
    text(tag, "DS", &words.join("\\"))
}

pub fn short(tag: u32, value: u16) -> Field {
    Field::Value(tag, "US", value.to_le_bytes().to_vec())
}

fn tag(field: &Field) -> u32 {
    match field {
        Field::Value(tag, ..) | Field::Items(tag, _) => *tag,
    }
}

/// A file of these fields, in any order, and of a frame's or several frames' pixel bytes in little endian.
pub fn file(syntax: Syntax, mut fields: Vec<Field>, frames: &[Vec<u8>], bytes_per_pixel: usize) -> Vec<u8> {
    let mut file = vec![0; 128];
    file.extend(b"DICM");
    let meta = [text(0x0002_0010, "UI", syntax.uid())];
    meta.iter().for_each(|field| put(&mut file, Syntax::Explicit, field));
    fields.sort_by_key(tag);
    fields.iter().for_each(|field| put(&mut file, syntax, field));
    if frames.is_empty() {
        return file;
    }
    if syntax == Syntax::Rle {
        head(&mut file, syntax, 0x7fe0_0010, "OB", u32::MAX);
        item(&mut file, &[]);
        frames.iter().for_each(|frame| item(&mut file, &rle(frame, bytes_per_pixel)));
        file.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
        return file;
    }
    let mut pixels = frames.concat();
    if pixels.len() % 2 == 1 {
        pixels.push(0);
    }
    if syntax == Syntax::BigEndian {
        // Bytes of eight-bit pixels are pairs in words.
        swap(&mut pixels, bytes_per_pixel.max(2));
    }
    head(&mut file, syntax, 0x7fe0_0010, "OW", pixels.len() as u32);
    file.extend(pixels);
    file
}

fn item(file: &mut Vec<u8>, bytes: &[u8]) {
    file.extend([0xfe, 0xff, 0x00, 0xe0]);
    file.extend((bytes.len() as u32).to_le_bytes());
    file.extend(bytes);
}

fn swap(bytes: &mut [u8], width: usize) {
    bytes.chunks_exact_mut(width).for_each(<[u8]>::reverse);
}

fn number(file: &mut Vec<u8>, syntax: Syntax, number: u32, width: usize) {
    let mut bytes = number.to_le_bytes()[..width].to_vec();
    if syntax == Syntax::BigEndian {
        bytes.reverse();
    }
    file.extend(bytes);
}

fn head(file: &mut Vec<u8>, syntax: Syntax, tag: u32, representation: &str, length: u32) {
    number(file, syntax, tag >> 16, 2);
    number(file, syntax, tag & 0xffff, 2);
    if syntax == Syntax::Implicit || tag >> 16 == 0xfffe {
        return number(file, syntax, length, 4);
    }
    file.extend(representation.as_bytes());
    if matches!(representation, "OB" | "OW" | "SQ" | "UN" | "UT") {
        number(file, syntax, 0, 2);
        number(file, syntax, length, 4);
    } else {
        number(file, syntax, length, 2);
    }
}

fn put(file: &mut Vec<u8>, syntax: Syntax, field: &Field) {
    match field {
        Field::Value(tag, representation, value) => {
            let mut value = value.clone();
            if syntax == Syntax::BigEndian {
                match *representation {
                    "US" | "SS" => swap(&mut value, 2),
                    "UL" => swap(&mut value, 4),
                    "FD" => swap(&mut value, 8),
                    _ => {}
                }
            }
            head(file, syntax, *tag, representation, value.len() as u32);
            file.extend(value);
        }
        // Both ways to end a sequence are used: by its length if it is short, else by a delimiter.
        Field::Items(tag, items) => {
            let mut content = Vec::new();
            for fields in items {
                let mut fields = fields.clone();
                fields.sort_by_key(self::tag);
                let mut bytes = Vec::new();
                fields.iter().for_each(|field| put(&mut bytes, syntax, field));
                let defined = bytes.len() % 4 == 0;
                head(
                    &mut content,
                    syntax,
                    0xfffe_e000,
                    "",
                    if defined { bytes.len() as u32 } else { u32::MAX },
                );
                content.extend(bytes);
                if !defined {
                    head(&mut content, syntax, 0xfffe_e00d, "", 0);
                }
            }
            let defined = items.len() < 2;
            head(file, syntax, *tag, "SQ", if defined { content.len() as u32 } else { u32::MAX });
            file.extend(content);
            if !defined {
                head(file, syntax, 0xfffe_e0dd, "", 0);
            }
        }
    }
}

/// Packs a frame: runs of one byte, and all others as they are.
fn rle(frame: &[u8], bytes_per_pixel: usize) -> Vec<u8> {
    let mut segments: Vec<Vec<u8>> = Vec::new();
    for significance in (0..bytes_per_pixel).rev() {
        let plane: Vec<u8> = frame.iter().skip(significance).step_by(bytes_per_pixel).copied().collect();
        let mut packed = Vec::new();
        for run in plane.chunk_by(|a, b| a == b) {
            for part in run.chunks(128) {
                match part {
                    [byte] => packed.extend([0, *byte]),
                    _ => packed.extend([(257 - part.len()) as u8, part[0]]),
                }
            }
        }
        if packed.len() % 2 == 1 {
            packed.push(0x80);
        }
        segments.push(packed);
    }
    let mut bytes = (segments.len() as u32).to_le_bytes().to_vec();
    let mut start = 64u32;
    for segment in &segments {
        bytes.extend(start.to_le_bytes());
        start += segment.len() as u32;
    }
    bytes.resize(64, 0);
    segments.iter().for_each(|segment| bytes.extend(segment));
    bytes
}
