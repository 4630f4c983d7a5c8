//! Random transfer functions, and their files.

use super::random::Random;

/// Random points of a transfer function, sorted by value: value, red, green, blue, opacity.
pub(crate) fn points(random: &mut Random) -> Vec<[f32; 5]> {
    let count = 1 + random.below(6);
    let mut value = random.pick(&[-1024.0, 0.0, 0.125]);
    let mut point = || {
        // Points that share a value form a step.
        value += random.pick(&[0.0, 1.0, 1000.5]);
        [value, random.share(), random.share(), random.share(), random.share()]
    };
    (0..count).map(|_| point()).collect()
}

/// The points as RON.
pub(crate) fn ron(random: &mut Random, points: &[[f32; 5]]) -> String {
    let point = |[value, red, green, blue, opacity]: &[f32; 5]| {
        format!("(value: {value:?}, color: ({red:?}, {green:?}, {blue:?}), opacity: {opacity:?}),\n")
    };
    let points: String = points.iter().map(point).collect();
    let unit = random.pick(&["", ", opacity_unit_distance_mm: 0.5"]);
    format!("(points: [{points}]{unit})")
}

/// The points as 3D Slicer's volume property.
pub(crate) fn slicer_vp(random: &mut Random, points: &[[f32; 5]]) -> String {
    let opacities: String = points.iter().map(|[value, .., opacity]| format!(" {value} {opacity}")).collect();
    let color = |[value, red, green, blue, _]: &[f32; 5]| format!(" {value} {red} {green} {blue}");
    let colors: String = points.iter().map(color).collect();
    let (opacity_count, color_count) = (2 * points.len(), 4 * points.len());
    // Text after an arrow is an explanation.
    let mut line =
        |text: String, what| if random.flip() { format!("{text} => {what}\n") } else { text + "\n" };
    [
        line("1\n1\n0.9\n0.1\n0.2\n10".into(), "specular power"),
        line(format!("{opacity_count}{opacities}"), "scalar opacity"),
        line("4 0 1 255 1".into(), "gradient opacity"),
        line(format!("{color_count}{colors}"), "color"),
    ]
    .concat()
}

/// The points as 3D Slicer's volume property in JSON. Points that share a value keep their order.
pub(crate) fn slicer_json(random: &mut Random, points: &[[f32; 5]]) -> String {
    // Members for a straight line to the next point, which can be left out.
    let straight = |random: &mut Random| {
        random.pick(&["", ", \"midpoint\": 0.5, \"sharpness\": 0.0", ", \"sharpness\": 0"])
    };
    let opacities: Vec<_> = points
        .iter()
        .map(|[value, .., opacity]| format!("{{\"x\": {value:?}, \"y\": {opacity:?}{}}}", straight(random)))
        .collect();
    let colors: Vec<_> = points
        .iter()
        .map(|[value, red, green, blue, _]| {
            format!("{{\"x\": {value:?}, \"color\": [{red:?}, {green:?}, {blue:?}]{}}}", straight(random))
        })
        .collect();
    let [opacities, colors] = [opacities, colors].map(|points| points.join(random.pick(&[",", ",\n  "])));
    let rest =
        random.pick(&["", ", \"shade\": true, \"lighting\": {\"ambient\": 0.1}, \"componentWeight\": 1.0"]);
    let unit = random.pick(&["", ", \"scalarOpacityUnitDistance\": 0.25"]);
    format!(
        "{{\"@schema\": \"volume-property-schema-v1.0.0.json#\", \"volumeProperties\": [{{\"components\": [{{\
         \"scalarOpacity\": {{\"points\": [{opacities}]}}, \"rgbTransferFunction\": {{\"points\": [{colors}]}}\
         {rest}{unit}}}]}}]}}\n"
    )
}
