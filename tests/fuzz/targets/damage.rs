//! Healthy files with a little damage: losses are reported.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bagreel_fuzz::damage(bytes));
