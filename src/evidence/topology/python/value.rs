//! The value of an expression of a launch file, as far as it is known without running it.

use crate::evidence::topology::tree::Tree;

/// The value of an expression. Texts may contain launch substitutions `$(…)`.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum PythonValue {
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

/// The deepest nesting of values that is kept.
pub(super) const DEEPEST: usize = 48;

impl PythonValue {
    /// The text in launch notation: the parts of a list joined, an unknown part as `$(unknown)`.
    pub(super) fn launch_text(&self) -> String {
        match self {
            Self::List(parts) => parts.iter().map(Self::launch_text).collect(),
            Self::None => String::new(),
            other => other.text().unwrap_or_else(|| "$(unknown)".to_owned()),
        }
    }

    /// The text as Python's `str` returns it; `None` if unknown.
    pub(super) fn text(&self) -> Option<String> {
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
    pub(super) fn truth(&self) -> Option<bool> {
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
    pub(super) fn equals(&self, other: &Self) -> Option<bool> {
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
    pub(super) fn acts(&self) -> bool {
        match self {
            Self::Action(_) => true,
            Self::List(list) => list.iter().any(Self::acts),
            _ => false,
        }
    }

    /// The size in bytes, approximately, and the depth of nesting.
    pub(super) fn measure(&self) -> (usize, usize) {
        let all = |parts: &mut dyn Iterator<Item = (usize, usize)>| {
            parts.fold((32, 1), |(size, depth), (s, d)| {
                (size + s, depth.max(d + 1))
            })
        };
        match self {
            Self::Text(text) => (32 + text.len(), 1),
            Self::List(list) => all(&mut list.iter().map(Self::measure)),
            Self::Dict(map) => all(&mut map.iter().map(|(key, value)| {
                let (size, depth) = value.measure();
                (size + key.len(), depth)
            })),
            Self::Action(tree) => of_tree(tree),
            _ => (32, 1),
        }
    }
}

fn of_tree(tree: &Tree) -> (usize, usize) {
    let texts = tree.attributes.iter().map(|(a, b)| 48 + a.len() + b.len());
    let own = 96 + texts.sum::<usize>();
    tree.children
        .iter()
        .map(of_tree)
        .fold((own, 1), |(size, depth), (s, d)| {
            (size + s, depth.max(d + 1))
        })
}

/// The value of an argument's text: `true` and `false` become Booleans.
pub(super) fn of_text(text: &str) -> PythonValue {
    match text {
        "true" | "True" => PythonValue::Bool(true),
        "false" | "False" => PythonValue::Bool(false),
        other => other
            .parse()
            .map_or_else(|_| PythonValue::Text(other.to_owned()), PythonValue::Number),
    }
}
