//! Source text as a syntax tree: the only user of tree-sitter, which continues after invalid text.

pub(crate) use tree_sitter::Node;

use std::ops::ControlFlow;

/// The language of a source file.
#[derive(Clone, Copy)]
pub(crate) enum Language {
    Python,
    Cpp,
}

/// A source text with its tree.
pub(crate) struct Parsed {
    pub(crate) text: String,
    tree: tree_sitter::Tree,
}

/// The most progress callbacks of the parser (one every hundred steps) per byte of text: usual text needs a
/// hundredth of them. Parsing of maliciously slow text is abandoned, by counting work instead of time.
const BREATHS_PER_BYTE: usize = 4;

/// The deepest nesting of elements that is visited: real code stays below a hundred, and readers keep a class per level.
const DEEPEST: usize = 400;

impl Parsed {
    /// Parses a text; `None` for one that takes too long.
    pub(crate) fn new(language: Language, text: String) -> Option<Self> {
        let grammar = match language {
            Language::Python => tree_sitter_python::LANGUAGE.into(),
            Language::Cpp => tree_sitter_cpp::LANGUAGE.into(),
        };
        let mut parser = tree_sitter::Parser::new();
        parser.set_language(&grammar).ok()?;
        let mut breaths = text.len().saturating_mul(BREATHS_PER_BYTE) + 1000;
        let mut bound = |_: &tree_sitter::ParseState| {
            breaths = breaths.saturating_sub(1);
            if breaths == 0 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let options = tree_sitter::ParseOptions::new().progress_callback(&mut bound);
        let bytes = text.as_bytes();
        let mut read = |at: usize, _| bytes.get(at..).unwrap_or_default();
        let tree = parser.parse_with_options(&mut read, None, Some(options))?;
        Some(Self { text, tree })
    }

    /// The whole file.
    pub(crate) fn root(&self) -> Node<'_> {
        self.tree.root_node()
    }

    /// The text of an element.
    pub(crate) fn text(&self, node: Node<'_>) -> &str {
        self.text.get(node.byte_range()).unwrap_or_default()
    }

    /// The text of a field of an element; empty without one.
    pub(crate) fn field(&self, node: Node<'_>, name: &str) -> &str {
        node.child_by_field_name(name).map_or("", |n| self.text(n))
    }
}

/// The line on which an element begins, ≥ 1.
pub(crate) fn line(node: Node<'_>) -> usize {
    node.start_position().row + 1
}

/// The child elements, in order, without punctuation and comments.
pub(crate) fn children(node: Node<'_>) -> Vec<Node<'_>> {
    let mut cursor = node.walk();
    let all = node.named_children(&mut cursor);
    all.filter(|child| !child.is_extra()).collect()
}

/// These fields of an element; `None` unless it has all of them.
pub(crate) fn fields<'a, const N: usize>(
    node: Node<'a>,
    names: [&str; N],
) -> Option<[Node<'a>; N]> {
    let mut found = [node; N];
    for (field, name) in found.iter_mut().zip(names) {
        *field = node.child_by_field_name(name)?;
    }
    Some(found)
}

/// The arguments of a call.
pub(crate) fn arguments(call: Node<'_>) -> Vec<Node<'_>> {
    let list = call.child_by_field_name("arguments");
    list.map(children).unwrap_or_default()
}

/// Visits an element and all inside it, in order, without recursion; `visit` returns whether to go inside.
pub(crate) fn walk<'a>(node: Node<'a>, visit: &mut dyn FnMut(Node<'a>) -> bool) {
    let mut cursor = node.walk();
    let mut depth = 0;
    loop {
        let inside = visit(cursor.node()) && depth < DEEPEST;
        if inside && cursor.goto_first_child() {
            depth += 1;
            continue;
        }
        while !cursor.goto_next_sibling() {
            if depth == 0 || !cursor.goto_parent() {
                return;
            }
            depth -= 1;
        }
        if depth == 0 {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_text_does_not_affect_text_around_it() {
        let parsed = Parsed::new(
            Language::Python,
            "a = f(1)\n)) print 'x'\nb = g(2)\n".into(),
        );
        let parsed = parsed.unwrap();
        let mut calls = Vec::new();
        walk(parsed.root(), &mut |node| {
            if node.kind() == "call" {
                calls.push((parsed.text(node).to_owned(), line(node)));
            }
            true
        });
        assert!(
            calls.contains(&("f(1)".into(), 1)) && calls.contains(&("g(2)".into(), 3)),
            "{calls:?}"
        );
    }

    #[test]
    fn unbounded_nesting_is_refused() {
        for language in [Language::Python, Language::Cpp] {
            let deep = "(".repeat(200_000);
            if let Some(parsed) = Parsed::new(language, deep) {
                let mut seen = 0_usize;
                walk(parsed.root(), &mut |_| {
                    seen += 1;
                    true
                });
                assert!(seen > 0);
            }
        }
    }
}
