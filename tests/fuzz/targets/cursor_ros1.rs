//! Payloads of ROS 1, of every type that a source reads.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bagreel_fuzz::read_message("ros1", b"", bytes));
