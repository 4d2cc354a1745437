//! Names of outputs: no input is overwritten.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bagreel_fuzz::outputs(bytes));
