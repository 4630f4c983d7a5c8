//! Display colours: levels from 0 to 255, sRGB-encoded.

/// Light of a display level, 0 to 1.
pub fn light_of(level: f64) -> f64 {
    let encoded = level / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Display level of light, not rounded. Light beyond 1 has the level of 1.
pub fn level_of(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    let encoded = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    255.0 * encoded
}
