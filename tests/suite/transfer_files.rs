//! Transfer functions in Slicer's newer files, and files that hold no transfer function.

use bevy_contextual_ao::volume::{
    ControlPoint, GradientPoint, GradientUnit, TransferFunction, TransferFunctionError,
};

fn point(value: f32, color: [f32; 3], opacity: f32) -> ControlPoint {
    ControlPoint { value, color, opacity }
}

fn gradient_point(gradient: f32, opacity: f32) -> GradientPoint {
    GradientPoint { gradient, opacity }
}

/// A volume property with the members that Slicer's own writer writes.
const JSON: &str = r#"{
    "@schema": "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/VolumeRendering/Resources/Schema/volume-property-schema-v1.0.0.json#",
    "volumeProperties": [
        {
            "effectiveRange": [0.0, 200.0],
            "isoSurfaceValues": [],
            "independentComponents": true,
            "interpolationType": "linear",
            "useClippedVoxelIntensity": true,
            "clippedVoxelIntensity": -10000000000.0,
            "scatteringAnisotropy": 0.0,
            "components": [
                {
                    "componentWeight": 1.0,
                    "shade": true,
                    "lighting": { "diffuse": 0.9, "ambient": 0.1, "specular": 0.2, "specularPower": 10.0 },
                    "disableGradientOpacity": false,
                    "scalarOpacityUnitDistance": 2.5,
                    "rgbTransferFunction": {
                        "type": "colorTransferFunction",
                        "points": [
                            { "x": 0.0, "color": [0.0, 0.0, 0.0], "midpoint": 0.5, "sharpness": 0.0 },
                            { "x": 200.0, "color": [1.0, 0.5, 0.25], "midpoint": 0.5, "sharpness": 0.0 }
                        ]
                    },
                    "scalarOpacity": {
                        "type": "piecewiseLinearFunction",
                        "points": [
                            { "x": 150.0, "y": 1.0, "midpoint": 0.5, "sharpness": 0.0 },
                            { "x": 50.0, "y": 0.25, "midpoint": 0.5, "sharpness": 0.0 },
                            { "x": 150.0, "y": 0.0, "midpoint": 0.5, "sharpness": 0.0 }
                        ]
                    },
                    "gradientOpacity": {
                        "type": "piecewiseLinearFunction",
                        "points": [
                            { "x": 0.0, "y": 0.0, "midpoint": 0.5, "sharpness": 0.0 },
                            { "x": 255.0, "y": 0.75, "midpoint": 0.5, "sharpness": 0.0 }
                        ]
                    }
                }
            ]
        }
    ]
}"#;

#[test]
fn slicer_properties_in_json_are_read() {
    let function = TransferFunction::from_slicer_vp(JSON).unwrap();
    // Points are sorted. The step at 150 keeps the file's order. Every node has the other function's value too.
    let expected = [
        point(0.0, [0.0; 3], 0.25),
        point(50.0, [0.25, 0.125, 0.0625], 0.25),
        point(150.0, [0.75, 0.375, 0.1875], 1.0),
        point(150.0, [0.75, 0.375, 0.1875], 0.0),
        point(200.0, [1.0, 0.5, 0.25], 0.0),
    ];
    assert_eq!(function.points, expected);
    assert_eq!(function.opacity_unit_distance_mm, 2.5);
    assert_eq!(function.gradient_opacity, [gradient_point(0.0, 0.0), gradient_point(255.0, 0.75)]);
    assert_eq!(function.gradient_unit, GradientUnit::PerVoxel);
    assert_eq!(TransferFunction::from_bytes(JSON.as_bytes()).unwrap(), function);

    let off = JSON.replace("\"disableGradientOpacity\": false", "\"disableGradientOpacity\": true");
    assert_eq!(TransferFunction::from_slicer_vp(&off).unwrap().gradient_opacity, []);
}

