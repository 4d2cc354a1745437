//! Message definitions, up to the first byte 0xff, followed by a payload.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |b| *b == 0xff);
    let (definition, payload) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    bagreel_fuzz::read_message("cdr", definition, payload);
});
