//! A whole workspace: the classes that names refer to, the parts of each node, its packages, and the nodes that their programs
//! and the launch files start.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::declaration::{Class, Declaration, FileCode};
use crate::evidence::code::{FileKind, SourceFile, kind};
use crate::evidence::given::launch::{LaunchedNode, closing};

/// The content of a workspace.
#[derive(Default)]
pub(super) struct Workspace {
    pub(super) packages: Vec<Package>,
    pub(super) files: Vec<CodeFile>,
    /// Launch files by their paths, with the nodes that each may start.
    pub(super) launches: Vec<(String, Vec<LaunchedNode>)>,
    /// The parts of each class, by its name.
    by_name: BTreeMap<String, Vec<ClassPlace>>,
}

/// A source file.
pub(super) struct CodeFile {
    pub(super) path: String,
    pub(super) package: Option<usize>,
    pub(super) code: FileCode,
}

/// The position of a class, or of the code outside classes: file, index in the file.
type ClassPlace = (usize, usize);

/// A declaration with its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileDeclaration {
    /// The path below the workspace.
    pub(crate) path: String,
    pub(crate) declaration: Declaration,
}

/// A node that the workspace may start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Instance {
    /// The name without namespace.
    pub(crate) name: String,
    /// The namespace, if a launch file sets one; empty at the root.
    pub(crate) namespace: Option<String>,
    pub(crate) remaps: Vec<(String, String)>,
    /// The launch file and the line that start it.
    pub(crate) launched: Option<(String, usize)>,
    /// The file and the class, which distinguish it from other programs with the same node name.
    pub(crate) program: (String, String),
    /// The declarations of its program.
    pub(crate) declared: Arc<[FileDeclaration]>,
    /// Whether it only belongs to tests.
    pub(crate) is_test: bool,
    /// Whether its program logs.
    pub(crate) logs: bool,
}

/// A node in the code.
struct CodeNode {
    names: Vec<String>,
    program: (String, String),
    declared: Arc<[FileDeclaration]>,
    logs: bool,
}

/// Base classes that make a class a node.
const NODES: &[&str] = &["LifecycleNode", "ManagedNode", "Node", "Nodelet"];

/// The most parts of a node; more are of names that many classes share: the largest node of 182 repositories has 60.
const MOST_PARTS: usize = 300;

/// The most declarations of one node, and of all nodes together: a hundred times those of the largest robots.
const MOST_DECLARED: usize = 1000;
const MOST_OF_ALL: usize = 500_000;

/// The most classes that may share a name; a more common name, as `Node`, says nothing outside of its own file.
const MOST_NAMESAKES: usize = 500;

/// The most programs that launch files may start; like the next limit, it bounds time and memory: ten times those of the largest
/// workspace seen.
const MOST_PROGRAMS: usize = 5_000;

/// The most nodes that a workspace may start.
const MOST_INSTANCES: usize = 20_000;

impl Workspace {
    pub(super) fn new(
        packages: Vec<Package>,
        files: Vec<(String, FileCode)>,
        launches: Vec<(String, Vec<LaunchedNode>)>,
    ) -> Self {
        let mut all = Self {
            packages,
            launches,
            ..Self::default()
        };
        let files = files.into_iter();
        for (path, code) in files.filter(|(_, code)| !code.classes.is_empty()) {
            let named = code.classes.iter().enumerate();
            for (place, class) in named.filter(|(_, c)| !c.name.is_empty()) {
                let parts = all.by_name.entry(class.name.clone()).or_default();
                parts.push((all.files.len(), place));
            }
            all.files.push(CodeFile {
                package: package_of(&all.packages, &path),
                path,
                code,
            });
        }
        all
    }

    /// Every declaration outside tests, with or without a node.
    pub(super) fn places(&self) -> Vec<FileDeclaration> {
        let files = self.files.iter().filter(|file| !is_test(&file.path));
        let classes = files.flat_map(|file| file.code.classes.iter().map(move |c| (file, c)));
        let declared = classes.flat_map(|(file, class)| declared(file, class));
        declared.collect()
    }

