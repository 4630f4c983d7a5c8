//! Transfer syntaxes: how pixels are stored.

use super::parse::{DEFLATED, EXPLICIT_BIG, EXPLICIT_LITTLE, IMPLICIT_LITTLE};

/// Storage of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    Native,
    Rle,
    /// Lossless, or baseline of eight bits.
    Jpeg,
    JpegLs,
    Jpeg2000,
}

impl Syntax {
    /// The syntax by its identifier; otherwise its name.
    pub fn of(uid: &str) -> Result<Self, String> {
        match uid {
            IMPLICIT_LITTLE | EXPLICIT_LITTLE | EXPLICIT_BIG => Ok(Self::Native),
            "1.2.840.10008.1.2.5" => Ok(Self::Rle),
            "1.2.840.10008.1.2.4.50" | "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => Ok(Self::Jpeg),
            "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => Ok(Self::JpegLs),
            "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => Ok(Self::Jpeg2000),
            _ => Err(name(uid)),
        }
    }

    /// Most pixels that a compressed byte can hold.
    ///
    /// A pixel of a JPEG takes a bit at least, and a byte of RLE is repeated 128 times by two bytes. The other two
    /// write areas of one value in few bytes: an empty slice of 512x512 in about a hundred.
    pub fn pixels_per_byte(self) -> u64 {
        match self {
            Self::Native => 1,
            Self::Jpeg => 8,
            Self::Rle => 64,
            Self::JpegLs | Self::Jpeg2000 => 1 << 13,
        }
    }
}

fn name(uid: &str) -> String {
    let name = match uid {
        DEFLATED => "Deflated Explicit VR Little Endian",
        "1.2.840.10008.1.2.4.51" => "JPEG Extended (12 bit)",
        "1.2.840.10008.1.2.4.92" | "1.2.840.10008.1.2.4.93" => "JPEG 2000 Multi-component",
        "1.2.840.10008.1.2.4.201" | "1.2.840.10008.1.2.4.202" | "1.2.840.10008.1.2.4.203" => "HTJ2K",
        "1.2.840.10008.1.2.4.110" | "1.2.840.10008.1.2.4.111" | "1.2.840.10008.1.2.4.112" => "JPEG XL",
        _ if uid.starts_with("1.2.840.10008.1.2.4.10") => "MPEG",
        // A text of the file's, which may be anything.
        _ if uid.len() > 64 || !uid.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.') => {
            return "with an impossible identifier".into();
        }
        _ => return uid.into(),
    };
    format!("{name} ({uid})")
}
