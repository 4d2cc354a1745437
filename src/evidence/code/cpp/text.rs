//! The texts of C++ expressions: literals, constants, members, defaults of parameters.

use super::super::texts::LONGEST;
use super::CppReader;
use super::made::Callee;
use crate::evidence::syntax::{Node, arguments, children};

impl<'a> CppReader<'a> {
    pub(super) fn literal(&self, node: Node<'a>) -> String {
        children(node)
            .into_iter()
            .map(|part| self.text(part))
            .collect()
    }

    pub(super) fn string(&self, node: Node<'a>) -> Option<String> {
        self.string_at(node, 0).filter(|text| text.len() <= LONGEST)
    }

    /// The text of an expression, if known.
    pub(super) fn string_at(&self, node: Node<'a>, depth: usize) -> Option<String> {
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
                let sides = ["left", "right"].map(|side| node.child_by_field_name(side));
                Some(again(sides[0]?)? + &again(sides[1]?)?)
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
