//! Calls in a launch file: functions of the file, paths and texts, lists that grow, and the launch system's
//! substitutions.

use super::evaluator::Evaluator;
use super::value::PythonValue;
use crate::evidence::syntax::{Node, children, line};

/// The arguments of a call, in order and by name.
#[derive(Debug, Default)]
pub(super) struct Arguments {
    pub(super) positional: Vec<PythonValue>,
    pub(super) named: Vec<(String, PythonValue)>,
    pub(super) line: usize,
}

impl Arguments {
    /// The argument of this name, or the one at position `place`.
    pub(super) fn get(&self, place: usize, name: &str) -> Option<&PythonValue> {
        self.named(name).or(self.positional.get(place))
    }

    /// The argument of this name.
    pub(super) fn named(&self, name: &str) -> Option<&PythonValue> {
        self.named
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, value)| value)
    }

    /// An argument as a text of launch files.
    pub(super) fn text(&self, place: usize, name: &str) -> Option<String> {
        self.get(place, name)
            .filter(|v| **v != PythonValue::None)
            .map(PythonValue::launch_text)
    }
}

impl<'a> Evaluator<'a> {
    pub(super) fn call_expression(&mut self, node: Node<'a>) -> PythonValue {
        let Some(function) = node.child_by_field_name("function") else {
            return PythonValue::Unknown(line(node));
        };
        let arguments = self.arguments(node);
        if function.kind() == "attribute"
            && let (Some(object), Some(name)) = (
                function.child_by_field_name("object"),
                function.child_by_field_name("attribute"),
            )
        {
            let name = self.text(name);
            if let Some(value) = self.method(object, name, &arguments) {
                return self.kept(value, node);
            }
        }
        let full = self.text(function);
        let name = full.rsplit('.').next().unwrap_or(full);
        if let ("arg", Some(PythonValue::Text(argument))) = (full, arguments.positional.first()) {
            return self.lookup(argument, node);
        }
        if let Some(own) = self.function(name) {
            return self.call(own, &arguments.positional, &arguments.named);
        }
        let value = self
            .action(name, &arguments)
            .or_else(|| substitution(name, &arguments))
            .or_else(|| plain(full, &arguments))
            .unwrap_or(PythonValue::Unknown(line(node)));
        self.kept(value, node)
    }

    fn arguments(&mut self, call: Node<'a>) -> Arguments {
        let mut arguments = Arguments {
            line: line(call),
            ..Arguments::default()
        };
        let Some(list) = call.child_by_field_name("arguments") else {
            return arguments;
        };
        if list.kind() == "generator_expression" {
            arguments.positional.push(self.value(list));
            return arguments;
        }
        for argument in children(list) {
            let part = |name| argument.child_by_field_name(name);
            match (argument.kind(), part("name"), part("value")) {
                ("keyword_argument", Some(name), Some(value)) => {
                    let value = self.value(value);
                    arguments.named.push((self.text(name).to_owned(), value));
                }
                ("dictionary_splat", ..) => {
                    if let Some(PythonValue::Dict(map)) =
                        argument.named_child(0).map(|n| self.value(n))
                    {
                        arguments.named.extend(map);
                    }
                }
                ("list_splat", ..) => {
                    let items = argument.named_child(0).map(|n| self.items(n));
                    arguments.positional.extend(items.unwrap_or_default());
                }
                _ => {
                    let value = self.value(argument);
                    arguments.positional.push(value);
                }
            }
        }
        arguments
    }

