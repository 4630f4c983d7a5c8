//! Transfer functions: sampling, their files, and Slicer's.

use bevy::math::{DAffine3, DVec3, UVec3};
use bevy_contextual_ao::volume::{
    ControlPoint, Intensities, Rescale, TransferFunction, TransferFunctionError, Volume,
};

fn point(value: f32, color: [f32; 3], opacity: f32) -> ControlPoint {
    ControlPoint { value, color, opacity }
}

fn volume(intensities: Intensities, rescale: Rescale) -> Volume {
    let size = UVec3::new(intensities.len() as u32, 1, 1);
    let spacing = DAffine3::from_scale(DVec3::new(2.0, 3.0, 4.0));
    Volume::new(size, spacing, intensities, rescale).unwrap()
}

#[test]
fn sampling_is_linear_between_points_and_constant_beyond() {
    let points = vec![point(20.0, [1.0, 0.5, 0.0], 1.0), point(10.0, [0.0, 0.5, 1.0], 0.0)];
    let function = TransferFunction::new(points, 2.0).unwrap();
    assert_eq!(function.points[0].value, 10.0);
    for (value, expected) in [
        (-1e30, [0.0, 0.5, 1.0, 0.0]),
        (10.0, [0.0, 0.5, 1.0, 0.0]),
        (12.5, [0.25, 0.5, 0.75, 0.25]),
        (20.0, [1.0, 0.5, 0.0, 1.0]),
        (f32::INFINITY, [1.0, 0.5, 0.0, 1.0]),
    ] {
        assert_eq!(function.sample(value), expected, "{value}");
    }
    let table = function.lookup_table([10.0, 20.0], 5);
    assert_eq!(table.len(), 5);
    for (entry, expected) in table.iter().zip([0.0, 0.25, 0.5, 0.75, 1.0]) {
        assert_eq!(entry[3], expected);
    }
    assert_eq!(function.lookup_table([15.0, 20.0], 1)[0][3], 0.5);
    assert!(function.lookup_table([0.0, 1.0], 0).is_empty());
}

#[test]
fn the_isovalue_is_where_half_of_the_opacity_is() {
    let isovalue = |points: &[(f32, f32)]| {
        let points = points.iter().map(|&(value, opacity)| point(value, [1.0; 3], opacity));
        TransferFunction::new(points.collect(), 1.0).expect("a valid function").isovalue()
    };
    assert_eq!(isovalue(&[(10.0, 0.0), (30.0, 0.4)]), Some(20.0));
    assert_eq!(isovalue(&[(0.0, 0.1), (10.0, 0.1), (20.0, 0.5), (30.0, 0.0)]), Some(13.75));
    assert_eq!(isovalue(&[(5.0, 0.0), (5.0, 1.0), (9.0, 0.0)]), Some(5.0));
    assert_eq!(isovalue(&[(-3.0, 0.2)]), Some(-3.0));
    assert_eq!(isovalue(&[(0.0, 0.0), (1.0, 0.0)]), None);
}

#[test]
fn steps_have_two_sides() {
    let white = [1.0; 3];
    let points =
        vec![point(0.0, white, 0.0), point(5.0, white, 0.0), point(5.0, white, 1.0), point(9.0, white, 1.0)];
    let function = TransferFunction::new(points, 1.0).unwrap();
    assert_eq!(function.sample(4.999)[3], 0.0);
    assert_eq!(function.sample(5.0)[3], 1.0);
}

#[test]
fn senseless_functions_are_refused() {
    let white = [1.0; 3];
    let error = |points, unit| TransferFunction::new(points, unit).unwrap_err();
    assert!(matches!(error(vec![], 1.0), TransferFunctionError::Empty));
    for (bad, field) in [
        (point(f32::NAN, white, 0.5), "value"),
        (point(0.0, white, 1.5), "opacity"),
        (point(0.0, white, f32::NAN), "opacity"),
        (point(0.0, [1.0, -0.1, 1.0], 0.5), "green"),
    ] {
        match error(vec![bad], 1.0) {
            TransferFunctionError::Point { field: found, .. } => assert_eq!(found, field),
            other => panic!("{other}"),
        }
    }
    for unit in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = error(vec![point(0.0, white, 0.5)], unit);
        assert!(matches!(error, TransferFunctionError::UnitDistance(_)));
    }
    // Fields are public, so an invalid function must not panic either.
    let unsorted = TransferFunction {
        points: vec![point(9.0, white, 1.0), point(f32::NAN, white, 1.0), point(1.0, white, 0.0)],
        ..Default::default()
    };
    assert!(unsorted.validate().is_err());
    unsorted.lookup_table([0.0, 10.0], 50);
    let empty = TransferFunction { points: vec![], ..unsorted };
    assert_eq!(empty.sample(1.0), [0.0; 4]);
}

