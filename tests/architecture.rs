//! Keeps the house in order: layers, siblings, one dependency in one file, and a first sentence for every file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules, lowest first: each uses only itself and those before it.
#[rustfmt::skip]
const LAYERS: &[&str] = &[
    "time", "name", "geometry", "error", "notice", "yaml", "table", "hash", "decompress", "source", "bag", "wire", "stamps", "rhythm",
    "definition", "value", "facts", "proof", "trust", "evidence", "collect", "topology", "window", "graph", "diff",
    "evolution", "events", "info", "view", "text", "layout", "style", "scene", "svg", "pixels", "picture", "palette",
    "output", "spells", "stage", "dot", "mermaid", "film", "strip", "report", "page", "encode", "reel", "pipeline",
    "terminal", "cli", "main", "lib",
];

/// Folders whose files do not know each other.
const SIBLINGS: &[&str] = &["bag", "evidence", "encode"];

/// Where a dependency may be named. What is not listed here may stand in one file only.
const EXCEPTIONS: &[(&str, &[&str])] = &[
    // Its derives stand on the types that they describe.
    ("serde", &[]),
    // The evolution, the summary and the page are JSON; YAML becomes its values.
    (
        "serde_json",
        &[
            "evidence/qos.rs",
            "evolution/lines.rs",
            "evolution/read.rs",
            "evolution/write.rs",
            "info.rs",
            "page/data.rs",
            "topology/tree.rs",
            "topology/yaml.rs",
            "yaml.rs",
        ],
    ),
    // What is typed, and its help, completions and manual page.
    ("clap", &["cli.rs", "cli/typed.rs"]),
    ("clap_complete", &["cli.rs", "cli/typed.rs"]),
    // Tables of an evolution are written as a stream, small ones as text.
    ("csv", &["encode/csv.rs", "table.rs"]),
    // Frames are painted and compared side by side.
    ("rayon", &["reel.rs", "reel/artists.rs"]),
    // Temporary files: of outputs, of decompressed bags, of stamps beyond what memory may hold.
    ("tempfile", &["output/sink.rs", "source.rs", "stamps.rs"]),
    // Plain functions on numbers, as the standard library's would be.
    ("libm", &[]),
];

struct File {
    /// From `src/`, with slashes.
    path: String,
    /// The module at the top: `bag` for `bag/mcap.rs`.
    module: String,
    /// The text without its tests and comments.
    code: String,
    first_line: String,
}

fn files() -> Vec<File> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    walk(&src, &mut found);
    found.sort();
    found.iter().map(|path| file(&src, path)).collect()
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") && !is_test(&path) {
            found.push(path);
        }
    }
}

fn is_test(path: &Path) -> bool {
    path.file_stem()
        .is_some_and(|stem| stem == "tests" || stem == "testing")
}

fn file(src: &Path, path: &Path) -> File {
    let text = fs::read_to_string(path).unwrap();
    let path = path
        .strip_prefix(src)
        .unwrap()
        .to_str()
        .unwrap()
        .replace('\\', "/");
    let module = path
        .split('/')
        .next()
        .unwrap()
        .trim_end_matches(".rs")
        .to_owned();
    let before_tests = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let lines = before_tests
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let first_line = text.lines().next().unwrap_or_default().to_owned();
    File {
        path,
        module,
        code: lines.collect::<Vec<_>>().join("\n"),
        first_line,
    }
}

/// Every word behind `prefix` in the code.
fn words_after<'a>(code: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    code.split(prefix).skip(1).map(|rest| {
        rest.split(|c: char| !c.is_alphanumeric() && c != '_')
            .next()
            .unwrap()
    })
}

#[test]
fn modules_use_only_those_below_them() {
    let layer = |module: &str| LAYERS.iter().position(|m| *m == module);
    let mut wrong = Vec::new();
    for file in files() {
        let Some(own) = layer(&file.module) else {
            wrong.push(format!("{} is in no layer", file.path));
            continue;
        };
        for used in words_after(&file.code, "crate::")
            .filter_map(layer)
            .filter(|used| *used > own)
        {
            wrong.push(format!("{} uses {} above it", file.path, LAYERS[used]));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn siblings_do_not_know_each_other() {
    let all = files();
    let mut wrong = Vec::new();
    for folder in SIBLINGS {
        let own: Vec<&File> = all
            .iter()
            .filter(|f| f.path.starts_with(&format!("{folder}/")))
            .collect();
        let names: BTreeSet<&str> = own
            .iter()
            .map(|f| f.path.rsplit('/').next().unwrap().trim_end_matches(".rs"))
            .collect();
        for file in &own {
            let direct = format!("crate::{folder}::");
            let used = words_after(&file.code, "super::").chain(words_after(&file.code, &direct));
            let known: Vec<_> = used.filter(|word| names.contains(word)).collect();
            // A folder below a sibling is its own business.
            if !known.is_empty() && file.path.matches('/').count() == 1 {
                wrong.push(format!("{} uses {known:?}", file.path));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_dependency_stands_in_one_file() {
    let manifest =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).unwrap();
    let section = manifest
        .split("[dependencies]\n")
        .nth(1)
        .unwrap()
        .split("\n[")
        .next()
        .unwrap();
    let names = section
        .lines()
        .filter_map(|l| l.split_once(" = "))
        .map(|(name, _)| name.trim().replace('-', "_"));
    let exceptions: BTreeMap<_, _> = EXCEPTIONS.iter().copied().collect();
    let all = files();
    let mut wrong = Vec::new();
    for name in names {
        let name = if name == "layout_rs" {
            "layout".to_owned()
        } else {
            name
        };
        let users: Vec<&str> = all
            .iter()
            .filter(|f| uses(f, &name))
            .map(|f| f.path.as_str())
            .collect();
        match exceptions.get(name.as_str()) {
            Some([]) => {}
            Some(allowed) if users.iter().all(|u| allowed.contains(u)) => {}
            _ if users.len() == 1 => {}
            _ => wrong.push(format!("{name}: {users:?}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Whether the code names this crate: `name::` that is no module declared or imported here.
fn uses(file: &File, name: &str) -> bool {
    let own = [
        format!("mod {name};"),
        format!(" {name},"),
        format!("{{{name},"),
        format!("::{name};"),
    ];
    if own.iter().any(|module| file.code.contains(module))
        && !file.code.contains(&format!("use {name}::"))
    {
        return false;
    }
    let path = format!("{name}::");
    file.code.match_indices(&path).any(|(at, _)| {
        let before = &file.code[..at];
        let joined = before
            .chars()
            .next_back()
            .is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':');
        !joined || before.ends_with(" ::")
    }) && (!LAYERS.contains(&name) || file.code.contains(&format!(" ::{path}")))
}

#[test]
fn every_file_says_what_it_is_for() {
    let silent: Vec<_> = files()
        .into_iter()
        .filter(|f| !f.first_line.starts_with("//! "))
        .map(|f| f.path)
        .collect();
    assert!(silent.is_empty(), "{silent:#?}");
}

#[test]
fn files_are_rooms_not_halls() {
    let long: Vec<_> = files()
        .into_iter()
        .map(|f| (f.code.lines().count(), f.path))
        .filter(|(lines, _)| *lines > 500)
        .collect();
    assert!(long.is_empty(), "{long:#?}");
}
