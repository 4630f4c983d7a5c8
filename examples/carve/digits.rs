//! Numbers with as many digits as their size asks for.

/// Digits that tell one value from its neighbours.
const DIGITS: i32 = 3;

/// Decimals in which values of a range of this width differ, so that a thousandth of it shows.
pub fn decimals(width: f32) -> usize {
    let magnitude = width.abs().log10().floor();
    // No width, or none that is finite.
    if !magnitude.is_finite() {
        return DIGITS as usize;
    }
    // Single precision holds no more.
    (DIGITS - magnitude as i32).clamp(0, 45) as usize
}

/// A value in three significant digits, or as many as it has before the point, without zeros that say nothing.
pub fn significant(value: f32) -> String {
    let text = format!("{value:.*}", decimals(value).saturating_sub(1));
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
