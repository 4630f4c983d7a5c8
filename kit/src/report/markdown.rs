//! Reports as Markdown: a table per section, a line per case, a column per figure.

use super::{Report, Row, Section};

/// Writes a report as text. Predicted values stand in brackets behind measured values.
pub fn to_markdown(report: &Report) -> String {
    let machine = report.machine.iter().map(|(name, value)| vec![escaped(name), escaped(value)]);
    let head = ["Machine", ""].map(str::to_owned).to_vec();
    let sections: Vec<_> = report.sections.iter().map(section).collect();
    let parts = [format!("# {}\n", escaped(&report.title)), table(head, machine)];
    parts.into_iter().chain(sections).collect::<Vec<_>>().join("\n")
}

fn section(section: &Section) -> String {
    let mut parts = vec![format!("## {}\n\n{}\n", escaped(section.name), section.about)];
    if !section.rows.is_empty() {
        parts.push(figures(&section.rows));
    }
    if let Some(error) = &section.error {
        parts.push(format!("**Error**: {}\n", escaped(error)));
    }
    if !section.left_out.is_empty() {
        let line = |case: &str, reason: &str| format!("- {}: {}\n", escaped(case), escaped(reason));
        let lines: String = section.left_out.iter().map(|out| line(&out.case, &out.reason)).collect();
        parts.push(format!("Left out:\n\n{lines}"));
    }
    if section.seconds > 0.0 {
        parts.push(format!("This took {:.0} s.\n", section.seconds));
    }
    parts.join("\n")
}

/// Table of figures. A column has the figures of one name and unit.
fn figures(rows: &[Row]) -> String {
    let mut columns: Vec<(&str, &str)> = Vec::new();
    let mut cases: Vec<&str> = Vec::new();
    for row in rows {
        if !columns.contains(&(&row.figure, row.unit)) {
            columns.push((&row.figure, row.unit));
        }
        if !cases.contains(&row.case.as_str()) {
            cases.push(&row.case);
        }
    }
    let title = |(figure, unit): &(&str, &str)| {
        if unit.is_empty() { escaped(figure) } else { escaped(&format!("{figure}, {unit}")) }
    };
    let head = ["Case".to_owned()].into_iter().chain(columns.iter().map(title)).collect();
    let line = |case: &&str| {
        let of = |column: &(&str, &str)| {
            let is_of = |row: &&Row| row.case == *case && (row.figure.as_str(), row.unit) == *column;
            rows.iter().find(is_of).map(cell).unwrap_or_default()
        };
        [escaped(case)].into_iter().chain(columns.iter().map(of)).collect()
    };
    table(head, cases.iter().map(line))
}

fn cell(row: &Row) -> String {
    let measured = number(row.measured);
    row.predicted.map_or(measured.clone(), |predicted| format!("{measured} ({})", number(predicted)))
}

fn table(head: Vec<String>, lines: impl IntoIterator<Item = Vec<String>>) -> String {
    let rule = vec!["---".to_owned(); head.len()];
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    [head, rule].into_iter().chain(lines).map(line).collect()
}

/// A whole number, or one with three significant digits and all digits before the point.
fn number(value: f64) -> String {
    let digits = if value.fract() == 0.0 { 0.0 } else { 2.0 - value.abs().log10().floor() };
    format!("{value:.*}", digits.clamp(0.0, 9.0) as usize)
}

/// Text that makes no column and no line.
fn escaped(text: &str) -> String {
    text.replace('|', "\\|").replace(['\n', '\r'], " ")
}