#[test]
fn ron_comes_back_as_it_went() {
    let function = TransferFunction::ramp(-100.5, 300.0, 0.25, [0.9, 0.8, 0.7]).unwrap();
    let text = function.to_ron().unwrap();
    assert_eq!(TransferFunction::from_ron(&text).unwrap(), function, "{text}");
    let short = "(points: [(value: 1.0, color: (1.0, 1.0, 1.0), opacity: 0.5)])";
    let short = TransferFunction::from_ron(short).unwrap();
    assert_eq!(short.opacity_unit_distance_mm, 1.0);
    let bad = "(points: [(value: 1.0, color: (1.0, 1.0, 1.0), opactiy: 0.5)])";
    let message = TransferFunction::from_ron(bad).unwrap_err().to_string();
    assert!(message.contains("opactiy"), "{message}");
    let unsorted = text.replace("-100.5", "900.0");
    assert!(TransferFunction::from_ron(&unsorted).is_err());
}

/// The example in Slicer's developer guide, with its explanations.
const SLICER: &str = "1 => interpolation type
1 => shading enabled
0.9 => diffuse reflection
0.1 => ambient reflection
0.2 => specular reflection
10 => specular reflection power
14 -3024 0 -86.9767 0 45.3791 0.169643 139.919 0.589286 347.907 0.607143 1224.16 0.607143 3071 0.616071 => scalar opacity
4 0 1 255 1 => gradient opacity
28 -3024 0 0 0 -86.9767 0 0.25098 1 45.3791 1 0 0 139.919 1 0.894893 0.894893 347.907 1 1 0.25098 1224.16 1 1 1 3071 0.827451 0.658824 1
";

#[test]
fn slicer_properties_are_read() {
    let function = TransferFunction::from_slicer_vp(SLICER).unwrap();
    let values: Vec<f32> = function.points.iter().map(|point| point.value).collect();
    let expected = [-3024.0, -86.9767, 45.3791, 139.919, 347.907, 1224.16, 3071.0];
    assert_eq!(values, expected);
    assert_eq!(function.points[3], point(139.919, [1.0, 0.894_893, 0.894_893], 0.589_286));

    // Nodes of both functions count. Each node gets the other function's value there.
    let settings = "0\n1\n0.9\n0.1\n0.2\n10\n";
    let merged = format!("{settings}4 0 0 100 1\n4 0 1 255 1\n12 0 0 0 0 50 1 0 0 200 1 1 1\n");
    let function = TransferFunction::from_slicer_vp(&merged).unwrap();
    let expected = [
        point(0.0, [0.0; 3], 0.0),
        point(50.0, [1.0, 0.0, 0.0], 0.5),
        point(100.0, [1.0, 1.0 / 3.0, 1.0 / 3.0], 1.0),
        point(200.0, [1.0; 3], 1.0),
    ];
    assert_eq!(function.points, expected);

    let step = format!("{settings}8 0 0 5 0 5 1 9 1\n0\n4 0 1 1 1\n");
    let function = TransferFunction::from_slicer_vp(&step).unwrap();
    assert_eq!((function.sample(4.9)[3], function.sample(5.0)[3]), (0.0, 1.0));
}

#[test]
fn broken_slicer_properties_name_the_line() {
    let lines: Vec<&str> = SLICER.lines().collect();
    let broken = |line: usize, text: &str| {
        let mut lines = lines.clone();
        lines[line - 1] = text;
        TransferFunction::from_slicer_vp(&lines.join("\n")).unwrap_err()
    };
    for (line, text) in [
        (3, "bright"),
        (7, "14 -3024 0 x 0"),
        (7, "-2 1 1"),
        (7, "5 1 1 1 1 1"),
        (9, "999999999 1 1 1 1"),
        (9, "4 0 nan 1 1"),
    ] {
        match broken(line, text) {
            TransferFunctionError::Slicer { line: found, .. } => assert_eq!(found, line, "{text}"),
            other => panic!("{text}: {other}"),
        }
    }
    let message = broken(9, "").to_string();
    assert!(message.contains("color: the file ends"), "{message}");
    assert!(TransferFunction::from_slicer_vp("").is_err());
    assert!(TransferFunction::from_slicer_vp("\u{89}PNG").is_err());
}

#[test]
fn the_default_parts_dark_from_bright() {
    let values = [[10u8; 50], [200; 50]].concat();
    let rescale = Rescale { slope: 2.0, intercept: -1000.0 };
    let function = TransferFunction::for_volume(&volume(Intensities::U8(values), rescale));
    function.validate().unwrap();
    assert_eq!(function.opacity_unit_distance_mm, 2.0);
    // -980 is dark, -600 bright.
    assert_eq!(function.sample(-980.0)[3], 0.0);
    assert!(function.sample(-600.0)[3] > 0.8);

    let wide = (0..2000u16).map(|i| if i % 3 == 0 { 60_000 + i } else { 1000 + i });
    let wide = volume(Intensities::U16(wide.collect()), Rescale::default());
    let function = TransferFunction::for_volume(&wide);
    assert_eq!(function.sample(3000.0)[3], 0.0);
    assert!(function.sample(60_000.0)[3] > 0.8);

    for values in [vec![7], vec![7; 9]] {
        let flat = volume(Intensities::U8(values), Rescale::default());
        TransferFunction::for_volume(&flat).validate().unwrap();
    }
    let steep = Rescale { slope: -1e300, intercept: 0.0 };
    let steep = volume(Intensities::U8(vec![0, 255]), steep);
    TransferFunction::for_volume(&steep).validate().unwrap();
}
