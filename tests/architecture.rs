//! Checks the architecture: the order of the stations, no circles inside them, one folder per dependency, and a
//! first sentence in every file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The stations, lowest first: each uses only itself and those before it. These are all modules directly below `src`.
const STATIONS: &[&str] = &[
    "base", "bag", "evidence", "graph", "mission", "view", "layout", "draw", "export", "gate",
    "pipeline", "cli",
];

/// The most circles of files that use each other, and the most files in one: each binds what could be read alone.
const CIRCLES: (usize, usize) = (2, 2);

/// Folders whose files do not use each other: kinds of evidence. Steps of engines are listed in their parent instead.
const SIBLINGS: &[&str] = &["evidence/source"];

/// Where a dependency may be used. One that is not listed may be used in one file, or in one folder and its file.
const EXCEPTIONS: &[(&str, &[&str])] = &[
    // Its derives are on the types that they describe.
    ("serde", &[]),
    // Missions, summaries and pages are JSON; YAML becomes its values.
    (
        "serde_json",
        &[
            "base/csv",
            "base/yaml",
            "evidence/source/connection",
            "evidence/given",
            "export/html",
            "gate/baseline",
            "gate/report",
            "mission/info",
            "mission/json",
        ],
    ),
    // Work on all cores: frames, and the ways of laying out a graph.
    ("rayon", &["export/run", "layout/layered"]),
    // Temporary files: outputs, decompressed bags, and times that exceed the memory limit.
    (
        "tempfile",
        &[
            "bag/source",
            "evidence/times",
            "export/sink",
            "export/tables",
        ],
    ),
    // Widths of texts, and the outlines and names of fonts in a PDF.
    ("skrifa", &["draw/text", "draw/paint/pdf"]),
    // Parses and formats times.
    ("chrono", &["base"]),
    // Mathematical functions, like the standard library's.
    ("libm", &[]),
    // Listed only for its features, so that tests rebuild nothing.
    ("regex_syntax", &[]),
];

struct File {
    /// From `src/`, with slashes, without `.rs`: `bag/mcap/chunk`.
    path: String,
    /// The code without its tests and comments.
    code: String,
    first_line: String,
    /// Every path inside this crate that it uses, in full: `bag::model::Sink`.
    uses: Vec<Vec<String>>,
}

impl File {
    /// The parts of its path: `bag`, `mcap`, `chunk`.
    fn parts(&self) -> Vec<&str> {
        self.path.split('/').collect()
    }
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The source files without those of tests.
pub(crate) fn source_files() -> Vec<PathBuf> {
    let mut found = Vec::new();
    walk(&src(), &mut found);
    found.sort();
    found
}

fn files() -> Vec<File> {
    let found = source_files();
    found.iter().map(|path| file(&src(), path)).collect()
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
        .and_then(|stem| stem.to_str())
        .is_some_and(|stem| stem.starts_with("tests") || stem == "testing")
}

fn file(src: &Path, path: &Path) -> File {
    let text = fs::read_to_string(path).unwrap();
    let path = path.strip_prefix(src).unwrap().with_extension("");
    let path = path.to_str().unwrap().replace('\\', "/");
    let before_tests = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    let lines = before_tests
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let code = lines.collect::<Vec<_>>().join("\n");
    File {
        uses: uses(&path, &code),
        first_line: text.lines().next().unwrap_or_default().to_owned(),
        path,
        code,
    }
}

/// Every path of this crate in the code, with groups split: `use crate::{bag, base::error::Error}` is two of them.
fn uses(path: &str, code: &str) -> Vec<Vec<String>> {
    let own: Vec<String> = path.split('/').map(str::to_owned).collect();
    let mut found = Vec::new();
    for (at, _) in code
        .match_indices("crate::")
        .chain(code.match_indices("super::"))
    {
        let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        if code[..at].chars().next_back().is_some_and(is_word) {
            continue;
        }
        let mut rest = &code[at..];
        let mut from = own.clone();
        if let Some(after) = rest.strip_prefix("crate::") {
            rest = after;
            from.clear();
        }
        while let Some(after) = rest.strip_prefix("super::") {
            rest = after;
            from.pop();
        }
        for tail in expand(rest) {
            let mut full = from.clone();
            full.extend(tail);
            found.push(full);
        }
    }
    found
}

/// The paths at the start of `text`: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expand(text: &str) -> Vec<Vec<String>> {
    let end = text
        .find(|c: char| !c.is_alphanumeric() && c != '_')
        .unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    if let Some(group) = rest.strip_prefix("::").filter(|_| !word.is_empty()) {
        let tails = expand(group);
        return tails
            .into_iter()
            .map(|tail| [vec![word.to_owned()], tail].concat())
            .collect();
    }
    if word.is_empty() && rest.starts_with('{') {
        return members(&rest[1..]).iter().flat_map(|m| expand(m)).collect();
    }
    if word.is_empty() {
        vec![Vec::new()]
    } else {
        vec![vec![word.to_owned()]]
    }
}

