//! Rows of charts and their Pareto front (`measure --chart`).

use contextual_ao_kit::{
    chart::{Row, from_csv, pareto_front, rms, to_csv},
    fit::Fit,
};

fn row() -> Row {
    Row {
        scene: "engine".into(),
        voxels: [128, 128, 64],
        pixels: [400, 300],
        family: "rays".into(),
        label: "CAO 54".into(),
        light: "all around".into(),
        frames: 7,
        ms: [1.5, 0.25, 1234.0],
        quartiles_ms: [[1.25, 2.0], [0.125, 0.5], [1000.0, 1500.0]],
        solid_ms: [1.0, 0.125, 2.0],
        dense_ms: 2000.0,
        voxels_fit: Some(Fit {
            count: 12_345,
            rms: 0.015625,
            factor: 2.0,
            fitted_rms: 0.125,
            correlation: 0.75,
        }),
        image_fit: Some(Fit { count: 3, rms: 0.5, factor: 1.0, fitted_rms: 0.5, correlation: -0.5 }),
        own_definition: String::new(),
        own_voxel_error: None,
        own_image_error: None,
    }
}

#[test]
fn rows_come_back_from_text() {
    let of_image = Row { voxels_fit: None, own_image_error: Some(0.25), ..row() };
    let rows = vec![row(), of_image];
    let csv = to_csv(&rows, "a device, its driver");
    assert_eq!(from_csv(&csv), Ok((rows, "a device, its driver".to_owned())));
    assert!((row().relative(2) - 0.617).abs() < 1e-9);
}

#[test]
fn text_with_commas_makes_no_columns() {
    let csv = to_csv(&[Row { scene: "a, b\nc".into(), ..row() }], "");
    let (rows, _) = from_csv(&csv).expect("a table");
    assert_eq!(rows[0].scene, "a; b c");
}

#[test]
fn broken_tables_are_refused_with_their_line() {
    let csv = to_csv(&[row()], "device");
    assert!(from_csv("").is_err());
    assert!(from_csv(&csv.replace("voxel_rms", "others")).is_err_and(|error| error.contains("voxel_rms")));
    assert!(from_csv(&csv.replace("1234", "fast")).is_err_and(|error| error.starts_with("line 3")));
    assert!(from_csv(&csv.replace("128x128x64", "128")).is_err_and(|error| error.contains("voxels")));
    assert!(from_csv(&(csv + "a,b\n")).is_err_and(|error| error.contains("2 cells")));
}

#[test]
fn the_front_has_what_nothing_else_beats() {
    let points = [[4.0, 1.0], [1.0, 4.0], [2.0, 4.0], [2.0, 2.0], [2.0, 3.0], [5.0, 1.0], [2.0, 2.0]];
    assert_eq!(pareto_front(&points), [1, 3, 0]);
    assert_eq!(pareto_front(&[[f64::NAN, 0.0], [1.0, 1.0], [0.0, f64::INFINITY]]), [1]);
    assert!(pareto_front(&[]).is_empty());
}

#[test]
fn errors_are_root_mean_squares() {
    assert_eq!(rms([3.0, -4.0, 0.0, 0.0]), (Some(2.5), 4));
    assert_eq!(rms([]), (None, 0));
}
