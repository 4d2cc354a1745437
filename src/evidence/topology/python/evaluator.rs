//! Follows a launch file's statements without running anything: assignments, literal lists, loops over them, functions of
//! the file. Where a condition is not known both branches count, and what they make is marked as undecided.

use std::collections::BTreeMap;

use super::super::budget::Budget;
use super::super::substitution::LONGEST;
use super::value::{DEEPEST, Value};
use crate::evidence::syntax::{Node, Parsed, children, line};

/// Expressions and calls inside each other deeper than this are not followed.
const NESTED: usize = 120;

/// The work of one step, in the bytes that budgets count.
const STEP: usize = 16;

pub(super) struct Evaluator<'a> {
    pub(super) parsed: &'a Parsed,
    frames: Vec<Frame>,
    functions: BTreeMap<String, Node<'a>>,
    pub(super) budget: Budget,
    /// How many conditions that are not known stand around the statement.
    pub(super) undecided: usize,
    nested: usize,
}

/// The names of a function that is being followed.
#[derive(Default)]
struct Frame {
    names: BTreeMap<String, Value>,
    returned: Option<Value>,
    /// `undecided` where the function was called.
    undecided: usize,
}

/// What comes after a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flow {
    Next,
    Done,
}

impl<'a> Evaluator<'a> {
    pub(super) fn new(parsed: &'a Parsed, names: BTreeMap<String, Value>) -> Self {
        let global = Frame {
            names,
            ..Frame::default()
        };
        Self {
            parsed,
            frames: vec![global],
            functions: BTreeMap::new(),
            budget: Budget::default(),
            undecided: 0,
            nested: 0,
        }
    }

    /// What `generate_launch_description` returns; `None` if there is no such function.
    pub(super) fn launch_description(&mut self) -> Option<Value> {
        self.run(self.parsed.root());
        let function = *self.functions.get("generate_launch_description")?;
        Some(self.call(function, &[], &[]))
    }

    /// The value of the file's only expression; `None` where there is none or it is not known.
    pub(super) fn whole(&mut self) -> Option<Value> {
        let statement = children(self.parsed.root());
        let expression = statement.first().and_then(|s| s.named_child(0))?;
        if self.parsed.root().has_error() || statement.len() != 1 {
            return None;
        }
        Some(self.value(expression)).filter(|value| !matches!(value, Value::Unknown(_)))
    }

