//! Topology files: dot.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x.dot", bytes, |path| drop(bagreel::internals::evidence::topology::read(path)));
});
