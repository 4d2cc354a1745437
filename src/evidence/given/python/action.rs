//! The actions of launch and `launch_ros` as elements of the XML format.

use super::super::tree::Tree;
use super::PythonValue::{self, Action, Dict, Function, List, Text, Unknown};
use super::{Arguments, Evaluator, UNREAD};

/// Actions that start no node and change no name.
const OTHER: &[&str] = &[
    "AppendEnvironmentVariable",
    "EmitEvent",
    "ExecuteLocal",
    "ExecuteProcess",
    "LogInfo",
    "ResetEnvironment",
    "SetEnvironmentVariable",
    "SetParameter",
    "SetParametersFromFile",
    "SetROSLogDir",
    "SetUseSimTime",
    "Shutdown",
    "UnsetEnvironmentVariable",
    "UnsetLaunchConfiguration",
];

impl Evaluator<'_> {
    /// The action that a call creates, if any.
    pub(super) fn action(&mut self, name: &str, arguments: &Arguments) -> Option<PythonValue> {
        let mut tree = match name {
            "LaunchDescription" => {
                return Some(match arguments.get(0, "initial_entities") {
                    Some(list @ List(_)) => list.clone(),
                    Some(PythonValue::None) | None => List(Vec::new()),
                    Some(other) => List(vec![other.clone()]),
                });
            }
            "OpaqueFunction" => self.opaque(arguments),
            _ => tree(name, arguments)?,
        };
        tree.line = arguments.line;
        if let Some(Action(condition)) = arguments.named("condition") {
            tree.attributes.extend(condition.attributes.iter().cloned());
        } else if arguments
            .named("condition")
            .is_some_and(|c| *c != PythonValue::None)
        {
            tree.attributes
                .push(("if".to_owned(), "$(unknown)".to_owned()));
        }
        if self.undecided > 0 {
            tree.attributes
                .insert(0, ("if".to_owned(), "$(unknown)".to_owned()));
        }
        Some(Action(tree))
    }

    /// A function that the launch system calls: followed like any other in this file; values from the running system
    /// are unknown.
    fn opaque(&mut self, arguments: &Arguments) -> Tree {
        let function = match arguments.get(0, "function") {
            Some(Function(name)) => self.function(name),
            _ => None,
        };
        let Some(function) = function else {
            return element(UNREAD, &[]);
        };
        let mut positional = vec![Unknown(arguments.line)];
        if let Some(List(more)) = arguments.named("args") {
            positional.extend(more.iter().cloned());
        }
        let named = match arguments.named("kwargs") {
            Some(Dict(map)) => map.clone(),
            _ => Vec::new(),
        };
        let made = self.call(function, &positional, &named);
        let mut group = element("group", &[("scoped", Some("false".to_owned()))]);
        group.children = trees(&made);
        group
    }
}

fn tree(name: &str, given: &Arguments) -> Option<Tree> {
    let text = |place, name| given.text(place, name);
    let children = |place, name| given.get(place, name).map(trees).unwrap_or_default();
    let mut tree = match name {
        "Node" | "LifecycleNode" => node("node", given),
        "ComposableNode" => node("composable_node", given),
        "ComposableNodeContainer" => node("node_container", given),
        "LoadComposableNodes" => element("load_composable_node", &[]),
        "IncludeLaunchDescription" => include(given),
        "GroupAction" => element("group", &[("scoped", text(9, "scoped"))]),
        "TimerAction" | "RegisterEventHandler" => {
            element("group", &[("scoped", Some("false".to_owned()))])
        }
        "PushRosNamespace" | "PushROSNamespace" => {
            element("push_ros_namespace", &[("namespace", text(0, "namespace"))])
        }
        "SetRemap" => element("remap", &[("from", text(0, "src")), ("to", text(1, "dst"))]),
        "SetLaunchConfiguration" => element(
            "let",
            &[("name", text(0, "name")), ("value", text(1, "value"))],
        ),
        "DeclareLaunchArgument" => element(
            "arg",
            &[
                ("name", text(0, "name")),
                ("default", text(1, "default_value")),
            ],
        ),
        "OnProcessExit"
        | "OnProcessStart"
        | "OnProcessIO"
        | "OnExecutionComplete"
        | "OnStateTransition" => element("group", &[("scoped", Some("false".to_owned()))]),
        "IfCondition" => element("condition", &[("if", text(0, "predicate_expression"))]),
        "UnlessCondition" => element("condition", &[("unless", text(0, "predicate_expression"))]),
        "LaunchConfigurationEquals" | "LaunchConfigurationNotEquals" => {
            let sign = if name == "LaunchConfigurationEquals" {
                "=="
            } else {
                "!="
            };
            let (variable, value) = (
                text(0, "launch_configuration_name")?,
                text(1, "expected_value")?,
            );
            element(
                "condition",
                &[(
                    "if",
                    Some(format!("$(eval '$(var {variable})' {sign} '{value}')")),
                )],
            )
        }
        other if OTHER.contains(&other) => element("other", &[]),
        _ => return None,
    };
    match name {
        "GroupAction" => tree.children = children(0, "actions"),
        "TimerAction" => tree.children = children(9, "actions"),
        "ComposableNodeContainer" | "LoadComposableNodes" => {
            tree.children
                .extend(children(9, "composable_node_descriptions"));
        }
        "RegisterEventHandler" => tree.children = children(0, "event_handler"),
        name if name.starts_with("On") => {
            let handlers = ["on_exit", "on_start", "on_completion", "entities"];
            tree.children = handlers
                .into_iter()
                .flat_map(|name| children(usize::MAX, name))
                .collect();
        }
        _ => {}
    }
    Some(tree)
}

