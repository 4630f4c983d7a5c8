//! A file's image: the pixels' format, and what all of its frames share.

use super::{
    data_set::DataSet,
    left_out::Reason,
    parse::{Parsed, PixelData},
    source::Source,
    suv::Suv,
    syntax::Syntax,
    tags,
};
use crate::volume::error::VolumeError;

/// An image of one or several frames. Nothing in it names the patient.
#[derive(Debug)]
pub(super) struct Image {
    pub source: Source,
    pub series: String,
    pub instance: String,
    pub frame_of_reference: String,
    pub modality: String,
    pub series_number: Option<i32>,
    pub instance_number: i32,
    /// Kind of the picture: its third word tells a magnitude from a phase.
    pub image_type: String,
    pub columns: u32,
    pub rows: u32,
    pub frames: u32,
    pub format: Format,
    pub syntax: Syntax,
    pub pixels: PixelData,
    pub big_endian: bool,
    /// Conversion to standardised uptake, or why there is none; for PET alone.
    pub suv: Option<Result<Suv, &'static str>>,
}

/// Format of a pixel's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Format {
    pub bits_allocated: u32,
    pub bits_stored: u32,
    pub high_bit: u32,
    pub signed: bool,
    /// High values are dark.
    pub inverted: bool,
    /// Lowest and highest of the numbers that mark pixels without a value.
    pub padding: Option<[i64; 2]>,
}

impl Format {
    pub fn bytes(self) -> u64 {
        u64::from(self.bits_allocated) / 8
    }
}

const SEGMENTATION_CLASS: &str = "1.2.840.10008.5.1.4.1.1.66.4";
const SECONDARY_CAPTURE_CLASS: &str = "1.2.840.10008.5.1.4.1.1.7";

impl Image {
    /// Reads an image's fields, or tells why it is no slice.
    pub fn of(source: &Source, parsed: &Parsed) -> Result<Self, Reason> {
        let fields = &parsed.fields;
        let text = |tag| fields.text(tag).map(code);
        let class = fields.text(tags::SOP_CLASS_UID).unwrap_or_default();
        if super::find::is_index(fields) {
            return Err(Reason::Index);
        }
        let syntax = Syntax::of(&parsed.transfer_syntax).map_err(Reason::TransferSyntax)?;
        let Some(pixels) = parsed.pixels else {
            return Err(Reason::NoPixels { modality: text(tags::MODALITY) });
        };
        let image_type = fields.words(tags::IMAGE_TYPE);
        let is = |word: &str| fields.words(tags::IMAGE_TYPE).any(|of| of.eq_ignore_ascii_case(word));
        let photometric = text(tags::PHOTOMETRIC_INTERPRETATION).unwrap_or_else(|| "MONOCHROME2".into());
        let samples = fields.u16(tags::SAMPLES_PER_PIXEL).unwrap_or(1);
        if class == SEGMENTATION_CLASS {
            return Err(Reason::Segmentation);
        } else if samples != 1 || !photometric.starts_with("MONOCHROME") {
            return Err(Reason::Colour(photometric));
        } else if class.starts_with(SECONDARY_CAPTURE_CLASS) {
            return Err(Reason::SecondaryCapture);
        } else if is("LOCALIZER") {
            return Err(Reason::Localizer);
        } else if is("MOSAIC") {
            return Err(Reason::Mosaic);
        } else if fields.has(tags::MODALITY_LUT_SEQUENCE) {
            return Err(Reason::ModalityLut);
        }
        let size = |tag| match fields.u16(tag) {
            Some(size) if size > 0 => Ok(u32::from(size)),
            size => {
                let size = size.map_or(String::new(), |size| size.to_string());
                Err(VolumeError::field(tags::name(tag), size, "must be at least 1"))
            }
        };
        let frames = match fields.number(tags::NUMBER_OF_FRAMES) {
            None => 1,
            Some(frames) if (1.0..=65_535.0).contains(&frames) => frames as u32,
            Some(frames) => {
                let reason = "must be from 1 to 65535";
                return Err(VolumeError::field("NumberOfFrames", frames, reason).into());
            }
        };
        let image = Self {
            source: source.clone(),
            series: text(tags::SERIES_INSTANCE_UID).unwrap_or_default(),
            instance: text(tags::SOP_INSTANCE_UID).unwrap_or_default(),
            frame_of_reference: text(tags::FRAME_OF_REFERENCE_UID).unwrap_or_default(),
            modality: text(tags::MODALITY).unwrap_or_default(),
            series_number: fields.number(tags::SERIES_NUMBER).map(|number| number as i32),
            instance_number: fields.number(tags::INSTANCE_NUMBER).map_or(0, |number| number as i32),
            image_type: image_type.skip(2).map(code).collect::<Vec<_>>().join(" "),
            columns: size(tags::COLUMNS)?,
            rows: size(tags::ROWS)?,
            frames,
            format: format(fields, &pixels, syntax, photometric == "MONOCHROME1")?,
            syntax,
            pixels,
            big_endian: parsed.big_endian,
            suv: fields.text(tags::MODALITY).filter(|&modality| modality == "PT").map(|_| Suv::of(fields)),
        };
        image.check_length()?;
        Ok(image)
    }

