//! Declarations in Python code: rclpy and rospy, actions, message filters, transforms, of Python 2 and 3.

use std::collections::BTreeMap;
use std::ops::Range;

use super::declaration::{
    Call, Class, Classes, DEEPEST, Declaration, FileCode, LONGEST, Made, TextValues, short, type_of,
};
use crate::evidence::syntax::{Language, Node, Parsed, arguments, children, fields, line, walk};

/// Reads a file; empty if it is too deeply nested.
pub(super) fn read(text: &str) -> FileCode {
    let Some(parsed) = Parsed::new(Language::Python, text.to_owned()) else {
        return FileCode::default();
    };
    let mut reader = PythonReader {
        parsed: &parsed,
        imports: BTreeMap::new(),
        wildcards: Vec::new(),
        texts: TextValues::new(text.len()),
        classes: Classes::default(),
        loops: Vec::new(),
        bound: BTreeMap::new(),
    };
    reader.visit_all(PythonReader::look);
    reader.visit_all(PythonReader::take);
    FileCode {
        classes: reader.classes.all,
        imports: reader.imports,
    }
}

struct PythonReader<'a> {
    parsed: &'a Parsed,
    /// Imported names and their full names: `std_msgs.msg.String` for `String`.
    imports: BTreeMap<String, String>,
    /// Modules whose names are all imported.
    wildcards: Vec<String>,
    texts: TextValues<'a>,
    classes: Classes,
    /// Loops: the text that is repeated, the variables and the items.
    loops: Vec<(Range<usize>, Node<'a>, Node<'a>)>,
    /// The values of the variables in the current iteration of the enclosing loops.
    bound: BTreeMap<&'a str, Node<'a>>,
}

/// The most iterations of the loops around a call that are followed: nested loops multiply them, and lists of topics in code have
/// at most some dozen.
const MOST_ITERATIONS: usize = 64;

