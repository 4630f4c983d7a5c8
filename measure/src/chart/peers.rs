//! Other programs on the chart: they draw the same scene, by scripts in `benches/peers`. The scene is handed over in a
//! folder: `scene.json`, and a volume for each step of the carver, from which the ball is carved already. So programs that
//! know no carvers have nothing to do but to take the next volume.

use bevy::{math::DMat4, prelude::*};
use bevy_contextual_ao::{occlusion::MethodSettings, volume::VolumeGeometry};
use contextual_ao_kit::{
    chart::{KINDS, Row},
    headless::project_folder,
    scene::{SceneParts, view_from},
};
use serde_json::{Value, json};
use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use super::{accuracy::Accuracy, brightness::encoded, definitions::clipped_intensities, shot::STEPS};
use crate::{Options, figures::quantile, stage::to_and_fro};

/// A program, the script by which it draws, and the script's options.
struct Peer {
    name: &'static str,
    script: &'static str,
    options: &'static [&'static str],
    /// Where the program does not draw on the driver of the other rows, its times stay out of the chart.
    is_timed: bool,
}

/// vtk.js is shown as it is, and with two faults of its shader repaired.
const PEERS: [Peer; 3] = [
    Peer { name: "VTK", script: "vtk_chart.py", options: &[], is_timed: true },
    Peer {
        name: "vtk.js",
        script: "vtkjs_chart.mjs",
        options: &["--times", "1", "--modes", "phong,lao,lao_best,scattering"],
        is_timed: false,
    },
    Peer {
        name: "vtk.js repaired",
        script: "vtkjs_chart.mjs",
        options: &["--times", "1", "--modes", "phong,lao_best,lao_ambient", "--repair"],
        is_timed: false,
    },
];

/// A scene in a folder.
pub struct HandedOver {
    folder: PathBuf,
}

impl HandedOver {
    /// Writes the scene into a folder.
    pub fn write(parts: &SceneParts, size: UVec2, folder: PathBuf) -> Result<Self, String> {
        let failed = |file: &Path, error: std::io::Error| format!("{}: {error}", file.display());
        fs::create_dir_all(&folder).map_err(|error| failed(&folder, error))?;
        let geometry = VolumeGeometry::of(&parts.volume);
        let view = view_from(parts.camera);
        let mut files = Vec::new();
        for step in 0..=STEPS {
            let carver = parts.carvers.first().cloned().map(|mut carver| {
                let way = to_and_fro(step) as f32 * geometry.spacing_mm.min_element() as f32;
                carver.position += way * view.right();
                carver
            });
            let values = clipped_intensities(&parts.volume, carver.as_ref());
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let file = format!("step_{step}.raw");
            fs::write(folder.join(&file), bytes).map_err(|error| failed(&folder.join(&file), error))?;
            files.push(file);
        }
        let function = parts.transfer_function.clone().unwrap_or_default();
        let points = function.points.iter().map(|point| {
            let [red, green, blue] = point.color;
            let light = Color::srgb(red, green, blue).to_linear();
            json!({
                "value": parts.volume.to_stored(point.value.into()),
                "opacity": point.opacity,
                "color": [light.red, light.green, light.blue],
            })
        });
        let world_from_voxel = DMat4::from(geometry.local_from_voxel);
        let world_from_grid = world_from_voxel * DMat4::from_scale(geometry.spacing_mm.recip());
        // Half a voxel, as VTK locks it to a volume's spacing. Points a voxel apart miss thin walls.
        let step_mm = 0.5 * geometry.spacing_mm.min_element();
        let rays = parts.occlusion.method.rays().copied().unwrap_or_default();
        let scene = json!({
            "volumes": files,
            "dimensions": geometry.dimensions.to_array(),
            "spacing_mm": geometry.spacing_mm.to_array(),
            "world_from_grid": world_from_grid.transpose().to_cols_array(),
            "points": points.collect::<Vec<_>>(),
            "opacity_unit_mm": function.opacity_unit_distance_mm,
            "step_mm": step_mm,
            "reach_mm": f64::from(rays.steps) * rays.step_length_mm(&geometry),
            "camera": {
                "position": parts.camera.to_array(),
                "focal_point": [0.0, 0.0, 0.0],
                "up": [0.0, 1.0, 0.0],
                "fov_degrees": parts.fov,
            },
            "pixels": size.to_array(),
        });
        let file = folder.join("scene.json");
        fs::write(&file, scene.to_string()).map_err(|error| failed(&file, error))?;
        Ok(Self { folder })
    }

