//! Packages of a workspace and their programs: the files or the class of each executable.

use std::collections::BTreeMap;

use super::files::{FileKind, SourceFile, kind};
use crate::evidence::given::substitution::closing;

/// A package, by its `package.xml`.
#[derive(Default)]
pub(super) struct Package {
    pub(super) name: String,
    /// The folder below the workspace, with a slash at the end; empty at the top.
    pub(super) folder: String,
    pub(super) programs: BTreeMap<String, Program>,
}

/// The code of an executable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Program {
    /// Source files, below the workspace.
    Files(Vec<String>),
    /// A component, given by its class without namespaces.
    Class(String),
}

/// All packages, sorted by folder, with the programs in their build files.
pub(super) fn packages(files: &[SourceFile]) -> Vec<Package> {
    let of_kind = |wanted| files.iter().filter(move |f| kind(&f.path) == Some(wanted));
    let mut all: Vec<Package> = of_kind(FileKind::Package).filter_map(package).collect();
    all.sort_by(|a, b| a.folder.cmp(&b.folder));
    let paths: Vec<&str> = files.iter().map(|f| f.path.as_str()).collect();
    for file in of_kind(FileKind::Cmake) {
        if let Some(at) = package_of(&all, &file.path) {
            let made = cmake(file, &all[at].name, &paths);
            all[at].programs.extend(made);
        }
    }
    for file in of_kind(FileKind::Setup) {
        if let Some(at) = package_of(&all, &file.path) {
            let folder = all[at].folder.clone();
            all[at].programs.extend(entry_points(&file.text, &folder));
        }
    }
    all
}

/// The package that a file belongs to: the innermost folder with a `package.xml`.
pub(super) fn package_of(all: &[Package], path: &str) -> Option<usize> {
    let inside = (0..).zip(all).filter(|(_, p)| path.starts_with(&p.folder));
    inside.max_by_key(|(_, p)| p.folder.len()).map(|(at, _)| at)
}

fn package(file: &SourceFile) -> Option<Package> {
    let (_, after) = file.text.split_once("<name>")?;
    let (name, _) = after.split_once("</name>")?;
    Some(Package {
        name: name.trim().to_owned(),
        folder: folder(&file.path).to_owned(),
        programs: BTreeMap::new(),
    })
}

/// The folder of a file, with a slash at the end; empty at the top.
fn folder(path: &str) -> &str {
    path.rfind('/').map_or("", |at| &path[..=at])
}

/// The entry points `'name = package.module:function'` in `setup.py` and `setup.cfg`.
fn entry_points(text: &str, folder: &str) -> Vec<(String, Program)> {
    let pieces = text.split(['\n', '\'', '"', ',']);
    let entry = |piece: &str| {
        let (name, target) = piece.split_once('=')?;
        let (module, _) = target.split_once(':')?;
        let (name, module) = (name.trim(), module.trim());
        let is_part = |c: char| c.is_alphanumeric() || "_-.".contains(c);
        let is_word = |word: &str| !word.is_empty() && word.chars().all(is_part);
        let file = format!("{folder}{}.py", module.replace('.', "/"));
        (is_word(name) && is_word(module)).then(|| (name.to_owned(), Program::Files(vec![file])))
    };
    pieces.filter_map(entry).collect()
}

/// The most variables and sources of a `CMakeLists.txt` that are kept: a hundred times those of large packages; lists of lists would
/// grow without it.
const MOST: usize = 10_000;

/// The most text in the variables of a `CMakeLists.txt`, in bytes: variables that repeat each other double with each line.
const MOST_TEXT: usize = 4 << 20;

/// The executables that a `CMakeLists.txt` builds.
fn cmake(file: &SourceFile, package: &str, paths: &[&str]) -> Vec<(String, Program)> {
    let here = folder(&file.path);
    let mut variables = BTreeMap::from([("PROJECT_NAME".to_owned(), package.to_owned())]);
    let mut programs = Vec::new();
    let mut left = MOST_TEXT;
    for (command, words) in commands(&file.text) {
        let words = words.iter().flat_map(|w| put_in(w, &variables, &mut left));
        let words: Vec<String> = words.take(MOST).collect();
        let Some((first, rest)) = words.split_first() else {
            continue;
        };
        match command.to_lowercase().as_str() {
            "project" => {
                variables.insert("PROJECT_NAME".to_owned(), first.clone());
            }
            "set" => {
                variables.insert(first.clone(), rest.join(";"));
            }
            "file" if first.starts_with("GLOB") => {
                let patterns = rest.iter().skip(1);
                let found = patterns.flat_map(|pattern| glob(pattern, here, paths));
                let value: Vec<String> = found.take(MOST).collect();
                variables.insert(rest.first().cloned().unwrap_or_default(), value.join(";"));
            }
            "rclcpp_components_register_node" => programs.extend(component(rest)),
            name if name.ends_with("add_executable") || name == "add_rostest_gtest" => {
                let sources = rest.iter().filter(|w| w.contains('.'));
                let sources = sources.map(|w| located(here, w)).collect();
                programs.push((first.clone(), Program::Files(sources)));
            }
            _ => {}
        }
    }
    programs
}

/// `rclcpp_components_register_node(library PLUGIN "package::Class" EXECUTABLE name)`
fn component(words: &[String]) -> Option<(String, Program)> {
    let behind = |key: &str| words.get(words.iter().position(|w| w == key)? + 1);
    let class = behind("PLUGIN")?.rsplit("::").next()?.to_owned();
    Some((behind("EXECUTABLE")?.clone(), Program::Class(class)))
}