impl<'a> PythonReader<'a> {
    /// Visits every element inside its classes.
    fn visit_all(&mut self, visit: fn(&mut Self, Node<'a>)) {
        let mut next = 1;
        self.classes.open.clear();
        walk(self.parsed.root(), &mut |node| {
            self.classes.leave(node);
            if node.kind() == "class_definition" {
                self.classes.enter(node, next);
                next += 1;
            }
            visit(self, node);
            true
        });
    }

    fn text(&self, node: Node<'_>) -> &'a str {
        self.parsed.text(node)
    }

    /// First pass: classes, imports, and values of names.
    fn look(&mut self, node: Node<'a>) {
        match node.kind() {
            "class_definition" => self.define(node),
            "import_statement" => self.import(node, ""),
            "import_from_statement" => {
                let module = self.parsed.field(node, "module_name");
                self.import(node, module);
            }
            "assignment" => {
                if let Some([left, right]) = fields(node, ["left", "right"]) {
                    self.texts.set(self.text(left), right);
                }
            }
            "for_statement" | "for_in_clause" => {
                let repeated = match node.kind() {
                    "for_statement" => node.child_by_field_name("body"),
                    _ => node.parent(),
                };
                let sides = fields(node, ["left", "right"]);
                if let Some((repeated, [left, right])) = repeated.zip(sides) {
                    self.loops.push((repeated.byte_range(), left, right));
                }
            }
            "default_parameter" | "typed_default_parameter" => {
                if let Some([name, value]) = fields(node, ["name", "value"]) {
                    self.texts.set(self.text(name), value);
                }
            }
            "call" => {
                let given = self.arguments(node);
                let is_parameter =
                    ["declare_parameter", "get_param"].contains(&self.called(node).0);
                if let (true, [name, value, ..]) = (is_parameter, &given.positional[..])
                    && let Some(name) = self.string(*name)
                {
                    self.texts.set_parameter(&name, *value);
                }
            }
            _ => {}
        }
    }

    fn define(&mut self, node: Node<'a>) {
        let bases = node.child_by_field_name("superclasses").map(children);
        let bases = bases.into_iter().flatten();
        let bases = bases.filter(|base| base.kind() != "keyword_argument");
        let last = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
        self.classes.all.push(Class {
            name: self.parsed.field(node, "name").to_owned(),
            bases: bases.map(|base| last(self.text(base))).collect(),
            is_defined: true,
            line: line(node),
            ..Class::default()
        });
    }

    fn import(&mut self, node: Node<'a>, module: &str) {
        let is_wildcard = |child: &Node<'_>| child.kind() == "wildcard_import";
        if children(node).iter().any(is_wildcard) {
            self.wildcards.push(module.to_owned());
        }
        let mut cursor = node.walk();
        for name in node.children_by_field_name("name", &mut cursor) {
            let field = |field| name.child_by_field_name(field).map(|n| self.text(n));
            let (full, alias) = match name.kind() {
                "aliased_import" => (field("name").unwrap_or_default(), field("alias")),
                _ => (self.text(name), None),
            };
            // `import a.b` binds `a`.
            let first = full.split('.').next().unwrap_or_default();
            let (bound, stands_for) = match (module, alias) {
                ("", None) => (first, first.to_owned()),
                ("", Some(alias)) => (alias, full.to_owned()),
                _ if module.ends_with('.') => (alias.unwrap_or(full), format!("{module}{full}")),
                _ => (alias.unwrap_or(full), format!("{module}.{full}")),
            };
            self.imports.insert(bound.to_owned(), stands_for);
        }
    }

    /// Second pass: calls.
    fn take(&mut self, node: Node<'a>) {
        if node.kind() != "call" {
            return;
        }
        let (name, object) = self.called(node);
        let full = self.full(if object.is_empty() {
            name.to_owned()
        } else {
            format!("{object}.{name}")
        });
        let given = self.arguments(node);
        let first = given.positional.iter().find_map(|n| self.string(*n));
        if name.chars().next().is_some_and(char::is_uppercase) {
            let class = self.classes.current();
            class.mentions.insert(name.to_owned(), first);
        }
        self.remark(name, object, &full, &given);
        if let Some(made) = made(name, &full) {
            let mut declared: Vec<Declaration> = Vec::new();
            for values in self.iterations(node) {
                self.bound = values;
                let call = Call {
                    made,
                    topic: self.topic(&given),
                    types: self.types(&given),
                    line: line(node),
                    text: short(&format!("{name}{}", self.parsed.field(node, "arguments"))),
                };
                let mut new = call.declarations();
                new.retain(|one| !declared.contains(one));
                declared.extend(new);
            }
            self.bound.clear();
            self.classes.current().declarations.extend(declared);
        }
    }

    /// The values of the variables of the loops around an element, for each iteration; a single empty entry
    /// outside of loops.
    fn iterations(&self, node: Node<'a>) -> Vec<BTreeMap<&'a str, Node<'a>>> {
        let mut iterations = vec![BTreeMap::new()];
        let around = self.loops.iter();
        for (_, left, right) in around.filter(|(body, ..)| body.contains(&node.start_byte())) {
            let items = self.items(*right, 0);
            if items.is_empty() || items.len() * iterations.len() > MOST_ITERATIONS {
                continue;
            }
            let with = |iteration: &BTreeMap<&'a str, Node<'a>>, item: Node<'a>| {
                let mut iteration = iteration.clone();
                if left.kind() == "identifier" {
                    iteration.insert(self.text(*left), item);
                } else {
                    let names = children(*left).into_iter().map(|name| self.text(name));
                    iteration.extend(names.zip(parts(item)));
                }
                iteration
            };
            let next = |iteration| items.iter().map(move |item| with(iteration, *item));
            iterations = iterations.iter().flat_map(next).collect();
        }
        iterations
    }

    /// The items of the literal that a loop iterates over, or of the one that a name refers to.
    fn items(&self, node: Node<'a>, depth: usize) -> Vec<Node<'a>> {
        let again = |node: Option<Node<'a>>| match node {
            Some(node) if depth < DEEPEST => self.items(node, depth + 1),
            _ => Vec::new(),
        };
        match node.kind() {
            "list" | "tuple" | "set" | "dictionary" => children(node),
            "parenthesized_expression" => again(node.named_child(0)),
            "identifier" | "attribute" => again(self.texts.get(self.text(node))),
            "call" if self.called(node).0 == "items" => {
                let function = node.child_by_field_name("function");
                again(function.and_then(|f| f.child_by_field_name("object")))
            }
            _ => Vec::new(),
        }
    }

    /// Records node names, logging, and bag writing.
    fn remark(&mut self, name: &str, object: &str, full: &str, given: &CallArguments<'a>) {
        let is_init = name == "__init__"
            && (object.starts_with("super(") || object == "Node" || object.ends_with(".Node"));
        let is_node = ["rclpy.create_node", "rclpy.node.Node", "rospy.init_node"].contains(&full);
        if is_init || is_node {
            let named = given.named("node_name name").into_iter();
            let named = named.chain(given.positional.iter().copied());
            let node_name = named.into_iter().find_map(|n| self.string(n));
            self.classes.current().node_names.extend(node_name);
        }
        let is_writer =
            name == "SequentialWriter" || full == "rosbag.Bag" && given.positional.len() > 1;
        self.classes.current().is_recorder |= is_writer;
        self.classes.current().logs |= name == "get_logger" || full.starts_with("rospy.log");
    }

    /// The called name, and the object before its dot.
    fn called(&self, call: Node<'a>) -> (&'a str, &'a str) {
        let Some(function) = call.child_by_field_name("function") else {
            return ("", "");
        };
        let field = |name| self.parsed.field(function, name);
        match function.kind() {
            "identifier" => (self.text(function), ""),
            "attribute" => (field("attribute"), field("object")),
            _ => ("", ""),
        }
    }

    fn arguments(&self, call: Node<'a>) -> CallArguments<'a> {
        let mut given = CallArguments::default();
        for argument in arguments(call) {
            let field = |name| argument.child_by_field_name(name);
            match (argument.kind(), field("name"), field("value")) {
                ("keyword_argument", Some(name), Some(value)) => {
                    given.named.push((self.text(name), value));
                }
                _ => given.positional.push(argument),
            }
        }
        given
    }

    /// A name with its first part replaced by the full name.
    fn full(&self, name: String) -> String {
        let (first, rest) = name.split_once('.').unwrap_or((&name, ""));
        match self.imports.get(first) {
            Some(full) if rest.is_empty() => full.clone(),
            Some(full) => format!("{full}.{rest}"),
            None => name,
        }
    }

    /// The topic among the arguments: the one of that name, else the first text.
    fn topic(&self, given: &CallArguments<'a>) -> Option<String> {
        let topic = match given.named("topic name topic_name action_name ns") {
            Some(named) => self.string(named),
            None => given.positional.iter().find_map(|n| self.string(*n)),
        };
        topic.filter(|topic| !topic.is_empty())
    }

    /// The type among the arguments.
    fn types(&self, given: &CallArguments<'a>) -> Vec<String> {
        let named = given.named("msg_type data_class topic_type action_type ActionSpec");
        let all = named.into_iter().chain(given.positional.iter().copied());
        all.map(|n| self.type_name(n))
            .find(|types| !types.is_empty())
            .unwrap_or_default()
    }

    fn type_name(&self, node: Node<'a>) -> Vec<String> {
        let node = self.bound.get(self.text(node)).copied().unwrap_or(node);
        if !["identifier", "attribute"].contains(&node.kind()) {
            return Vec::new();
        }
        let written = self.text(node);
        let full = self.full(written.to_owned());
        let parts: Vec<&str> = full.split('.').collect();
        let is_type = parts.len() >= 3 && ["msg", "action"].contains(&parts[parts.len() - 2]);
        if is_type {
            return type_of(parts).into_iter().collect();
        }
        let is_bare =
            !written.contains('.') && full == written && written.starts_with(char::is_uppercase);
        let modules = self.wildcards.iter().filter(|m| {
            is_bare && ["msg", "action"].contains(&m.rsplit('.').next().unwrap_or_default())
        });
        let name = |module: &String| type_of(module.split('.').chain([written]));
        modules.filter_map(name).collect()
    }

    fn string(&self, node: Node<'a>) -> Option<String> {
        self.string_at(node, 0).filter(|text| text.len() <= LONGEST)
    }

    /// The text of an expression, if known.
    fn string_at(&self, node: Node<'a>, depth: usize) -> Option<String> {
        self.texts.evaluate(depth)?;
        let field = |name| node.child_by_field_name(name);
        let again = |node| {
            self.string_at(node, depth + 1)
                .filter(|text| text.len() <= LONGEST)
        };
        match node.kind() {
            "string" => {
                let part = |part: Node<'a>| match part.kind() {
                    "string_content" => Some(self.text(part).to_owned()),
                    "interpolation" => again(part.child_by_field_name("expression")?),
                    _ => Some(String::new()),
                };
                children(node).into_iter().map(part).collect()
            }
            "concatenated_string" => children(node).into_iter().map(again).collect(),
            "parenthesized_expression" => again(node.named_child(0)?),
            "binary_operator" if self.text(field("operator")?) == "+" => {
                Some(again(field("left")?)? + &again(field("right")?)?)
            }
            "identifier" => {
                let bound = self.bound.get(self.text(node)).copied();
                again(bound.or_else(|| self.texts.get(self.text(node)))?)
            }
            "attribute" => match self.texts.get(self.text(node)) {
                Some(value) => again(value),
                // `….get_parameter('x').value`, `….get_parameter_value().string_value`
                None => {
                    again(field("object").filter(|n| ["call", "attribute"].contains(&n.kind()))?)
                }
            },
            "call" => {
                let (name, object) = self.called(node);
                let given = self.arguments(node);
                match name {
                    "get_param" | "declare_parameter" => again(*given.positional.get(1)?),
                    "get_parameter" => {
                        let name = again(*given.positional.first()?)?;
                        again(self.texts.parameter(&name)?)
                    }
                    "get_parameter_value" => {
                        again(field("function")?.child_by_field_name("object")?)
                    }
                    "str" if object.is_empty() => again(*given.positional.first()?),
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

/// The arguments of a call.
#[derive(Default)]
struct CallArguments<'a> {
    positional: Vec<Node<'a>>,
    named: Vec<(&'a str, Node<'a>)>,
}

impl<'a> CallArguments<'a> {
    /// The argument of the first of these names, separated by spaces, that has one.
    fn named(&self, names: &str) -> Option<Node<'a>> {
        let find = |name| self.named.iter().find(|(own, _)| *own == name);
        names.split(' ').find_map(find).map(|(_, value)| *value)
    }
}

/// The parts of an item of a loop: of a pair, or of an entry of a dictionary.
fn parts(item: Node<'_>) -> Vec<Node<'_>> {
    match item.kind() {
        "tuple" | "list" | "pair" => children(item),
        _ => Vec::new(),
    }
}

/// The kind of object that a call creates, by its name and its full name.
fn made(name: &str, full: &str) -> Option<Made> {
    let module = full.split('.').next().unwrap_or_default();
    Some(match (name, module) {
        ("create_publisher" | "create_lifecycle_publisher", _) | ("Publisher", "rospy") => {
            Made::Publisher
        }
        ("create_subscription", _) | ("Subscriber", "rospy" | "message_filters") => {
            Made::Subscriber
        }
        ("wait_for_message", _) => Made::Moment,
        ("SimpleActionServer" | "ActionServer", "actionlib") => Made::ActionServer1,
        ("SimpleActionClient" | "ActionClient", "actionlib") => Made::ActionClient1,
        ("ActionServer", "rclpy") => Made::ActionServer2,
        ("ActionClient", "rclpy") => Made::ActionClient2,
        ("TransformBroadcaster", "tf" | "tf2_ros") => Made::Broadcaster,
        ("StaticTransformBroadcaster", "tf2_ros") => Made::StaticBroadcaster,
        ("TransformListener", "tf" | "tf2_ros") => Made::Listener,
        _ => return None,
    })
}

#[cfg(test)]
mod tests;
