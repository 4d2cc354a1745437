//! Evaluates a launch file's statements statically: assignments, literal lists, loops over them, functions of the file.
//! If a condition is unknown, both branches are followed and their results marked as undecided.

use std::collections::BTreeMap;

use super::super::substitution::LONGEST;
use super::value::{DEEPEST, PythonValue};
use crate::base::budget::LaunchWork;
use crate::evidence::syntax::{Node, Parsed, children, line};

/// The deepest nesting of expressions and calls that is followed.
const NESTED: usize = 120;

/// The cost of one step, in bytes of work.
const STEP: usize = 16;

pub(super) struct Evaluator<'a> {
    pub(super) parsed: &'a Parsed,
    frames: Vec<Locals>,
    functions: BTreeMap<String, Node<'a>>,
    pub(super) budget: LaunchWork,
    /// The number of enclosing unknown conditions.
    pub(super) undecided: usize,
    nested: usize,
}

/// The variables of a function that is being followed.
#[derive(Default)]
struct Locals {
    names: BTreeMap<String, PythonValue>,
    returned: Option<PythonValue>,
    /// The value of `undecided` where the function was called.
    undecided: usize,
}

/// The continuation after a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ControlFlow {
    Next,
    Done,
}

impl<'a> Evaluator<'a> {
    pub(super) fn new(parsed: &'a Parsed, names: BTreeMap<String, PythonValue>) -> Self {
        let global = Locals {
            names,
            ..Locals::default()
        };
        Self {
            parsed,
            frames: vec![global],
            functions: BTreeMap::new(),
            budget: LaunchWork::of_text(parsed.text.len()),
            undecided: 0,
            nested: 0,
        }
    }

    /// The return value of `generate_launch_description`; `None` if there is no such function.
    pub(super) fn launch_description(&mut self) -> Option<PythonValue> {
        self.run(self.parsed.root());
        let function = *self.functions.get("generate_launch_description")?;
        Some(self.call(function, &[], &[]))
    }

    /// The value of the file's only expression; `None` if there is none or it is unknown.
    pub(super) fn whole(&mut self) -> Option<PythonValue> {
        let statement = children(self.parsed.root());
        let expression = statement.first().and_then(|s| s.named_child(0))?;
        if self.parsed.root().has_error() || statement.len() != 1 {
            return None;
        }
        Some(self.value(expression)).filter(|value| !matches!(value, PythonValue::Unknown(_)))
    }

