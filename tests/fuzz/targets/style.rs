//! Styles.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = bagreel::internals::draw::style::Style::from_toml(text, "x.toml".as_ref());
    }
});
