//! One slice: a frame of an image, with its place, its values' conversion and all that tells it from others there.

use std::sync::Arc;

use bevy::math::DVec3;

use super::{
    data_set::DataSet,
    image::{Image, code},
    left_out::Reason,
    parse::Parsed,
    tags::{self, Tag},
};
use crate::volume::{
    asset::{Rescale, check_rescale},
    error::VolumeError,
};

/// A slice of a volume. Lengths and places are in the patient's millimetres, as DICOM has them: x to the left, y to the
/// back, z up.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub image: Arc<Image>,
    /// Index of the frame in its image.
    pub frame: u32,
    /// Centre of the first pixel.
    pub position: DVec3,
    /// Directions along a row and down a column.
    pub axes: [DVec3; 2],
    /// Distances of pixels along a row and down a column.
    pub spacing: [f64; 2],
    pub spacing_from: SpacingFrom,
    /// Conversion of the file's numbers to its units.
    pub rescale: Rescale,
    /// Code of the values' unit, as the file says.
    pub unit: Option<String>,
    pub windows: Vec<Window>,
    pub tells: Tells,
}

impl Slice {
    /// Direction across the slice.
    pub fn normal(&self) -> DVec3 {
        self.axes[0].cross(self.axes[1]).normalize()
    }
}

/// Origin of a slice's spacing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SpacingFrom {
    Patient,
    /// The detector's spacing, which is the patient's only at the detector.
    Detector,
    /// No field: a millimetre is assumed.
    Nothing,
}

/// A range of values that the scanner or a person found worth looking at, in file units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Value of medium brightness.
    pub center: f64,
    /// Values from black to white.
    pub width: f64,
}

/// All that tells slices at one place from each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tells {
    pub kind: String,
    pub stack: String,
    pub echo_ms: Option<f64>,
    pub b_value: Option<f64>,
    pub gradient: Vec<f64>,
    pub time: Option<f64>,
    pub delay_ms: Option<f64>,
    pub acquisition: Option<f64>,
}

/// The slices of an image.
pub(super) fn slices(image: Image, parsed: &Parsed) -> Result<Vec<Slice>, (Arc<Image>, Reason)> {
    let image = Arc::new(image);
    let slices = (0..image.frames).map(|frame| Fields::of(&parsed.fields, frame, image.frames).slice(&image));
    slices.collect::<Result<_, _>>().map_err(|reason| (image.clone(), reason))
}

/// Fields of a frame: its own, those that all frames share, and those of the image.
struct Fields<'a, 'b> {
    levels: [Option<&'b DataSet<'a>>; 2],
    image: &'b DataSet<'a>,
    /// Whether the image's own place is the frame's.
    is_alone: bool,
    frame: u32,
}

impl<'a, 'b> Fields<'a, 'b> {
    fn of(image: &'b DataSet<'a>, frame: u32, frames: u32) -> Self {
        let own = image.items(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE).get(frame as usize);
        let shared = image.items(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE).first();
        Self { levels: [own, shared], image, is_alone: frames == 1, frame }
    }

    /// The fields of a group: the frame's, or all frames'.
    fn group(&self, sequence: Tag) -> Option<&'b DataSet<'a>> {
        self.levels.iter().flatten().find_map(|level| level.items(sequence).first())
    }

    /// The group that has a field, else the image.
    fn with(&self, sequence: Tag, field: Tag) -> Option<&'b DataSet<'a>> {
        let group = self.group(sequence).filter(|group| group.has(field));
        group.or(Some(self.image).filter(|image| image.has(field)))
    }

    fn slice(&self, image: &Arc<Image>) -> Result<Slice, Reason> {
        let position = self
            .with(tags::PLANE_POSITION_SEQUENCE, tags::IMAGE_POSITION_PATIENT)
            .filter(|&of| self.is_alone || !std::ptr::eq(of, self.image))
            .ok_or(Reason::NoPlace("ImagePositionPatient"))?;
        let orientation = self
            .with(tags::PLANE_ORIENTATION_SEQUENCE, tags::IMAGE_ORIENTATION_PATIENT)
            .ok_or(Reason::NoPlace("ImageOrientationPatient"))?;
        let (spacing, spacing_from) = self.spacing()?;
        Ok(Slice {
            image: image.clone(),
            frame: self.frame,
            position: place(position)?,
            axes: axes(orientation)?,
            spacing,
            spacing_from,
            rescale: self.rescale(image)?,
            unit: self.unit(),
            windows: self.windows(),
            tells: self.tells(image),
        })
    }

    fn spacing(&self) -> Result<([f64; 2], SpacingFrom), VolumeError> {
        let patient = self.with(tags::PIXEL_MEASURES_SEQUENCE, tags::PIXEL_SPACING);
        let detector = Some(self.image).filter(|image| image.has(tags::IMAGER_PIXEL_SPACING));
        let (field, values, from) = match (patient, detector) {
            (Some(of), _) => ("PixelSpacing", of.numbers(tags::PIXEL_SPACING), SpacingFrom::Patient),
            (_, Some(of)) => {
                ("ImagerPixelSpacing", of.numbers(tags::IMAGER_PIXEL_SPACING), SpacingFrom::Detector)
            }
            _ => return Ok(([1.0; 2], SpacingFrom::Nothing)),
        };
        match values[..] {
            // The distance of rows comes first.
            [down, along] if down > 0.0 && along > 0.0 => Ok(([along, down], from)),
            _ => Err(VolumeError::field(field, format!("{values:?}"), "must be two positive lengths")),
        }
    }