    /// Every node that may be started, as in the code and as in launch files.
    pub(super) fn instances(&self) -> Vec<Instance> {
        let mut all = Vec::new();
        let mut declared = 0;
        for file in 0..self.files.len() {
            if declared > MOST_OF_ALL || all.len() > MOST_INSTANCES {
                break;
            }
            for node in self.nodes_in(file) {
                declared += node.declared.len();
                all.extend(node.names.iter().map(|name| as_written(&node, name)));
            }
        }
        self.launched(&mut all);
        all
    }

    /// The nodes in the code of a file.
    fn nodes_in(&self, file: usize) -> Vec<CodeNode> {
        let classes = &self.files[file].code.classes;
        let mut nodes: Vec<CodeNode> = self.free_node(&[file]).into_iter().collect();
        for (place, class) in classes.iter().enumerate() {
            if class.is_defined && self.is_node((file, place), 0) {
                nodes.push(self.class_node((file, place)));
            }
        }
        let given = classes.iter().flat_map(|c| &c.mentions);
        let given = given.filter_map(|(class, name)| Some((class.as_str(), name.as_ref()?)));
        let given: BTreeMap<&str, &String> = given.collect();
        for (class, name) in given {
            let parts = self.meant(class, file);
            if let Some(part) = parts.first().filter(|p| self.is_node(**p, 0)) {
                let mut node = self.class_node(*part);
                // The text in the call may be anything; it is used as a name only if the class has none.
                if node.names.is_empty() {
                    node.names.push(name.clone());
                    nodes.push(node);
                }
            }
        }
        nodes
    }

    /// Adds the nodes that launch files start.
    fn launched(&self, all: &mut Vec<Instance>) {
        let mut programs = BTreeMap::new();
        for (path, launched) in &self.launches {
            for node in launched.iter().take(MOST_INSTANCES) {
                let key = (node.package.clone(), node.program.clone());
                let nodes = programs
                    .entry(key)
                    .or_insert_with(|| self.program(&node.package, &node.program));
                all.extend(as_launched(path, node, nodes));
                if all.len() > MOST_INSTANCES || programs.len() > MOST_PROGRAMS {
                    return;
                }
            }
        }
    }

    /// The nodes of an executable, a component or a nodelet of a package.
    fn program(&self, package: &str, program: &str) -> Vec<CodeNode> {
        let packages = (0..).zip(&self.packages).filter(|(_, p)| p.name == package);
        for (at, found) in packages {
            match found.programs.get(program) {
                Some(Program::Files(paths)) => {
                    let is_own = |f: &usize| paths.contains(&self.files[*f].path);
                    let files: Vec<usize> = (0..self.files.len()).filter(is_own).collect();
                    return self.nodes_of(&files);
                }
                Some(Program::Class(class)) => return self.component(class, at),
                None => {}
            }
            let last = program.rsplit(['/', ':']).next().unwrap_or(program);
            let is_script = |f: &usize| {
                let file = &self.files[*f];
                let name = file.path.rsplit('/').next().unwrap_or_default();
                file.package == Some(at)
                    && (name == program || name.strip_suffix(".py") == Some(program))
            };
            let scripts: Vec<usize> = (0..self.files.len()).filter(is_script).collect();
            if !scripts.is_empty() {
                return self.nodes_of(&scripts);
            }
            let nodes = self.component(last, at);
            if !nodes.is_empty() {
                return nodes;
            }
        }
        Vec::new()
    }

    fn component(&self, class: &str, package: usize) -> Vec<CodeNode> {
        let mut parts = self.by_name.get(class).into_iter().flatten();
        let is_own = |part: ClassPlace| self.file(part).package == Some(package);
        let own = parts.find(|part| is_own(**part) && self.class(**part).is_defined);
        own.map(|part| self.class_node(*part)).into_iter().collect()
    }

    /// The nodes that a program of these files starts: its own code's, and the node classes that it instantiates.
    fn nodes_of(&self, files: &[usize]) -> Vec<CodeNode> {
        let mut nodes: Vec<CodeNode> = self.free_node(files).into_iter().collect();
        let free = files.iter().map(|file| (*file, 0)).collect();
        let (_, made) = self.belonging(free);
        nodes.extend(made.into_iter().map(|part| self.class_node(part)));
        nodes
    }

