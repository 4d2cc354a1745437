//! Launch files in Python, parsed but never run: the result of `generate_launch_description` becomes a tree like that
//! of the XML format, with `$(…)` for values that the launch system would substitute.
//!
//! Statements are evaluated statically: assignments, literal lists, loops over them, functions of the file. If a condition is
//! unknown, both branches are followed and their results marked as undecided. `action` knows the actions of launch.

mod action;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use crate::base::budget::LaunchWork;
use crate::base::error::{Error, Result};
use crate::evidence::given::tree::{LONGEST, Tree};
use crate::evidence::syntax::{Language, Node, Parsed, children, fields, line};

use PythonValue::{Bool, Dict, Function, List, Number, Text, Unknown};

/// The tag of an element that is only known at run time.
pub(super) const UNREAD: &str = "unread";

const HINT: &str = "a launch file in Python defines `generate_launch_description` and returns a `LaunchDescription`";

/// The tree of a launch file in Python.
pub(super) fn of_python(path: &Path, text: &str) -> Result<Tree> {
    let Some(parsed) = Parsed::new(Language::Python, text.to_owned()) else {
        let reason = "it is too complex to be read";
        return Err(Error::bad_file(path, 0, reason, HINT));
    };
    let mut evaluator = Evaluator::new(&parsed, BTreeMap::new());
    let Some(actions) = evaluator.launch_description() else {
        let reason = "there is no `generate_launch_description`";
        return Err(Error::bad_file(path, 0, reason, HINT));
    };
    Ok(Tree {
        tag: "launch".to_owned(),
        children: action::trees(&actions),
        ..Tree::default()
    })
}

/// The value of a Python expression as a text (`$(eval …)`, `PythonExpression`) in which `names` have these texts;
/// `None` if it is only known at run time.
pub(super) fn evaluate(expression: &str, names: &BTreeMap<String, String>) -> Option<String> {
    match value(expression, names)? {
        // XML puts quotes around the whole expression.
        Text(text) => match value(&text, names) {
            Some(Bool(is_true)) => Some(is_true.to_string()),
            _ => Some(text).filter(|text| !text.contains("$(")),
        },
        Bool(is_true) => Some(is_true.to_string()),
        other => other.text(),
    }
}

fn value(expression: &str, names: &BTreeMap<String, String>) -> Option<PythonValue> {
    let parsed = Parsed::new(Language::Python, format!("({expression})"))?;
    let texts = names
        .iter()
        .map(|(name, text)| (name.clone(), of_text(text)));
    Evaluator::new(&parsed, texts.collect()).whole()
}

/// A value that is only known at run time.
fn unknown(at: Node<'_>) -> PythonValue {
    Unknown(line(at))
}

// Statements.

/// The deepest nesting of expressions and calls that is followed, which the stack must hold: half a megabyte in a debug build.
/// Launch files in use nest a dozen deep.
const NESTED: usize = 120;

/// The cost of one step, in bytes of work: as that of so much text.
const STEP: usize = 16;

struct Evaluator<'a> {
    parsed: &'a Parsed,
    frames: Vec<Locals>,
    functions: BTreeMap<String, Node<'a>>,
    budget: LaunchWork,
    /// The number of enclosing unknown conditions.
    undecided: usize,
    nested: usize,
}

/// The continuation after a statement: the next one, or none.
type Flow = ControlFlow<()>;
const NEXT: Flow = ControlFlow::Continue(());
const DONE: Flow = ControlFlow::Break(());

/// The variables of a function that is being followed.
#[derive(Default)]
struct Locals {
    names: BTreeMap<String, PythonValue>,
    returned: Option<PythonValue>,
    /// The value of `undecided` where the function was called.
    undecided: usize,
}

