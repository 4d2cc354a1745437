//! The actions of launch and `launch_ros` as elements of the XML format.

use super::super::tree::Tree;
use super::PythonValue::{self, Action, Dict, Function, List, Text, Unknown};
use super::{Arguments, Evaluator, UNREAD};

/// Actions that start no node and change no name.
const OTHER: &str = "\
    AppendEnvironmentVariable EmitEvent ExecuteLocal ExecuteProcess LogInfo ResetEnvironment \
    SetEnvironmentVariable SetParameter SetParametersFromFile SetROSLogDir SetUseSimTime Shutdown \
    UnsetEnvironmentVariable UnsetLaunchConfiguration";

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
        let unknown = || ("if".to_owned(), "$(unknown)".to_owned());
        match arguments.named("condition") {
            Some(Action(condition)) => {
                tree.attributes.extend(condition.attributes.iter().cloned());
            }
            Some(PythonValue::None) | None => {}
            Some(_) => tree.attributes.push(unknown()),
        }
        if self.undecided > 0 {
            tree.attributes.insert(0, unknown());
        }
        Some(Action(tree))
    }

    /// A function that the launch system calls: followed like any other in this file; values from the running system
    /// are unknown.
    fn opaque(&mut self, arguments: &Arguments) -> Tree {
        let function = match arguments.get(0, "function") {
            Some(Function(name)) => self.functions.get(name).copied(),
            _ => None,
        };
        let Some(function) = function else {
            return element(UNREAD, &[]);
        };
        let mut given = Arguments::default();
        given.positional.push(Unknown(arguments.line));
        if let Some(List(more)) = arguments.named("args") {
            given.positional.extend(more.iter().cloned());
        }
        if let Some(Dict(map)) = arguments.named("kwargs") {
            given.named.clone_from(map);
        }
        let made = self.call(function, &given);
        Tree {
            children: trees(&made),
            ..unscoped()
        }
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
        "TimerAction"
        | "RegisterEventHandler"
        | "OnProcessExit"
        | "OnProcessStart"
        | "OnProcessIO"
        | "OnExecutionComplete"
        | "OnStateTransition" => unscoped(),
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
        "IfCondition" => element("condition", &[("if", text(0, "predicate_expression"))]),
        "UnlessCondition" => element("condition", &[("unless", text(0, "predicate_expression"))]),
        "LaunchConfigurationEquals" | "LaunchConfigurationNotEquals" => {
            let is_equal = name == "LaunchConfigurationEquals";
            let sign = if is_equal { "==" } else { "!=" };
            let variable = text(0, "launch_configuration_name")?;
            let value = text(1, "expected_value")?;
            let condition = format!("$(eval '$(var {variable})' {sign} '{value}')");
            element("condition", &[("if", Some(condition))])
        }
        other if OTHER.split(' ').any(|name| name == other) => element("other", &[]),
        _ => return None,
    };
    tree.children.extend(match name {
        "GroupAction" => children(0, "actions"),
        "TimerAction" => children(9, "actions"),
        "ComposableNodeContainer" | "LoadComposableNodes" => {
            children(9, "composable_node_descriptions")
        }
        "RegisterEventHandler" => children(0, "event_handler"),
        name if name.starts_with("On") => {
            let handlers = ["on_exit", "on_start", "on_completion", "entities"];
            let children = handlers.map(|name| children(usize::MAX, name));
            children.into_iter().flatten().collect()
        }
        _ => Vec::new(),
    });
    Some(tree)
}

fn node(tag: &str, given: &Arguments) -> Tree {
    let words = match given.named("arguments") {
        Some(List(words)) => words.iter().map(PythonValue::launch_text).collect(),
        _ => Vec::new(),
    };
    // The second names are those before ROS 2 Foxy.
    let either = |name: &str| {
        let before = format!("node_{name}");
        let text = |name| given.text(usize::MAX, name);
        text(name).or_else(|| text(&before))
    };
    let attributes = [
        ("args", Some(words.join(" "))),
        ("pkg", given.text(usize::MAX, "package")),
        ("exec", either("executable")),
        ("plugin", either("plugin")),
        ("name", either("name")),
        ("namespace", either("namespace")),
    ];
    let remaps = match given.named("remappings") {
        Some(List(remaps)) => &remaps[..],
        _ => &[],
    };
    Tree {
        children: pairs("remap", ["from", "to"], remaps),
        ..element(tag, &attributes)
    }
}

fn include(given: &Arguments) -> Tree {
    let file = given.text(0, "launch_description_source");
    // In ROS 2 an included file inherits the arguments of the including file.
    let attributes = [("file", file), ("pass_all_args", Some("true".to_owned()))];
    let passed = match given.get(1, "launch_arguments") {
        Some(List(pairs)) => pairs.clone(),
        Some(Dict(map)) => {
            let pair =
                |(key, value): &(String, PythonValue)| List(vec![Text(key.clone()), value.clone()]);
            map.iter().map(pair).collect()
        }
        _ => Vec::new(),
    };
    Tree {
        children: pairs("arg", ["name", "value"], &passed),
        ..element("include", &attributes)
    }
}

/// An element for each pair in a list, with its parts as these attributes.
fn pairs(tag: &str, [first, second]: [&str; 2], list: &[PythonValue]) -> Vec<Tree> {
    let one = |pair: &PythonValue| {
        let List(pair) = pair else { return None };
        let [a, b] = &pair[..] else { return None };
        let (a, b) = (a.launch_text(), b.launch_text());
        Some(element(tag, &[(first, Some(a)), (second, Some(b))]))
    };
    list.iter().filter_map(one).collect()
}

/// A group whose settings apply to what follows it.
fn unscoped() -> Tree {
    element("group", &[("scoped", Some("false".to_owned()))])
}

fn element(tag: &str, attributes: &[(&str, Option<String>)]) -> Tree {
    let known = |(name, value): &(&str, Option<String>)| Some(((*name).to_owned(), value.clone()?));
    Tree {
        tag: tag.to_owned(),
        attributes: attributes.iter().filter_map(known).collect(),
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
