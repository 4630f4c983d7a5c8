//! The axes of a NRRD array: the grid's axes, and an axis along which there are several volumes.

use bevy::math::{DVec3, UVec3};

use super::VolumeReadSettings;
use super::header::{Components, checked_dimensions, parse_numbers};
use super::nrrd_fields::{Fields, quoted_words, required, vectors};
use super::nrrd_kinds::Kind;
use crate::volume::error::{VolumeError, excerpt};

/// One axis of the array.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Number of the axis in the array, from one.
    number: usize,
    pub(super) size: u64,
    pub(super) kind: Kind,
    /// Spacing between neighbouring samples, in the axis' unit.
    pub(super) spacing: Option<f64>,
    /// Direction in space, scaled by the spacing; `None` without a direction.
    pub(super) direction: Option<DVec3>,
    /// Name of the axis' unit.
    pub(super) unit: Option<String>,
}

/// The three axes of the grid, and the layout of volumes on it in the file.
pub(super) struct Grid {
    pub(super) axes: [Axis; 3],
    pub(super) dimensions: UVec3,
    pub(super) components: Components,
}

impl Grid {
    /// Separates the grid's axes from the component axis.
    ///
    /// # Errors
    ///
    /// - An axis is of values that belong together.
    /// - There are not three axes for the grid.
    /// - There are several volumes along a fourth axis and the settings choose none.
    pub(super) fn new(fields: &Fields, settings: &VolumeReadSettings) -> Result<Self, VolumeError> {
        let mut axes = axes(fields)?;
        for axis in &axes {
            if let Kind::Values(kind) = &axis.kind
                && axis.size > 1
            {
                return Err(VolumeError::NotScalar { kind: kind.clone(), values: axis.size });
            }
        }
        while axes.len() > 4
            && let Some(index) = least_likely(&axes, |axis| axis.size == 1)
        {
            axes.remove(index);
        }
        let mut components = Components { count: 1, index: 0, axes_before: 3 };
        let mut along = "in the file".to_owned();
        if axes.len() == 4
            && let Some(index) = least_likely(&axes, |_| true)
        {
            let axis = axes.remove(index);
            components = Components { count: axis.size, index: 0, axes_before: index };
            along = match axis.kind {
                Kind::Components(name) => name.to_owned(),
                _ => format!("along axis {}", axis.number),
            };
        }
        let sizes: Vec<u64> = axes.iter().map(|axis| axis.size).collect();
        let error = |reason: String| VolumeError::Dimensions { sizes: sizes.clone(), reason };
        if let Some(axis) = axes.iter().find(|axis| !axis.kind.may_be_of_a_grid()) {
            return Err(error(format!("an axis of kind {}, three others are needed", axis.kind)));
        }
        if components.count == 0 {
            return Err(error("there are no volumes".into()));
        }
        components.index = settings.choose(components.count, &along)?;
        let dimensions = checked_dimensions(&sizes)?;
        let axes = axes.try_into().map_err(|_| error("three are needed".into()))?;
        Ok(Self { axes, dimensions, components })
    }
}

/// The axis, among the axes that `of` accepts, that is least likely an axis of the grid. The criteria are its
/// kind, a missing direction, a size of one, and coming last.
fn least_likely(axes: &[Axis], of: impl Fn(&Axis) -> bool) -> Option<usize> {
    let unlikeliness =
        |axis: &Axis| (!axis.kind.may_be_of_a_grid(), axis.direction.is_none(), axis.size == 1);
    let some = axes.iter().enumerate().filter(|(_, axis)| of(axis));
    some.max_by_key(|(index, axis)| (unlikeliness(axis), *index)).map(|(index, _)| index)
}

/// All axes of the array.
fn axes(fields: &Fields) -> Result<Vec<Axis>, VolumeError> {
    let text = required("sizes", &fields.sizes)?;
    let sizes: Vec<u64> = parse_numbers("sizes", text)?;
    let dimension = required("dimension", &fields.dimension)?;
    // The format allows sixteen axes.
    if dimension.parse() != Ok(sizes.len()) || sizes.len() > 16 {
        let reason = format!("but there are {} sizes", sizes.len());
        return Err(VolumeError::field("dimension", dimension, reason));
    }
    let spacings =
        per_axis("spacings", &fields.spacings, sizes.len(), |text| parse_numbers("spacings", text))?;
    let extents = extents(fields, &sizes)?;
    let directions = per_axis("space directions", &fields.directions, sizes.len(), |text| {
        vectors("space directions", text)
    })?;
    let kinds = per_axis("kinds", &fields.kinds, sizes.len(), |text| {
        text.split_whitespace().map(Kind::named).collect()
    })?;
    let units = per_axis("units", &fields.units, sizes.len(), |text| Ok(quoted_words(text)))?;
    let axis = |(index, &size): (usize, &u64)| Axis {
        number: index + 1,
        size,
        kind: kinds.get(index).cloned().unwrap_or(Kind::Unknown),
        spacing: spacings.get(index).copied().filter(|spacing: &f64| !spacing.is_nan()).or(extents[index]),
        direction: directions.get(index).copied().flatten(),
        unit: units.get(index).map(|unit| excerpt(unit)),
    };
    Ok(sizes.iter().enumerate().map(axis).collect())
}

/// The values of a field, one per axis; empty if the field is missing.
fn per_axis<'a, T>(
    field: &'static str,
    text: &'a Option<String>,
    axes: usize,
    parse: impl Fn(&'a str) -> Result<Vec<T>, VolumeError>,
) -> Result<Vec<T>, VolumeError> {
    let Some(text) = text else { return Ok(Vec::new()) };
    let values = parse(text)?;
    if values.len() != axes {
        let reason = format!("{} values are given for {axes} axes", values.len());
        return Err(VolumeError::field(field, text, reason));
    }
    Ok(values)
}

/// The spacings by the positions of the axes' ends. The ends are the outermost samples if these are nodes, else
/// the outer faces of their cells.
fn extents(fields: &Fields, sizes: &[u64]) -> Result<Vec<Option<f64>>, VolumeError> {
    let count = sizes.len();
    let numbers = |field, text| per_axis(field, text, count, |text| parse_numbers::<f64>(field, text));
    let mins = numbers("axis mins", &fields.axis_mins)?;
    let maxs = numbers("axis maxs", &fields.axis_maxs)?;
    let words = |text: &str| Ok(text.split_whitespace().map(str::to_ascii_lowercase).collect());
    let centers: Vec<String> = per_axis("centers", &fields.centers, count, words)?;
    let spacing = |(index, &size): (usize, &u64)| {
        let nodes = centers.get(index).is_some_and(|center| center == "node");
        let steps = if nodes { size.saturating_sub(1) } else { size };
        let spacing = (maxs.get(index)? - mins.get(index)?) / steps as f64;
        (spacing.is_finite() && spacing != 0.0).then_some(spacing)
    };
    Ok(sizes.iter().enumerate().map(spacing).collect())
}
