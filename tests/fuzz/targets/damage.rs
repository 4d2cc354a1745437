//! Healthy files with a little damage: what is missing is said.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bagreel_fuzz::damage(bytes));
