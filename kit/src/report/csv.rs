//! Reports as comma-separated values (RFC 4180), with the machine and all that is missing in comments.

use super::{Report, Section};

const COLUMNS: &str = "section,case,figure,unit,measured,predicted";

/// Writes a report as text: comments that start with `#`, the columns' names, a line per figure. Text in quotes may
/// have commas, quotes and line breaks.
pub fn to_csv(report: &Report) -> String {
    let machine = report.machine.iter().map(|(name, value)| comment(&format!("{name}: {value}")));
    let missing = report.sections.iter().flat_map(missing);
    let rows = report.sections.iter().flat_map(lines);
    machine.chain(missing).chain([COLUMNS.to_owned()]).chain(rows).map(|line| line + "\n").collect()
}

fn missing(section: &Section) -> Vec<String> {
    let name = section.name;
    let left_out =
        section.left_out.iter().map(|out| format!("left out: {name}, {}: {}", out.case, out.reason));
    let error = section.error.iter().map(|error| format!("error: {name}: {error}"));
    left_out.chain(error).map(|text| comment(&text)).collect()
}

fn lines(section: &Section) -> Vec<String> {
    let line = |row: &super::Row| {
        let predicted = row.predicted.map(|value| value.to_string()).unwrap_or_default();
        let texts = [section.name, &row.case, &row.figure, row.unit].map(quoted);
        format!("{},{},{predicted}", texts.join(","), row.measured)
    };
    section.rows.iter().map(line).collect()
}

fn comment(text: &str) -> String {
    format!("# {}", text.replace(['\n', '\r'], " "))
}

/// Text of a cell, in quotes where it needs them.
fn quoted(text: &str) -> String {
    if text.starts_with('#') || text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
