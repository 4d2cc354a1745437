//! Snapshots: texts and pictures that a run must reproduce. `SNAPSHOTS=new` replaces them.

use std::fs;
use std::path::Path;

/// Whether this run replaces the snapshots.
pub fn is_new() -> bool {
    std::env::var("SNAPSHOTS").is_ok_and(|word| word == "new")
}

/// Compares a text with its snapshot, a file in `tests/snapshots`, or replaces that.
pub fn assert_snapshot(file: &str, text: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    if is_new() {
        fs::write(folder.join(file), text).unwrap();
        return;
    }
    let expected = fs::read_to_string(folder.join(file)).unwrap_or_default();
    let mut lines = (1..).zip(expected.lines().zip(text.lines()));
    let differs = lines.find(|(_, (expected, actual))| expected != actual);
    if let Some((line, (expected, actual))) = differs {
        panic!("{file}, line {line}:\n- {expected}\n+ {actual}");
    }
    assert!(
        expected == text,
        "{file} is longer, or shorter, than expected"
    );
}