fn node(tag: &str, given: &Arguments) -> Tree {
    let text = |name| given.text(usize::MAX, name);
    let words = match given.named("arguments") {
        Some(List(words)) => words.iter().map(PythonValue::launch_text).collect(),
        _ => Vec::new(),
    };
    let mut tree = element(
        tag,
        &[
            ("args", Some(words.join(" "))),
            ("pkg", text("package")),
            (
                "exec",
                text("executable").or_else(|| text("node_executable")),
            ),
            ("plugin", text("plugin").or_else(|| text("node_plugin"))),
            ("name", text("name").or_else(|| text("node_name"))),
            (
                "namespace",
                text("namespace").or_else(|| text("node_namespace")),
            ),
        ],
    );
    if let Some(List(remaps)) = given.named("remappings") {
        for remap in remaps {
            if let List(pair) = remap
                && let [from, to] = &pair[..]
            {
                let sides = [
                    ("from", Some(from.launch_text())),
                    ("to", Some(to.launch_text())),
                ];
                tree.children.push(element("remap", &sides));
            }
        }
    }
    tree
}

fn include(given: &Arguments) -> Tree {
    let file = given.text(0, "launch_description_source");
    // In ROS 2 an included file inherits the arguments of the including file.
    let mut tree = element(
        "include",
        &[("file", file), ("pass_all_args", Some("true".to_owned()))],
    );
    let pairs = match given.get(1, "launch_arguments") {
        Some(List(pairs)) => pairs.clone(),
        Some(Dict(map)) => {
            let pair =
                |(key, value): &(String, PythonValue)| List(vec![Text(key.clone()), value.clone()]);
            map.iter().map(pair).collect()
        }
        _ => Vec::new(),
    };
    for pair in pairs {
        if let List(pair) = pair
            && let [name, value] = &pair[..]
        {
            let sides = [
                ("name", Some(name.launch_text())),
                ("value", Some(value.launch_text())),
            ];
            tree.children.push(element("arg", &sides));
        }
    }
    tree
}

fn element(tag: &str, attributes: &[(&str, Option<String>)]) -> Tree {
    let known = attributes
        .iter()
        .filter_map(|(name, value)| Some(((*name).to_owned(), value.clone()?)));
    Tree {
        tag: tag.to_owned(),
        attributes: known.collect(),
        ..Tree::default()
    }
}

/// The actions in a value, with lists flattened; unknown values are kept as unknown.
pub(super) fn trees(value: &PythonValue) -> Vec<Tree> {
    match value {
        List(list) => list.iter().flat_map(trees).collect(),
        Action(tree) => vec![tree.clone()],
        Unknown(line) => vec![Tree {
            tag: UNREAD.to_owned(),
            line: *line,
            ..Tree::default()
        }],
        _ => Vec::new(),
    }
}
