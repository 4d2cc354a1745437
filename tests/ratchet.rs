//! A ratchet: the code, its direct dependencies and its options become fewer, never more. Whoever removes some lowers the limit.

use std::fs;
use std::path::{Path, PathBuf};

use crate::architecture;
use crate::options;

/// Lines of `src` that are neither blank nor comment nor test.
const MOST_LINES: usize = 67_445;
/// Entries of the dependency sections in `Cargo.toml`, optional ones included, those of tests not.
const MOST_DEPENDENCIES: usize = 44;
/// Options in the help of all commands; one that three commands have counts three times.
const MOST_OPTIONS: usize = 115;
/// Options in the help of `render`.
const MOST_OPTIONS_OF_RENDER: usize = 37;

/// The code lines of a file: an inner module of tests ends it.
fn lines(path: &PathBuf) -> usize {
    let text = fs::read_to_string(path).unwrap();
    let code = text
        .lines()
        .take_while(|line| !line.starts_with("mod tests"));
    code.map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with("//"))
        .count()
}

fn holds(what: &str, found: usize, most: usize) {
    assert!(
        found <= most,
        "{found} {what}, and at most {most} are allowed: remove some"
    );
    // A limit far above what exists would let the next change grow unseen.
    let slack = most / 100;
    assert!(
        found + slack >= most,
        "only {found} {what}: lower the limit of {most}"
    );
}

#[test]
fn the_code_does_not_grow() {
    let found = architecture::source_files().iter().map(lines).sum();
    holds("lines of code", found, MOST_LINES);
}

#[test]
fn the_dependencies_do_not_grow() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let text = fs::read_to_string(manifest).unwrap();
    let mut is_counted = false;
    let mut found = 0;
    for line in text.lines() {
        if let Some(section) = line.strip_prefix('[') {
            is_counted = section.ends_with("dependencies]") && section != "dev-dependencies]";
        }
        found += usize::from(is_counted && line.contains(" = "));
    }
    holds("direct dependencies", found, MOST_DEPENDENCIES);
}

#[test]
fn the_options_do_not_grow() {
    let count = |command: &String| options::listed(command).len();
    let found = options::commands().iter().map(count).sum();
    holds("options", found, MOST_OPTIONS);
    holds(
        "options of `render`",
        count(&"render".to_owned()),
        MOST_OPTIONS_OF_RENDER,
    );
}