    /// Bytes of an uncompressed frame.
    pub fn frame_bytes(&self) -> u64 {
        self.frame_pixels() * self.format.bytes()
    }

    pub fn frame_pixels(&self) -> u64 {
        u64::from(self.columns) * u64::from(self.rows)
    }

    /// Whether pixels of eight bits are pairs in words whose upper byte comes first.
    pub fn has_swapped_bytes(&self) -> bool {
        self.big_endian && self.format.bits_allocated == 8 && self.pixels.words
    }

    /// Checks that the pixels can be in the file, before room is made for them.
    fn check_length(&self) -> Result<(), VolumeError> {
        let there = self.source.length().saturating_sub(self.pixels.start);
        let frames = u64::from(self.frames);
        if self.syntax == Syntax::Native {
            let expected_bytes = self.frame_bytes().saturating_mul(frames);
            let found_bytes = there.min(self.pixels.length.unwrap_or(0));
            if found_bytes < expected_bytes {
                return Err(VolumeError::Truncated { expected_bytes, found_bytes });
            }
            return Ok(());
        }
        if self.pixels.length.is_some() {
            return Err(VolumeError::Damaged { reason: "compressed pixels are not in fragments".into() });
        }
        let most = there.saturating_mul(self.syntax.pixels_per_byte());
        if self.frame_pixels().saturating_mul(frames) > most {
            let sizes = [self.columns.into(), self.rows.into(), frames].to_vec();
            let reason = format!("{there} compressed bytes cannot hold so many pixels");
            return Err(VolumeError::Dimensions { sizes, reason });
        }
        Ok(())
    }
}

/// A short text that may be printed: codes and identifiers are of letters, digits and little else.
pub(super) fn code(text: &str) -> String {
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || " ._-+/".contains(*c);
    text.chars().filter(is_plain).take(64).collect()
}

fn format(fields: &DataSet, pixels: &PixelData, syntax: Syntax, inverted: bool) -> Result<Format, Reason> {
    if pixels.tag != tags::PIXEL_DATA {
        return Err(Reason::Pixels("with floating-point numbers".into()));
    }
    let bits_allocated = fields.u16(tags::BITS_ALLOCATED).map_or(0, u32::from);
    let supported = matches!(bits_allocated, 8 | 16) || bits_allocated == 32 && syntax == Syntax::Native;
    if !supported {
        let kind = match bits_allocated {
            12 => "of 12 bits, packed,".into(),
            1 => "of 1 bit".into(),
            bits if syntax == Syntax::Native => format!("of {bits} bits"),
            bits => format!("of {bits} bits in {syntax:?}"),
        };
        return Err(Reason::Pixels(kind));
    }
    let bits_stored = fields.u16(tags::BITS_STORED).map_or(bits_allocated, u32::from);
    let high_bit = fields.u16(tags::HIGH_BIT).map_or(bits_stored.saturating_sub(1), u32::from);
    if bits_stored == 0 || bits_stored > bits_allocated {
        let reason = format!("must be from 1 to BitsAllocated, {bits_allocated}");
        return Err(VolumeError::field("BitsStored", bits_stored, reason).into());
    }
    if high_bit >= bits_allocated || high_bit + 1 < bits_stored {
        let reason = format!("{bits_stored} bits of {bits_allocated} do not fit below it");
        return Err(VolumeError::field("HighBit", high_bit, reason).into());
    }
    let signed = fields.u16(tags::PIXEL_REPRESENTATION) == Some(1);
    let number = |tag| {
        let number = fields.integer(tag)?;
        Some(match (signed, bits_allocated) {
            (true, 32) => i64::from(number as i32),
            (true, _) => i64::from(number as u16 as i16),
            (false, _) => i64::from(number),
        })
    };
    let padding = number(tags::PIXEL_PADDING_VALUE).map(|value| {
        let limit = number(tags::PIXEL_PADDING_RANGE_LIMIT).unwrap_or(value);
        [value.min(limit), value.max(limit)]
    });
    Ok(Format { bits_allocated, bits_stored, high_bit, signed, inverted, padding })
}