    pub(super) fn text(&self, node: Node<'_>) -> &'a str {
        self.parsed.text(node)
    }

    /// Returns a new value, or unknown if it is too large, too deep or exceeds the budget.
    pub(super) fn kept(&mut self, value: PythonValue, at: Node<'_>) -> PythonValue {
        let (size, depth) = value.measure();
        let is_small =
            depth <= DEEPEST && !matches!(&value, PythonValue::Text(text) if text.len() > LONGEST);
        match self.budget.spend(size) {
            Some(()) if is_small => value,
            _ => PythonValue::Unknown(line(at)),
        }
    }

    fn run(&mut self, block: Node<'a>) -> ControlFlow {
        for statement in children(block) {
            if self.statement(statement) == ControlFlow::Done {
                return ControlFlow::Done;
            }
        }
        ControlFlow::Next
    }

    fn statement(&mut self, node: Node<'a>) -> ControlFlow {
        if self.budget.spend(STEP).is_none() || self.nested > NESTED {
            return ControlFlow::Done;
        }
        self.nested += 1;
        let flow = match node.kind() {
            "expression_statement" => {
                for expression in children(node) {
                    self.effect(expression);
                }
                ControlFlow::Next
            }
            "function_definition" => {
                if let Some(name) = node.child_by_field_name("name") {
                    self.functions.insert(self.text(name).to_owned(), node);
                }
                ControlFlow::Next
            }
            "decorated_definition" => {
                let definition = node.child_by_field_name("definition");
                definition.map_or(ControlFlow::Next, |inner| self.statement(inner))
            }
            "return_statement" => self.returns(node),
            "if_statement" => self.branches(node),
            "for_statement" => self.repeats(node),
            "with_statement" | "try_statement" => {
                let body = node.child_by_field_name("body");
                body.map_or(ControlFlow::Next, |body| self.run(body))
            }
            _ => ControlFlow::Next,
        };
        self.nested -= 1;
        flow
    }

    fn returns(&mut self, node: Node<'a>) -> ControlFlow {
        let value = node
            .named_child(0)
            .map_or(PythonValue::None, |n| self.value(n));
        let undecided = self.undecided;
        let Some(frame) = self.frames.last_mut() else {
            return ControlFlow::Done;
        };
        let is_sure = undecided == frame.undecided;
        frame.returned = Some(match (frame.returned.take(), value) {
            (None, value) if is_sure || value.acts() => value,
            (Some(PythonValue::List(mut before)), after) if after.acts() => {
                before.push(after);
                PythonValue::List(before)
            }
            (Some(before), after) if before.acts() && after.acts() => {
                PythonValue::List(vec![before, after])
            }
            _ => PythonValue::Unknown(line(node)),
        });
        if is_sure {
            ControlFlow::Done
        } else {
            ControlFlow::Next
        }
    }

    fn branches(&mut self, node: Node<'a>) -> ControlFlow {
        let mut cursor = node.walk();
        let others: Vec<Node<'a>> = node
            .children_by_field_name("alternative", &mut cursor)
            .collect();
        let mut sure = true;
        let mut flow = ControlFlow::Next;
        for part in std::iter::once(node).chain(others) {
            let truth = match part.child_by_field_name("condition") {
                Some(condition) => self.value(condition).truth(),
                None => Some(true),
            };
            let body = part
                .child_by_field_name("consequence")
                .or(part.child_by_field_name("body"));
            let Some(body) = body.filter(|_| truth != Some(false)) else {
                continue;
            };
            sure &= truth.is_some();
            self.undecided += usize::from(!sure);
            flow = self.run(body);
            self.undecided -= usize::from(!sure);
            if truth == Some(true) {
                break;
            }
        }
        if sure { flow } else { ControlFlow::Next }
    }

    fn repeats(&mut self, node: Node<'a>) -> ControlFlow {
        let fields = ["left", "right", "body"].map(|name| node.child_by_field_name(name));
        let [Some(left), Some(right), Some(body)] = fields else {
            return ControlFlow::Next;
        };
        for item in self.items(right) {
            self.assign(left, item);
            if self.run(body) == ControlFlow::Done {
                return ControlFlow::Done;
            }
        }
        ControlFlow::Next
    }

    /// The items of a loop, as far as known.
    pub(super) fn items(&mut self, node: Node<'a>) -> Vec<PythonValue> {
        match self.value(node) {
            PythonValue::List(list) => list,
            PythonValue::Dict(map) => map
                .into_iter()
                .map(|(key, _)| PythonValue::Text(key))
                .collect(),
            _ => vec![PythonValue::Unknown(line(node))],
        }
    }

    /// An expression statement: an assignment, or a call that changes a list.
    fn effect(&mut self, node: Node<'a>) {
        let side = |name| node.child_by_field_name(name);
        match (node.kind(), side("left"), side("right")) {
            ("assignment", Some(left), Some(right)) => {
                let value = self.value(right);
                self.assign(left, value);
            }
            ("augmented_assignment", Some(left), Some(right)) => {
                let (before, more) = (self.value(left), self.value(right));
                let sum = self.sum(before, more, node);
                self.assign(left, sum);
            }
            ("call", ..) => {
                self.value(node);
            }
            _ => {}
        }
    }

    pub(super) fn assign(&mut self, target: Node<'a>, value: PythonValue) {
        match (target.kind(), value) {
            ("identifier", value) => {
                let name = self.text(target).to_owned();
                let sure = self
                    .frames
                    .last()
                    .is_some_and(|f| f.undecided == self.undecided);
                let value = if sure || value.acts() {
                    value
                } else {
                    PythonValue::Unknown(line(target))
                };
                if let Some(frame) = self.frames.last_mut() {
                    frame.names.insert(name, value);
                }
            }
            ("pattern_list" | "tuple_pattern", PythonValue::List(parts)) => {
                for (target, part) in children(target).into_iter().zip(parts) {
                    self.assign(target, part);
                }
            }
            ("pattern_list" | "tuple_pattern", _) => {
                for target in children(target) {
                    self.assign(target, PythonValue::Unknown(line(target)));
                }
            }
            ("subscript", value) => self.put(target, value),
            _ => {}
        }
    }

    /// `map['key'] = value`
    fn put(&mut self, target: Node<'a>, value: PythonValue) {
        let part = |name| target.child_by_field_name(name);
        let (Some(map), Some(key)) = (part("value"), part("subscript")) else {
            return;
        };
        let key = self.value(key).text();
        if let (Some(PythonValue::Dict(entries)), Some(key)) = (self.variable(map), key) {
            entries.retain(|(known, _)| *known != key);
            entries.push((key, value));
        }
    }

    /// The variable of a name, to be changed.
    pub(super) fn variable(&mut self, node: Node<'a>) -> Option<&mut PythonValue> {
        let name = self.parsed.text(node);
        let frames = self.frames.iter_mut().rev();
        frames
            .filter(|_| node.kind() == "identifier")
            .find_map(|f| f.names.get_mut(name))
    }

    /// A copy of the value of a name.
    pub(super) fn named(&mut self, node: Node<'a>) -> PythonValue {
        self.lookup(self.text(node), node)
    }

    /// A copy of the value of a name at `node`.
    pub(super) fn lookup(&mut self, name: &str, node: Node<'a>) -> PythonValue {
        let found = self.frames.iter().rev().find_map(|f| f.names.get(name));
        match found {
            Some(value) => {
                let value = value.clone();
                self.kept(value, node)
            }
            None if self.functions.contains_key(name) => PythonValue::Function(name.to_owned()),
            None if name == "true" => PythonValue::Bool(true),
            None if name == "false" => PythonValue::Bool(false),
            None => PythonValue::Unknown(line(node)),
        }
    }

    /// A function of this file by its name.
    pub(super) fn function(&self, name: &str) -> Option<Node<'a>> {
        self.functions.get(name).copied()
    }

