//! The values of expressions in a launch file: literals, sums and formats of texts, comparisons, comprehensions.

use super::evaluator::Evaluator;
use super::value::PythonValue;
use crate::evidence::syntax::{Node, children, line};

impl<'a> Evaluator<'a> {
    pub(super) fn expression(&mut self, node: Node<'a>) -> PythonValue {
        let unknown = PythonValue::Unknown(line(node));
        let field = |name| node.child_by_field_name(name);
        match node.kind() {
            "string" | "concatenated_string" => self.string(node),
            "integer" => self.text(node).parse().map_or(unknown, PythonValue::Number),
            "float" => PythonValue::Text(self.text(node).to_owned()),
            "true" => PythonValue::Bool(true),
            "false" => PythonValue::Bool(false),
            "none" => PythonValue::None,
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

    fn constant(&mut self, node: Node<'a>) -> PythonValue {
        match self.text(node) {
            "__file__" => PythonValue::Text("$(dirname)/launch.py".to_owned()),
            "__name__" => PythonValue::Text("launch".to_owned()),
            _ => self.named(node),
        }
    }

    fn string(&mut self, node: Node<'a>) -> PythonValue {
        let mut text = String::new();
        for part in children(node) {
            match part.kind() {
                "string_content" => text.push_str(self.text(part)),
                "string" => text.push_str(&self.string(part).launch_text()),
                "interpolation" => {
                    let inner = part
                        .child_by_field_name("expression")
                        .or(part.named_child(0));
                    let value = inner.map_or(PythonValue::None, |n| self.value(n));
                    text.push_str(&value.launch_text());
                }
                _ => {}
            }
        }
        self.kept(PythonValue::Text(text), node)
    }

    fn list(&mut self, node: Node<'a>) -> PythonValue {
        let mut list = Vec::new();
        for part in children(node) {
            match (part.kind(), part.named_child(0)) {
                ("list_splat", Some(inner)) => list.extend(self.items(inner)),
                _ => list.push(self.value(part)),
            }
        }
        self.kept(PythonValue::List(list), node)
    }

    fn dictionary(&mut self, node: Node<'a>) -> PythonValue {
        let mut map: Vec<(String, PythonValue)> = Vec::new();
        for pair in children(node) {
            let parts = ["key", "value"].map(|name| pair.child_by_field_name(name));
            if let [Some(key), Some(value)] = parts {
                let (key, value) = (self.value(key), self.value(value));
                map.push((key.launch_text(), value));
            }
        }
        self.kept(PythonValue::Dict(map), node)
    }

    fn comprehension(&mut self, node: Node<'a>) -> PythonValue {
        let parts = children(node);
        let [body, clause, ..] = parts[..] else {
            return PythonValue::Unknown(line(node));
        };
        let sides = ["left", "right"].map(|name| clause.child_by_field_name(name));
        let ([Some(left), Some(right)], 2) = (sides, parts.len()) else {
            return PythonValue::Unknown(line(node));
        };
        let mut list = Vec::new();
        for item in self.items(right) {
            self.assign(left, item);
            list.push(self.value(body));
        }
        self.kept(PythonValue::List(list), node)
    }

    fn binary(&mut self, node: Node<'a>) -> PythonValue {
        let fields = ["left", "operator", "right"].map(|name| node.child_by_field_name(name));
        let [Some(left), Some(operator), Some(right)] = fields else {
            return PythonValue::Unknown(line(node));
        };
        let (left, right) = (self.value(left), self.value(right));
        match self.text(operator) {
            "+" => self.sum(left, right, node),
            "%" => self.formatted(&left, &right, node),
            // `Path(…) / 'x'`
            "/" => self.kept(
                PythonValue::Text(format!("{}/{}", left.launch_text(), right.launch_text())),
                node,
            ),
            sign => match (sign, left, right) {
                ("-", PythonValue::Number(a), PythonValue::Number(b)) => a
                    .checked_sub(b)
                    .map_or(PythonValue::Unknown(line(node)), PythonValue::Number),
                ("*", PythonValue::Number(a), PythonValue::Number(b)) => a
                    .checked_mul(b)
                    .map_or(PythonValue::Unknown(line(node)), PythonValue::Number),
                _ => PythonValue::Unknown(line(node)),
            },
        }
    }

    pub(super) fn sum(
        &mut self,
        left: PythonValue,
        right: PythonValue,
        at: Node<'a>,
    ) -> PythonValue {
        let sum = match (left, right) {
            (PythonValue::Number(a), PythonValue::Number(b)) => a
                .checked_add(b)
                .map_or(PythonValue::Unknown(line(at)), PythonValue::Number),
            (PythonValue::List(mut a), PythonValue::List(b)) => {
                a.extend(b);
                PythonValue::List(a)
            }
            (PythonValue::List(mut a), unknown @ PythonValue::Unknown(_)) => {
                a.push(unknown);
                PythonValue::List(a)
            }
            (PythonValue::Text(a), b @ (PythonValue::Text(_) | PythonValue::Unknown(_))) => {
                PythonValue::Text(a + &b.launch_text())
            }
            (a @ PythonValue::Unknown(_), PythonValue::Text(b)) => {
                PythonValue::Text(a.launch_text() + &b)
            }
            _ => PythonValue::Unknown(line(at)),
        };
        self.kept(sum, at)
    }

    /// `'%s_%d' % (a, b)`
    fn formatted(
        &mut self,
        format: &PythonValue,
        values: &PythonValue,
        at: Node<'a>,
    ) -> PythonValue {
        let PythonValue::Text(format) = format else {
            return PythonValue::Unknown(line(at));
        };
        let one = std::slice::from_ref(values);
        let mut values = match values {
            PythonValue::List(list) => list.iter(),
            _ => one.iter(),
        };
        let mut parts = format.split('%');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let value = values
                .next()
                .map_or_else(|| "$(unknown)".to_owned(), PythonValue::launch_text);
            match part.strip_prefix(['s', 'd']) {
                Some(rest) => text.extend([&value, rest]),
                None => return PythonValue::Unknown(line(at)),
            }
        }
        self.kept(PythonValue::Text(text), at)
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
        truth.map_or(PythonValue::Unknown(line(node)), PythonValue::Bool)
    }

    fn both(&mut self, node: Node<'a>) -> Option<bool> {
        let side = |name| node.child_by_field_name(name);
        let (left, right) = (
            self.value(side("left")?).truth(),
            self.value(side("right")?).truth(),
        );
        // The value of a left side for which the operator short-circuits.
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
                ("<", PythonValue::Number(a), PythonValue::Number(b)) => Some(a < b),
                (">", PythonValue::Number(a), PythonValue::Number(b)) => Some(a > b),
                ("<=", PythonValue::Number(a), PythonValue::Number(b)) => Some(a <= b),
                (">=", PythonValue::Number(a), PythonValue::Number(b)) => Some(a >= b),
                _ => None,
            },
        }
    }

    /// `a if condition else b`
    fn choice(&mut self, node: Node<'a>) -> PythonValue {
        let parts = children(node);
        let [yes, condition, no] = parts[..] else {
            return PythonValue::Unknown(line(node));
        };
        match self.value(condition).truth() {
            Some(true) => self.value(yes),
            Some(false) => self.value(no),
            None => PythonValue::Unknown(line(node)),
        }
    }

    fn subscript(&mut self, value: Node<'a>, key: Node<'a>) -> PythonValue {
        if self.text(value) == "os.environ" {
            return PythonValue::Text(format!("$(env {})", self.value(key).launch_text()));
        }
        let (found, key_value) = (self.value(value), self.value(key));
        let part = match (&found, &key_value) {
            (PythonValue::List(list), PythonValue::Number(at)) => {
                usize::try_from(*at).ok().and_then(|at| list.get(at))
            }
            (PythonValue::Dict(map), key) => {
                let key = key.launch_text();
                map.iter()
                    .find(|(name, _)| *name == key)
                    .map(|(_, value)| value)
            }
            _ => None,
        };
        part.cloned().unwrap_or(PythonValue::Unknown(line(key)))
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
