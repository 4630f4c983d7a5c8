//! Data of a chart of speed against accuracy: rows, kept as comma-separated values, and the Pareto front.

use std::{collections::HashMap, str::FromStr};

use crate::fit::Fit;

/// Kinds of frames that are timed: after a carver moved, with nothing changed, after an edit of the transfer
/// function.
pub const KINDS: [&str; 3] = ["carve", "rest", "edit"];

/// One setting of one method in one scene. Errors are root mean squares, of a range from 0 to 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    pub scene: String,
    /// Number of voxels along each axis.
    pub voxels: [u32; 3],
    /// Width and height of the image.
    pub pixels: [u32; 2],
    /// The method.
    pub family: String,
    /// Short name of the setting, with the name of the method.
    pub label: String,
    /// Light for which the true occlusion was computed, and the view samples of the true image if they are not the
    /// scene's. Rows that differ here are not compared.
    pub light: String,
    /// Number of times each kind of frame was timed.
    pub frames: u32,
    /// Median milliseconds of each of [`KINDS`].
    pub ms: [f64; 3],
    /// Lower and upper quartile of each.
    pub quartiles_ms: [[f64; 2]; 3],
    /// Median milliseconds without occlusion: clipping and drawing alone.
    pub solid_ms: [f64; 3],
    /// Milliseconds of a carve frame of dense local ambient occlusion with 54 rays, as published.
    pub dense_ms: f64,
    /// Errors against very many rays, over the voxels that the image reads. `None` for methods without voxels.
    pub voxels_fit: Option<Fit>,
    /// Errors against the image of very many rays, over the colours of the object's pixels. The factor is one on
    /// linear light.
    pub image_fit: Option<Fit>,
    /// The method's own definition of occlusion, if it is another.
    pub own_definition: String,
    /// Error of the method's voxels against its own definition.
    pub own_voxel_error: Option<f64>,
    /// Error of the method's image against its own definition.
    pub own_image_error: Option<f64>,
}

const COLUMNS: [&str; 36] = [
    "scene",
    "voxels",
    "pixels",
    "family",
    "label",
    "light",
    "frames",
    "carve_ms",
    "rest_ms",
    "edit_ms",
    "carve_quartile_1_ms",
    "carve_quartile_3_ms",
    "rest_quartile_1_ms",
    "rest_quartile_3_ms",
    "edit_quartile_1_ms",
    "edit_quartile_3_ms",
    "solid_carve_ms",
    "solid_rest_ms",
    "solid_edit_ms",
    "dense_lao_ms",
    "carve_relative",
    "rest_relative",
    "edit_relative",
    "voxels_compared",
    "voxel_rms",
    "voxel_factor",
    "voxel_fitted_rms",
    "voxel_correlation",
    "colors_compared",
    "image_rms",
    "image_factor",
    "image_fitted_rms",
    "image_correlation",
    "own_definition",
    "own_voxel_rms",
    "own_image_rms",
];

impl Row {
    /// Time of a kind of frame, over that of dense local ambient occlusion.
    pub fn relative(&self, kind: usize) -> f64 {
        self.ms[kind] / self.dense_ms
    }

    fn cells(&self) -> Vec<String> {
        let [carve, rest, edit] = self.ms.map(number);
        let [solid_carve, solid_rest, solid_edit] = self.solid_ms.map(number);
        let [carve_relative, rest_relative, edit_relative] =
            [0, 1, 2].map(|kind| number(self.relative(kind)));
        let optional = |value: Option<f64>| value.map(number).unwrap_or_default();
        let [quartiles_carve, quartiles_rest, quartiles_edit] = self.quartiles_ms.map(|ms| ms.map(number));
        let [voxels, image] = [self.voxels_fit, self.image_fit].map(fit_cells);
        [
            text(&self.scene),
            product(&self.voxels),
            product(&self.pixels),
            text(&self.family),
            text(&self.label),
            text(&self.light),
            self.frames.to_string(),
            carve,
            rest,
            edit,
        ]
        .into_iter()
        .chain([quartiles_carve, quartiles_rest, quartiles_edit].into_iter().flatten())
        .chain([
            solid_carve,
            solid_rest,
            solid_edit,
            number(self.dense_ms),
            carve_relative,
            rest_relative,
            edit_relative,
        ])
        .chain(voxels)
        .chain(image)
        .chain([text(&self.own_definition), optional(self.own_voxel_error), optional(self.own_image_error)])
        .collect()
    }

