//! Declarations in C++ code: rclcpp and roscpp, actions, message filters, image transport, transforms.
//!
//! Macros are not expanded and headers not included: a single file is nearly always sufficient. Two passes: the first knows
//! classes, types and values of variables, the second takes the calls and variables that create something.

use std::collections::BTreeMap;

use crate::evidence::code::declaration::{Call, Class, Classes, FileCode, Made, short, type_of};
use crate::evidence::code::declaration::{LONGEST, TextValues};
use crate::evidence::syntax::{Language, Node, Parsed, arguments, children, fields, line, walk};

/// Every file with declarations contains at least one of these words; other files are not parsed. They include classes,
/// as a node may derive from them.
const KEYWORDS: &[&str] = &[
    "class ",
    "struct ",
    "ros::",
    "rclcpp",
    "Node",
    "advertise",
    "ubscribe",
    "publisher",
];

/// Reads a file; empty if it is too deeply nested.
pub(super) fn read(text: &str) -> FileCode {
    if !KEYWORDS.iter().any(|word| text.contains(word)) {
        return FileCode::default();
    }
    let Some(parsed) = Parsed::new(Language::Cpp, text.to_owned()) else {
        return FileCode::default();
    };
    let mut reader = CppReader {
        parsed: &parsed,
        names: Aliases::default(),
        texts: TextValues::new(text.len()),
        handles: BTreeMap::new(),
        members: BTreeMap::new(),
        callbacks: BTreeMap::new(),
        classes: Classes::default(),
        places: BTreeMap::new(),
    };
    reader.visit_all(CppReader::look);
    reader.visit_all(CppReader::take);
    FileCode {
        classes: reader.classes.all,
        imports: BTreeMap::new(),
    }
}

struct CppReader<'a> {
    parsed: &'a Parsed,
    names: Aliases,
    texts: TextValues<'a>,
    /// Node handles with their namespaces.
    handles: BTreeMap<String, String>,
    /// Variables with their types.
    members: BTreeMap<String, Node<'a>>,
    /// Functions with the type of their first parameter.
    callbacks: BTreeMap<String, Node<'a>>,
    classes: Classes,
    /// The index of each class.
    places: BTreeMap<String, usize>,
}

