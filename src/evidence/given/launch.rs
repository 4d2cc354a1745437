//! Launch files of ROS 1 and ROS 2: the nodes they would start, with their namespaces and remapped topics.
//!
//! Arguments, namespaces, conditions, includes and substitutions are resolved as far as possible without execution: files of other
//! packages are searched for beside the file. See <http://wiki.ros.org/roslaunch/XML> and the design article on static
//! launch files of ROS 2. Arguments of well-known programs name topics: relays of `topic_tools`, `republish` of
//! `image_transport`, and the program that a nodelet loads.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::base::budget::LaunchWork;
use crate::base::error::Result;
use crate::evidence::given::tree::{self, LONGEST, Tree};
use crate::evidence::given::{
    NamedElement, Topology, TopologyEntry, place, python, resolved, unused,
};

/// The deepest nesting of includes; deeper ones are cyclic, by way of links or arguments: those in use nest five deep.
const DEEPEST: usize = 16;

/// The cost of opening a file, in bytes of work: about the time in which so much text is read.
const FILE: usize = 8 << 10;

/// The assumed length of a launch file of a workspace, in bytes: it bounds the work that each may cause, of which there may be
/// thousands. Nine of ten are shorter.
const OWN_TEXT: usize = 10_000;

/// The deepest nesting of groups and files that is followed, which the stack must hold: above the depth of one tree, so that
/// includes inside groups are followed too.
const NESTED: usize = 200;

/// The cost of keeping one entry of a file, in bytes of work: about its memory.
const ENTRY: usize = 150;

/// A node that a launch file starts.
pub(crate) struct LaunchedNode {
    /// The package of the program.
    pub(crate) package: String,
    /// The program: an executable, or the class of a component or nodelet.
    pub(crate) program: String,
    /// The name without namespace; `None` if only the program knows the name.
    pub(crate) name: Option<String>,
    /// The namespace without a slash at the end; empty at the root.
    pub(crate) namespace: String,
    /// Topics and their new names, as written.
    pub(crate) remaps: Vec<(String, String)>,
    /// The line that starts it, ≥ 1; 0 where not known.
    pub(crate) line: usize,
}

impl LaunchedNode {
    /// The full name of a topic: `~x` is below the node, a plain name in its namespace.
    fn full(&self, node: &str, topic: &str) -> String {
        match topic.strip_prefix('~') {
            Some(private) => join(node, private.trim_start_matches('/')),
            None => join(&self.namespace, topic),
        }
    }

    /// The full name of a topic of its program after its remaps; for `in/compressed`, `in` may be remapped.
    fn resolved(&self, node: &str, topic: &str) -> String {
        let remapped = self.remaps.iter().rev().find_map(|(from, to)| {
            let rest = topic.strip_prefix(from.as_str())?;
            (rest.is_empty() || rest.starts_with('/')).then(|| format!("{to}{rest}"))
        });
        self.full(node, remapped.as_deref().unwrap_or(topic))
    }
}

/// The most topics that the arguments of a node name; more are hostile.
const MOST_TOPICS: usize = 1000;

/// The treatment of conditions that cannot be decided statically.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Undecided {
    /// The elements under it are left out with a notice.
    LeftOut,
    /// All conditions count as met, to find every node that the file may start.
    Taken,
}

/// The settings in effect at a point in a file.
#[derive(Clone, Default)]
struct Scope {
    namespace: String,
    arguments: Rc<BTreeMap<String, String>>,
    remaps: Rc<Vec<(String, String)>>,
}

/// Reads a launch file with all its includes.
pub(super) fn read(path: &Path, tree: &Tree) -> Result<Topology> {
    let mut reader = Launch::new(Undecided::LeftOut);
    reader.stack.extend(path.canonicalize().ok());
    reader.inside(path, tree, &mut Scope::default())?;
    if reader.budget.is_spent {
        let what = "it repeats or includes itself too often; the excess is left out";
        reader.topology.notices.push(unused(path, 0, what));
    }
    Ok(reader.topology)
}

/// Every node that a launch file may start by itself, without its includes and regardless of conditions.
pub(crate) fn nodes(path: &Path, tree: &Tree) -> Vec<LaunchedNode> {
    let mut reader = Launch::new(Undecided::Taken);
    // Only includes can fail, and they are not followed.
    let _ = reader.inside(path, tree, &mut Scope::default());
    reader.nodes
}

