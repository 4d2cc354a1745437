//! The line from the bytes of any bag to its graphs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x", bytes, bagreel_fuzz::read_graphs);
});
