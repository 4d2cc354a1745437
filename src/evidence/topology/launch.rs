//! Launch files of ROS 1 and ROS 2: which nodes they would start, in which namespace, with which topics remapped.
//!
//! Arguments, namespaces, conditions and includes are followed as far as that needs no execution: files of other
//! packages are looked for beside the file. See <http://wiki.ros.org/roslaunch/XML> and the design article on static
//! launch files of ROS 2.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::tree::{self, Tree};
use super::{Element, Entry, Topology, place, resolved, unused};
use crate::base::error::Result;

/// Files that include each other deeper than this go in circles.
const DEEPEST: usize = 16;

/// What holds at a place in a file.
#[derive(Clone, Debug, Default)]
struct Scope {
    namespace: String,
    arguments: BTreeMap<String, String>,
    remaps: Vec<(String, String)>,
}

/// Reads a launch file with all that it includes.
pub(super) fn read(path: &Path, tree: &Tree) -> Result<Topology> {
    let mut reader = Launch::default();
    reader.inside(path, tree, &mut Scope::default(), 0)?;
    Ok(reader.topology)
}

#[derive(Default)]
struct Launch {
    topology: Topology,
}

impl Launch {
    /// The elements inside one, in order; what they change holds for those after them.
    fn inside(&mut self, path: &Path, tree: &Tree, scope: &mut Scope, depth: usize) -> Result<()> {
        for child in &tree.children {
            let value = |name: &str| child.get(name).map(|text| substitute(text, path, scope));
            let truth = |name| {
                value(name).map(|text| ["true", "1", "yes"].contains(&&*text.to_lowercase()))
            };
            if truth("if") == Some(false) || truth("unless") == Some(true) {
                continue;
            }
            match child.tag.as_str() {
                "arg" | "let" => {
                    let name = value("name").unwrap_or_default();
                    if let Some(fixed) = value("value") {
                        scope.arguments.insert(name, fixed);
                    } else if let Some(default) = value("default") {
                        scope.arguments.entry(name).or_insert(default);
                    }
                }
                "remap" => {
                    let (from, to) = (
                        value("from").unwrap_or_default(),
                        value("to").unwrap_or_default(),
                    );
                    scope.remaps.push((from, to));
                }
                "push_ros_namespace" | "push-ros-namespace" => {
                    let space = value("namespace").or(value("value")).unwrap_or_default();
                    scope.namespace = join(&scope.namespace, &space);
                }
                "group" => {
                    let space = value("ns").unwrap_or_default();
                    let mut inner = scope.clone();
                    inner.namespace = join(&scope.namespace, &space);
                    self.inside(path, child, &mut inner, depth)?;
                }
                "include" => {
                    let space = value("ns").unwrap_or_default();
                    let file = value("file").unwrap_or_default();
                    self.include(path, child, &file, &space, scope, depth)?;
                }
                "node" | "composable_node" => self.node(path, child, scope),
                "node_container" => {
                    self.node(path, child, scope);
                    self.inside(path, child, &mut scope.clone(), depth)?;
                }
                "load_composable_node" => self.inside(path, child, &mut scope.clone(), depth)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn node(&mut self, path: &Path, tree: &Tree, scope: &Scope) {
        let value = |name: &str| tree.get(name).map(|text| substitute(text, path, scope));
        let Some(name) = value("name").filter(|name| !name.is_empty()) else {
            let what = "a node without a name is left out, for only its program knows the name";
            self.topology.notices.push(unused(path, tree.line, what));
            return;
        };
        let space = value("ns").or(value("namespace")).unwrap_or_default();
        let space = join(&scope.namespace, &space);
        self.add(path, tree, Element::Node(join(&space, &name)));
        let own = tree.children.iter().filter(|child| child.tag == "remap");
        let own = own
            .filter_map(|child| Some((child.get("from")?.to_owned(), child.get("to")?.to_owned())));
        for (_, to) in scope.remaps.iter().cloned().chain(own) {
            let to = substitute(&to, path, scope);
            // `~x` lies below the node, a plain name in its namespace.
            let topic = match to.strip_prefix('~') {
                Some(private) => join(&join(&space, &name), private.trim_start_matches('/')),
                None => join(&space, &to),
            };
            self.add(path, tree, Element::Topic(topic));
        }
    }

    fn add(&mut self, path: &Path, tree: &Tree, element: Element) {
        self.topology.entries.push(Entry {
            element,
            from_ns: None,
            to_ns: None,
            declared: true,
            place: place(path, tree.line),
        });
    }

    fn include(
        &mut self,
        path: &Path,
        tree: &Tree,
        file: &str,
        space: &str,
        scope: &Scope,
        depth: usize,
    ) -> Result<()> {
        let found = located(path, file).filter(|_| depth < DEEPEST);
        let Some(found) = found else {
            let what = format!("the included file `{file}` was not found");
            self.topology.notices.push(unused(path, tree.line, &what));
            return Ok(());
        };
        let mut inner = Scope {
            namespace: join(&scope.namespace, space),
            arguments: BTreeMap::new(),
            remaps: scope.remaps.clone(),
        };
        if tree.get("pass_all_args").is_some_and(|all| all == "true") {
            inner.arguments.clone_from(&scope.arguments);
        }
        for argument in tree
            .children
            .iter()
            .filter(|c| ["arg", "let"].contains(&c.tag.as_str()))
        {
            if let (Some(name), Some(value)) = (argument.get("name"), argument.get("value")) {
                inner
                    .arguments
                    .insert(name.to_owned(), substitute(value, path, scope));
            }
        }
        let text = super::text(&found)?;
        let included = match found
            .extension()
            .map(|e| e.to_string_lossy().to_lowercase())
            .as_deref()
        {
            Some("py") => {
                let what = format!("the included file `{file}` is a program and was not run");
                self.topology.notices.push(unused(path, tree.line, &what));
                return Ok(());
            }
            Some("yaml" | "yml") => tree::of_yaml(&found, &text)?.unwrap_or_default(),
            _ => tree::of_xml(&found, &text)?,
        };
        self.inside(&found, &included, &mut inner, depth + 1)
    }
}

/// The file that an include means: as it stands, or beside the including file.
fn located(path: &Path, file: &str) -> Option<PathBuf> {
    let file = Path::new(file);
    let folder = path.parent().unwrap_or(Path::new("."));
    let found = folder.join(file);
    (!file.as_os_str().is_empty() && found.is_file()).then_some(found)
}

/// A name in a namespace; a name that begins with a slash stands for itself.
fn join(space: &str, name: &str) -> String {
    match name.strip_prefix('/') {
        Some(_) => resolved(name.trim_end_matches('/')),
        None if name.is_empty() => space.to_owned(),
        None => format!("{space}/{}", name.trim_matches('/')),
    }
}

/// A text with its substitutions `$(…)` put in; one that would need execution, or is not known, is left out.
fn substitute(text: &str, path: &Path, scope: &Scope) -> String {
    let mut done = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("$(") {
        done.push_str(before);
        let Some((inside, next)) = after.split_once(')') else {
            break;
        };
        let (verb, words) = inside.trim().split_once(' ').unwrap_or((inside.trim(), ""));
        let words = words.trim().trim_matches(['\'', '"']);
        match verb {
            "arg" | "var" => done.push_str(scope.arguments.get(words).map_or("", String::as_str)),
            "anon" => done.push_str(words),
            "optenv" | "env" => {
                done.push_str(words.split_once(' ').map_or("", |(_, default)| default));
            }
            "dirname" => done.push('.'),
            "find" | "find-pkg-share" | "find-pkg-prefix" => done.push_str(&package(path, words)),
            _ => {}
        }
        rest = next;
    }
    done + rest
}

/// The folder of a package, looked for among the folders above the file and beside those; its name if not found.
fn package(path: &Path, name: &str) -> String {
    let above = path.ancestors().skip(1);
    let found = above
        .into_iter()
        .find_map(|folder| match folder.file_name() {
            Some(own) if own == name => Some(folder.to_owned()),
            _ => Some(folder.join(name)).filter(|beside| !name.is_empty() && beside.is_dir()),
        });
    let absolute = found.and_then(|folder| folder.canonicalize().ok());
    absolute.map_or_else(
        || name.to_owned(),
        |folder| folder.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(text: &str) -> Vec<Element> {
        let path = Path::new("robot.launch");
        let tree = if text.starts_with('<') {
            tree::of_xml(path, text).unwrap()
        } else {
            tree::of_yaml(path, text).unwrap().unwrap()
        };
        let entries = read(path, &tree).unwrap().entries;
        entries.into_iter().map(|e| e.element).collect()
    }

    #[test]
    fn ros1_has_groups_arguments_conditions_and_remaps() {
        let text = r#"<launch>
            <arg name="robot" default="r1"/><arg name="sim" value="false"/>
            <group ns="$(arg robot)">
              <node pkg="a" type="b" name="lidar"><remap from="scan" to="front/scan"/></node>
              <node pkg="a" type="b" name="cam" if="$(arg sim)"/>
            </group>
            <node pkg="a" type="b" name="map" ns="/maps"/></launch>"#;
        assert_eq!(
            elements(text),
            [
                Element::Node("/r1/lidar".into()),
                Element::Topic("/r1/front/scan".into()),
                Element::Node("/maps/map".into()),
            ]
        );
    }

    #[test]
    fn ros2_is_the_same_in_xml_and_yaml() {
        let xml = r#"<launch><let name="ns" value="r2"/><group><push_ros_namespace namespace="$(var ns)"/>
            <node pkg="a" exec="b" name="nav"><remap from="plan" to="/plan"/></node></group>
            <node pkg="a" exec="b" name="top"/></launch>"#;
        let yaml = "launch:\n- let: {name: ns, value: r2}\n- group:\n  - push_ros_namespace: {namespace: $(var ns)}\n  \
                    - node: {pkg: a, exec: b, name: nav, remap: [{from: plan, to: /plan}]}\n- node: {pkg: a, exec: b, name: top}\n";
        let expected = [
            Element::Node("/r2/nav".into()),
            Element::Topic("/plan".into()),
            Element::Node("/top".into()),
        ];
        assert_eq!(elements(xml), expected);
        assert_eq!(elements(yaml), expected);
    }

    #[test]
    fn includes_are_followed_with_their_arguments() {
        let folder = tempfile::tempdir().unwrap();
        let launch = folder.path().join("robot/launch");
        std::fs::create_dir_all(&launch).unwrap();
        let inner = r#"<launch><arg name="n" default="x"/><node pkg="a" type="b" name="$(arg n)"/></launch>"#;
        std::fs::write(launch.join("inner.launch"), inner).unwrap();
        let outer = r#"<launch><include ns="r1" file="$(find robot)/launch/inner.launch"><arg name="n" value="y"/></include>
            <include file="$(find elsewhere)/x.launch"/></launch>"#;
        let path = launch.join("outer.launch");
        std::fs::write(&path, outer).unwrap();
        let topology = crate::evidence::topology::read(&path).unwrap();
        assert_eq!(topology.entries[0].element, Element::Node("/r1/y".into()));
        assert_eq!(topology.notices.len(), 1);
    }

    #[test]
    fn a_bad_line_is_named() {
        let error = tree::of_xml(Path::new("x.launch"), "<launch>\n<node>\n</launch>").unwrap_err();
        assert!(error.to_string().contains("line 3"), "{error}");
    }
}
