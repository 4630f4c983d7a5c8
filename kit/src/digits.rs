//! Numbers with as many digits as their size needs.

/// Number of digits that tell a value from its neighbours.
const DIGITS: i32 = 3;

/// Number of decimals that tell values of a range of this width apart: a thousandth of the width shows.
pub fn decimals(width: f32) -> usize {
    let magnitude = width.abs().log10().floor();
    // The width is zero or not finite.
    if !magnitude.is_finite() {
        return DIGITS as usize;
    }
    // Single precision holds no more decimals.
    (DIGITS - magnitude as i32).clamp(0, 45) as usize
}

/// Formats a value in three significant digits, or in all digits before the point, without needless zeros.
pub fn significant(value: f32) -> String {
    let text = format!("{value:.*}", decimals(value).saturating_sub(1));
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