struct Launch {
    undecided: Undecided,
    budget: LaunchWork,
    /// The files that are being read, each included by the previous one.
    stack: Vec<PathBuf>,
    nested: usize,
    topology: Topology,
    nodes: Vec<LaunchedNode>,
}

impl Launch {
    fn new(undecided: Undecided) -> Self {
        // Files given by the user may include others; those of a workspace are read individually, and are many.
        let budget = match undecided {
            Undecided::LeftOut => LaunchWork::all(),
            Undecided::Taken => LaunchWork::of_text(OWN_TEXT),
        };
        Self {
            undecided,
            budget,
            stack: Vec::new(),
            nested: 0,
            topology: Topology::default(),
            nodes: Vec::new(),
        }
    }

    /// Reads the children of an element in order; their changes apply to those after them.
    fn inside(&mut self, path: &Path, tree: &Tree, scope: &mut Scope) -> Result<()> {
        if self.nested > NESTED {
            self.left_out(path, tree, "it is nested too deeply");
            return Ok(());
        }
        self.nested += 1;
        for child in &tree.children {
            if self.is_met(path, child, scope) {
                self.element(path, child, scope)?;
            }
        }
        self.nested -= 1;
        Ok(())
    }

    fn element(&mut self, path: &Path, child: &Tree, scope: &mut Scope) -> Result<()> {
        let mut value = |name: &str| self.value(path, child, scope, name);
        match child.tag.as_str() {
            "arg" | "let" => {
                let (name, fixed, default) = (value("name"), value("value"), value("default"));
                let name = name.unwrap_or_default();
                self.copied(scope.arguments.len());
                let arguments = Rc::make_mut(&mut scope.arguments);
                // One without a known value stays unset.
                if let Some(fixed) = fixed {
                    arguments.insert(name, fixed);
                } else if let Some(default) = default {
                    arguments.entry(name).or_insert(default);
                }
            }
            "remap" => {
                if let (Some(from), Some(to)) = (value("from"), value("to")) {
                    self.copied(scope.remaps.len());
                    Rc::make_mut(&mut scope.remaps).push((from, to));
                }
            }
            "push_ros_namespace" | "push-ros-namespace" => {
                let space = value("namespace").or(value("value")).unwrap_or_default();
                scope.namespace = join(&scope.namespace, &space);
            }
            "group" if child.get("scoped").is_some_and(|scoped| !is_true(scoped)) => {
                self.inside(path, child, scope)?;
            }
            "group" => {
                let space = value("ns").unwrap_or_default();
                let mut inner = scope.clone();
                inner.namespace = join(&scope.namespace, &space);
                self.inside(path, child, &mut inner)?;
            }
            "include" => self.include(path, child, scope)?,
            "node" | "composable_node" => self.node(path, child, scope),
            "node_container" => {
                self.node(path, child, scope);
                self.inside(path, child, &mut scope.clone())?;
            }
            "load_composable_node" => self.inside(path, child, &mut scope.clone())?,
            python::UNREAD => {
                self.left_out(path, child, "this is only known at run time");
            }
            _ => {}
        }
        Ok(())
    }

    /// An attribute with its substitutions replaced; `None` if it is missing or only known at run time.
    fn value(&mut self, path: &Path, tree: &Tree, scope: &Scope, name: &str) -> Option<String> {
        let arguments = &scope.arguments;
        SubstitutionContext { path, arguments }.substitute(tree.get(name)?, &mut self.budget, 0)
    }

    /// Whether the conditions on an element are met.
    fn is_met(&mut self, path: &Path, tree: &Tree, scope: &Scope) -> bool {
        if self.undecided == Undecided::Taken {
            return true;
        }
        for (name, wanted) in [("if", true), ("unless", false)] {
            if tree.get(name).is_none() {
                continue;
            }
            match self.value(path, tree, scope, name) {
                Some(text) if is_true(&text) == wanted => {}
                Some(_) => return false,
                None => {
                    self.left_out(path, tree, "its condition is only known at run time");
                    return false;
                }
            }
        }
        true
    }

    /// Charges for the copy of a scope that is about to change.
    fn copied(&mut self, entries: usize) {
        // An exceeded budget is reported where texts are created.
        let _ = self.budget.spend(entries);
    }

    fn left_out(&mut self, path: &Path, tree: &Tree, why: &str) {
        if self.budget.spend(ENTRY).is_some() {
            let what = format!("{why}, and it is left out");
            self.topology.notices.push(unused(path, tree.line, &what));
        }
    }