impl<'a> CppReader<'a> {
    /// Visits every element inside its classes.
    fn visit_all(&mut self, visit: fn(&mut Self, Node<'a>)) {
        self.classes.open.clear();
        walk(self.parsed.root(), &mut |node| {
            self.classes.leave(node);
            if let Some(name) = self.class_of(node) {
                let at = self.place(name, node);
                self.classes.enter(node, at);
            }
            visit(self, node);
            true
        });
    }

    fn text(&self, node: Node<'_>) -> &'a str {
        self.parsed.text(node)
    }

    fn field(&self, node: Node<'a>, name: &str) -> &'a str {
        self.parsed.field(node, name)
    }

    /// The class that an element defines, or whose function it defines: `void Foo::run() {…}`.
    fn class_of(&self, node: Node<'a>) -> Option<&'a str> {
        match node.kind() {
            "class_specifier" | "struct_specifier" => {
                node.child_by_field_name("body")?;
                let name = node.child_by_field_name("name")?;
                let name = name.child_by_field_name("name").unwrap_or(name);
                Some(self.text(name))
            }
            "function_definition" => {
                let mut declarator = node.child_by_field_name("declarator")?;
                while declarator.kind() != "function_declarator" {
                    declarator = declarator
                        .child_by_field_name("declarator")
                        .or(declarator.named_child(0))?;
                }
                let name = declarator.child_by_field_name("declarator")?;
                if name.kind() != "qualified_identifier" {
                    return None;
                }
                let class = self.text(name).rsplit("::").nth(1)?;
                Some(class.split('<').next().unwrap_or_default().trim())
            }
            _ => None,
        }
    }

    fn place(&mut self, name: &str, node: Node<'a>) -> usize {
        if let Some(at) = self.places.get(name) {
            return *at;
        }
        self.classes.all.push(Class {
            name: name.to_owned(),
            line: line(node),
            ..Class::default()
        });
        let at = self.classes.all.len() - 1;
        self.places.insert(name.to_owned(), at);
        at
    }
}

// First pass: classes, names of types, and values of variables.

impl<'a> CppReader<'a> {
    /// First pass: classes, names of types, and values of variables.
    fn look(&mut self, node: Node<'a>) {
        match node.kind() {
            "class_specifier" | "struct_specifier"
                if node.child_by_field_name("body").is_some() =>
            {
                self.define(node);
            }
            "using_declaration"
            | "alias_declaration"
            | "type_definition"
            | "namespace_alias_definition" => {
                self.names.look(self.parsed, node);
            }
            "preproc_def" => self.set(node, "name", "value"),
            "init_declarator" => {
                self.set(node, "declarator", "value");
                self.handle(node);
            }
            "assignment_expression" => {
                self.set(node, "left", "right");
                self.handle_given(node);
            }
            "field_declaration" => {
                self.set(node, "declarator", "default_value");
                self.member(node);
            }
            "declaration" => self.member(node),
            "field_initializer" => {
                if let [name, given] = children(node)[..]
                    && let Some(first) = given.named_child(0)
                    && first.kind() == "string_literal"
                {
                    let space = self.literal(first);
                    self.handles.insert(self.text(name).to_owned(), space);
                }
            }
            "function_declarator" => self.callback(node),
            "call_expression" => self.parameter(node),
            _ => {}
        }
    }

    fn define(&mut self, node: Node<'a>) {
        let mut parts = children(node).into_iter();
        let clause = parts.find(|part| part.kind() == "base_class_clause");
        let bases = clause.map(children).unwrap_or_default();
        let bases = bases.into_iter().filter(|b| b.kind() != "access_specifier");
        let last = |base: Node<'a>| {
            let name = self.text(base).split('<').next().unwrap_or_default();
            unscoped(name).trim().to_owned()
        };
        let bases: Vec<String> = bases.map(last).collect();
        let class = self.classes.current();
        class.bases.extend(bases);
        class.is_defined = true;
        class.line = line(node);
    }

    /// Records an assignment to a name.
    fn set(&mut self, node: Node<'a>, name: &str, value: &str) {
        if let Some([name, value]) = fields(node, [name, value]) {
            let name = self.text(name).trim_end_matches("[]");
            let name = name.trim_start_matches(['*', '&']);
            self.texts.set(name.trim_start_matches("this->"), value);
        }
    }

    /// `ros::NodeHandle pnh("~");`
    fn handle(&mut self, node: Node<'a>) {
        let kind = node
            .parent()
            .map_or("", |parent| self.field(parent, "type"));
        let given = node.child_by_field_name("value");
        let Some(given) = given.filter(|_| kind.contains("NodeHandle")) else {
            return;
        };
        let name = self.field(node, "declarator");
        let name = name.trim_start_matches(['*', '&']).to_owned();
        let written = self.text(given);
        if written.contains("getPrivateNodeHandle") || written.contains("getMTPrivateNodeHandle") {
            self.handles.insert(name, "~".to_owned());
            return;
        }
        let parts = children(given);
        let mut texts = parts.iter().filter(|part| part.kind() == "string_literal");
        if let Some(text) = texts.next_back() {
            let first = parts.first().map_or("", |first| self.text(*first));
            let below = self.handles.get(first);
            let below = below.map_or(String::new(), |space| format!("{space}/"));
            self.handles.insert(name, below + &self.literal(*text));
        }
    }

    /// `pnh_ = ros::NodeHandle("~");`, `pnh_ = getPrivateNodeHandle();`
    fn handle_given(&mut self, node: Node<'a>) {
        let (name, value) = (self.field(node, "left"), self.field(node, "right"));
        let is_private = value.contains("getPrivateNodeHandle")
            || value.contains("getMTPrivateNodeHandle")
            || value.contains("NodeHandle(\"~\")");
        if is_private {
            self.handles.insert(name.to_owned(), "~".to_owned());
        }
    }

    fn member(&mut self, node: Node<'a>) {
        if let Some([kind, mut declarator]) = fields(node, ["type", "declarator"]) {
            while let Some(inner) = declarator.child_by_field_name("declarator") {
                declarator = inner;
            }
            let name = self.text(declarator).trim_start_matches(['*', '&']);
            self.members.insert(name.to_owned(), kind);
        }
    }

    fn callback(&mut self, node: Node<'a>) {
        let name = unscoped(self.field(node, "declarator"));
        if let Some(kind) = first_parameter(node) {
            self.callbacks.entry(name.to_owned()).or_insert(kind);
        }
    }

    /// `declare_parameter("topic", "default")`, `nh.param("topic", variable, "default")`
    fn parameter(&mut self, node: Node<'a>) {
        let callee = Callee::of(self.parsed, node);
        let given = arguments(node);
        match (callee.name, &given[..]) {
            ("declare_parameter", [name, value, ..]) => {
                if let Some(name) = self.string(*name) {
                    self.texts.set_parameter(&name, *value);
                }
            }
            ("param", [_, variable, value]) => self.texts.set(self.text(*variable), *value),
            ("get_parameter", [name, variable]) => {
                if let Some(name) = self.string(*name)
                    && let Some(value) = self.texts.parameter(&name)
                {
                    self.texts.set(self.text(*variable), value);
                }
            }
            _ => {}
        }
    }
}

/// The type of a function's first parameter.
fn first_parameter(declarator: Node<'_>) -> Option<Node<'_>> {
    let parameters = declarator.child_by_field_name("parameters")?;
    children(parameters).first()?.child_by_field_name("type")
}

// Second pass: calls and variables that create publishers, subscribers and nodes.

impl<'a> CppReader<'a> {
    /// Second pass: calls and variables that create publishers, subscribers and nodes.
    fn take(&mut self, node: Node<'a>) {
        match node.kind() {
            "call_expression" => self.call(node),
            "field_initializer" => self.initializer(node),
            "init_declarator" => {
                if let Some(kind) = node.parent().and_then(|p| p.child_by_field_name("type"))
                    && let Some(given) = node.child_by_field_name("value")
                    && ["argument_list", "initializer_list"].contains(&given.kind())
                {
                    self.constructed(node, kind, given);
                }
            }
            "field_declaration" => {
                if let Some([kind, given]) = fields(node, ["type", "default_value"])
                    && given.kind() == "initializer_list"
                {
                    self.constructed(node, kind, given);
                }
            }
            "type_identifier" => {
                let name = self.text(node);
                let full = node.parent().map_or("", |parent| self.text(parent));
                let class = self.classes.current();
                class.is_recorder |= is_recorder(name, full);
                class.mentions.entry(name.to_owned()).or_insert(None);
                self.transform(node, name);
            }
            "identifier"
                if self.text(node).starts_with("RCLCPP_")
                    || self.text(node).starts_with("ROS_") =>
            {
                self.classes.current().logs = true;
            }
            _ => {}
        }
    }

    fn call(&mut self, node: Node<'a>) {
        let callee = Callee::of(self.parsed, node);
        let given = arguments(node);
        if let ("init", "ros", [_, _, name, ..]) = (callee.name, callee.scope, &given[..]) {
            let name = self.string(*name);
            self.classes.current().node_names.extend(name);
        }
        let first = given.first().and_then(|n| self.string(*n));
        let is_node = callee.name == "make_shared"
            && (callee.scope.ends_with("Node") || callee.template.ends_with("Node"));
        if is_node && (callee.scope.starts_with("rclcpp") || callee.template.starts_with("rclcpp"))
        {
            self.classes.current().node_names.extend(first);
        } else if let ("make_shared" | "make_unique", Some(name)) = (callee.name, first) {
            let class = unscoped(callee.template).to_owned();
            self.classes.current().mentions.insert(class, Some(name));
        }
        // A filter is constructed without a topic and subscribes later.
        let kind = match (callee.name, self.members.get(callee.object)) {
            ("subscribe", Some(kind)) => self.text(*kind),
            ("make_shared" | "make_unique", _) => callee.template,
            _ => "",
        };
        if let Some((made, inner)) = by_constructor(kind) {
            let types = self.names.types(inner);
            self.declare(node, made, &given, types, "");
        } else if let Some(made) = by_function(&callee) {
            let types = match callee.template {
                "" => self.callback_type(&given),
                template => self.names.types(template),
            };
            let space = self.handles.get(callee.object).cloned();
            let space = space.unwrap_or_else(|| namespace_hint(callee.object).to_owned());
            self.declare(node, made, &given, types, &space);
        }
    }

    /// A member initializer: `sub_(nh_, "topic", 1)`, `Node("name")`.
    fn initializer(&mut self, node: Node<'a>) {
        let parts = children(node);
        let [name, given, ..] = parts[..] else {
            return;
        };
        if let Some(kind) = self.members.get(self.text(name)).copied() {
            self.constructed(node, kind, given);
            return;
        }
        let last = unscoped(self.text(name)).to_owned();
        let first = given.named_child(0).and_then(|n| self.string(n));
        let class = self.classes.current();
        let is_base = class.bases.contains(&last) || class.name == last || last.ends_with("Node");
        if let (true, Some(name)) = (is_base, first) {
            class.node_names.push(name);
        }
    }

    /// A variable constructed from these arguments.
    fn constructed(&mut self, node: Node<'a>, kind: Node<'a>, given: Node<'a>) {
        let given = children(given);
        let kind = self.text(kind);
        if kind.ends_with("rclcpp::Node") {
            let name = given.first().and_then(|n| self.string(*n));
            self.classes.current().node_names.extend(name);
        }
        if let Some((made, inner)) = by_constructor(kind) {
            let types = self.names.types(inner);
            let first = given.first().map_or("", |first| self.text(*first));
            let space = self.handles.get(first).cloned().unwrap_or_default();
            self.declare(node, made, &given, types, &space);
        }
    }

    /// A broadcaster or listener of transforms, once per class: it needs no topic.
    fn transform(&mut self, node: Node<'a>, name: &'a str) {
        let scope = node.parent().map_or("", |p| self.field(p, "scope"));
        let Some(made) = made_by_transform(scope, name) else {
            return;
        };
        let call = Call {
            made,
            topic: None,
            types: Vec::new(),
            line: line(node),
            text: format!("{scope}::{name}"),
        };
        let class = self.classes.current();
        for declaration in call.declarations() {
            let (role, topic) = (declaration.role, &declaration.topic);
            let mut known = class.declarations.iter();
            if !known.any(|one| one.role == role && one.topic == *topic) {
                class.declarations.push(declaration);
            }
        }
    }

    fn declare(
        &mut self,
        node: Node<'a>,
        made: Made,
        given: &[Node<'a>],
        types: Vec<String>,
        space: &str,
    ) {
        let topic = given.iter().take(3).find_map(|n| self.string(*n));
        let topic = topic.map(|topic| {
            if topic.starts_with(['/', '~']) || space.is_empty() {
                topic
            } else {
                format!("{space}/{topic}")
            }
        });
        let call = Call {
            made,
            topic,
            types,
            line: line(node),
            text: short(self.text(node)),
        };
        let class = self.classes.current();
        class.declarations.extend(call.declarations());
    }

    /// The message type of a callback among the arguments.
    fn callback_type(&self, given: &[Node<'a>]) -> Vec<String> {
        let of = |argument: &Node<'a>| {
            let mut found = None;
            walk(*argument, &mut |node| {
                if found.is_none() {
                    found = match node.kind() {
                        "lambda_expression" => node
                            .child_by_field_name("declarator")
                            .and_then(first_parameter),
                        "identifier" => self.callbacks.get(self.text(node)).copied(),
                        _ => None,
                    };
                }
                found.is_none()
            });
            found
        };
        let found = given.iter().skip(1).find_map(of);
        found.map_or_else(Vec::new, |kind| self.names.message(self.text(kind)))
    }
}

/// The namespace suggested by a node handle's name, if it is constructed elsewhere: `pnh`, `private_nh_`. The bag
/// verifies the guess, as only a topic of exactly this name counts.
fn namespace_hint(object: &str) -> &'static str {
    let name = object.to_lowercase();
    // `getPrivateNodeHandle()` is among them.
    let words = ["pnh", "private", "priv_n", "nhp", "nh_p"];
    if words.iter().any(|word| name.contains(word)) {
        "~"
    } else {
        ""
    }
}

// The client libraries.

/// The parts of a called name: `object.name<template>(…)`, `scope::name<template>(…)`.
#[derive(Clone, Copy, Default)]
struct Callee<'a> {
    name: &'a str,
    /// The object; empty without one.
    object: &'a str,
    /// The scope; empty without one.
    scope: &'a str,
    /// The first argument of the template; empty without one.
    template: &'a str,
}

impl<'a> Callee<'a> {
    fn of(parsed: &'a Parsed, call: Node<'a>) -> Self {
        let mut callee = Self::default();
        let Some(mut function) = call.child_by_field_name("function") else {
            return callee;
        };
        if function.kind() == "field_expression" {
            callee.object = parsed.field(function, "argument");
        }
        // Names inside names: `a::b::c<T>`, `object.c<T>`.
        for _ in 0..8 {
            let field = |name| function.child_by_field_name(name);
            let inner = match function.kind() {
                "field_expression" => field("field"),
                "qualified_identifier" => {
                    callee.scope = parsed.field(function, "scope");
                    field("name")
                }
                "template_function" | "template_method" => {
                    let first = field("arguments").and_then(|list| list.named_child(0));
                    callee.template = first.map_or("", |n| parsed.text(n));
                    field("name")
                }
                _ => None,
            };
            let Some(inner) = inner else { break };
            function = inner;
        }
        callee.name = parsed.text(function);
        callee
    }
}

/// The kind of object that a function creates.
fn by_function(callee: &Callee<'_>) -> Option<Made> {
    let has_type = !callee.template.is_empty();
    let is_transport = callee.scope.ends_with("image_transport");
    Some(match callee.name {
        "create_publisher" if is_transport => Made::ImagePublisher,
        "create_subscription" if is_transport => Made::Subscriber,
        "create_camera_publisher" | "advertiseCamera" => Made::CameraPublisher,
        "create_camera_subscription" | "subscribeCamera" => Made::CameraSubscriber,
        "create_publisher" | "advertise" if has_type => Made::Publisher,
        // Only image transport advertises without a type.
        "advertise" => Made::ImagePublisher,
        "create_subscription" => Made::Subscriber,
        "subscribe" if !callee.object.is_empty() => Made::Subscriber,
        "waitForMessage" if has_type => Made::Moment,
        "create_server" if callee.scope.ends_with("rclcpp_action") => Made::ActionServer2,
        "create_client" if callee.scope.ends_with("rclcpp_action") => Made::ActionClient2,
        _ => return None,
    })
}

/// The kind of object that constructing a variable of this type, or a pointer to it, creates, with its template's type.
fn by_constructor(kind: &str) -> Option<(Made, &str)> {
    let (before, inner) = kind.split_once('<')?;
    let inner = inner.trim().strip_suffix('>')?;
    let before = before.trim();
    let (scope, name) = before.rsplit_once("::").unwrap_or(("", before));
    match (unscoped(scope), name) {
        ("message_filters", "Subscriber") => Some((Made::Subscriber, inner)),
        ("realtime_tools", "RealtimePublisher") => Some((Made::Publisher, inner)),
        ("actionlib", "SimpleActionServer" | "ActionServer") => Some((Made::ActionServer1, inner)),
        ("actionlib", "SimpleActionClient" | "ActionClient") => Some((Made::ActionClient1, inner)),
        (_, "shared_ptr" | "unique_ptr" | "scoped_ptr") => by_constructor(inner),
        _ => None,
    }
}

/// The kind of object that a transform class creates.
fn made_by_transform(scope: &str, name: &str) -> Option<Made> {
    Some(match (scope, name) {
        ("tf" | "tf2_ros", "TransformBroadcaster") => Made::Broadcaster,
        ("tf2_ros", "StaticTransformBroadcaster") => Made::StaticBroadcaster,
        ("tf" | "tf2_ros", "TransformListener") => Made::Listener,
        _ => return None,
    })
}

/// Whether a class of this name writes bags.
fn is_recorder(name: &str, full: &str) -> bool {
    let full = full.trim_start_matches("::");
    matches!(name, "SequentialWriter" | "Recorder")
        || name == "Writer" && full.starts_with("rosbag2_cpp")
}

// The types of messages as C++ names them.

/// The alias names in a file.
#[derive(Default)]
struct Aliases {
    aliases: BTreeMap<String, String>,
    /// Namespaces that are opened by `using namespace`.
    open: Vec<String>,
}

/// The most steps from alias to alias that are followed, as aliases may be circular: code in use takes two.
const DEEPEST: usize = 8;

impl Aliases {
    /// Adds an element that defines a name.
    fn look(&mut self, parsed: &Parsed, node: Node<'_>) {
        let text = |node: Node<'_>| parsed.text(node).trim().to_owned();
        let field = |name| node.child_by_field_name(name).map(text);
        match node.kind() {
            "using_declaration" => {
                let Some(name) = children(node).first().map(|n| text(*n)) else {
                    return;
                };
                if parsed.text(node).split_whitespace().nth(1) == Some("namespace") {
                    self.open.push(name);
                } else if let Some((_, last)) = name.rsplit_once("::") {
                    self.aliases.insert(last.to_owned(), name.clone());
                }
            }
            "alias_declaration" => self.alias(field("name"), field("type")),
            "type_definition" => self.alias(field("declarator"), field("type")),
            _ => self.alias(field("name"), children(node).last().map(|n| text(*n))),
        }
    }

    fn alias(&mut self, name: Option<String>, stands_for: Option<String>) {
        if let (Some(name), Some(stands_for)) = (name, stands_for)
            && name != stands_for
        {
            self.aliases.insert(name, stands_for);
        }
    }

    /// The types that a name may refer to, as `package/Name`.
    fn types(&self, name: &str) -> Vec<String> {
        let mut full = bare(name).to_owned();
        for _ in 0..DEEPEST {
            let first = full.split("::").next().unwrap_or_default();
            let Some(known) = self.aliases.get(first) else {
                break;
            };
            full = format!("{}{}", bare(known), &full[first.len()..]);
            if full.len() > 300 {
                return Vec::new();
            }
        }
        if full.contains("::") {
            return type_of(full.split("::")).into_iter().collect();
        }
        let is_of_std = |space: &str| space.starts_with("std") && !space.starts_with("std_");
        let open = self.open.iter().filter(|space| !is_of_std(space));
        let in_open = |space: &String| type_of(space.split("::").chain([full.as_str()]));
        open.filter_map(in_open).collect()
    }

    /// The types of a message that a callback takes: `sensor_msgs::ImageConstPtr`, `std::shared_ptr<const T>`,
    /// `T::SharedPtr`, `T`.
    fn message(&self, parameter: &str) -> Vec<String> {
        let mut name = bare(parameter);
        while let Some((outer, inner)) = name.split_once('<') {
            let wrappers = ["shared_ptr", "unique_ptr", "MessageEvent"];
            let is_wrapper = wrappers.iter().any(|end| outer.trim().ends_with(end));
            match inner.trim().strip_suffix('>').filter(|_| is_wrapper) {
                Some(inner) => name = bare(inner),
                None => return Vec::new(),
            }
        }
        let cut = POINTERS.split(' ').find_map(|end| name.strip_suffix(end));
        self.types(cut.unwrap_or(name))
    }
}

/// The ends of the names of pointers to messages.
const POINTERS: &str = "::ConstSharedPtr ::SharedPtr ::UniquePtr ::ConstPtr ::Ptr ConstPtr Ptr";

/// A name without the scopes before it.
fn unscoped(name: &str) -> &str {
    name.rsplit("::").next().unwrap_or_default()
}

/// A type without `const`, references and leading colons.
fn bare(name: &str) -> &str {
    let name = name.trim().trim_end_matches(['&', '*', ' ']);
    let name = name.strip_prefix("const ").unwrap_or(name);
    let name = name.strip_suffix(" const").unwrap_or(name);
    let name = name.trim().strip_prefix("typename ").unwrap_or(name.trim());
    name.trim_start_matches("::").trim()
}

// The texts of expressions.

impl<'a> CppReader<'a> {
    fn literal(&self, node: Node<'a>) -> String {
        let parts = children(node).into_iter();
        parts.map(|part| self.text(part)).collect()
    }

    fn string(&self, node: Node<'a>) -> Option<String> {
        self.string_at(node, 0).filter(|text| text.len() <= LONGEST)
    }

    /// The text of an expression, if known.
    fn string_at(&self, node: Node<'a>, depth: usize) -> Option<String> {
        self.texts.evaluate(depth)?;
        let again = |node| {
            self.string_at(node, depth + 1)
                .filter(|text| text.len() <= LONGEST)
        };
        match node.kind() {
            "string_literal" => Some(self.literal(node)),
            "preproc_arg" => {
                let text = self.text(node).trim();
                text.strip_prefix('"')?.strip_suffix('"').map(str::to_owned)
            }
            "concatenated_string" => children(node).into_iter().map(again).collect(),
            "parenthesized_expression" => again(node.named_child(0)?),
            // `std::string topic{"x"}`
            "initializer_list" | "argument_list" if node.named_child_count() == 1 => {
                again(node.named_child(0)?)
            }
            "identifier" | "field_identifier" => again(self.texts.get(self.text(node))?),
            "field_expression" => again(self.texts.get(self.field(node, "field"))?),
            "binary_expression" if self.field(node, "operator") == "+" => {
                let [left, right] = fields(node, ["left", "right"])?;
                Some(again(left)? + &again(right)?)
            }
            "call_expression" => {
                let callee = Callee::of(self.parsed, node);
                let given = arguments(node);
                match callee.name {
                    "string" | "as_string" | "c_str" if given.is_empty() => again(
                        node.child_by_field_name("function")?
                            .child_by_field_name("argument")?,
                    ),
                    "string" => again(*given.first()?),
                    "declare_parameter" | "param" => again(*given.get(1)?),
                    "get_parameter" => {
                        let name = again(*given.first()?)?;
                        again(self.texts.parameter(&name)?)
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;