    pub(super) fn text(&self, node: Node<'_>) -> &'a str {
        self.parsed.text(node)
    }

    /// Keeps a new value, if it is neither too large nor too deep and there is room.
    pub(super) fn kept(&mut self, value: Value, at: Node<'_>) -> Value {
        let (size, depth) = value.measure();
        let is_small =
            depth <= DEEPEST && !matches!(&value, Value::Text(text) if text.len() > LONGEST);
        match self.budget.spend(size) {
            Some(()) if is_small => value,
            _ => Value::Unknown(line(at)),
        }
    }

    fn run(&mut self, block: Node<'a>) -> Flow {
        for statement in children(block) {
            if self.statement(statement) == Flow::Done {
                return Flow::Done;
            }
        }
        Flow::Next
    }

    fn statement(&mut self, node: Node<'a>) -> Flow {
        if self.budget.spend(STEP).is_none() || self.nested > NESTED {
            return Flow::Done;
        }
        self.nested += 1;
        let flow = match node.kind() {
            "expression_statement" => {
                for expression in children(node) {
                    self.effect(expression);
                }
                Flow::Next
            }
            "function_definition" => {
                if let Some(name) = node.child_by_field_name("name") {
                    self.functions.insert(self.text(name).to_owned(), node);
                }
                Flow::Next
            }
            "decorated_definition" => {
                let definition = node.child_by_field_name("definition");
                definition.map_or(Flow::Next, |inner| self.statement(inner))
            }
            "return_statement" => self.returns(node),
            "if_statement" => self.branches(node),
            "for_statement" => self.repeats(node),
            "with_statement" | "try_statement" => {
                let body = node.child_by_field_name("body");
                body.map_or(Flow::Next, |body| self.run(body))
            }
            _ => Flow::Next,
        };
        self.nested -= 1;
        flow
    }

    fn returns(&mut self, node: Node<'a>) -> Flow {
        let value = node.named_child(0).map_or(Value::None, |n| self.value(n));
        let undecided = self.undecided;
        let Some(frame) = self.frames.last_mut() else {
            return Flow::Done;
        };
        let is_sure = undecided == frame.undecided;
        frame.returned = Some(match (frame.returned.take(), value) {
            (None, value) if is_sure || value.acts() => value,
            (Some(Value::List(mut before)), after) if after.acts() => {
                before.push(after);
                Value::List(before)
            }
            (Some(before), after) if before.acts() && after.acts() => {
                Value::List(vec![before, after])
            }
            _ => Value::Unknown(line(node)),
        });
        if is_sure { Flow::Done } else { Flow::Next }
    }

    fn branches(&mut self, node: Node<'a>) -> Flow {
        let mut cursor = node.walk();
        let others: Vec<Node<'a>> = node
            .children_by_field_name("alternative", &mut cursor)
            .collect();
        let mut sure = true;
        let mut flow = Flow::Next;
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
        if sure { flow } else { Flow::Next }
    }

    fn repeats(&mut self, node: Node<'a>) -> Flow {
        let fields = ["left", "right", "body"].map(|name| node.child_by_field_name(name));
        let [Some(left), Some(right), Some(body)] = fields else {
            return Flow::Next;
        };
        for item in self.items(right) {
            self.assign(left, item);
            if self.run(body) == Flow::Done {
                return Flow::Done;
            }
        }
        Flow::Next
    }

    /// What a loop goes over, as far as it is known.
    pub(super) fn items(&mut self, node: Node<'a>) -> Vec<Value> {
        match self.value(node) {
            Value::List(list) => list,
            Value::Dict(map) => map.into_iter().map(|(key, _)| Value::Text(key)).collect(),
            _ => vec![Value::Unknown(line(node))],
        }
    }

    /// An expression that stands by itself: an assignment, a call that changes a list.
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

    pub(super) fn assign(&mut self, target: Node<'a>, value: Value) {
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
                    Value::Unknown(line(target))
                };
                if let Some(frame) = self.frames.last_mut() {
                    frame.names.insert(name, value);
                }
            }
            ("pattern_list" | "tuple_pattern", Value::List(parts)) => {
                for (target, part) in children(target).into_iter().zip(parts) {
                    self.assign(target, part);
                }
            }
            ("pattern_list" | "tuple_pattern", _) => {
                for target in children(target) {
                    self.assign(target, Value::Unknown(line(target)));
                }
            }
            ("subscript", value) => self.put(target, value),
            _ => {}
        }
    }

    /// `map['key'] = value`
    fn put(&mut self, target: Node<'a>, value: Value) {
        let part = |name| target.child_by_field_name(name);
        let (Some(map), Some(key)) = (part("value"), part("subscript")) else {
            return;
        };
        let key = self.value(key).text();
        if let (Some(Value::Dict(entries)), Some(key)) = (self.variable(map), key) {
            entries.retain(|(known, _)| *known != key);
            entries.push((key, value));
        }
    }

    /// The variable that a name stands for, to be changed.
    pub(super) fn variable(&mut self, node: Node<'a>) -> Option<&mut Value> {
        let name = self.parsed.text(node);
        let frames = self.frames.iter_mut().rev();
        frames
            .filter(|_| node.kind() == "identifier")
            .find_map(|f| f.names.get_mut(name))
    }

    /// A copy of the value of a name.
    pub(super) fn named(&mut self, node: Node<'a>) -> Value {
        self.lookup(self.text(node), node)
    }

    /// A copy of the value that a name stands for at `node`.
    pub(super) fn lookup(&mut self, name: &str, node: Node<'a>) -> Value {
        let found = self.frames.iter().rev().find_map(|f| f.names.get(name));
        match found {
            Some(value) => {
                let value = value.clone();
                self.kept(value, node)
            }
            None if self.functions.contains_key(name) => Value::Function(name.to_owned()),
            None if name == "true" => Value::Bool(true),
            None if name == "false" => Value::Bool(false),
            None => Value::Unknown(line(node)),
        }
    }

    /// A function of this file by its name.
    pub(super) fn function(&self, name: &str) -> Option<Node<'a>> {
        self.functions.get(name).copied()
    }

    /// What a function of this file returns.
    pub(super) fn call(
        &mut self,
        function: Node<'a>,
        positional: &[Value],
        named: &[(String, Value)],
    ) -> Value {
        let parts = ["parameters", "body"].map(|name| function.child_by_field_name(name));
        let [Some(parameters), Some(body)] = parts else {
            return Value::Unknown(line(function));
        };
        if self.nested > NESTED {
            return Value::Unknown(line(function));
        }
        let mut frame = Frame {
            undecided: self.undecided,
            ..Frame::default()
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
                .insert(name, value.unwrap_or(Value::Unknown(line(parameter))));
        }
        self.frames.push(frame);
        self.nested += 1;
        self.run(body);
        self.nested -= 1;
        let frame = self.frames.pop();
        frame.and_then(|f| f.returned).unwrap_or(Value::None)
    }

    /// The value of an expression.
    pub(super) fn value(&mut self, node: Node<'a>) -> Value {
        if self.nested > NESTED || self.budget.spend(STEP).is_none() {
            return Value::Unknown(line(node));
        }
        self.nested += 1;
        let value = self.expression(node);
        self.nested -= 1;
        value
    }

    fn expression(&mut self, node: Node<'a>) -> Value {
        let unknown = Value::Unknown(line(node));
        let field = |name| node.child_by_field_name(name);
        match node.kind() {
            "string" | "concatenated_string" => self.string(node),
            "integer" => self.text(node).parse().map_or(unknown, Value::Number),
            "float" => Value::Text(self.text(node).to_owned()),
            "true" => Value::Bool(true),
            "false" => Value::Bool(false),
            "none" => Value::None,
            "identifier" => self.constant(node),
            "parenthesized_expression" | "await" => {
                node.named_child(0).map_or(unknown, |n| self.value(n))
            }
            "list" | "tuple" | "set" | "expression_list" => self.list(node),
            "dictionary" => self.dictionary(node),
            "list_comprehension" | "generator_expression" => self.comprehension(node),
            "binary_operator" => self.binary(node),
            "boolean_operator" | "not_operator" | "comparison_operator" => self.logic(node),
            "conditional_expression" => self.choice(node),
            "subscript" => match (field("value"), field("subscript")) {
                (Some(value), Some(key)) => self.subscript(value, key),
                _ => unknown,
            },
            "attribute" => self.attribute(node),
            "call" => self.call_expression(node),
            _ => unknown,
        }
    }

    fn constant(&mut self, node: Node<'a>) -> Value {
        match self.text(node) {
            "__file__" => Value::Text("$(dirname)/launch.py".to_owned()),
            "__name__" => Value::Text("launch".to_owned()),
            _ => self.named(node),
        }
    }

    fn string(&mut self, node: Node<'a>) -> Value {
        let mut text = String::new();
        for part in children(node) {
            match part.kind() {
                "string_content" => text.push_str(self.text(part)),
                "string" => text.push_str(&self.string(part).launch_text()),
                "interpolation" => {
                    let inner = part
                        .child_by_field_name("expression")
                        .or(part.named_child(0));
                    let value = inner.map_or(Value::None, |n| self.value(n));
                    text.push_str(&value.launch_text());
                }
                _ => {}
            }
        }
        self.kept(Value::Text(text), node)
    }

    fn list(&mut self, node: Node<'a>) -> Value {
        let mut list = Vec::new();
        for part in children(node) {
            match (part.kind(), part.named_child(0)) {
                ("list_splat", Some(inner)) => list.extend(self.items(inner)),
                _ => list.push(self.value(part)),
            }
        }
        self.kept(Value::List(list), node)
    }

    fn dictionary(&mut self, node: Node<'a>) -> Value {
        let mut map: Vec<(String, Value)> = Vec::new();
        for pair in children(node) {
            let parts = ["key", "value"].map(|name| pair.child_by_field_name(name));
            if let [Some(key), Some(value)] = parts {
                let (key, value) = (self.value(key), self.value(value));
                map.push((key.launch_text(), value));
            }
        }
        self.kept(Value::Dict(map), node)
    }

    fn comprehension(&mut self, node: Node<'a>) -> Value {
        let parts = children(node);
        let [body, clause, ..] = parts[..] else {
            return Value::Unknown(line(node));
        };
        let sides = ["left", "right"].map(|name| clause.child_by_field_name(name));
        let ([Some(left), Some(right)], 2) = (sides, parts.len()) else {
            return Value::Unknown(line(node));
        };
        let mut list = Vec::new();
        for item in self.items(right) {
            self.assign(left, item);
            list.push(self.value(body));
        }
        self.kept(Value::List(list), node)
    }

    fn binary(&mut self, node: Node<'a>) -> Value {
        let fields = ["left", "operator", "right"].map(|name| node.child_by_field_name(name));
        let [Some(left), Some(operator), Some(right)] = fields else {
            return Value::Unknown(line(node));
        };
        let (left, right) = (self.value(left), self.value(right));
        match self.text(operator) {
            "+" => self.sum(left, right, node),
            "%" => self.formatted(&left, &right, node),
            // `Path(…) / 'x'`
            "/" => self.kept(
                Value::Text(format!("{}/{}", left.launch_text(), right.launch_text())),
                node,
            ),
            sign => match (sign, left, right) {
                ("-", Value::Number(a), Value::Number(b)) => a
                    .checked_sub(b)
                    .map_or(Value::Unknown(line(node)), Value::Number),
                ("*", Value::Number(a), Value::Number(b)) => a
                    .checked_mul(b)
                    .map_or(Value::Unknown(line(node)), Value::Number),
                _ => Value::Unknown(line(node)),
            },
        }
    }

    pub(super) fn sum(&mut self, left: Value, right: Value, at: Node<'a>) -> Value {
        let sum = match (left, right) {
            (Value::Number(a), Value::Number(b)) => a
                .checked_add(b)
                .map_or(Value::Unknown(line(at)), Value::Number),
            (Value::List(mut a), Value::List(b)) => {
                a.extend(b);
                Value::List(a)
            }
            (Value::List(mut a), unknown @ Value::Unknown(_)) => {
                a.push(unknown);
                Value::List(a)
            }
            (Value::Text(a), b @ (Value::Text(_) | Value::Unknown(_))) => {
                Value::Text(a + &b.launch_text())
            }
            (a @ Value::Unknown(_), Value::Text(b)) => Value::Text(a.launch_text() + &b),
            _ => Value::Unknown(line(at)),
        };
        self.kept(sum, at)
    }

    /// `'%s_%d' % (a, b)`
    fn formatted(&mut self, format: &Value, values: &Value, at: Node<'a>) -> Value {
        let Value::Text(format) = format else {
            return Value::Unknown(line(at));
        };
        let one = std::slice::from_ref(values);
        let mut values = match values {
            Value::List(list) => list.iter(),
            _ => one.iter(),
        };
        let mut parts = format.split('%');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let value = values
                .next()
                .map_or_else(|| "$(unknown)".to_owned(), Value::launch_text);
            match part.strip_prefix(['s', 'd']) {
                Some(rest) => text.extend([&value, rest]),
                None => return Value::Unknown(line(at)),
            }
        }
        self.kept(Value::Text(text), at)
    }

    fn logic(&mut self, node: Node<'a>) -> Value {
        let truth = match node.kind() {
            "not_operator" => {
                let inner = node.child_by_field_name("argument");
                inner.and_then(|n| self.value(n).truth()).map(|t| !t)
            }
            "boolean_operator" => self.both(node),
            _ => self.compared(node),
        };
        truth.map_or(Value::Unknown(line(node)), Value::Bool)
    }

    fn both(&mut self, node: Node<'a>) -> Option<bool> {
        let side = |name| node.child_by_field_name(name);
        let (left, right) = (
            self.value(side("left")?).truth(),
            self.value(side("right")?).truth(),
        );
        // What the operator makes of a side that decides alone.
        let deciding = self.text(side("operator")?) == "or";
        match (left, right) {
            (Some(a), _) if a == deciding => Some(deciding),
            (_, Some(b)) if b == deciding => Some(deciding),
            (Some(_), Some(_)) => Some(!deciding),
            _ => None,
        }
    }

    fn compared(&mut self, node: Node<'a>) -> Option<bool> {
        let sides = children(node);
        let [left, right] = sides[..] else {
            return None;
        };
        let operator = node.child_by_field_name("operators")?;
        let operator = self.text(operator);
        let (left, right) = (self.value(left), self.value(right));
        match operator {
            "==" | "is" => left.equals(&right),
            "!=" | "is not" => left.equals(&right).map(|same| !same),
            "in" => left.is_in(&right),
            "not in" => left.is_in(&right).map(|inside| !inside),
            sign => match (sign, left, right) {
                ("<", Value::Number(a), Value::Number(b)) => Some(a < b),
                (">", Value::Number(a), Value::Number(b)) => Some(a > b),
                ("<=", Value::Number(a), Value::Number(b)) => Some(a <= b),
                (">=", Value::Number(a), Value::Number(b)) => Some(a >= b),
                _ => None,
            },
        }
    }

    /// `a if condition else b`
    fn choice(&mut self, node: Node<'a>) -> Value {
        let parts = children(node);
        let [yes, condition, no] = parts[..] else {
            return Value::Unknown(line(node));
        };
        match self.value(condition).truth() {
            Some(true) => self.value(yes),
            Some(false) => self.value(no),
            None => Value::Unknown(line(node)),
        }
    }

    fn subscript(&mut self, value: Node<'a>, key: Node<'a>) -> Value {
        if self.text(value) == "os.environ" {
            return Value::Text(format!("$(env {})", self.value(key).launch_text()));
        }
        let (found, key_value) = (self.value(value), self.value(key));
        let part = match (&found, &key_value) {
            (Value::List(list), Value::Number(at)) => {
                usize::try_from(*at).ok().and_then(|at| list.get(at))
            }
            (Value::Dict(map), key) => {
                let key = key.launch_text();
                map.iter()
                    .find(|(name, _)| *name == key)
                    .map(|(_, value)| value)
            }
            _ => None,
        };
        part.cloned().unwrap_or(Value::Unknown(line(key)))
    }
}

impl Value {
    /// Whether it is one of a list or a part of a text; `None` where that is not known.
    fn is_in(&self, all: &Self) -> Option<bool> {
        match (self, all) {
            (_, Self::List(list)) => {
                let each: Option<Vec<bool>> = list.iter().map(|v| self.equals(v)).collect();
                each.map(|each| each.contains(&true))
            }
            (Self::Text(part), Self::Text(text))
                if !part.contains("$(") && !text.contains("$(") =>
            {
                Some(text.contains(part.as_str()))
            }
            _ => None,
        }
    }
}