    /// Rows of all programs that are installed, like `row`. Others are named and left out.
    pub fn rows(&self, accuracy: &Accuracy, row: &Row, options: &Options) -> Result<Vec<Row>, String> {
        let mut rows = Vec::new();
        for peer in &PEERS {
            let lines = match self.draw(peer, options) {
                Ok(lines) => lines,
                Err(error) => {
                    eprintln!("{} is left out: {error}", peer.name);
                    continue;
                }
            };
            for line in lines {
                let label = format!("{} {}", peer.name, line["mode"].as_str().unwrap_or_default());
                if let Some(reason) = line["unsupported"].as_str() {
                    eprintln!("{label} is left out: {reason}");
                    continue;
                }
                let files = list(&line["images"]).filter_map(Value::as_str);
                let pictures = files.map(|file| self.picture(file)).collect::<Result<Vec<_>, _>>()?;
                // None where a program is not timed.
                let kinds: [Vec<f64>; KINDS.len()] = KINDS.map(|kind| {
                    list(&line["ms"][kind]).filter_map(Value::as_f64).filter(|_| peer.is_timed).collect()
                });
                let of = |share: f64| {
                    // A time that is not compared is no number.
                    kinds
                        .each_ref()
                        .map(|ms| if ms.is_empty() { f64::NAN } else { quantile(ms.clone(), share) })
                };
                let (lower, upper) = (of(0.25), of(0.75));
                rows.push(Row {
                    family: peer.name.to_owned(),
                    label,
                    frames: kinds[0].len() as u32,
                    ms: of(0.5),
                    quartiles_ms: [0, 1, 2].map(|kind| [lower[kind], upper[kind]]),
                    voxels_fit: None,
                    image_fit: accuracy.fit_of_pictures(&pictures),
                    own_definition: String::new(),
                    own_voxel_error: None,
                    own_image_error: None,
                    ..row.clone()
                });
            }
        }
        Ok(rows)
    }

    /// Runs a script over the folder. It prints a line per mode.
    fn draw(&self, peer: &Peer, options: &Options) -> Result<Vec<Value>, String> {
        let script = project_folder().join("benches/peers").join(peer.script);
        let is_python = peer.script.ends_with(".py");
        let program = if is_python { options.python.as_os_str() } else { OsStr::new("node") };
        let mut command = Command::new(program);
        command.arg(&script).args(peer.options);
        if let (false, Some(packages)) = (is_python, &options.node_packages) {
            command.arg("--packages").arg(packages);
        }
        command.arg(&self.folder);
        let output = command.output().map_err(|error| format!("{}: {error}", script.display()))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or_default();
            return Err(format!("{}: {last}", script.display()));
        }
        let printed = String::from_utf8_lossy(&output.stdout);
        let line = |line: &str| serde_json::from_str(line).map_err(|error| format!("`{line}`: {error}"));
        printed.lines().filter(|line| line.starts_with('{')).map(line).collect()
    }

    /// Encoded colours of a picture, RGBA. The programs' levels are light.
    fn picture(&self, file: &str) -> Result<Vec<u8>, String> {
        let path = self.folder.join(file);
        let image = image::open(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let levels = image.into_rgba8().into_raw();
        let encoded: Vec<u8> =
            (0..=u8::MAX).map(|level| (255.0 * encoded(f64::from(level) / 255.0)).round() as u8).collect();
        Ok(levels.into_iter().map(|level| encoded[usize::from(level)]).collect())
    }
}

/// Values of a list; none if it is no list.
fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}
