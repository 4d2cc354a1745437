//! Any bag by the second reader.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x", bytes, |path| bagreel_fuzz::read_bag(path, true));
});