    fn rescale(&self, image: &Image) -> Result<Rescale, VolumeError> {
        let sequence = tags::PIXEL_VALUE_TRANSFORMATION_SEQUENCE;
        let number = |tag| self.with(sequence, tag).and_then(|of| of.number(tag));
        let slope = number(tags::RESCALE_SLOPE).unwrap_or(1.0);
        let intercept = number(tags::RESCALE_INTERCEPT).unwrap_or(0.0);
        let factor = image.suv.and_then(Result::ok).map_or(1.0, |suv| suv.0);
        let sign = if image.format.inverted && !has_units(image) { -1.0 } else { 1.0 };
        let rescale = Rescale { slope: sign * factor * slope, intercept: sign * factor * intercept };
        check_rescale(rescale)?;
        Ok(rescale)
    }

    fn unit(&self) -> Option<String> {
        let rescale_type = self.with(tags::PIXEL_VALUE_TRANSFORMATION_SEQUENCE, tags::RESCALE_TYPE);
        let unit = self.image.text(tags::UNITS).or_else(|| rescale_type?.text(tags::RESCALE_TYPE));
        unit.map(code)
    }

    fn windows(&self) -> Vec<Window> {
        let sequence = tags::FRAME_VOI_LUT_SEQUENCE;
        let numbers = |tag| self.with(sequence, tag).map(|of| of.numbers(tag)).unwrap_or_default();
        let [centers, widths] = [tags::WINDOW_CENTER, tags::WINDOW_WIDTH].map(numbers);
        let windows = centers.into_iter().zip(widths).map(|(center, width)| Window { center, width });
        windows.filter(|window| window.width > 0.0).collect()
    }

    fn tells(&self, image: &Image) -> Tells {
        let content = self.group(tags::FRAME_CONTENT_SEQUENCE);
        let image_number = |tag| self.image.number(tag);
        let double = |group: Option<&DataSet>, tag| group?.doubles(tag).first().copied();
        let diffusion = self.group(tags::MR_DIFFUSION_SEQUENCE);
        let direction =
            diffusion.and_then(|group| group.items(tags::DIFFUSION_GRADIENT_DIRECTION_SEQUENCE).first());
        let cardiac = self.group(tags::CARDIAC_SYNCHRONIZATION_SEQUENCE);
        let types = [
            tags::MR_IMAGE_FRAME_TYPE_SEQUENCE,
            tags::CT_IMAGE_FRAME_TYPE_SEQUENCE,
            tags::PET_FRAME_TYPE_SEQUENCE,
        ];
        let frame_type = types.iter().find_map(|&tag| self.group(tag));
        let kind =
            frame_type.map(|group| group.words(tags::FRAME_TYPE).skip(2).collect::<Vec<_>>().join(" "));
        Tells {
            kind: kind.unwrap_or_else(|| image.image_type.clone()),
            stack: content.and_then(|group| group.text(tags::STACK_ID)).unwrap_or_default().into(),
            echo_ms: double(self.group(tags::MR_ECHO_SEQUENCE), tags::EFFECTIVE_ECHO_TIME)
                .or_else(|| image_number(tags::ECHO_TIME))
                .or_else(|| image_number(tags::ECHO_NUMBERS)),
            b_value: double(diffusion, tags::DIFFUSION_BVALUE)
                .or_else(|| double(Some(self.image), tags::DIFFUSION_BVALUE)),
            gradient: direction.unwrap_or(self.image).doubles(tags::DIFFUSION_GRADIENT_ORIENTATION),
            time: content
                .and_then(|group| group.integer(tags::TEMPORAL_POSITION_INDEX))
                .map(f64::from)
                .or_else(|| image_number(tags::TEMPORAL_POSITION_IDENTIFIER)),
            delay_ms: double(cardiac, tags::NOMINAL_CARDIAC_TRIGGER_DELAY_TIME)
                .or_else(|| double(cardiac, tags::NOMINAL_PERCENTAGE_OF_CARDIAC_PHASE))
                .or_else(|| image_number(tags::TRIGGER_TIME)),
            acquisition: content
                .and_then(|group| group.u16(tags::FRAME_ACQUISITION_NUMBER))
                .map(f64::from)
                .or_else(|| image_number(tags::ACQUISITION_NUMBER)),
        }
    }
}

/// Whether the values have a meaning that a dark display must not turn around.
pub(super) fn has_units(image: &Image) -> bool {
    matches!(&*image.modality, "CT" | "PT")
}

fn place(fields: &DataSet) -> Result<DVec3, VolumeError> {
    let values = fields.numbers(tags::IMAGE_POSITION_PATIENT);
    match values[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(VolumeError::field("ImagePositionPatient", format!("{values:?}"), "must be three lengths")),
    }
}

fn axes(fields: &DataSet) -> Result<[DVec3; 2], VolumeError> {
    let values = fields.numbers(tags::IMAGE_ORIENTATION_PATIENT);
    let error = |reason| VolumeError::field("ImageOrientationPatient", format!("{values:?}"), reason);
    let [a, b, c, d, e, f] = values[..] else { return Err(error("must be six numbers")) };
    let axes = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
    // Some programs round to two decimals.
    let are_unit = axes.iter().all(|axis| (axis.length() - 1.0).abs() < 0.02);
    if !are_unit || axes[0].dot(axes[1]).abs() > 0.02 {
        return Err(error("must be two directions at right angles"));
    }
    Ok(axes.map(DVec3::normalize))
}
