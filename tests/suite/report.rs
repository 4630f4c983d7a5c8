//! Reports as text (`measure --report`).

use contextual_ao_kit::report::{LeftOut, Report, Row, Section, to_csv, to_markdown};

fn row(case: &str, figure: &str, measured: f64, predicted: Option<f64>) -> Row {
    Row { case: case.into(), figure: figure.into(), unit: "ms", measured, predicted }
}

fn report() -> Report {
    let passes = Section {
        name: "Passes",
        about: "All passes.".into(),
        rows: vec![
            row("a, b|c", "cast", 1234.56, None),
            row("a, b|c", "say \"mark\"", 0.012345, Some(0.5)),
            row("at rest", "cast", 0.0, None),
        ],
        seconds: 2.0,
        ..Section::default()
    };
    let peers = Section {
        name: "Peers",
        about: "Others.".into(),
        left_out: vec![LeftOut { case: "VTK".into(), reason: "not\ninstalled".into() }],
        error: Some("the device | was lost".into()),
        ..Section::default()
    };
    let machine = vec![("Device", "a | device,\n1".to_owned())];
    Report { title: "Measured".into(), machine, sections: vec![passes, peers] }
}

#[test]
fn values_separated_by_commas_keep_all_text() {
    let expected = [
        "# Device: a | device, 1",
        "# left out: Peers, VTK: not installed",
        "# error: Peers: the device | was lost",
        "section,case,figure,unit,measured,predicted",
        "Passes,\"a, b|c\",cast,ms,1234.56,",
        "Passes,\"a, b|c\",\"say \"\"mark\"\"\",ms,0.012345,0.5",
        "Passes,at rest,cast,ms,0,",
    ];
    assert_eq!(to_csv(&report()).lines().collect::<Vec<_>>(), expected);
}

#[test]
fn markdown_has_every_section_once() {
    let text = to_markdown(&report());
    for section in ["## Passes", "## Peers"] {
        assert_eq!(text.lines().filter(|line| *line == section).count(), 1, "{text}");
    }
    for line in ["**Error**: the device \\| was lost", "- VTK: not installed"] {
        assert!(text.lines().any(|found| found == line), "{text}");
    }
}

#[test]
fn markdown_has_a_line_per_case_and_a_column_per_figure() {
    let text = to_markdown(&report());
    let lines: Vec<_> = text.lines().filter(|line| line.starts_with('|')).collect();
    let expected = [
        "| Machine |  |",
        "| --- | --- |",
        "| Device | a \\| device, 1 |",
        "| Case | cast, ms | say \"mark\", ms |",
        "| --- | --- | --- |",
        "| a, b\\|c | 1235 | 0.0123 (0.500) |",
        "| at rest | 0 |  |",
    ];
    assert_eq!(lines, expected);
}