    fn node(&mut self, path: &Path, tree: &Tree, scope: &Scope) {
        let mut value = |name: &str| self.value(path, tree, scope, name);
        let own_space = value("ns").or_else(|| value("namespace"));
        let given = value("args").unwrap_or_default();
        let given = ProgramArguments::new(&given);
        let mut node = LaunchedNode {
            package: value("pkg").unwrap_or_default(),
            program: ["type", "exec", "plugin"]
                .into_iter()
                .find_map(&mut value)
                .unwrap_or_default(),
            name: value("name").filter(|name| !name.is_empty()),
            namespace: join(&scope.namespace, &own_space.unwrap_or_default()),
            remaps: self.remaps(path, tree, scope),
            line: tree.line,
        };
        node.remaps.extend(given.remaps.iter().cloned());
        if let Some((package, class)) = given.nodelet().filter(|_| node.package == "nodelet") {
            (node.package, node.program) = (package, class);
        }
        let cost = ENTRY + node.remaps.len() * ENTRY;
        if self.budget.spend(cost).is_none() {
            return;
        }
        if self.undecided == Undecided::Taken {
            node.name = node.name.map(|name| name.replace(ANONYMOUS, ""));
            self.nodes.push(node);
            return;
        }
        let Some(name) = &node.name else {
            self.left_out(path, tree, "the node's name is only known to its program");
            return;
        };
        let full = join(&node.namespace, name);
        self.add(path, tree, NamedElement::Node(full.clone()));
        let topics = given.topics(&node.package, &node.program);
        for (publishes, topic) in topics.into_iter().take(MOST_TOPICS) {
            let topic = node.resolved(&full, &topic);
            let edge = NamedElement::edge(publishes, full.clone(), topic);
            self.add(path, tree, edge);
        }
        for (_, to) in &node.remaps {
            self.add(path, tree, NamedElement::Topic(node.full(&full, to)));
        }
    }

    /// The remaps that apply to a node: the enclosing ones, then its own.
    fn remaps(&mut self, path: &Path, tree: &Tree, scope: &Scope) -> Vec<(String, String)> {
        if self.budget.spend(scope.remaps.len() * ENTRY).is_none() {
            return Vec::new();
        }
        let mut all = scope.remaps.to_vec();
        for child in tree.children.iter().filter(|child| child.tag == "remap") {
            let mut value = |name: &str| self.value(path, child, scope, name);
            if let (Some(from), Some(to)) = (value("from"), value("to")) {
                all.push((from, to));
            }
        }
        all
    }

    fn add(&mut self, path: &Path, tree: &Tree, element: NamedElement) {
        self.topology.entries.push(TopologyEntry {
            declared: true,
            ..TopologyEntry::new(element, place(path, tree.line))
        });
    }

    fn include(&mut self, path: &Path, tree: &Tree, scope: &Scope) -> Result<()> {
        if self.undecided == Undecided::Taken {
            return Ok(());
        }
        let space = self.value(path, tree, scope, "ns").unwrap_or_default();
        let Some(file) = self.value(path, tree, scope, "file") else {
            self.left_out(path, tree, "the included file is only known at run time");
            return Ok(());
        };
        let Some(found) = located(path, &file) else {
            let why = format!("the included file `{file}` was not found");
            self.left_out(path, tree, &why);
            return Ok(());
        };
        if self.stack.contains(&found) || self.stack.len() > DEEPEST {
            let why = format!("the included file `{file}` includes itself");
            self.left_out(path, tree, &why);
            return Ok(());
        }
        let text = super::text(&found)?;
        if self.budget.spend(FILE + text.len()).is_none() {
            return Ok(());
        }
        let mut inner = Scope {
            namespace: join(&scope.namespace, &space),
            arguments: self.passed(path, tree, scope),
            remaps: Rc::clone(&scope.remaps),
        };
        self.topology.files.push(found.clone());
        let included = tree_of(&found, &text)?.unwrap_or_default();
        self.stack.push(found.clone());
        let done = self.inside(&found, &included, &mut inner);
        self.stack.pop();
        done
    }

