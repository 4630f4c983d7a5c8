#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bevy_contextual_ao_fuzz::check_dicom(bytes));
