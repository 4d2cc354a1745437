//! Replaces substitutions `$(…)` in launch files, as far as possible without execution.

use std::collections::BTreeMap;
use std::path::Path;

use super::python;
use super::tree::LONGEST;
use crate::base::budget::LaunchWork;

/// Replaces the part of an anonymous name that differs from run to run; it occurs in no name.
pub(crate) const ANONYMOUS: char = '*';

/// The deepest nesting of substitutions; deeper ones are hostile: those in use nest three deep.
const DEEPEST: usize = 16;

/// The context of a text: the values that its substitutions may refer to.
pub(super) struct SubstitutionContext<'a> {
    pub(super) path: &'a Path,
    pub(super) arguments: &'a BTreeMap<String, String>,
}

impl SubstitutionContext<'_> {
    /// The text after substitution; `None` if a part of it is only known at run time, or it becomes too long.
    pub(super) fn substitute(&self, text: &str, budget: &mut LaunchWork) -> Option<String> {
        self.at_depth(text, budget, 0)
    }

    fn at_depth(&self, text: &str, budget: &mut LaunchWork, depth: usize) -> Option<String> {
        budget.spend(text.len())?;
        let mut done = String::new();
        let mut rest = text;
        while let Some((before, after)) = rest.split_once("$(") {
            done.push_str(before);
            let end = closing(after)?;
            if depth >= DEEPEST {
                return None;
            }
            let inside = self.at_depth(&after[..end], budget, depth + 1)?;
            let value = self.value(inside.trim())?;
            budget.spend(value.len())?;
            done.push_str(&value);
            if done.len() > LONGEST {
                return None;
            }
            rest = &after[end + 1..];
        }
        done.push_str(rest);
        Some(done)
    }

    /// The value of one substitution, with the inner ones replaced already.
    fn value(&self, inside: &str) -> Option<String> {
        let split = inside.split_once(char::is_whitespace);
        let (verb, words) = split.unwrap_or((inside, ""));
        let words = unquoted(words);
        let parts: Vec<&str> = words.split_whitespace().map(unquoted).collect();
        let argument = |name: &str| self.arguments.get(name).cloned();
        let default = words
            .split_once(' ')
            .map(|(_, text)| unquoted(text).to_owned());
        let both = |f: fn(&str, &str) -> bool| match parts[..] {
            [a, b] => Some(f(a, b).to_string()),
            _ => None,
        };
        match verb {
            // In ROS 2 a default follows the name.
            "arg" | "var" => argument(words.split(' ').next()?).or(default),
            "anon" => Some(format!("{words}{ANONYMOUS}")),
            "optenv" => default.or(Some(String::new())),
            "env" => default,
            "dirname" => Some(".".to_owned()),
            "find" | "find-pkg-share" | "find-pkg-prefix" => Some(package(self.path, words)),
            "eval" => python::evaluate(inside.strip_prefix(verb)?.trim(), self.arguments),
            "equals" => both(|a, b| a == b),
            "not-equals" => both(|a, b| a != b),
            "and" => both(|a, b| is_true(a) && is_true(b)),
            "or" => both(|a, b| is_true(a) || is_true(b)),
            "not" => Some((!is_true(words)).to_string()),
            _ => None,
        }
    }
}

/// Whether the text of a condition is true, as in ROS 1 and ROS 2.
pub(super) fn is_true(text: &str) -> bool {
    ["true", "1", "yes", "on"].contains(&&*text.trim().to_lowercase())
}

/// A text without the quotes around it.
fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let quoted = |quote: char| text.strip_prefix(quote).and_then(|t| t.strip_suffix(quote));
    // With quotes inside, the outer ones belong to two texts: `'a' == 'b'`.
    let inside = |quote: char| quoted(quote).filter(|t| !t.contains(quote));
    inside('"').or(inside('\'')).unwrap_or(text)
}

/// The position of the parenthesis that closes the one at the start.
pub(crate) fn closing(text: &str) -> Option<usize> {
    let mut open = 1_usize;
    text.char_indices().find_map(|(at, c)| {
        match c {
            '(' => open += 1,
            ')' => open -= 1,
            _ => {}
        }
        (open == 0).then_some(at)
    })
}

/// The folder of a package, searched for above the file and beside those folders; its name if not found.
fn package(path: &Path, name: &str) -> String {
    let found = path.ancestors().skip(1).find_map(|folder| {
        let is_own = folder.file_name().is_some_and(|own| own == name);
        let beside = || Some(folder.join(name)).filter(|at| !name.is_empty() && at.is_dir());
        is_own.then(|| folder.to_owned()).or_else(beside)
    });
    let absolute = found.and_then(|folder| folder.canonicalize().ok());
    absolute.map_or_else(
        || name.to_owned(),
        |folder| folder.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn substituted(text: &str) -> Option<String> {
        let arguments = [("robot", "r1"), ("sim", "true"), ("which", "robot")];
        let arguments = arguments.map(|(a, b)| (a.to_owned(), b.to_owned())).into();
        let place = SubstitutionContext {
            path: Path::new("x.launch"),
            arguments: &arguments,
        };
        place.substitute(text, &mut LaunchWork::all())
    }

    #[test]
    fn static_substitutions_are_replaced() {
        for (text, expected) in [
            ("$(arg robot)/$(var robot)", "r1/r1"),
            ("$(var $(var which))", "r1"),
            ("$(env HOME /root)", "/root"),
            ("$(anon viewer)", "viewer*"),
            ("$(eval arg('robot') == 'r1')", "true"),
            ("$(eval \"'$(var robot)' == 'r2' or $(var sim)\")", "true"),
            ("$(not $(var sim))", "false"),
            ("$(equals $(var robot) r1)", "true"),
        ] {
            assert_eq!(substituted(text).as_deref(), Some(expected), "{text}");
        }
    }

    #[test]
    fn substitutions_that_need_execution_are_unknown() {
        for text in [
            "$(command hostname)",
            "$(arg nobody)",
            "$(env ROBOT)",
            "$(arg",
            "$(eval open('x'))",
        ] {
            assert_eq!(substituted(text), None, "{text}");
        }
    }
}
