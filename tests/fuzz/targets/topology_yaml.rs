//! Topology files: yaml.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("x.yaml", bytes, |path| drop(bagreel::internals::evidence::topology::read(path)));
});
