//! Reads a file's fields, of which it keeps those in [`tags`].
//!
//! Values are borrowed, so a length takes no memory, whatever it claims.

use super::{
    data_set::{DataSet, Value},
    tags::{self, Tag},
};

/// Place of the pixels in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PixelData {
    /// The field: floating-point pixels have others.
    pub tag: Tag,
    /// First byte of the value.
    pub start: u64,
    /// Length of the value; `None` if it is a list of compressed fragments.
    pub length: Option<u64>,
    /// Whether the pixels are words of 16 bits, whatever a pixel's size.
    pub words: bool,
}

/// A file's fields, and the place of its pixels.
#[derive(Debug)]
pub(super) struct Parsed<'a> {
    pub fields: DataSet<'a>,
    pub transfer_syntax: String,
    pub pixels: Option<PixelData>,
    pub big_endian: bool,
}

/// Reason why bytes are no data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unparsed {
    /// It is no DICOM file.
    NotDicom,
    /// The bytes end too early.
    Short,
    /// The finding.
    Damaged(&'static str),
}

pub(super) const IMPLICIT_LITTLE: &str = "1.2.840.10008.1.2";
pub(super) const EXPLICIT_LITTLE: &str = "1.2.840.10008.1.2.1";
pub(super) const DEFLATED: &str = "1.2.840.10008.1.2.1.99";
pub(super) const EXPLICIT_BIG: &str = "1.2.840.10008.1.2.2";

/// Sequences within sequences; real files have about five.
const MAX_DEPTH: usize = 16;
const UNDEFINED: u32 = u32::MAX;
const ITEM: Tag = 0xfffe_e000;
const ITEM_END: Tag = 0xfffe_e00d;
const SEQUENCE_END: Tag = 0xfffe_e0dd;

/// Reads the fields up to the pixels. `whole` says that the bytes are all of the file.
pub(super) fn parse(bytes: &[u8], whole: bool) -> Result<Parsed<'_>, Unparsed> {
    if bytes.len() < 132 && !whole {
        return Err(Unparsed::Short);
    }
    let start = if bytes.get(128..132) == Some(b"DICM") { 132 } else { 0 };
    let mut reader = Reader { bytes, at: start, explicit: true, big_endian: false, whole };
    let mut fields = DataSet::default();
    if reader.peek_group() == Some(2) {
        reader.fields(&mut fields, Until::Group(2), 0, true)?;
    }
    let transfer_syntax = match fields.text(tags::TRANSFER_SYNTAX_UID) {
        Some(uid) => uid.to_owned(),
        // Some programs leave out the beginning of the file.
        None => reader.guess_syntax()?.to_owned(),
    };
    if transfer_syntax == DEFLATED {
        return Ok(Parsed { fields, transfer_syntax, pixels: None, big_endian: false });
    }
    reader.explicit = transfer_syntax != IMPLICIT_LITTLE;
    reader.big_endian = transfer_syntax == EXPLICIT_BIG;
    let mut main = DataSet { fields: fields.fields, big_endian: reader.big_endian };
    let pixels = reader.fields(&mut main, Until::Pixels, 0, true)?;
    Ok(Parsed { fields: main, transfer_syntax, pixels, big_endian: reader.big_endian })
}

/// End of a list of fields.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Until {
    /// The last field of a group.
    Group(u32),
    /// The pixels, or the end of the file.
    Pixels,
    /// A byte.
    Byte(usize),
    /// The item's delimiter.
    Delimiter,
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    explicit: bool,
    big_endian: bool,
    whole: bool,
}

/// A field's head. The value follows.
struct Head {
    tag: Tag,
    /// Value representation; zeros if the file does not say.
    representation: [u8; 2],
    length: u32,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Unparsed> {
        let end = self.at.checked_add(count).ok_or(Unparsed::Short)?;
        let taken = self.bytes.get(self.at..end).ok_or(Unparsed::Short)?;
        self.at = end;
        Ok(taken)
    }