    fn read(cells: &HashMap<&str, &str>) -> Result<Self, String> {
        let text =
            |name: &str| cells.get(name).copied().ok_or_else(|| format!("there is no column `{name}`"));
        let number = |name: &str| parse::<f64>(name, text(name)?);
        let optional = |name: &str| if text(name)?.is_empty() { Ok(None) } else { number(name).map(Some) };
        let owned = |name: &str| text(name).map(str::to_owned);
        let quartiles = |kind: &str| {
            Ok::<_, String>([
                number(&format!("{kind}_quartile_1_ms"))?,
                number(&format!("{kind}_quartile_3_ms"))?,
            ])
        };
        let fit = |[count, rms, factor, fitted_rms, correlation]: [&str; 5]| {
            if text(rms)?.is_empty() {
                return Ok::<_, String>(None);
            }
            Ok(Some(Fit {
                count: parse(count, text(count)?)?,
                rms: number(rms)?,
                factor: number(factor)?,
                fitted_rms: number(fitted_rms)?,
                correlation: number(correlation)?,
            }))
        };
        Ok(Self {
            scene: owned("scene")?,
            voxels: parse_product("voxels", text("voxels")?)?,
            pixels: parse_product("pixels", text("pixels")?)?,
            family: owned("family")?,
            label: owned("label")?,
            light: owned("light")?,
            frames: parse("frames", text("frames")?)?,
            ms: [number("carve_ms")?, number("rest_ms")?, number("edit_ms")?],
            solid_ms: [number("solid_carve_ms")?, number("solid_rest_ms")?, number("solid_edit_ms")?],
            dense_ms: number("dense_lao_ms")?,
            quartiles_ms: [quartiles("carve")?, quartiles("rest")?, quartiles("edit")?],
            voxels_fit: fit([
                "voxels_compared",
                "voxel_rms",
                "voxel_factor",
                "voxel_fitted_rms",
                "voxel_correlation",
            ])?,
            image_fit: fit([
                "colors_compared",
                "image_rms",
                "image_factor",
                "image_fitted_rms",
                "image_correlation",
            ])?,
            own_definition: owned("own_definition")?,
            own_voxel_error: optional("own_voxel_rms")?,
            own_image_error: optional("own_image_rms")?,
        })
    }
}

/// Cells of errors; empty without errors.
fn fit_cells(fit: Option<Fit>) -> [String; 5] {
    fit.map_or_else(Default::default, |fit| {
        let [rms, factor, fitted_rms, correlation] =
            [fit.rms, fit.factor, fit.fitted_rms, fit.correlation].map(number);
        [fit.count.to_string(), rms, factor, fitted_rms, correlation]
    })
}

/// Writes rows as text: a comment that names the device, the columns' names, a line per row.
pub fn to_csv(rows: &[Row], device: &str) -> String {
    let lines = rows.iter().map(|row| row.cells().join(","));
    let head = [format!("# {}", device.replace('\n', " ")), COLUMNS.join(",")];
    head.into_iter().chain(lines).map(|line| line + "\n").collect()
}

/// Reads rows and the comment from text. Columns may come in any order.
pub fn from_csv(csv: &str) -> Result<(Vec<Row>, String), String> {
    let comment = csv.lines().find_map(|line| line.strip_prefix('#')).unwrap_or_default();
    let mut lines = csv.lines().enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (_, head) = lines.next().ok_or("there are no columns")?;
    let columns: Vec<&str> = head.split(',').collect();
    let rows = lines.map(|(index, line)| {
        let cells: Vec<&str> = line.split(',').collect();
        let in_line = |problem: String| format!("line {}: {problem}", index + 1);
        if cells.len() != columns.len() {
            return Err(in_line(format!("{} cells in {} columns", cells.len(), columns.len())));
        }
        Row::read(&columns.iter().copied().zip(cells).collect()).map_err(in_line)
    });
    Ok((rows.collect::<Result<_, _>>()?, comment.trim().to_owned()))
}

/// A number with six decimals: a microsecond, or a millionth, is enough.
fn number(value: f64) -> String {
    format!("{value:.6}")
}

/// Text of a cell. Cells have no quotes, so they have no commas.
fn text(text: &str) -> String {
    text.replace(',', ";").replace('\n', " ")
}

fn product(factors: &[u32]) -> String {
    factors.iter().map(u32::to_string).collect::<Vec<_>>().join("x")
}

fn parse<T: FromStr>(name: &str, cell: &str) -> Result<T, String> {
    cell.parse().map_err(|_| format!("{name}: `{cell}` is not a number"))
}

fn parse_product<const N: usize>(name: &str, cell: &str) -> Result<[u32; N], String> {
    let factors = cell.split('x').map(|factor| parse(name, factor)).collect::<Result<Vec<u32>, _>>()?;
    factors.try_into().map_err(|_| format!("{name}: `{cell}` has not {N} numbers"))
}

/// Pareto front of points, from left to right. Lower coordinates are better. A point is on the front if no other
/// point is better or as good in both. Points that are not finite are left out. Of points in one place the first
/// counts.
pub fn pareto_front(points: &[[f64; 2]]) -> Vec<usize> {
    let is_finite = |index: &usize| points[*index].iter().all(|value| value.is_finite());
    let mut order: Vec<usize> = (0..points.len()).filter(is_finite).collect();
    order.sort_by(|&a, &b| {
        let by = |axis: usize| points[a][axis].total_cmp(&points[b][axis]);
        by(0).then(by(1))
    });
    let mut lowest = f64::INFINITY;
    order.retain(|&index| {
        let is_lower = points[index][1] < lowest;
        lowest = lowest.min(points[index][1]);
        is_lower
    });
    order
}

/// Root mean square of differences, and their number. `None` without differences.
pub fn rms(differences: impl IntoIterator<Item = f64>) -> (Option<f64>, u64) {
    let (sum, count) = differences
        .into_iter()
        .fold((0.0, 0u64), |(sum, count), difference| (sum + difference * difference, count + 1));
    ((count > 0).then(|| (sum / count as f64).sqrt()), count)
}