/// The members of a group after its opening brace.
fn members(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                found.push(text[start..at].trim());
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                found.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    found.retain(|member| !member.is_empty());
    found
}

#[test]
fn grouped_imports_are_split() {
    let code =
        "use crate::{bag, base::{error::{Error, Result}, time}};\nlet x = super::model::Sink;";
    let found: Vec<String> = uses("bag/mcap", code)
        .iter()
        .map(|u| u.join("::"))
        .collect();
    let expected = [
        "bag",
        "base::error::Error",
        "base::error::Result",
        "base::time",
        "bag::model::Sink",
    ];
    assert_eq!(found, expected);
}

#[test]
fn the_top_level_modules_are_the_stations() {
    let all = files();
    let doors: BTreeSet<&str> = all.iter().map(|f| f.parts()[0]).collect();
    let expected: BTreeSet<&str> = STATIONS
        .iter()
        .copied()
        .chain(["main", "lib", "internals"])
        .collect();
    assert_eq!(doors, expected);
    let lib = all.iter().find(|f| f.path == "lib").unwrap();
    let shown = words_after(&lib.code, "\npub mod ");
    let reported: BTreeSet<&str> = words_after(&lib.code, "\nmod ").chain(shown).collect();
    let page = ["values", "commands", "internals"];
    let expected: BTreeSet<&str> = STATIONS.iter().copied().chain(page).collect();
    assert_eq!(
        reported, expected,
        "the stations and the re-exported modules"
    );
    assert!(
        all.iter().all(|f| !f.code.contains("#[path")),
        "a file is not where its name requires"
    );
}

/// Every word after `prefix` in the code.
fn words_after<'a>(code: &'a str, prefix: &'a str) -> impl Iterator<Item = &'a str> {
    code.split(prefix).skip(1).map(|rest| {
        rest.split(|c: char| !c.is_alphanumeric() && c != '_')
            .next()
            .unwrap()
    })
}

