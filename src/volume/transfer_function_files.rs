//! Reading and writing of transfer function files.

#[cfg(feature = "slicer")]
use super::slicer;
use super::transfer_function::TransferFunction;
use super::transfer_function_error::TransferFunctionError;

impl TransferFunction {
    /// Reads the bytes of a file in any readable format, whatever its name.
    ///
    /// The formats are volume properties of 3D Slicer in lines (`.vp`) or JSON (`.vp.json`), and RON (`.tf.ron`).
    ///
    /// # Errors
    ///
    /// [`TransferFunctionError::NotATransferFunction`] names the likely format of another file. Otherwise as
    /// [`from_slicer_vp`](Self::from_slicer_vp) and [`from_ron`](Self::from_ron).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TransferFunctionError> {
        match Content::of(bytes)? {
            Content::Ron(text) => Self::from_ron(text),
            #[cfg(feature = "slicer")]
            Content::Slicer(text) => Self::from_slicer_vp(text),
        }
    }

    /// Reads a transfer function written by [`to_ron`](Self::to_ron). If the unit of length is left out, it is 1 mm.
    ///
    /// # Errors
    ///
    /// [`TransferFunctionError::NotATransferFunction`] if it is not RON, [`TransferFunctionError::Ron`] with the
    /// place in the text, or as [`validate`](Self::validate).
    pub fn from_ron(text: &str) -> Result<Self, TransferFunctionError> {
        let function: Self = ron::from_str(text).map_err(|error| unless_something_else(text, error))?;
        function.validate()?;
        Ok(function)
    }

    /// Writes the transfer function as text, in RON.
    ///
    /// # Errors
    ///
    /// [`TransferFunctionError::WriteRon`], which no value of this type is known to cause.
    pub fn to_ron(&self) -> Result<String, TransferFunctionError> {
        let pretty = ron::ser::PrettyConfig::default().depth_limit(2);
        Ok(ron::ser::to_string_pretty(self, pretty)?)
    }

    /// Reads a volume property of 3D Slicer, in lines (`.vp`) or, from newer versions, in JSON (`.vp.json`).
    ///
    /// The reader takes the opacity, gradient opacity and colour functions and the unit of length. Of several
    /// components in JSON, it takes the first. Shading and interpolation have no counterpart here.
    ///
    /// Gradients are those per voxel ([`GradientUnit::PerVoxel`](super::GradientUnit::PerVoxel)), as VTK measures them.
    ///
    /// Every value at which the opacity or the colour has a node becomes a control point. JSON may bend a function
    /// between two nodes by a midpoint and a sharpness, as VTK does. Points between the nodes then follow the curve to
    /// 2.5 % of the step from one node to the next. A sharpness above 0.99 is a step. The format in lines has no unit
    /// of length. Slicer's unit is then 1 mm unless set in the scene, and the unit here is also 1 mm.
    ///
    /// # Errors
    ///
    /// [`TransferFunctionError::NotATransferFunction`] for another format, [`TransferFunctionError::Slicer`] with the
    /// line, [`TransferFunctionError::SlicerJson`] with the place in the text, or as [`validate`](Self::validate).
    #[cfg(feature = "slicer")]
    pub fn from_slicer_vp(text: &str) -> Result<Self, TransferFunctionError> {
        let function = slicer::read(text).map_err(|error| unless_something_else(text, error))?;
        function.validate()?;
        Ok(function)
    }
}

/// The error of a text of a known format, else [`TransferFunctionError::NotATransferFunction`].
fn unless_something_else(text: &str, error: impl Into<TransferFunctionError>) -> TransferFunctionError {
    Content::of(text.as_bytes()).err().unwrap_or_else(|| error.into())
}

/// Format of a transfer function's file, by its beginning.
enum Content<'a> {
    Ron(&'a str),
    #[cfg(feature = "slicer")]
    Slicer(&'a str),
}

impl<'a> Content<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, TransferFunctionError> {
        let something_else = |found| Err(TransferFunctionError::NotATransferFunction { found });
        let text = match std::str::from_utf8(bytes) {
            Ok(text) if !text.contains('\0') => text,
            _ => return something_else(binary(bytes)),
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let start = text.trim_start();
        #[cfg(feature = "slicer")]
        let word = start.split_whitespace().next().unwrap_or_default();
        if ["(", "TransferFunction", "//", "/*", "#!["].iter().any(|ron| start.starts_with(ron)) {
            return Ok(Self::Ron(text));
        }
        #[cfg(feature = "slicer")]
        if word.parse::<f32>().is_ok() || slicer::is_json(text) {
            return Ok(Self::Slicer(text));
        }
        something_else(match start.chars().next() {
            None => "an empty file",
            Some('<') if start.contains("<MRML") => "a scene of 3D Slicer, or its list of presets (XML)",
            Some('<') => "XML or HTML",
            Some('{' | '[') => "JSON without volumeProperties",
            Some(_) => "text of another kind",
        })
    }
}

/// Likely format of a binary file.
fn binary(bytes: &[u8]) -> &'static str {
    let magics: [(&[u8], _); 6] = [
        (b"\x89PNG", "a PNG image"),
        (b"\xff\xd8\xff", "a JPEG image"),
        (b"\x1f\x8b", "a gzipped file"),
        (b"PK\x03\x04", "a ZIP archive"),
        (b"NRRD", "a NRRD volume"),
        (b"ObjectType = Image", "a MetaImage volume"),
    ];
    magics.iter().find(|(magic, _)| bytes.starts_with(magic)).map_or("binary data", |(_, found)| found)
}
