//! The types of messages as C++ names them: with namespaces, aliases, and the pointers that callbacks take.

use std::collections::BTreeMap;

use super::super::declaration::type_of;
use crate::evidence::syntax::{Node, Parsed, children};

/// The alias names in a file.
#[derive(Debug, Default)]
pub(super) struct Aliases {
    aliases: BTreeMap<String, String>,
    /// Namespaces that are opened by `using namespace`.
    open: Vec<String>,
}

/// The most steps from alias to alias that are followed.
const DEEPEST: usize = 8;

impl Aliases {
    /// Adds an element that defines a name.
    pub(super) fn look(&mut self, parsed: &Parsed, node: Node<'_>) {
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
    pub(super) fn types(&self, name: &str) -> Vec<String> {
        let mut full = bare(name).to_owned();
        for _ in 0..DEEPEST {
            let (first, rest) = full
                .split_once("::")
                .map_or((full.as_str(), None), |(a, b)| (a, Some(b)));
            match (self.aliases.get(first), rest) {
                (Some(known), Some(rest)) => full = format!("{}::{rest}", bare(known)),
                (Some(known), None) => full = bare(known).to_owned(),
                (None, _) => break,
            }
            if full.len() > 300 {
                return Vec::new();
            }
        }
        if full.contains("::") {
            return type_of(&full.split("::").collect::<Vec<_>>())
                .into_iter()
                .collect();
        }
        let in_open =
            |space: &String| type_of(&space.split("::").chain([full.as_str()]).collect::<Vec<_>>());
        self.open
            .iter()
            .filter(|space| !space.starts_with("std") || space.starts_with("std_"))
            .filter_map(in_open)
            .collect()
    }

    /// The types of a message that a callback takes: `sensor_msgs::ImageConstPtr`, `std::shared_ptr<const T>`,
    /// `T::SharedPtr`, `T`.
    pub(super) fn message(&self, parameter: &str) -> Vec<String> {
        let mut name = bare(parameter);
        while let Some((outer, inner)) = name.split_once('<') {
            let is_wrapper = ["shared_ptr", "unique_ptr", "MessageEvent"]
                .iter()
                .any(|w| outer.trim().ends_with(w));
            match inner.trim().strip_suffix('>').filter(|_| is_wrapper) {
                Some(inner) => name = bare(inner),
                None => return Vec::new(),
            }
        }
        let pointers = [
            "::ConstSharedPtr",
            "::SharedPtr",
            "::UniquePtr",
            "::ConstPtr",
            "::Ptr",
            "ConstPtr",
            "Ptr",
        ];
        let cut = pointers.iter().find_map(|end| name.strip_suffix(end));
        self.types(cut.unwrap_or(name))
    }
}

/// A name without the scopes before it.
pub(super) fn unscoped(name: &str) -> &str {
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
