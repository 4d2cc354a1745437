//! Bags compressed as a whole: the bytes, compressed.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x.mcap.zstd", bytes, |path| bagreel_fuzz::read_bag(path, false));
});
