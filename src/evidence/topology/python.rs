//! Launch files in Python, parsed but never run: the result of `generate_launch_description` becomes a tree like that
//! of the XML format, with `$(…)` for values that the launch system would substitute.

mod action;
mod call;
mod evaluator;
mod expression;
mod value;

use std::collections::BTreeMap;
use std::path::Path;

use super::tree::Tree;
use crate::base::error::{Error, Result};
use crate::evidence::syntax::{Language, Parsed};
use evaluator::Evaluator;
use value::PythonValue;

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
        PythonValue::Text(text) => match value(&text, names) {
            Some(PythonValue::Bool(is_true)) => Some(word(is_true)),
            _ => Some(text).filter(|text| !text.contains("$(")),
        },
        PythonValue::Bool(is_true) => Some(word(is_true)),
        other => other.text(),
    }
}

fn value(expression: &str, names: &BTreeMap<String, String>) -> Option<PythonValue> {
    let parsed = Parsed::new(Language::Python, format!("({expression})"))?;
    let texts = names
        .iter()
        .map(|(name, text)| (name.clone(), value::of_text(text)));
    Evaluator::new(&parsed, texts.collect()).whole()
}

fn word(is_true: bool) -> String {
    if is_true { "true" } else { "false" }.to_owned()
}

#[cfg(test)]
mod tests;