    /// The return value of a function of this file.
    pub(super) fn call(
        &mut self,
        function: Node<'a>,
        positional: &[PythonValue],
        named: &[(String, PythonValue)],
    ) -> PythonValue {
        let parts = ["parameters", "body"].map(|name| function.child_by_field_name(name));
        let [Some(parameters), Some(body)] = parts else {
            return PythonValue::Unknown(line(function));
        };
        if self.nested > NESTED {
            return PythonValue::Unknown(line(function));
        }
        let mut frame = Locals {
            undecided: self.undecided,
            ..Locals::default()
        };
        for (at, parameter) in children(parameters).into_iter().enumerate() {
            let name = parameter
                .child_by_field_name("name")
                .or(match parameter.kind() {
                    "identifier" => Some(parameter),
                    _ => parameter.named_child(0),
                });
            let name = name.map_or("", |n| self.text(n)).to_owned();
            let given = named.iter().find(|(n, _)| *n == name).map(|(_, v)| v);
            let given = given.or(positional.get(at)).cloned();
            let default = parameter.child_by_field_name("value");
            let value = given.or_else(|| default.map(|d| self.value(d)));
            frame
                .names
                .insert(name, value.unwrap_or(PythonValue::Unknown(line(parameter))));
        }
        self.frames.push(frame);
        self.nested += 1;
        self.run(body);
        self.nested -= 1;
        let frame = self.frames.pop();
        frame.and_then(|f| f.returned).unwrap_or(PythonValue::None)
    }

    /// The value of an expression.
    pub(super) fn value(&mut self, node: Node<'a>) -> PythonValue {
        if self.nested > NESTED || self.budget.spend(STEP).is_none() {
            return PythonValue::Unknown(line(node));
        }
        self.nested += 1;
        let value = self.expression(node);
        self.nested -= 1;
        value
    }
}