impl<'a> Evaluator<'a> {
    fn new(parsed: &'a Parsed, names: BTreeMap<String, PythonValue>) -> Self {
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
    fn launch_description(&mut self) -> Option<PythonValue> {
        let _ = self.run(self.parsed.root());
        let function = *self.functions.get("generate_launch_description")?;
        Some(self.call(function, &Arguments::default()))
    }

    /// The value of the file's only expression; `None` if there is none or it is unknown.
    fn whole(&mut self) -> Option<PythonValue> {
        let statement = children(self.parsed.root());
        let expression = statement.first().and_then(|s| s.named_child(0))?;
        if self.parsed.root().has_error() || statement.len() != 1 {
            return None;
        }
        Some(self.value(expression)).filter(|value| !matches!(value, Unknown(_)))
    }

    fn text(&self, node: Node<'_>) -> &'a str {
        self.parsed.text(node)
    }

    /// Returns a new value, or unknown if it is too large, too deep or exceeds the budget.
    fn kept(&mut self, value: PythonValue, at: Node<'_>) -> PythonValue {
        let (size, depth) = value.measure();
        let is_small = depth <= DEEPEST && !matches!(&value, Text(text) if text.len() > LONGEST);
        match self.budget.spend(size) {
            Some(()) if is_small => value,
            _ => unknown(at),
        }
    }

    fn run(&mut self, block: Node<'a>) -> Flow {
        let mut all = children(block).into_iter();
        all.try_for_each(|statement| self.statement(statement))
    }

    fn statement(&mut self, node: Node<'a>) -> Flow {
        if self.budget.spend(STEP).is_none() || self.nested > NESTED {
            return DONE;
        }
        self.nested += 1;
        let flow = match node.kind() {
            "expression_statement" => {
                for one in children(node) {
                    self.effect(one);
                }
                NEXT
            }
            "function_definition" => {
                let name = self.parsed.field(node, "name");
                self.functions.insert(name.to_owned(), node);
                NEXT
            }
            "decorated_definition" => {
                let definition = node.child_by_field_name("definition");
                definition.map_or(NEXT, |inner| self.statement(inner))
            }
            "return_statement" => self.returns(node),
            "if_statement" => self.branches(node),
            "for_statement" => self.repeats(node),
            "with_statement" | "try_statement" => {
                let body = node.child_by_field_name("body");
                body.map_or(NEXT, |body| self.run(body))
            }
            _ => NEXT,
        };
        self.nested -= 1;
        flow
    }

    fn returns(&mut self, node: Node<'a>) -> Flow {
        let value = node
            .named_child(0)
            .map_or(PythonValue::None, |n| self.value(n));
        let undecided = self.undecided;
        let Some(frame) = self.frames.last_mut() else {
            return DONE;
        };
        let is_sure = undecided == frame.undecided;
        frame.returned = Some(match (frame.returned.take(), value) {
            (None, value) if is_sure || value.acts() => value,
            (Some(List(mut before)), after) if after.acts() => {
                before.push(after);
                List(before)
            }
            (Some(before), after) if before.acts() && after.acts() => List(vec![before, after]),
            _ => unknown(node),
        });
        if is_sure { DONE } else { NEXT }
    }

    fn branches(&mut self, node: Node<'a>) -> Flow {
        let mut cursor = node.walk();
        let others = node.children_by_field_name("alternative", &mut cursor);
        let (mut sure, mut flow) = (true, NEXT);
        for part in std::iter::once(node).chain(others) {
            let field = |name| part.child_by_field_name(name);
            let condition = field("condition");
            let truth = condition.map_or(Some(true), |one| self.value(one).truth());
            let body = field("consequence").or(field("body"));
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
        if sure { flow } else { NEXT }
    }

    fn repeats(&mut self, node: Node<'a>) -> Flow {
        let Some([left, right, body]) = fields(node, ["left", "right", "body"]) else {
            return NEXT;
        };
        for item in self.items(right) {
            self.assign(left, item);
            self.run(body)?;
        }
        NEXT
    }

    /// The items of a loop, as far as known.
    fn items(&mut self, node: Node<'a>) -> Vec<PythonValue> {
        match self.value(node) {
            List(list) => list,
            Dict(map) => map.into_iter().map(|(key, _)| Text(key)).collect(),
            _ => vec![unknown(node)],
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

    fn assign(&mut self, target: Node<'a>, value: PythonValue) {
        match (target.kind(), value) {
            ("identifier", value) => {
                let name = self.text(target).to_owned();
                if let Some(frame) = self.frames.last_mut() {
                    let is_sure = frame.undecided == self.undecided || value.acts();
                    let value = if is_sure { value } else { unknown(target) };
                    frame.names.insert(name, value);
                }
            }
            ("pattern_list" | "tuple_pattern", List(parts)) => {
                for (target, part) in children(target).into_iter().zip(parts) {
                    self.assign(target, part);
                }
            }
            ("pattern_list" | "tuple_pattern", _) => {
                for target in children(target) {
                    self.assign(target, unknown(target));
                }
            }
            ("subscript", value) => self.put(target, value),
            _ => {}
        }
    }

    /// `map['key'] = value`
    fn put(&mut self, target: Node<'a>, value: PythonValue) {
        let Some([map, key]) = fields(target, ["value", "subscript"]) else {
            return;
        };
        let key = self.value(key).text();
        if let (Some(Dict(entries)), Some(key)) = (self.variable(map), key) {
            entries.retain(|(known, _)| *known != key);
            entries.push((key, value));
        }
    }

    /// The variable of a name, to be changed.
    fn variable(&mut self, node: Node<'a>) -> Option<&mut PythonValue> {
        let name = self.parsed.text(node);
        if node.kind() != "identifier" {
            return None;
        }
        let mut frames = self.frames.iter_mut().rev();
        frames.find_map(|frame| frame.names.get_mut(name))
    }

    /// A copy of the value of a name at `node`.
    fn lookup(&mut self, name: &str, node: Node<'a>) -> PythonValue {
        let mut frames = self.frames.iter().rev();
        match frames.find_map(|frame| frame.names.get(name)).cloned() {
            Some(value) => self.kept(value, node),
            None if self.functions.contains_key(name) => Function(name.to_owned()),
            None if name == "true" => Bool(true),
            None if name == "false" => Bool(false),
            None => unknown(node),
        }
    }

    /// The return value of a function of this file.
    fn call(&mut self, function: Node<'a>, given: &Arguments) -> PythonValue {
        let Some([parameters, body]) = fields(function, ["parameters", "body"]) else {
            return unknown(function);
        };
        if self.nested > NESTED {
            return unknown(function);
        }
        let mut frame = Locals {
            undecided: self.undecided,
            ..Locals::default()
        };
        for (at, parameter) in children(parameters).into_iter().enumerate() {
            let name = parameter.child_by_field_name("name");
            let name = name.or_else(|| match parameter.kind() {
                "identifier" => Some(parameter),
                _ => parameter.named_child(0),
            });
            let name = name.map_or("", |n| self.text(n)).to_owned();
            let given = given.named(&name).or(given.positional.get(at)).cloned();
            let default = parameter.child_by_field_name("value");
            let value = given.or_else(|| default.map(|d| self.value(d)));
            let value = value.unwrap_or(unknown(parameter));
            frame.names.insert(name, value);
        }
        self.frames.push(frame);
        self.nested += 1;
        let _ = self.run(body);
        self.nested -= 1;
        let frame = self.frames.pop();
        frame.and_then(|f| f.returned).unwrap_or(PythonValue::None)
    }

    /// The value of an expression.
    fn value(&mut self, node: Node<'a>) -> PythonValue {
        if self.nested > NESTED || self.budget.spend(STEP).is_none() {
            return unknown(node);
        }
        self.nested += 1;
        let value = self.expression(node);
        self.nested -= 1;
        value
    }

    // Expressions.

    fn expression(&mut self, node: Node<'a>) -> PythonValue {
        let unknown = Unknown(line(node));
        let field = |name| node.child_by_field_name(name);
        match node.kind() {
            "string" | "concatenated_string" => self.string(node),
            "integer" => self.text(node).parse().map_or(unknown, Number),
            "float" => Text(self.text(node).to_owned()),
            "true" => Bool(true),
            "false" => Bool(false),
            "none" => PythonValue::None,
            "identifier" => match self.text(node) {
                "__file__" => Text("$(dirname)/launch.py".to_owned()),
                "__name__" => Text("launch".to_owned()),
                name => self.lookup(name, node),
            },
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

    fn string(&mut self, node: Node<'a>) -> PythonValue {
        let mut text = String::new();
        for part in children(node) {
            match part.kind() {
                "string_content" => text.push_str(self.text(part)),
                "string" => text.push_str(&self.string(part).launch_text()),
                "interpolation" => {
                    let inner = part.child_by_field_name("expression");
                    let inner = inner.or(part.named_child(0));
                    let value = inner.map_or(PythonValue::None, |n| self.value(n));
                    text.push_str(&value.launch_text());
                }
                _ => {}
            }
        }
        self.kept(Text(text), node)
    }

    fn list(&mut self, node: Node<'a>) -> PythonValue {
        let mut list = Vec::new();
        for part in children(node) {
            match (part.kind(), part.named_child(0)) {
                ("list_splat", Some(inner)) => list.extend(self.items(inner)),
                _ => list.push(self.value(part)),
            }
        }
        self.kept(List(list), node)
    }

    fn dictionary(&mut self, node: Node<'a>) -> PythonValue {
        let mut map: Vec<(String, PythonValue)> = Vec::new();
        for pair in children(node) {
            if let Some([key, value]) = fields(pair, ["key", "value"]) {
                let (key, value) = (self.value(key), self.value(value));
                map.push((key.launch_text(), value));
            }
        }
        self.kept(Dict(map), node)
    }

    fn comprehension(&mut self, node: Node<'a>) -> PythonValue {
        let parts = children(node);
        let [body, clause, ..] = parts[..] else {
            return unknown(node);
        };
        let sides = fields(clause, ["left", "right"]);
        let Some([left, right]) = sides.filter(|_| parts.len() == 2) else {
            return unknown(node);
        };
        let mut list = Vec::new();
        for item in self.items(right) {
            self.assign(left, item);
            list.push(self.value(body));
        }
        self.kept(List(list), node)
    }

    fn binary(&mut self, node: Node<'a>) -> PythonValue {
        let Some([left, operator, right]) = fields(node, ["left", "operator", "right"]) else {
            return unknown(node);
        };
        match (self.text(operator), self.value(left), self.value(right)) {
            ("+", left, right) => self.sum(left, right, node),
            ("%", Text(format), values) => self.formatted(&format, &values, node),
            // `Path(…) / 'x'`
            ("/", left, right) => {
                let path = format!("{}/{}", left.launch_text(), right.launch_text());
                self.kept(Text(path), node)
            }
            ("-", Number(a), Number(b)) => a.checked_sub(b).map_or(unknown(node), Number),
            ("*", Number(a), Number(b)) => a.checked_mul(b).map_or(unknown(node), Number),
            _ => unknown(node),
        }
    }

    fn sum(&mut self, left: PythonValue, right: PythonValue, at: Node<'a>) -> PythonValue {
        let sum = match (left, right) {
            (Number(a), Number(b)) => a.checked_add(b).map_or(unknown(at), Number),
            (List(mut a), List(b)) => {
                a.extend(b);
                List(a)
            }
            (List(mut a), unknown @ Unknown(_)) => {
                a.push(unknown);
                List(a)
            }
            (Text(a), b @ (Text(_) | Unknown(_))) => Text(a + &b.launch_text()),
            (a @ Unknown(_), Text(b)) => Text(a.launch_text() + &b),
            _ => unknown(at),
        };
        self.kept(sum, at)
    }

    /// `'%s_%d' % (a, b)`
    fn formatted(&mut self, format: &str, values: &PythonValue, at: Node<'a>) -> PythonValue {
        let mut values = match values {
            List(list) => list.iter(),
            one => std::slice::from_ref(one).iter(),
        };
        let mut parts = format.split('%');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let value = values.next().map(PythonValue::launch_text);
            let value = value.unwrap_or_else(|| "$(unknown)".to_owned());
            match part.strip_prefix(['s', 'd']) {
                Some(rest) => text.extend([&value, rest]),
                None => return unknown(at),
            }
        }
        self.kept(Text(text), at)
    }

    fn logic(&mut self, node: Node<'a>) -> PythonValue {
        let truth = match node.kind() {
            "not_operator" => {
                let inner = node.child_by_field_name("argument");
                inner.and_then(|n| self.value(n).truth()).map(|t| !t)
            }
            "boolean_operator" => self.both(node),
            _ => self.compared(node),
        };
        truth.map_or(unknown(node), Bool)
    }

    fn both(&mut self, node: Node<'a>) -> Option<bool> {
        let [left, operator, right] = fields(node, ["left", "operator", "right"])?;
        let (left, right) = (self.value(left).truth(), self.value(right).truth());
        // The value of a left side for which the operator short-circuits.
        let deciding = self.text(operator) == "or";
        match (left, right) {
            (Some(a), _) if a == deciding => Some(deciding),
            (_, Some(b)) if b == deciding => Some(deciding),
            (Some(_), Some(_)) => Some(!deciding),
            _ => None,
        }
    }

    fn compared(&mut self, node: Node<'a>) -> Option<bool> {
        let [left, right] = children(node)[..] else {
            return None;
        };
        let operator = node.child_by_field_name("operators")?;
        match (self.text(operator), self.value(left), self.value(right)) {
            ("==" | "is", left, right) => left.equals(&right),
            ("!=" | "is not", left, right) => left.equals(&right).map(|same| !same),
            ("in", left, right) => left.is_in(&right),
            ("not in", left, right) => left.is_in(&right).map(|inside| !inside),
            ("<", Number(a), Number(b)) => Some(a < b),
            (">", Number(a), Number(b)) => Some(a > b),
            ("<=", Number(a), Number(b)) => Some(a <= b),
            (">=", Number(a), Number(b)) => Some(a >= b),
            _ => None,
        }
    }

    /// `a if condition else b`
    fn choice(&mut self, node: Node<'a>) -> PythonValue {
        let [yes, condition, no] = children(node)[..] else {
            return unknown(node);
        };
        match self.value(condition).truth() {
            Some(true) => self.value(yes),
            Some(false) => self.value(no),
            None => unknown(node),
        }
    }

    fn subscript(&mut self, value: Node<'a>, key: Node<'a>) -> PythonValue {
        if self.text(value) == "os.environ" {
            return Text(format!("$(env {})", self.value(key).launch_text()));
        }
        let (found, key_value) = (self.value(value), self.value(key));
        let part = match (&found, &key_value) {
            (List(list), Number(at)) => usize::try_from(*at).ok().and_then(|at| list.get(at)),
            (Dict(map), key) => named(map, &key.launch_text()),
            _ => None,
        };
        part.cloned().unwrap_or(unknown(key))
    }
}

impl PythonValue {
    /// Whether it is an item of a list or a part of a text; `None` if unknown.
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

// Calls.

/// The value of a name in a list of names.
fn named<'v>(map: &'v [(String, PythonValue)], name: &str) -> Option<&'v PythonValue> {
    let found = map.iter().find(|(known, _)| known == name);
    found.map(|(_, value)| value)
}

/// The arguments of a call, in order and by name.
#[derive(Default)]
struct Arguments {
    positional: Vec<PythonValue>,
    named: Vec<(String, PythonValue)>,
    line: usize,
}

impl Arguments {
    /// The argument of this name, or the one at position `place`.
    fn get(&self, place: usize, name: &str) -> Option<&PythonValue> {
        self.named(name).or(self.positional.get(place))
    }

    /// The argument of this name.
    fn named(&self, name: &str) -> Option<&PythonValue> {
        named(&self.named, name)
    }

    /// An argument as a text of launch files.
    fn text(&self, place: usize, name: &str) -> Option<String> {
        self.get(place, name)
            .filter(|v| **v != PythonValue::None)
            .map(PythonValue::launch_text)
    }
}

impl<'a> Evaluator<'a> {
    fn call_expression(&mut self, node: Node<'a>) -> PythonValue {
        let Some(function) = node.child_by_field_name("function") else {
            return unknown(node);
        };
        let arguments = self.arguments(node);
        if function.kind() == "attribute"
            && let Some([object, name]) = fields(function, ["object", "attribute"])
            && let Some(value) = self.method(object, self.text(name), &arguments)
        {
            return self.kept(value, node);
        }
        let full = self.text(function);
        let name = full.rsplit('.').next().unwrap_or(full);
        if let ("arg", Some(Text(argument))) = (full, arguments.positional.first()) {
            return self.lookup(argument, node);
        }
        if let Some(own) = self.functions.get(name).copied() {
            return self.call(own, &arguments);
        }
        let value = self
            .action(name, &arguments)
            .or_else(|| substitution(name, &arguments))
            .or_else(|| plain(full, &arguments))
            .unwrap_or(unknown(node));
        self.kept(value, node)
    }

    fn arguments(&mut self, call: Node<'a>) -> Arguments {
        let mut arguments = Arguments {
            line: line(call),
            ..Arguments::default()
        };
        let Some(list) = call.child_by_field_name("arguments") else {
            return arguments;
        };
        if list.kind() == "generator_expression" {
            arguments.positional.push(self.value(list));
            return arguments;
        }
        for argument in children(list) {
            let part = |name| argument.child_by_field_name(name);
            match (argument.kind(), part("name"), part("value")) {
                ("keyword_argument", Some(name), Some(value)) => {
                    let value = self.value(value);
                    arguments.named.push((self.text(name).to_owned(), value));
                }
                ("dictionary_splat", ..) => {
                    if let Some(Dict(map)) = argument.named_child(0).map(|n| self.value(n)) {
                        arguments.named.extend(map);
                    }
                }
                ("list_splat", ..) => {
                    let items = argument.named_child(0).map(|n| self.items(n));
                    arguments.positional.extend(items.unwrap_or_default());
                }
                _ => {
                    let value = self.value(argument);
                    arguments.positional.push(value);
                }
            }
        }
        arguments
    }

    /// A method of a known value: appends to lists, formats texts.
    fn method(
        &mut self,
        object: Node<'a>,
        name: &str,
        arguments: &Arguments,
    ) -> Option<PythonValue> {
        let first = || arguments.positional.first().cloned();
        match name {
            "append" | "add_action" | "add_entity" => self.grow(object, vec![first()?]),
            "insert" => self.grow(object, vec![arguments.positional.get(1)?.clone()]),
            "extend" => match first()? {
                List(list) => self.grow(object, list),
                other => self.grow(object, vec![other]),
            },
            "items" => match self.value(object) {
                Dict(map) => {
                    let pair = |(key, value)| List(vec![Text(key), value]);
                    Some(List(map.into_iter().map(pair).collect()))
                }
                _ => None,
            },
            // `LaunchConfiguration('x').perform(context)` is equivalent to `$(var x)`.
            "perform" => Some(self.value(object)).filter(|value| value.text().is_some()),
            "find" => {
                let share = self.value(object).text()?;
                share.starts_with("$(find-pkg-share").then_some(Text(share))
            }
            "format" => formatted(&self.value(object).text()?, arguments).map(Text),
            "lower" => {
                let text = self.value(object).text()?;
                (!text.contains("$(")).then(|| Text(text.to_lowercase()))
            }
            "get" if self.text(object) == "os.environ" => substitution("getenv", arguments),
            "get" => match self.value(object) {
                Dict(map) => {
                    let found = named(&map, &first()?.launch_text());
                    let found = found.or(arguments.positional.get(1)).cloned();
                    Some(found.unwrap_or(PythonValue::None))
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// Adds to the list in a variable.
    fn grow(&mut self, object: Node<'a>, more: Vec<PythonValue>) -> Option<PythonValue> {
        let more = self.kept(List(more), object);
        if let (List(list), List(more)) = (self.variable(object)?, more) {
            list.extend(more);
        }
        Some(PythonValue::None)
    }

    /// The value of an attribute, such as `Path(…).parent`.
    fn attribute(&mut self, node: Node<'a>) -> PythonValue {
        let Some([object, name]) = fields(node, ["object", "attribute"]) else {
            return unknown(node);
        };
        match (self.text(name), self.value(object)) {
            ("parent", Text(path)) => Text(parent(&path).to_owned()),
            _ => unknown(node),
        }
    }
}

/// Launch substitutions: the name in Python, the names of the arguments, and the XML notation with `@` for each argument. Of
/// several lines of one name the first counts that has all its arguments.
const SUBSTITUTIONS: &str = "\
    LaunchConfiguration variable_name default: $(var @ @)
    LaunchConfiguration variable_name: $(var @)
    TextSubstitution text: @
    FindPackageShare package: $(find-pkg-share @)
    get_package_share_directory package: $(find-pkg-share @)
    get_package_share_path package: $(find-pkg-share @)
    FindPackagePrefix package: $(find-pkg-prefix @)
    FindPackage package: $(find-pkg-prefix @)
    get_package_prefix package: $(find-pkg-prefix @)
    ThisLaunchFileDir: $(dirname)
    EnvironmentVariable name default_value: $(env @ @)
    EnvironmentVariable name default: $(env @ @)
    EnvironmentVariable name: $(env @)
    getenv name default_value: $(env @ @)
    getenv name default: $(env @ @)
    getenv name: $(env @)
    PythonExpression expression: $(eval @)
    EqualsSubstitution left right: $(eval '@' == '@')
    NotEqualsSubstitution left right: $(eval '@' != '@')
    NotSubstitution value: $(not @)
    AndSubstitution left right: $(and @ @)
    OrSubstitution left right: $(or @ @)
    PythonLaunchDescriptionSource launch_file_path: @
    AnyLaunchDescriptionSource launch_file_path: @
    XMLLaunchDescriptionSource launch_file_path: @
    YAMLLaunchDescriptionSource launch_file_path: @
    FrontendLaunchDescriptionSource launch_file_path: @";

/// A launch substitution in its XML notation.
fn substitution(name: &str, given: &Arguments) -> Option<PythonValue> {
    if let "PathJoinSubstitution" | "PathJoin" = name {
        return Some(Text(match given.get(0, "substitutions")? {
            List(parts) => path(parts),
            other => other.launch_text(),
        }));
    }
    SUBSTITUTIONS.lines().find_map(|line| {
        let (words, notation) = line.trim().split_once(": ")?;
        let mut words = words.split(' ');
        words.next().filter(|own| *own == name)?;
        let texts = (0..).zip(words).map(|(at, name)| given.text(at, name));
        let mut parts = notation.split('@');
        let mut made = parts.next()?.to_owned();
        for (text, part) in texts.zip(parts) {
            made.extend([&text?, part]);
        }
        Some(Text(made))
    })
}

/// The result of a function of Python itself.
fn plain(full: &str, arguments: &Arguments) -> Option<PythonValue> {
    let first = arguments.positional.first();
    let text = || first.map(PythonValue::launch_text);
    match full {
        "os.path.join" | "path.join" | "join" => Some(Text(path(&arguments.positional))),
        "os.path.dirname" | "path.dirname" => Some(Text(parent(&text()?).to_owned())),
        "os.path.abspath" | "os.path.realpath" | "os.path.normpath" | "Path" | "pathlib.Path"
        | "str" => text().map(Text),
        "os.getenv" | "os.environ.get" => substitution("getenv", arguments),
        "list" | "tuple" => Some(first.cloned().unwrap_or(List(Vec::new()))),
        "dict" => Some(Dict(arguments.named.clone())),
        "range" => {
            let number = |at: usize| match arguments.positional.get(at) {
                Some(Number(number)) => Some(*number),
                _ => None,
            };
            let (from, to) = match number(1) {
                Some(to) => (number(0)?, to),
                None => (0, number(0)?),
            };
            let is_small = to.checked_sub(from).is_some_and(|n| n <= 1000);
            is_small.then(|| List((from..to).map(Number).collect()))
        }
        "len" => match first? {
            List(list) => i64::try_from(list.len()).ok().map(Number),
            _ => None,
        },
        "enumerate" => match first? {
            List(list) => {
                let pair = |(at, item): (i64, &PythonValue)| List(vec![Number(at), item.clone()]);
                Some(List((0..).zip(list).map(pair).collect()))
            }
            _ => None,
        },
        _ => None,
    }
}

/// Joins the parts of a path; a part that begins with a slash replaces those before it.
fn path(parts: &[PythonValue]) -> String {
    let mut joined = String::new();
    for part in parts {
        let part = part.launch_text();
        if part.starts_with('/') {
            joined.clear();
        } else if !joined.is_empty() && !joined.ends_with('/') {
            joined.push('/');
        }
        joined.push_str(&part);
    }
    joined
}

fn parent(path: &str) -> &str {
    path.rsplit_once('/').map_or(".", |(folder, _)| folder)
}

/// `'{}_{name}'.format(a, name=b)`
fn formatted(format: &str, arguments: &Arguments) -> Option<String> {
    let mut next = 0;
    let mut text = String::new();
    let mut rest = format;
    while let Some((before, after)) = rest.split_once('{') {
        let (key, behind) = after.split_once('}')?;
        let value = if key.is_empty() {
            next += 1;
            arguments.positional.get(next - 1)?
        } else if let Ok(place) = key.parse::<usize>() {
            arguments.positional.get(place)?
        } else {
            arguments.named(key)?
        };
        text.push_str(before);
        text.push_str(&value.launch_text());
        rest = behind;
    }
    Some(text + rest)
}

// Values.

/// The value of an expression. Texts may contain launch substitutions `$(…)`.
#[derive(Clone, PartialEq)]
enum PythonValue {
    /// A value that is only known at run time, with its line.
    Unknown(usize),
    None,
    Bool(bool),
    Number(i64),
    Text(String),
    List(Vec<Self>),
    Dict(Vec<(String, Self)>),
    /// A launch action, a condition, or a description of a node.
    Action(Tree),
    /// A function of this file.
    Function(String),
}

/// The deepest nesting of values that is kept, which the stack must hold while they are copied and dropped; below that of trees,
/// which they become.
const DEEPEST: usize = 48;

impl PythonValue {
    /// The text in launch notation: the parts of a list joined, an unknown part as `$(unknown)`.
    fn launch_text(&self) -> String {
        match self {
            Self::List(parts) => parts.iter().map(Self::launch_text).collect(),
            Self::None => String::new(),
            other => other.text().unwrap_or_else(|| "$(unknown)".to_owned()),
        }
    }

    /// The text as Python's `str` returns it; `None` if unknown.
    fn text(&self) -> Option<String> {
        match self {
            Self::Text(text) => Some(text.clone()),
            Self::Number(number) => Some(number.to_string()),
            Self::Bool(true) => Some("True".to_owned()),
            Self::Bool(false) => Some("False".to_owned()),
            Self::None => Some("None".to_owned()),
            _ => None,
        }
    }

    /// Whether Python treats it as true; `None` if unknown.
    fn truth(&self) -> Option<bool> {
        match self {
            Self::Bool(is_true) => Some(*is_true),
            Self::None => Some(false),
            Self::Number(number) => Some(*number != 0),
            Self::Text(text) if text.contains("$(") => None,
            Self::Text(text) => Some(!text.is_empty()),
            Self::List(list) => Some(!list.is_empty()),
            Self::Dict(map) => Some(!map.is_empty()),
            Self::Unknown(_) | Self::Action(_) | Self::Function(_) => None,
        }
    }

    /// Whether two values are equal; `None` if unknown. The text `true` equals `True`, as arguments are texts.
    fn equals(&self, other: &Self) -> Option<bool> {
        match (self, other) {
            (Self::Text(a), Self::Text(b)) if a.contains("$(") || b.contains("$(") => None,
            (Self::Text(text), Self::Bool(_)) => Some(text.eq_ignore_ascii_case(&other.text()?)),
            (Self::Bool(_), Self::Text(text)) => Some(text.eq_ignore_ascii_case(&self.text()?)),
            (Self::Text(text), Self::Number(number)) | (Self::Number(number), Self::Text(text)) => {
                Some(*text == number.to_string())
            }
            (Self::Unknown(_) | Self::Action(_), _) | (_, Self::Unknown(_) | Self::Action(_)) => {
                None
            }
            (a, b) => Some(a == b),
        }
    }

    /// Whether it contains launch actions.
    fn acts(&self) -> bool {
        match self {
            Self::Action(_) => true,
            Self::List(list) => list.iter().any(Self::acts),
            _ => false,
        }
    }

    /// The size in bytes, approximately, and the depth of nesting.
    fn measure(&self) -> (usize, usize) {
        match self {
            Self::Text(text) => (32 + text.len(), 1),
            Self::List(list) => measured(32, list.iter().map(Self::measure)),
            Self::Dict(map) => {
                let keys = map.iter().map(|(key, _)| key.len()).sum::<usize>();
                measured(32 + keys, map.iter().map(|(_, value)| value.measure()))
            }
            Self::Action(tree) => of_tree(tree),
            _ => (32, 1),
        }
    }
}

/// The size and the depth of what has this size of its own and these parts.
fn measured(own: usize, parts: impl Iterator<Item = (usize, usize)>) -> (usize, usize) {
    parts.fold((own, 1), |(size, depth), (s, d)| {
        (size + s, depth.max(d + 1))
    })
}

fn of_tree(tree: &Tree) -> (usize, usize) {
    let texts = tree.attributes.iter().map(|(a, b)| 48 + a.len() + b.len());
    let own = 96 + texts.sum::<usize>();
    measured(own, tree.children.iter().map(of_tree))
}

/// The value of an argument's text: `true` and `false` become Booleans.
fn of_text(text: &str) -> PythonValue {
    match text {
        "true" | "True" => Bool(true),
        "false" | "False" => Bool(false),
        _ => text.parse().map_or_else(|_| Text(text.to_owned()), Number),
    }
}

#[cfg(test)]
mod tests;