    /// The arguments that an include passes on.
    fn passed(&mut self, path: &Path, tree: &Tree, scope: &Scope) -> Rc<BTreeMap<String, String>> {
        let mut passed = match tree.get("pass_all_args") {
            Some(all) if is_true(all) => Rc::clone(&scope.arguments),
            _ => Rc::default(),
        };
        let own = |child: &&Tree| ["arg", "let"].contains(&child.tag.as_str());
        for argument in tree.children.iter().filter(own) {
            let name = argument.get("name").map(str::to_owned);
            if let (Some(name), Some(value)) = (name, self.value(path, argument, scope, "value")) {
                self.copied(passed.len());
                Rc::make_mut(&mut passed).insert(name, value);
            }
        }
        passed
    }
}

/// The tree of a launch file of any form; `None` for YAML that is not a launch file.
pub(crate) fn tree_of(path: &Path, text: &str) -> Result<Option<Tree>> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("py") => python::of_python(path, text).map(Some),
        Some("yaml" | "yml") => tree::of_yaml(path, text),
        _ => tree::of_xml(path, text).map(Some),
    }
}

/// The file that an include refers to: as written, or beside the including file.
fn located(path: &Path, file: &str) -> Option<PathBuf> {
    let file = Path::new(file);
    let folder = path.parent().unwrap_or(Path::new("."));
    let found = folder.join(file);
    (!file.as_os_str().is_empty() && found.is_file())
        .then(|| found.canonicalize().ok())
        .flatten()
}

/// A name in a namespace; a name that begins with a slash is unchanged.
pub(crate) fn join(space: &str, name: &str) -> String {
    match name.strip_prefix('/') {
        Some(_) if name.trim_matches('/').is_empty() => String::new(),
        Some(_) => resolved(name.trim_end_matches('/')),
        None if name.is_empty() => space.to_owned(),
        None => format!("{space}/{}", name.trim_matches('/')),
    }
}

/// The arguments of a node, as written.
struct ProgramArguments<'a> {
    /// Remaps among the arguments: names and their new names.
    remaps: Vec<(String, String)>,
    rest: Vec<&'a str>,
}

impl<'a> ProgramArguments<'a> {
    fn new(text: &'a str) -> Self {
        let (remaps, rest): (Vec<&str>, Vec<&str>) = text
            .split_whitespace()
            .partition(|word| word.contains(":="));
        let remaps = remaps.into_iter().filter_map(|word| word.split_once(":="));
        let is_name = |(from, _): &(&str, &str)| !from.starts_with('_');
        let remaps = remaps.filter(is_name);
        Self {
            remaps: remaps.map(|(a, b)| (a.to_owned(), b.to_owned())).collect(),
            rest,
        }
    }

    /// The package and the class that a nodelet loads: `load image_proc/rectify manager`.
    fn nodelet(&self) -> Option<(String, String)> {
        let ["load" | "standalone", class, ..] = self.rest[..] else {
            return None;
        };
        let (package, _) = class.split_once('/')?;
        Some((package.to_owned(), class.to_owned()))
    }

    /// The topics of a program, and whether it publishes them.
    fn topics(&self, package: &str, program: &str) -> Vec<(bool, String)> {
        let passed = |input: &str, output: Option<&&str>, ending: &str| {
            let output =
                output.map_or_else(|| format!("{input}{ending}"), |topic| (*topic).to_owned());
            vec![(false, input.to_owned()), (true, output)]
        };
        let many = |is_output: bool, one: &str, others: &[&str]| {
            let others = others.iter().map(|topic| (!is_output, (*topic).to_owned()));
            others.chain([(is_output, one.to_owned())]).collect()
        };
        let rest = &self.rest[..];
        match (package, program, rest) {
            ("topic_tools", "relay", [input, ..]) => passed(input, rest.get(1), "_relay"),
            ("topic_tools", "drop", [input, _, _, ..]) => passed(input, rest.get(3), "_drop"),
            ("topic_tools", "throttle", ["messages", input, _, ..]) => {
                passed(input, rest.get(3), "_throttle")
            }
            ("topic_tools", "throttle", ["bytes", input, _, _, ..]) => {
                passed(input, rest.get(4), "_throttle")
            }
            ("topic_tools", "mux", [output, inputs @ ..]) => many(true, output, inputs),
            ("topic_tools", "demux", [input, outputs @ ..]) => many(false, input, outputs),
            ("image_transport", "republish", [from, ..]) => {
                let of = |name: &str, transport: &str| match transport {
                    "raw" => name.to_owned(),
                    _ => format!("{name}/{transport}"),
                };
                let to = rest.get(1).copied().unwrap_or("raw");
                vec![(false, of("in", from)), (true, of("out", to))]
            }
            _ => Vec::new(),
        }
    }
}

