//! `metadata.yaml` of a folder, which may list two existing files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    bagreel_fuzz::as_file("metadata.yaml", bytes, |path| {
        let folder = path.parent().expect("a folder");
        for name in ["bag_0.mcap", "bag_1.mcap"] {
            std::fs::write(folder.join(name), b"\x89MCAP0\r\n").expect("a file");
        }
        bagreel_fuzz::read_bag(folder, false);
    });
});
