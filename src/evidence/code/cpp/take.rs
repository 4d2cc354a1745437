//! Second pass over a C++ file: the calls and variables that create publishers, subscribers and nodes.

use super::super::declaration::{Call, Made, short};
use super::CppReader;
use super::look::first_parameter;
use super::made::{self, Callee, by_constructor, by_function, is_recorder};
use super::names::unscoped;
use crate::evidence::syntax::{Node, arguments, children, line, walk};

impl<'a> CppReader<'a> {
    /// Second pass: calls and variables that create publishers, subscribers and nodes.
    pub(super) fn take(&mut self, node: Node<'a>) {
        match node.kind() {
            "call_expression" => self.call(node),
            "field_initializer" => self.initializer(node),
            "init_declarator" => {
                let kind = node.parent().and_then(|p| p.child_by_field_name("type"));
                let given = node
                    .child_by_field_name("value")
                    .filter(|v| ["argument_list", "initializer_list"].contains(&v.kind()));
                if let (Some(kind), Some(given)) = (kind, given) {
                    self.constructed(node, kind, given);
                }
            }
            "field_declaration" => {
                let given = node
                    .child_by_field_name("default_value")
                    .filter(|v| v.kind() == "initializer_list");
                if let (Some(kind), Some(given)) = (node.child_by_field_name("type"), given) {
                    self.constructed(node, kind, given);
                }
            }
            "type_identifier" => {
                let name = self.text(node);
                self.classes.current().is_recorder |=
                    is_recorder(name, node.parent().map_or("", |p| self.text(p)));
                self.transform(node, name);
                self.classes
                    .current()
                    .mentions
                    .entry(name.to_owned())
                    .or_insert(None);
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

    pub(super) fn call(&mut self, node: Node<'a>) {
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
        if let ("subscribe", Some(kind)) = (callee.name, self.members.get(callee.object))
            && let Some((made, inner)) = by_constructor(self.text(*kind))
        {
            let types = self.names.types(inner);
            self.declare(node, made, &given, types, "");
        } else if let Some(made) = by_function(&callee) {
            let types = match callee.template {
                "" => self.callback_type(&given),
                template => self.names.types(template),
            };
            let space = self
                .handles
                .get(callee.object)
                .cloned()
                .unwrap_or_else(|| namespace_hint(callee.object).to_owned());
            self.declare(node, made, &given, types, &space);
        } else if let ("make_shared" | "make_unique", template) = (callee.name, callee.template)
            && let Some((made, inner)) = by_constructor(template)
        {
            let types = self.names.types(inner);
            self.declare(node, made, &given, types, "");
        }
    }

    /// A member initializer: `sub_(nh_, "topic", 1)`, `Node("name")`.
    pub(super) fn initializer(&mut self, node: Node<'a>) {
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
    pub(super) fn constructed(&mut self, node: Node<'a>, kind: Node<'a>, given: Node<'a>) {
        let given = children(given);
        let kind = self.text(kind);
        if kind.ends_with("rclcpp::Node") {
            let name = given.first().and_then(|n| self.string(*n));
            self.classes.current().node_names.extend(name);
        }
        if let Some((made, inner)) = by_constructor(kind) {
            let types = self.names.types(inner);
            let space = given
                .first()
                .and_then(|n| self.handles.get(self.text(*n)))
                .cloned()
                .unwrap_or_default();
            self.declare(node, made, &given, types, &space);
        }
    }

    /// A broadcaster or listener of transforms, once per class: it needs no topic.
    pub(super) fn transform(&mut self, node: Node<'a>, name: &'a str) {
        let scope = node.parent().map_or("", |p| self.field(p, "scope"));
        let Some(made) = made::transform(scope, name) else {
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
            if !class
                .declarations
                .iter()
                .any(|d| (d.role, &d.topic) == (declaration.role, &declaration.topic))
            {
                class.declarations.push(declaration);
            }
        }
    }

    pub(super) fn declare(
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
        self.classes
            .current()
            .declarations
            .extend(call.declarations());
    }

    /// The message type of a callback among the arguments.
    pub(super) fn callback_type(&self, given: &[Node<'a>]) -> Vec<String> {
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
    let is_private = ["pnh", "private", "priv_n", "nhp", "nh_p"]
        .iter()
        .any(|word| name.contains(word));
    if is_private || name.starts_with("getprivatenodehandle") {
        "~"
    } else {
        ""
    }
}