// Replaces substitutions `$(…)` in launch files, as far as possible without execution.

/// Replaces the part of an anonymous name that differs from run to run; it occurs in no name.
pub(crate) const ANONYMOUS: char = '*';

/// The deepest nesting of substitutions; deeper ones are hostile: those in use nest three deep.
const DEEPEST_SUBSTITUTION: usize = 16;

/// The context of a text: the values that its substitutions may refer to.
struct SubstitutionContext<'a> {
    path: &'a Path,
    arguments: &'a BTreeMap<String, String>,
}

impl SubstitutionContext<'_> {
    /// The text after substitution; `None` if a part of it is only known at run time, or it becomes too long.
    fn substitute(&self, text: &str, budget: &mut LaunchWork, depth: usize) -> Option<String> {
        budget.spend(text.len())?;
        let mut done = String::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once("$(") {
            done.push_str(before);
            let end = closing(after)?;
            if depth >= DEEPEST_SUBSTITUTION {
                return None;
            }
            let inside = self.substitute(&after[..end], budget, depth + 1)?;
            let value = self.value(inside.trim())?;
            budget.spend(value.len())?;
            done.push_str(&value);
            if done.len() > LONGEST {
                return None;
            }
            rest = &after[end + 1..];
        }
        done.push_str(rest);
        Some(done)
    }

    /// The value of one substitution, with the inner ones replaced already.
    fn value(&self, inside: &str) -> Option<String> {
        let split = inside.split_once(char::is_whitespace);
        let (verb, words) = split.unwrap_or((inside, ""));
        let words = unquoted(words);
        let parts: Vec<&str> = words.split_whitespace().map(unquoted).collect();
        let argument = |name: &str| self.arguments.get(name).cloned();
        let default = words.split_once(' ');
        let default = default.map(|(_, text)| unquoted(text).to_owned());
        let both = |f: fn(&str, &str) -> bool| match parts[..] {
            [a, b] => Some(f(a, b).to_string()),
            _ => None,
        };
        match verb {
            // In ROS 2 a default follows the name.
            "arg" | "var" => argument(words.split(' ').next()?).or(default),
            "anon" => Some(format!("{words}{ANONYMOUS}")),
            "optenv" => default.or(Some(String::new())),
            "env" => default,
            "dirname" => Some(".".to_owned()),
            "find" | "find-pkg-share" | "find-pkg-prefix" => Some(package(self.path, words)),
            "eval" => python::evaluate(inside.strip_prefix(verb)?.trim(), self.arguments),
            "equals" => both(|a, b| a == b),
            "not-equals" => both(|a, b| a != b),
            "and" => both(|a, b| is_true(a) && is_true(b)),
            "or" => both(|a, b| is_true(a) || is_true(b)),
            "not" => Some((!is_true(words)).to_string()),
            _ => None,
        }
    }
}

/// Whether the text of a condition is true, as in ROS 1 and ROS 2.
pub(super) fn is_true(text: &str) -> bool {
    ["true", "1", "yes", "on"].contains(&&*text.trim().to_lowercase())
}

/// A text without the quotes around it.
fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let quoted = |quote: char| text.strip_prefix(quote).and_then(|t| t.strip_suffix(quote));
    // With quotes inside, the outer ones belong to two texts: `'a' == 'b'`.
    let inside = |quote: char| quoted(quote).filter(|t| !t.contains(quote));
    inside('"').or(inside('\'')).unwrap_or(text)
}

/// The position of the parenthesis that closes the one at the start.
pub(crate) fn closing(text: &str) -> Option<usize> {
    let mut open = 1_usize;
    text.char_indices().find_map(|(at, c)| {
        match c {
            '(' => open += 1,
            ')' => open -= 1,
            _ => {}
        }
        (open == 0).then_some(at)
    })
}

/// The folder of a package, searched for above the file and beside those folders; its name if not found.
fn package(path: &Path, name: &str) -> String {
    let found = path.ancestors().skip(1).find_map(|folder| {
        let is_own = folder.file_name().is_some_and(|own| own == name);
        let beside = || Some(folder.join(name)).filter(|at| !name.is_empty() && at.is_dir());
        is_own.then(|| folder.to_owned()).or_else(beside)
    });
    let absolute = found.and_then(|folder| folder.canonicalize().ok());
    absolute.map_or_else(
        || name.to_owned(),
        |folder| folder.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests;