#[test]
fn stations_only_use_lower_stations() {
    let place = |station: &str| STATIONS.iter().position(|s| *s == station);
    let mut wrong = Vec::new();
    for file in files() {
        let Some(own) = place(file.parts()[0]) else {
            continue;
        };
        let above =
            |used: &&Vec<String>| used.first().and_then(|s| place(s)).is_some_and(|p| p > own);
        for used in file.uses.iter().filter(above) {
            wrong.push(format!("{} uses {} above it", file.path, used.join("::")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// For each file, those that it uses, as indices; without the files of the folders that it is in, whose types all of
/// their files share.
fn used_files(all: &[File]) -> Vec<BTreeSet<usize>> {
    let places: BTreeMap<&str, usize> = (0..).zip(all).map(|(at, f)| (&*f.path, at)).collect();
    let target = |used: &Vec<String>| {
        let ends = (1..=used.len()).rev();
        let mut found = ends.filter_map(|end| places.get(&*used[..end].join("/")));
        found.next().copied()
    };
    let used = |file: &File| {
        let targets = file.uses.iter().filter_map(target);
        let others = targets.filter(|at| !is_below(&file.path, &all[*at].path));
        others.collect()
    };
    all.iter().map(used).collect()
}

/// The files that can be reached from a file.
fn reached(uses: &[BTreeSet<usize>], from: usize) -> BTreeSet<usize> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(at) = open.pop() {
        open.extend(uses[at].iter().copied().filter(|next| found.insert(*next)));
    }
    found
}

#[test]
fn few_files_use_each_other_in_circles() {
    let all = files();
    let uses = used_files(&all);
    let reached: Vec<BTreeSet<usize>> = (0..all.len()).map(|at| reached(&uses, at)).collect();
    let circle = |at: usize| {
        let mutual = reached[at]
            .iter()
            .filter(|other| reached[**other].contains(&at));
        mutual
            .map(|other| &*all[*other].path)
            .collect::<Vec<&str>>()
    };
    let circles: BTreeSet<Vec<&str>> = (0..all.len()).map(circle).collect();
    let circles: Vec<_> = circles.into_iter().filter(|c| c.len() > 1).collect();
    let largest = circles.iter().map(Vec::len).max().unwrap_or(0);
    assert!(
        circles.len() <= CIRCLES.0 && largest <= CIRCLES.1,
        "{circles:#?}"
    );
}

#[test]
fn siblings_do_not_import_each_other() {
    let all = files();
    let mut wrong = Vec::new();
    for folder in SIBLINGS {
        let prefix = format!("{folder}/");
        let own: Vec<&File> = all.iter().filter(|f| f.path.starts_with(&prefix)).collect();
        let depth = folder.split('/').count();
        let names: BTreeSet<&str> = own.iter().map(|f| f.parts()[depth]).collect();
        for file in &own {
            let name = file.parts()[depth];
            let is_sibling = |used: &&Vec<String>| {
                used.len() > depth
                    && used[..depth].join("/") == *folder
                    && used[depth] != name
                    && names.contains(used[depth].as_str())
            };
            for used in file.uses.iter().filter(is_sibling) {
                wrong.push(format!("{} uses {}", file.path, used.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn each_dependency_is_used_in_one_folder() {
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
            .filter(|f| names_crate(f, &name))
            .map(|f| f.path.as_str())
            .collect();
        let within = |folder: &str| users.iter().all(|u| is_below(u, folder));
        match exceptions.get(name.as_str()) {
            Some([]) => {}
            Some(allowed) if users.iter().all(|u| allowed.iter().any(|a| is_below(u, a))) => {}
            _ if users.first().is_some_and(|first| {
                let folder = if first.matches('/').count() > 1 {
                    first.rsplit_once('/').map_or(*first, |f| f.0)
                } else {
                    first
                };
                within(folder) || (name == "clap" || name == "clap_complete") && within("cli")
            }) => {}
            _ => wrong.push(format!("{name}: {users:?}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Whether this file is `place` or in the folder of that name.
fn is_below(path: &str, place: &str) -> bool {
    path == place
        || path
            .strip_prefix(place)
            .is_some_and(|rest| rest.starts_with('/'))
}

/// Whether the code uses this crate: `name::` that is not a module declared or imported here.
fn names_crate(file: &File, name: &str) -> bool {
    let own = [
        format!("mod {name};"),
        format!(" {name},"),
        format!("{{{name},"),
        format!("::{name};"),
        format!("{{self, {name}"),
    ];
    if own.iter().any(|module| file.code.contains(module))
        && !file.code.contains(&format!("use {name}::"))
        && !file.code.contains(&format!(" ::{name}::"))
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
    }) && (!STATIONS.contains(&name) || file.code.contains(&format!(" ::{path}")))
}

#[test]
fn every_file_states_its_purpose() {
    let silent: Vec<_> = files()
        .into_iter()
        .filter(|f| !f.first_line.starts_with("//! "))
        .map(|f| f.path)
        .collect();
    assert!(silent.is_empty(), "{silent:#?}");
}

/// Code that formats for people, and the other places where it may occur for a reason.
const SPELLINGS: &[(&str, &[&str])] = &[
    // A rate. The event log has the numbers before it formats them as a sentence.
    (" Hz\"", &["mission/event_log"]),
    ("} Hz", &["mission/event_log"]),
    ("} kHz", &[]),
    // A size.
    ("} MB", &[]),
    ("} kB", &[]),
    // A clock or an offset. The player's script has its own for the browser.
    (":02}:{", &[]),
    // A plural.
    ("{ \"s\" }", &[]),
    ("\"s\" } else", &[]),
    // An invisible character; names of characters that the font lacks are reported in a note.
    ("escape_unicode", &["draw/picture"]),
    // A shortened name. Labels are cut by their width in the font, not by characters.
    ("'…'", &["draw/text", "export/markdown"]),
    ("}…\"", &[]),
];

#[test]
fn one_module_formats_for_people() {
    let mut wrong = Vec::new();
    for file in files().iter().filter(|f| f.path != "base/words") {
        for (spelling, allowed) in SPELLINGS {
            if file.code.contains(spelling) && !allowed.iter().any(|a| is_below(&file.path, a)) {
                wrong.push(format!("{} spells `{spelling}` itself", file.path));
            }
        }
    }
    assert!(wrong.is_empty(), "use `base::words`: {wrong:#?}");
}