    /// A method of a known value: appends to lists, formats texts.
    fn method(
        &mut self,
        object: Node<'a>,
        name: &str,
        arguments: &Arguments,
    ) -> Option<PythonValue> {
        let first = || arguments.positional.first().cloned();
        match name {
            "append" | "add_action" | "add_entity" => self.grow(object, vec![first()?]),
            "insert" => self.grow(object, vec![arguments.positional.get(1)?.clone()]),
            "extend" => match first()? {
                PythonValue::List(list) => self.grow(object, list),
                other => self.grow(object, vec![other]),
            },
            "items" => match self.value(object) {
                PythonValue::Dict(map) => {
                    let pair =
                        |(key, value)| PythonValue::List(vec![PythonValue::Text(key), value]);
                    Some(PythonValue::List(map.into_iter().map(pair).collect()))
                }
                _ => None,
            },
            // `LaunchConfiguration('x').perform(context)` is equivalent to `$(var x)`.
            "perform" => Some(self.value(object)).filter(|value| value.text().is_some()),
            "find" => {
                let share = self.value(object).text()?;
                share
                    .starts_with("$(find-pkg-share")
                    .then_some(PythonValue::Text(share))
            }
            "format" => {
                let text = self.value(object).text()?;
                formatted(&text, arguments).map(PythonValue::Text)
            }
            "lower" => self
                .value(object)
                .text()
                .filter(|t| !t.contains("$("))
                .map(|t| PythonValue::Text(t.to_lowercase())),
            "get" => {
                if self.text(object) == "os.environ" {
                    return plain("os.getenv", arguments);
                }
                match self.value(object) {
                    PythonValue::Dict(map) => {
                        let key = first()?.launch_text();
                        let found = map
                            .into_iter()
                            .find(|(k, _)| *k == key)
                            .map(|(_, value)| value);
                        Some(
                            found.unwrap_or(
                                arguments
                                    .positional
                                    .get(1)
                                    .cloned()
                                    .unwrap_or(PythonValue::None),
                            ),
                        )
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// Adds to the list in a variable.
    fn grow(&mut self, object: Node<'a>, more: Vec<PythonValue>) -> Option<PythonValue> {
        let more = self.kept(PythonValue::List(more), object);
        if let (PythonValue::List(list), PythonValue::List(more)) = (self.variable(object)?, more) {
            list.extend(more);
        }
        Some(PythonValue::None)
    }

    /// The value of an attribute, such as `Path(…).parent`.
    pub(super) fn attribute(&mut self, node: Node<'a>) -> PythonValue {
        let unknown = PythonValue::Unknown(line(node));
        let Some(object) = node.child_by_field_name("object") else {
            return unknown;
        };
        let name = node
            .child_by_field_name("attribute")
            .map_or("", |n| self.text(n));
        match (name, self.value(object)) {
            ("parent", PythonValue::Text(path)) => PythonValue::Text(parent(&path).to_owned()),
            _ => unknown,
        }
    }
}

/// A launch substitution in its XML notation.
fn substitution(name: &str, arguments: &Arguments) -> Option<PythonValue> {
    let text = |place, name| arguments.text(place, name);
    let made = match name {
        "LaunchConfiguration" => match text(1, "default") {
            Some(default) => format!("$(var {} {default})", text(0, "variable_name")?),
            None => format!("$(var {})", text(0, "variable_name")?),
        },
        "TextSubstitution" => text(0, "text")?,
        "FindPackageShare" | "get_package_share_directory" | "get_package_share_path" => {
            format!("$(find-pkg-share {})", text(0, "package")?)
        }
        "FindPackagePrefix" | "FindPackage" | "get_package_prefix" => {
            format!("$(find-pkg-prefix {})", text(0, "package")?)
        }
        "ThisLaunchFileDir" => "$(dirname)".to_owned(),
        "EnvironmentVariable" | "getenv" => {
            match text(1, "default_value").or_else(|| text(1, "default")) {
                Some(default) => format!("$(env {} {default})", text(0, "name")?),
                None => format!("$(env {})", text(0, "name")?),
            }
        }
        "PathJoinSubstitution" | "PathJoin" => match arguments.get(0, "substitutions")? {
            PythonValue::List(parts) => path(parts),
            other => other.launch_text(),
        },
        "PythonExpression" => format!("$(eval {})", text(0, "expression")?),
        "EqualsSubstitution" => {
            format!("$(eval '{}' == '{}')", text(0, "left")?, text(1, "right")?)
        }
        "NotEqualsSubstitution" => {
            format!("$(eval '{}' != '{}')", text(0, "left")?, text(1, "right")?)
        }
        "NotSubstitution" => format!("$(not {})", text(0, "value")?),
        "AndSubstitution" => format!("$(and {} {})", text(0, "left")?, text(1, "right")?),
        "OrSubstitution" => format!("$(or {} {})", text(0, "left")?, text(1, "right")?),
        // Their path argument.
        "PythonLaunchDescriptionSource"
        | "AnyLaunchDescriptionSource"
        | "XMLLaunchDescriptionSource"
        | "YAMLLaunchDescriptionSource"
        | "FrontendLaunchDescriptionSource" => text(0, "launch_file_path")?,
        _ => return None,
    };
    Some(PythonValue::Text(made))
}

/// The result of a function of Python itself.
fn plain(full: &str, arguments: &Arguments) -> Option<PythonValue> {
    let first = arguments.positional.first();
    let text = || first.map(PythonValue::launch_text);
    match full {
        "os.path.join" | "path.join" | "join" => {
            Some(PythonValue::Text(path(&arguments.positional)))
        }
        "os.path.dirname" | "path.dirname" => Some(PythonValue::Text(parent(&text()?).to_owned())),
        "os.path.abspath" | "os.path.realpath" | "os.path.normpath" | "Path" | "pathlib.Path"
        | "str" => text().map(PythonValue::Text),
        "os.getenv" | "os.environ.get" => substitution("getenv", arguments),
        "list" | "tuple" => Some(first.cloned().unwrap_or(PythonValue::List(Vec::new()))),
        "dict" => Some(PythonValue::Dict(arguments.named.clone())),
        "range" => {
            let number = |at: usize| match arguments.positional.get(at) {
                Some(PythonValue::Number(number)) => Some(*number),
                _ => None,
            };
            let (from, to) = match number(1) {
                Some(to) => (number(0)?, to),
                None => (0, number(0)?),
            };
            let is_small = to.checked_sub(from).is_some_and(|n| n <= 1000);
            is_small.then(|| PythonValue::List((from..to).map(PythonValue::Number).collect()))
        }
        "len" => match first? {
            PythonValue::List(list) => i64::try_from(list.len()).ok().map(PythonValue::Number),
            _ => None,
        },
        "enumerate" => match first? {
            PythonValue::List(list) => {
                let pairs = (0..)
                    .zip(list)
                    .map(|(n, v)| PythonValue::List(vec![PythonValue::Number(n), v.clone()]));
                Some(PythonValue::List(pairs.collect()))
            }
            _ => None,
        },
        _ => None,
    }
}

/// Joins the parts of a path; a part that begins with a slash replaces those before it.
fn path(parts: &[PythonValue]) -> String {
    let mut joined = String::new();
    for part in parts {
        let part = part.launch_text();
        if part.starts_with('/') {
            joined.clear();
        } else if !joined.is_empty() && !joined.ends_with('/') {
            joined.push('/');
        }
        joined.push_str(&part);
    }
    joined
}

fn parent(path: &str) -> &str {
    path.rsplit_once('/').map_or(".", |(folder, _)| folder)
}

/// `'{}_{name}'.format(a, name=b)`
fn formatted(format: &str, arguments: &Arguments) -> Option<String> {
    let mut next = 0;
    let mut text = String::new();
    let mut rest = format;
    while let Some((before, after)) = rest.split_once('{') {
        let (key, behind) = after.split_once('}')?;
        let value = if key.is_empty() {
            next += 1;
            arguments.positional.get(next - 1)?
        } else if let Ok(place) = key.parse::<usize>() {
            arguments.positional.get(place)?
        } else {
            arguments.named(key)?
        };
        text.push_str(before);
        text.push_str(&value.launch_text());
        rest = behind;
    }
    Some(text + rest)
}
