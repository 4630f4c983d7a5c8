#![no_main]

use bevy_contextual_ao_fuzz::{check_transfer_function, volume::TransferFunction};

libfuzzer_sys::fuzz_target!(|text: &str| check_transfer_function(text, TransferFunction::from_slicer_vp));
