//! Declarations in C++ code: rclcpp and roscpp, actions, message filters, image transport, transforms.
//!
//! Macros are not expanded and headers not included: a single file is nearly always sufficient.

mod look;
mod made;
mod names;
mod take;
mod text;

use std::collections::BTreeMap;

use super::declaration::{Class, Classes, FileCode};
use super::texts::TextValues;
use crate::evidence::syntax::{Language, Node, Parsed, line, walk};
use names::Aliases;

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
                let mut scopes = self.text(name).rsplit("::");
                scopes
                    .nth(1)
                    .map(|class| class.split('<').next().unwrap_or_default().trim())
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

#[cfg(test)]
mod tests;