#[test]
fn curves_between_nodes_follow_vtk() {
    // VTK 9.7.2's vtkPiecewiseFunction between (0, 0.1) and (100, 0.9), by midpoint and sharpness.
    const AT: [f32; 10] = [0.0, 10.0, 25.0, 30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 100.0];
    #[rustfmt::skip]
    let table = [
        ([0.5, 0.0], [0.1, 0.18, 0.3, 0.34, 0.42, 0.5, 0.58, 0.7, 0.82, 0.9]),
        ([0.25, 0.0], [0.1, 0.26, 0.5, 0.526_667, 0.58, 0.633_333, 0.686_667, 0.766_667, 0.846_667, 0.9]),
        ([0.25, 0.5], [0.1, 0.100_824, 0.5, 0.665_591, 0.828_757, 0.880_197, 0.895_24, 0.899_725, 0.899_999, 0.9]),
        ([0.6, 0.2], [0.1, 0.101_484, 0.123_761, 0.141_797, 0.204_309, 0.317_621, 0.5, 0.815_305, 0.894_971, 0.9]),
        ([0.5, 0.05], [0.1, 0.134_221, 0.237_658, 0.282_084, 0.383_602, 0.5, 0.616_398, 0.762_342, 0.865_779, 0.9]),
        ([0.0, 0.3], [0.1, 0.655_742, 0.795_282, 0.823_222, 0.860_818, 0.881_811, 0.892_715, 0.898_903, 0.899_972, 0.9]),
        // VTK's vtkColorTransferFunction gives this row.
        ([0.3, 1.0], [0.1, 0.1, 0.1, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9]),
    ];
    for ([midpoint, sharpness], expected) in table {
        let text = format!(
            "{{\"volumeProperties\": [{{\"components\": [{{\"scalarOpacity\": {{\"points\": [\
             {{\"x\": 0, \"y\": 0.1, \"midpoint\": {midpoint}, \"sharpness\": {sharpness}}}, \
             {{\"x\": 100, \"y\": 0.9}}]}}}}]}}]}}"
        );
        let function = TransferFunction::from_slicer_vp(&text).unwrap();
        for (at, expected) in AT.into_iter().zip(expected) {
            let found = function.sample(at)[3];
            // A straight line is exact up to rounding. Pieces of a curve are documented to be within 2.5 % of 0.8.
            let tolerance = if sharpness == 0.0 || sharpness == 1.0 { 1e-6 } else { 0.025 * 0.8 };
            assert!(
                (found - expected).abs() < tolerance,
                "{midpoint} {sharpness} at {at}: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn gradient_opacity_is_kept() {
    let lines = "1\n1\n0.9\n0.1\n0.2\n10\n4 0 0 100 1\n6 0 0.5 20 1 10 0.25\n8 0 1 1 1 100 1 1 1\n";
    let function = TransferFunction::from_slicer_vp(lines).unwrap();
    let expected = [gradient_point(0.0, 0.5), gradient_point(10.0, 0.25), gradient_point(20.0, 1.0)];
    assert_eq!(function.gradient_opacity, expected);
    let written = function.to_ron().unwrap();
    assert_eq!(TransferFunction::from_ron(&written).unwrap(), function, "{written}");
    // Files without gradient opacity stay as they were.
    let plain = TransferFunction::ramp(0.0, 1.0, 1.0, [1.0; 3]).unwrap();
    assert!(!plain.to_ron().unwrap().contains("gradient"));

    for (bad, expected) in [
        (vec![gradient_point(f32::NAN, 1.0)], "gradient is NaN"),
        (vec![gradient_point(5.0, 1.0), gradient_point(4.0, 1.0)], "gradient is 4"),
        (vec![gradient_point(5.0, 1.5)], "gradient_opacity is 1.5"),
    ] {
        let error =
            TransferFunction { gradient_opacity: bad, ..plain.clone() }.validate().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let error =
        TransferFunction::from_slicer_vp(&lines.replace("20 1 10", "20 7 10")).unwrap_err().to_string();
    assert!(error.contains("gradient_opacity is 7"), "{error}");
}

#[test]
fn files_that_are_no_transfer_function_are_refused_by_what_they_are() {
    let presets =
        "<?xml version=\"1.0\"?>\n<MRML>\n  <VolumeProperty name=\"CT-Bone\" shade=\"1\"/>\n</MRML>\n";
    let utf_16: Vec<u8> = "(points: [])".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let files: [(&[u8], &str); 14] = [
        (presets.as_bytes(), "a scene of 3D Slicer, or its list of presets (XML)"),
        (b"<!DOCTYPE html><html></html>", "XML or HTML"),
        (b"  \n", "an empty file"),
        (b"", "an empty file"),
        (b"dear diary, it is 5 o'clock", "text of another kind"),
        (b"# a comment\n1 2 3", "text of another kind"),
        (b"{\"markups\": []}", "JSON without volumeProperties"),
        (b"[1, 2]", "JSON without volumeProperties"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "a PNG image"),
        (b"\x1f\x8b\x08\0\0\0\0\0", "a gzipped file"),
        (b"NRRD0004\ntype: uchar\n\n\0\x01\xff", "a NRRD volume"),
        (b"ObjectType = Image\nNDims = 3\n\0", "a MetaImage volume"),
        (b"\xff\xfe\xfd", "binary data"),
        (&utf_16, "binary data"),
    ];
    for (bytes, expected) in files {
        let errors = [
            Some(TransferFunction::from_bytes(bytes)),
            std::str::from_utf8(bytes).ok().map(TransferFunction::from_ron),
            std::str::from_utf8(bytes).ok().map(TransferFunction::from_slicer_vp),
        ];
        for error in errors.into_iter().flatten().map(Result::unwrap_err) {
            let message = error.to_string();
            assert!(
                message.starts_with(&format!("{expected}, not a transfer function")),
                "{expected}: {message}"
            );
            for kind in [".vp", ".vp.json", ".tf.ron"] {
                assert!(message.contains(kind), "{message}");
            }
        }
    }
}

#[test]
fn what_is_nearly_a_transfer_function_says_where_it_is_wrong() {
    type Check = fn(&TransferFunctionError) -> bool;
    let files: [(&str, &str, Check); 7] = [
        ("(points: [(value: 1.0, color: (1, 1, 1), opactiy: 0.5)])", "opactiy", |e| {
            matches!(e, TransferFunctionError::Ron(_))
        }),
        ("1\n1\nbright\n", "line 3", |e| matches!(e, TransferFunctionError::Slicer { .. })),
        ("{\"volumeProperties\": [", "line 1", |e| matches!(e, TransferFunctionError::SlicerJson(_))),
        ("{\"volumeProperties\": []}", "no component", |e| matches!(e, TransferFunctionError::SlicerJson(_))),
        ("{\"volumeProperties\": [{\"components\": []}]}", "no component", |e| {
            matches!(e, TransferFunctionError::SlicerJson(_))
        }),
        ("{\"volumeProperties\": [{\"components\": [{}]}]}", "no control points", |e| {
            matches!(e, TransferFunctionError::Empty)
        }),
        (
            "{\"volumeProperties\": [{\"components\": [{\"scalarOpacity\": {\"points\": [{\"x\": 1}]}}]}]}",
            "`y`",
            |e| matches!(e, TransferFunctionError::SlicerJson(_)),
        ),
    ];
    for (text, part, check) in files {
        let error = TransferFunction::from_bytes(text.as_bytes()).unwrap_err();
        assert!(check(&error) && error.to_string().contains(part), "{text}: {error}");
    }
    // A byte order mark before the text, as Windows' editor writes it, is ignored.
    let marked =
        format!("\u{feff}{}", TransferFunction::ramp(0.0, 1.0, 1.0, [1.0; 3]).unwrap().to_ron().unwrap());
    TransferFunction::from_bytes(marked.as_bytes()).unwrap();
    TransferFunction::from_bytes(format!("\u{feff}{JSON}").as_bytes()).unwrap();
}
