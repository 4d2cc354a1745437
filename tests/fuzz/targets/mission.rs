//! Missions as JSON.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = bagreel::internals::mission::read_json(text, "x.json".as_ref());
    }
});