    fn u16(&mut self) -> Result<u16, Unparsed> {
        let bytes = self.take(2)?;
        let pair = [bytes[0], bytes[1]];
        Ok(if self.big_endian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) })
    }

    fn u32(&mut self) -> Result<u32, Unparsed> {
        let bytes = self.take(4)?;
        let four = [bytes[0], bytes[1], bytes[2], bytes[3]];
        Ok(if self.big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
    }

    fn peek_group(&self) -> Option<u16> {
        let bytes = self.bytes.get(self.at..self.at + 2)?;
        Some(u16::from_le_bytes([bytes[0], bytes[1]]))
    }

    /// The transfer syntax of a file that does not name it, by its first field.
    fn guess_syntax(&self) -> Result<&'static str, Unparsed> {
        let Some(first) = self.bytes.get(self.at..self.at + 8) else { return Err(Unparsed::NotDicom) };
        let little = u16::from_le_bytes([first[0], first[1]]);
        let big = u16::from_be_bytes([first[0], first[1]]);
        let explicit = known_representation([first[4], first[5]]);
        match (little, big, explicit) {
            (8, _, true) => Ok(EXPLICIT_LITTLE),
            (8, _, false) if first[2] <= 0x18 && first[3] == 0 && first[7] == 0 => Ok(IMPLICIT_LITTLE),
            (_, 8, true) => Ok(EXPLICIT_BIG),
            _ => Err(Unparsed::NotDicom),
        }
    }

    fn head(&mut self) -> Result<Head, Unparsed> {
        let group = self.u16()?;
        let tag = u32::from(group) << 16 | u32::from(self.u16()?);
        if group == 0xfffe || !self.explicit {
            return Ok(Head { tag, representation: [0; 2], length: self.u32()? });
        }
        let at = self.at;
        let letters = self.take(2)?;
        let representation = [letters[0], letters[1]];
        if !representation.iter().all(u8::is_ascii_uppercase) {
            // Some programs write single fields without a representation.
            self.at = at;
            return Ok(Head { tag, representation: [0; 2], length: self.u32()? });
        }
        let length = if SHORT.contains(&&representation) {
            self.u16()?.into()
        } else {
            self.take(2)?;
            self.u32()?
        };
        Ok(Head { tag, representation, length })
    }

    /// Reads fields, and adds those that are kept if `keep` says so.
    fn fields(
        &mut self,
        into: &mut DataSet<'a>,
        until: Until,
        depth: usize,
        keep: bool,
    ) -> Result<Option<PixelData>, Unparsed> {
        loop {
            match until {
                Until::Group(group)
                    if (self.at < self.bytes.len() || self.whole)
                        && self.peek_group().map(u32::from) != Some(group) =>
                {
                    return Ok(None);
                }
                Until::Byte(end) if self.at >= end => return Ok(None),
                // Bytes that are too few for a field pad the file.
                Until::Pixels if self.whole && self.bytes.len() - self.at < 8 => return Ok(None),
                _ => {}
            }
            let Head { tag, representation, length } = self.head()?;
            if tag == ITEM_END && until == Until::Delimiter {
                return Ok(None);
            }
            if matches!(tag, tags::PIXEL_DATA | tags::FLOAT_PIXEL_DATA | tags::DOUBLE_FLOAT_PIXEL_DATA)
                && until == Until::Pixels
            {
                let length = (length != UNDEFINED).then_some(length.into());
                let words = &representation == b"OW" || !self.explicit;
                return Ok(Some(PixelData { tag, start: self.at as u64, length, words }));
            }
            // Pixels of an icon are none of the image's.
            let kept = keep && tags::is_kept(tag) && tag != tags::PIXEL_DATA;
            if length == UNDEFINED || &representation == b"SQ" || kept && tags::is_sequence(tag) {
                // Unknown representations hide fields without representations.
                let explicit = self.explicit;
                self.explicit = explicit && (&representation == b"SQ" || representation == [0; 2]);
                let items = self.items(length, depth + 1, kept);
                self.explicit = explicit;
                if kept {
                    into.fields.push((tag, Value::Items(items?)));
                } else {
                    items?;
                }
            } else {
                let value = self.take(length as usize)?;
                if kept {
                    into.fields.push((tag, Value::Bytes(value)));
                }
            }
        }
    }

    /// Reads the items of a sequence.
    fn items(&mut self, length: u32, depth: usize, keep: bool) -> Result<Vec<DataSet<'a>>, Unparsed> {
        if depth > MAX_DEPTH {
            return Err(Unparsed::Damaged("too many sequences within each other"));
        }
        let end = self.end_of(length)?;
        if let (Some(end), false) = (end, keep) {
            self.at = end;
            return Ok(Vec::new());
        }
        let mut items = Vec::new();
        while end.is_none_or(|end| self.at < end) {
            let Head { tag, length, .. } = self.head()?;
            match tag {
                ITEM => {
                    let until = self.end_of(length)?.map_or(Until::Delimiter, Until::Byte);
                    let mut item = DataSet { fields: Vec::new(), big_endian: self.big_endian };
                    if let (Until::Byte(end), false) = (until, keep) {
                        self.at = end;
                    } else {
                        self.fields(&mut item, until, depth, keep)?;
                    }
                    if keep {
                        items.push(item);
                    }
                }
                SEQUENCE_END => break,
                _ => return Err(Unparsed::Damaged("a sequence holds a field that is no item")),
            }
        }
        Ok(items)
    }

    /// End of a value of a defined length.
    fn end_of(&self, length: u32) -> Result<Option<usize>, Unparsed> {
        if length == UNDEFINED {
            return Ok(None);
        }
        let end = self.at.checked_add(length as usize).filter(|&end| end <= self.bytes.len());
        end.map(Some).ok_or(Unparsed::Short)
    }
}

/// Representations whose lengths have sixteen bits.
const SHORT: &[&[u8; 2]] = &[
    b"AE", b"AS", b"AT", b"CS", b"DA", b"DS", b"DT", b"FL", b"FD", b"IS", b"LO", b"LT", b"PN", b"SH", b"SL",
    b"SS", b"ST", b"TM", b"UI", b"UL", b"US",
];
const LONG: &[&[u8; 2]] =
    &[b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"];

fn known_representation(letters: [u8; 2]) -> bool {
    SHORT.iter().chain(LONG).any(|&&known| known == letters)
}
