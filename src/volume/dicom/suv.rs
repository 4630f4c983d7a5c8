//! Standardised uptake values (SUV) of PET, by body weight.
//!
//! The steps follow the vendor-neutral recipe of the Quantitative Imaging Biomarkers Alliance (QIBA). The weight and
//! the dose are needed for one factor alone, which is kept.

use super::{data_set::DataSet, tags};

/// Factor from the file's units to grams per millilitre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Suv(pub f64);

impl Suv {
    /// The factor, or why there is none.
    pub fn of(fields: &DataSet) -> Result<Self, &'static str> {
        match fields.text(tags::UNITS) {
            Some("GML") => return Ok(Self(1.0)),
            Some("BQML") => {}
            _ => return Err("Units is neither BQML nor GML"),
        }
        let is_corrected = |word| fields.words(tags::CORRECTED_IMAGE).any(|of| of == word);
        if !is_corrected("ATTN") || !is_corrected("DECY") {
            return Err("CorrectedImage lacks ATTN or DECY");
        }
        let positive = |number: Option<f64>| number.filter(|&number| number > 0.0);
        let weight_kg = positive(fields.number(tags::PATIENT_WEIGHT)).ok_or("PatientWeight is missing")?;
        let [dose] = fields.items(tags::RADIOPHARMACEUTICAL_INFORMATION_SEQUENCE) else {
            return Err("RadiopharmaceuticalInformationSequence has not one item");
        };
        let becquerel =
            positive(dose.number(tags::RADIONUCLIDE_TOTAL_DOSE)).ok_or("RadionuclideTotalDose is missing")?;
        let at_scan = match fields.text(tags::DECAY_CORRECTION) {
            Some("ADMIN") => becquerel,
            Some("START") => {
                let half_life = positive(dose.number(tags::RADIONUCLIDE_HALF_LIFE))
                    .ok_or("RadionuclideHalfLife is missing")?;
                becquerel * 2f64.powf(-seconds_to_scan(fields, dose)? / half_life)
            }
            _ => return Err("DecayCorrection is neither START nor ADMIN"),
        };
        let factor = weight_kg * 1000.0 / at_scan;
        if factor.is_finite() { Ok(Self(factor)) } else { Err("the dose is no usable number") }
    }
}

/// Seconds from the injection to the scan.
fn seconds_to_scan(fields: &DataSet, dose: &DataSet) -> Result<f64, &'static str> {
    let scan = time(fields.text(tags::SERIES_TIME)).ok_or("SeriesTime is missing")?;
    let acquired = time(fields.text(tags::ACQUISITION_TIME)).unwrap_or(scan);
    let days = [tags::SERIES_DATE, tags::ACQUISITION_DATE].map(|tag| fields.text(tag));
    // A series made later has a later time than its parts. Then the scan's start is unknown.
    if days[1].is_some() && days[0] != days[1] || acquired < scan {
        return Err("SeriesTime is later than AcquisitionTime");
    }
    let injected = match dose.text(tags::RADIOPHARMACEUTICAL_START_DATE_TIME) {
        Some(moment) => {
            let (day, of_day) =
                moment.split_at_checked(8).ok_or("RadiopharmaceuticalStartDateTime is damaged")?;
            if Some(day) != days[0] {
                return Err("the injection was on another day");
            }
            time(Some(of_day.split(['+', '-']).next().unwrap_or(of_day)))
        }
        None => time(dose.text(tags::RADIOPHARMACEUTICAL_START_TIME)),
    };
    let seconds = scan - injected.ok_or("RadiopharmaceuticalStartTime is missing")?;
    if seconds >= 0.0 { Ok(seconds) } else { Err("the injection is later than the scan") }
}

/// Seconds of a day, written as HHMMSS.FFF.
fn time(text: Option<&str>) -> Option<f64> {
    let text = text?;
    let part = |range: std::ops::Range<usize>| text.get(range)?.parse::<f64>().ok();
    let seconds =
        text.get(4..).filter(|rest| !rest.is_empty()).map_or(Some(0.0), |rest| rest.parse().ok())?;
    let of_day = part(0..2)? * 3600.0 + part(2..4).unwrap_or(0.0) * 60.0 + seconds;
    (0.0..86_401.0).contains(&of_day).then_some(of_day)
}