    /// The node of the code outside classes.
    fn free_node(&self, files: &[usize]) -> Option<CodeNode> {
        let free: Vec<ClassPlace> = files.iter().map(|file| (*file, 0)).collect();
        // rospy has one node per process, wherever it is named.
        let classes = |file: usize| 0..self.files[file].code.classes.len();
        let all = files
            .iter()
            .flat_map(|file| classes(*file).map(|place| (*file, place)));
        let names = self.names(all.filter(|part| part.1 == 0 || !self.is_node(*part, 0)));
        let path = self.files[*files.first()?].path.clone();
        let (parts, _) = self.belonging(free);
        let node = self.node(&parts, names, (path, String::new()));
        (!node.names.is_empty() || !node.declared.is_empty()).then_some(node)
    }

    fn class_node(&self, part: ClassPlace) -> CodeNode {
        let (parts, _) = self.belonging(self.parts(part));
        // A node name in the class itself takes precedence over those in its bases.
        let mut names = self.names(self.parts(part));
        if names.is_empty() {
            let of_bases = parts.iter().copied();
            names = self.names(of_bases.filter(|part| self.is_node(*part, 0)));
        }
        let program = (self.file(part).path.clone(), self.class(part).name.clone());
        self.node(&parts, names, program)
    }

    /// The names that these parts give to their node.
    fn names(&self, parts: impl IntoIterator<Item = ClassPlace>) -> BTreeSet<String> {
        let parts = parts.into_iter();
        let names = parts.flat_map(|part| &self.class(part).node_names);
        names.cloned().collect()
    }

    fn node(
        &self,
        parts: &[ClassPlace],
        names: BTreeSet<String>,
        program: (String, String),
    ) -> CodeNode {
        let is_recorder = parts.iter().any(|part| self.class(*part).is_recorder);
        let placed = |part: &ClassPlace| declared(self.file(*part), self.class(*part));
        // A text that is not a valid node name has another purpose.
        let is_name = |n: &String| !n.is_empty() && !n.contains(char::is_whitespace);
        CodeNode {
            names: names.into_iter().filter(is_name).collect(),
            program,
            // A recorder subscribes to topics given at run time, which are not in the code.
            declared: if is_recorder {
                Arc::default()
            } else {
                parts.iter().flat_map(placed).take(MOST_DECLARED).collect()
            },
            logs: parts.iter().any(|part| self.class(*part).logs),
        }
    }

    /// The parts that belong to the node of these parts, sorted: its bases, and the classes that it instantiates and
    /// that are not nodes themselves. Those that are nodes are returned second.
    fn belonging(&self, parts: Vec<ClassPlace>) -> (Vec<ClassPlace>, Vec<ClassPlace>) {
        let mut open = parts;
        let (mut own, mut others) = (BTreeSet::new(), BTreeSet::new());
        while let Some(part) = open.pop() {
            if own.len() >= MOST_PARTS || !own.insert(part) {
                continue;
            }
            let class = self.class(part);
            for base in &class.bases {
                open.extend(self.meant(base, part.0));
            }
            for name in class.mentions.keys() {
                let other = self.meant(name, part.0);
                match other.first().filter(|first| self.is_node(**first, 0)) {
                    Some(first) => {
                        others.insert(*first);
                    }
                    None => open.extend(other),
                }
            }
        }
        let defined = others
            .into_iter()
            .filter(|p| self.class(*p).is_defined && !own.contains(p));
        (own.iter().copied().collect(), defined.collect())
    }

    /// The parts of the class that a name refers to in a file: in this file, in the module that it is imported from, in
    /// this package, or the only one in the workspace.
    fn meant(&self, name: &str, file: usize) -> Vec<ClassPlace> {
        let Some(all) = self.by_name.get(name) else {
            return Vec::new();
        };
        if all.len() > MOST_NAMESAKES {
            let from = all.partition_point(|part| part.0 < file);
            let own = all[from..].iter().copied();
            let own = own.take_while(|part| part.0 == file);
            let mut defined = own.filter(|part| self.class(*part).is_defined);
            return defined.next().into_iter().collect();
        }
        let defined = || all.iter().copied().filter(|p| self.class(*p).is_defined);
        let here = &self.files[file];
        let import = here.code.imports.get(name);
        let module = import.map(|full| {
            let module = full.rsplit_once('.').map_or("", |(module, _)| module);
            format!("{}.py", module.trim_start_matches('.').replace('.', "/"))
        });
        let is_imported = |p: &ClassPlace| {
            let module = module.as_ref();
            module.is_some_and(|m| is_path_end(&self.file(*p).path, m))
        };
        let in_package =
            |p: &ClassPlace| here.package.is_some() && self.file(*p).package == here.package;
        let is_both = |p: &ClassPlace| is_imported(p) && in_package(p);
        let chosen = defined().find(|p| p.0 == file);
        let chosen = chosen.or_else(|| only(defined().filter(is_both)));
        let chosen = chosen.or_else(|| only(defined().filter(is_imported)));
        let chosen = chosen.or_else(|| only(defined().filter(in_package)));
        let chosen = chosen.or_else(|| only(defined()));
        chosen.map(|part| self.parts(part)).unwrap_or_default()
    }