/// A source file below the workspace.
fn located(here: &str, source: &str) -> String {
    let own = [
        "${CMAKE_CURRENT_SOURCE_DIR}/",
        "${PROJECT_SOURCE_DIR}/",
        "./",
    ];
    let below = own.iter().fold(source, |source, start| {
        source.strip_prefix(start).unwrap_or(source)
    });
    format!("{here}{below}")
}

/// The files that match `src/*.cpp`, relative to `here`.
fn glob(pattern: &str, here: &str, paths: &[&str]) -> Vec<String> {
    let Some((start, end)) = pattern.split_once('*') else {
        return vec![pattern.to_owned()];
    };
    let start = located(here, start);
    let end = end.trim_start_matches('*');
    let matching = paths
        .iter()
        .filter(|p| p.starts_with(&start) && p.ends_with(end));
    let below = matching.take(MOST).filter_map(|p| p.strip_prefix(here));
    below.map(str::to_owned).collect()
}

/// A word with its variables replaced and lists split; unknown variables stay as written.
fn put_in(word: &str, variables: &BTreeMap<String, String>, left: &mut usize) -> Vec<String> {
    let mut done = String::new();
    let mut rest = word;
    while let Some((before, after)) = rest.split_once("${") {
        let Some((name, behind)) = after.split_once('}') else {
            break;
        };
        done.push_str(before);
        match variables.get(name) {
            Some(value) if value.len() <= *left => {
                *left -= value.len();
                done.push_str(value);
            }
            _ => done.extend(["${", name, "}"]),
        }
        rest = behind;
    }
    done.push_str(rest);
    done.split(';')
        .filter(|w| !w.is_empty())
        .map(str::to_owned)
        .collect()
}

/// Every `command(words …)`, without comments.
fn commands(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('(') {
        let line = before.rsplit('\n').next().unwrap_or_default();
        if line.contains('#') {
            rest = after.split_once('\n').map_or("", |(_, next)| next);
            continue;
        }
        let end = closing(after).unwrap_or(after.len());
        let inside = &after[..end];
        let lines = inside.lines();
        let lines = lines.map(|line| line.split('#').next().unwrap_or_default());
        let words = lines.flat_map(|line| line.split([' ', '\t', '"', '(', ')', '\r']));
        found.push((line.trim(), words.filter(|w| !w.is_empty()).collect()));
        rest = after.get(end + 1..).unwrap_or_default();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn workspace(files: &[(&str, &str)]) -> Vec<Package> {
        let file = |(path, text): &(&str, &str)| SourceFile {
            path: (*path).to_owned(),
            text: (*text).to_owned(),
        };
        packages(&files.iter().map(file).collect::<Vec<_>>())
    }

    #[test]
    fn executables_of_cmake_have_their_sources() {
        let all = workspace(&[
            ("a/package.xml", "<package><name> arm </name></package>"),
            ("a/src/one.cpp", ""),
            ("a/src/two.cpp", ""),
            (
                "a/CMakeLists.txt",
                "project(arm)\n# add_executable(no no.cpp)\nset(SRC src/one.cpp src/two.cpp) # both\n\
                 file(GLOB ALL src/*.cpp)\nadd_executable(${PROJECT_NAME}_node ${SRC})\nament_auto_add_executable(all ${ALL})\n\
                 rclcpp_components_register_node(lib PLUGIN \"arm::Gripper\" EXECUTABLE gripper)\n",
            ),
        ]);
        let both = vec!["a/src/one.cpp".to_owned(), "a/src/two.cpp".to_owned()];
        assert_eq!(all[0].name, "arm");
        assert_eq!(all[0].programs["arm_node"], Program::Files(both.clone()));
        assert_eq!(all[0].programs["all"], Program::Files(both));
        assert_eq!(
            all[0].programs["gripper"],
            Program::Class("Gripper".to_owned())
        );
        assert_eq!(all[0].programs.len(), 3);
    }

    #[test]
    fn entry_points_of_python_have_their_module() {
        let setup = "setup(name='p', entry_points={'console_scripts': ['talk = p.nodes.talker:main', \"hear=p.hear:main\"]})";
        let all = workspace(&[
            ("w/p/package.xml", "<name>p</name>"),
            ("w/p/setup.py", setup),
        ]);
        assert_eq!(
            all[0].programs["talk"],
            Program::Files(vec!["w/p/p/nodes/talker.py".to_owned()])
        );
        assert_eq!(
            all[0].programs["hear"],
            Program::Files(vec!["w/p/p/hear.py".to_owned()])
        );
    }

    #[test]
    fn a_file_belongs_to_the_innermost_package() {
        let all = workspace(&[
            ("package.xml", "<name>out</name>"),
            ("in/package.xml", "<name>in</name>"),
        ]);
        assert_eq!(all[package_of(&all, "in/src/x.cpp").unwrap()].name, "in");
        assert_eq!(all[package_of(&all, "x.py").unwrap()].name, "out");
    }

    #[test]
    fn growing_variables_are_bounded() {
        let grow: String = (0..40).flat_map(|_| ["set(A ${A}${A}${A}x)\n"]).collect();
        let all = workspace(&[("package.xml", "<name>p</name>"), ("CMakeLists.txt", &grow)]);
        assert!(all[0].programs.is_empty());
    }
}
