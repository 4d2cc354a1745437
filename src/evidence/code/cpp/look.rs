//! First pass over a C++ file: its classes, the names of its types, and the values of its variables.

use super::CppReader;
use super::made::Callee;
use super::names::unscoped;
use crate::evidence::syntax::{Node, arguments, children, line};

impl<'a> CppReader<'a> {
    /// First pass: classes, names of types, and values of variables.
    pub(super) fn look(&mut self, node: Node<'a>) {
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
                    && let Some(first) = given
                        .named_child(0)
                        .filter(|n| n.kind() == "string_literal")
                {
                    self.handles
                        .insert(self.text(name).to_owned(), self.literal(first));
                }
            }
            "function_declarator" => self.callback(node),
            "call_expression" => self.parameter(node),
            _ => {}
        }
    }

    pub(super) fn define(&mut self, node: Node<'a>) {
        let clause = children(node)
            .into_iter()
            .find(|c| c.kind() == "base_class_clause");
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
    pub(super) fn set(&mut self, node: Node<'a>, name: &str, value: &str) {
        let sides = [name, value].map(|side| node.child_by_field_name(side));
        if let [Some(name), Some(value)] = sides {
            let name = self
                .text(name)
                .trim_end_matches("[]")
                .trim_start_matches(['*', '&']);
            self.texts.set(name.trim_start_matches("this->"), value);
        }
    }

    /// `ros::NodeHandle pnh("~");`
    pub(super) fn handle(&mut self, node: Node<'a>) {
        let is_handle = node
            .parent()
            .is_some_and(|p| self.field(p, "type").contains("NodeHandle"));
        let given = node.child_by_field_name("value").filter(|_| is_handle);
        let Some(given) = given else {
            return;
        };
        let name = self
            .field(node, "declarator")
            .trim_start_matches(['*', '&'])
            .to_owned();
        let written = self.text(given);
        if written.contains("getPrivateNodeHandle") || written.contains("getMTPrivateNodeHandle") {
            self.handles.insert(name, "~".to_owned());
            return;
        }
        let mut texts = children(given)
            .into_iter()
            .filter(|n| n.kind() == "string_literal");
        if let Some(text) = texts.next_back() {
            let below = children(given)
                .first()
                .and_then(|first| self.handles.get(self.text(*first)));
            let below = below.map_or(String::new(), |space| format!("{space}/"));
            self.handles.insert(name, below + &self.literal(text));
        }
    }

    /// `pnh_ = ros::NodeHandle("~");`, `pnh_ = getPrivateNodeHandle();`
    pub(super) fn handle_given(&mut self, node: Node<'a>) {
        let (name, value) = (self.field(node, "left"), self.field(node, "right"));
        let is_private = value.contains("getPrivateNodeHandle")
            || value.contains("getMTPrivateNodeHandle")
            || value.contains("NodeHandle(\"~\")");
        if is_private {
            self.handles.insert(name.to_owned(), "~".to_owned());
        }
    }

    pub(super) fn member(&mut self, node: Node<'a>) {
        let parts = ["type", "declarator"].map(|name| node.child_by_field_name(name));
        if let [Some(kind), Some(mut declarator)] = parts {
            while let Some(inner) = declarator.child_by_field_name("declarator") {
                declarator = inner;
            }
            self.members.insert(
                self.text(declarator)
                    .trim_start_matches(['*', '&'])
                    .to_owned(),
                kind,
            );
        }
    }

    pub(super) fn callback(&mut self, node: Node<'a>) {
        let name = unscoped(self.field(node, "declarator"));
        if let Some(kind) = first_parameter(node) {
            self.callbacks.entry(name.to_owned()).or_insert(kind);
        }
    }

    /// `declare_parameter("topic", "default")`, `nh.param("topic", variable, "default")`
    pub(super) fn parameter(&mut self, node: Node<'a>) {
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
                if let Some(value) = self
                    .string(*name)
                    .and_then(|name| self.texts.parameter(&name))
                {
                    self.texts.set(self.text(*variable), value);
                }
            }
            _ => {}
        }
    }
}

/// The type of a function's first parameter.
pub(super) fn first_parameter(declarator: Node<'_>) -> Option<Node<'_>> {
    let parameters = declarator.child_by_field_name("parameters")?;
    children(parameters).first()?.child_by_field_name("type")
}