    /// A class with its functions in other files of its package.
    fn parts(&self, part: ClassPlace) -> Vec<ClassPlace> {
        let package = self.file(part).package;
        let others = self.by_name.get(&self.class(part).name);
        let others = others.into_iter().flatten().copied();
        let is_own =
            |p: &ClassPlace| !self.class(*p).is_defined && self.file(*p).package == package;
        std::iter::once(part).chain(others.filter(is_own)).collect()
    }

    /// Whether a class is a node, by its base classes.
    fn is_node(&self, part: ClassPlace, depth: usize) -> bool {
        depth < 8
            && self.class(part).bases.iter().any(|base| {
                let meant = self.meant(base, part.0);
                match meant.first() {
                    Some(first) if *first != part => self.is_node(*first, depth + 1),
                    _ => NODES.contains(&base.as_str()),
                }
            })
    }

    fn file(&self, part: ClassPlace) -> &CodeFile {
        &self.files[part.0]
    }

    fn class(&self, part: ClassPlace) -> &Class {
        &self.files[part.0].code.classes[part.1]
    }
}

/// The declarations of a class in a file.
fn declared<'a>(
    file: &'a CodeFile,
    class: &'a Class,
) -> impl Iterator<Item = FileDeclaration> + use<'a> {
    class.declarations.iter().map(|one| FileDeclaration {
        path: file.path.clone(),
        declaration: one.clone(),
    })
}

/// The only item; `None` for none or several.
fn only<T>(mut all: impl Iterator<Item = T>) -> Option<T> {
    let first = all.next();
    if all.next().is_none() { first } else { None }
}

fn is_path_end(path: &str, end: &str) -> bool {
    path.strip_suffix(end)
        .is_some_and(|before| before.is_empty() || before.ends_with('/'))
}

fn as_written(node: &CodeNode, name: &str) -> Instance {
    Instance {
        name: name.trim_start_matches('/').to_owned(),
        namespace: None,
        remaps: Vec::new(),
        launched: None,
        program: node.program.clone(),
        declared: Arc::clone(&node.declared),
        is_test: is_test(&node.program.0),
        logs: node.logs,
    }
}

/// A node as a launch file starts it. The name there takes precedence if the program starts only one node.
fn as_launched(path: &str, launched: &LaunchedNode, nodes: &[CodeNode]) -> Vec<Instance> {
    let mut all = Vec::new();
    for node in nodes {
        let names = match &launched.name {
            Some(name) if nodes.len() == 1 => std::slice::from_ref(name),
            _ => &node.names[..],
        };
        for name in names {
            all.push(Instance {
                namespace: Some(launched.namespace.clone()),
                remaps: launched.remaps.clone(),
                launched: Some((path.to_owned(), launched.line)),
                is_test: is_test(path) || is_test(&node.program.0),
                ..as_written(node, name)
            });
        }
    }
    all
}

/// Whether a file belongs to tests.
fn is_test(path: &str) -> bool {
    let (folders, name) = path.rsplit_once('/').unwrap_or(("", path));
    let stem = name.split('.').next().unwrap_or_default();
    folders
        .split('/')
        .any(|f| ["test", "tests"].contains(&f) || f.starts_with("integration_test"))
        || stem.starts_with("test_")
        || stem.ends_with("_test")
        || name.split('.').next_back() == Some("test")
}

// Packages of a workspace and their programs: the files or the class of each executable.

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
fn package_of(all: &[Package], path: &str) -> Option<usize> {
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
    let paths = paths.iter();
    let matching = paths.filter(|path| path.starts_with(&start) && path.ends_with(end));
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
    let words = done.split(';').filter(|word| !word.is_empty());
    words.map(str::to_owned).collect()
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
