//! ROS 1 bags: by the index, from the front.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x.bag", bytes, |path| bagreel_fuzz::read_bag(path, false));
});
