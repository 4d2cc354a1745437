//! The name filters of `rqt_graph`'s window: the texts of its two boxes, with exactly its rules.

use regex::Regex;

use crate::base::error::{Error, Result};

/// A list of names and patterns, some of them exclusions. The default accepts every name.
///
/// The rules are those of `matches_any` and `_split_filter_string` in `rqt_graph/dotcode.py`: tokens are split at
/// commas and stripped; one that begins with `-` excludes; a lone `/` or nothing includes everything. A token matches
/// a name that it equals, and, if it contains a character outside `[A-Za-z0-9_/]`, as a pattern at the name's beginning.
#[derive(Clone, Debug, Default)]
pub struct NameFilter {
    includes: Vec<FilterToken>,
    excludes: Vec<FilterToken>,
}

#[derive(Clone, Debug)]
struct FilterToken {
    text: String,
    pattern: Option<Regex>,
}

impl NameFilter {
    /// Whether it accepts every name.
    pub(crate) fn is_empty(&self) -> bool {
        self.includes.is_empty() && self.excludes.is_empty()
    }

    /// The filter of this text.
    ///
    /// # Errors
    /// [`Error::Usage`] for a pattern that is not a regular expression, or one that needs features that only Python has.
    pub fn parse(text: &str) -> Result<Self> {
        let tokens: Vec<&str> = text.split(',').map(str::trim).collect();
        let excludes = tokens.iter().filter_map(|t| t.strip_prefix('-'));
        let excludes = excludes.map(FilterToken::new).collect::<Result<_>>()?;
        let mut includes: Vec<&str> = tokens;
        includes.retain(|t| !t.starts_with('-'));
        if matches!(includes[..], ["/" | ""]) {
            includes.clear();
        }
        let includes = includes.into_iter().map(FilterToken::new);
        let includes = includes.collect::<Result<_>>()?;
        Ok(Self { includes, excludes })
    }

    /// Whether a name passes: an inclusion matches it, or none is given, and no exclusion matches it.
    pub fn passes(&self, name: &str) -> bool {
        let name = name.trim();
        let included = self.includes.is_empty() || self.includes.iter().any(|t| t.matches(name));
        included && !self.excludes.iter().any(|t| t.matches(name))
    }

    /// The inclusions as they were written: names and patterns.
    pub(crate) fn wanted(&self) -> Vec<&str> {
        self.includes.iter().map(|t| t.text.as_str()).collect()
    }

    /// The inclusions and, with their `-`, the exclusions that match none of these names, as they were written.
    pub(crate) fn unused(&self, names: &[&str]) -> Vec<String> {
        let is_used = |token: &&FilterToken| names.iter().any(|name| token.matches(name.trim()));
        let includes = self.includes.iter().filter(|token| !is_used(token));
        let includes = includes.map(|token| token.text.clone());
        let excludes = self.excludes.iter().filter(|token| !is_used(token));
        includes
            .chain(excludes.map(|token| format!("-{}", token.text)))
            .collect()
    }

    /// Whether every name passes.
    pub fn passes_all(&self) -> bool {
        self.includes.is_empty() && self.excludes.is_empty()
    }
}

impl FilterToken {
    fn new(text: &str) -> Result<Self> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
        let is_pattern = text.is_empty() || !text.chars().all(plain);
        Ok(Self {
            text: text.to_owned(),
            pattern: is_pattern.then(|| anchored(text)).transpose()?,
        })
    }

    fn matches(&self, name: &str) -> bool {
        self.text == name || self.pattern.as_ref().is_some_and(|p| p.is_match(name))
    }
}

/// The pattern as in Python's `re.match`: anchored at the start of the text, free to end anywhere.
fn anchored(pattern: &str) -> Result<Regex> {
    // Compiled alone first, so that a stray `)` cannot close our group.
    let compiled = Regex::new(pattern).and_then(|_| Regex::new(&format!(r"\A(?:{pattern})")));
    compiled.map_err(|error| {
        let text = error.to_string();
        let reason = text.lines().last().unwrap_or_default();
        let reason = reason.trim().trim_start_matches("error: ");
        Error::usage(
            format!("`{pattern}` is not a pattern for names: {reason}"),
            "patterns are regular expressions: `/robot1/.*`, `-/rqt.*`",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names that pass, as one text.
    fn passing(filter: &str, names: &[&str]) -> String {
        let filter = NameFilter::parse(filter).unwrap();
        let kept: Vec<&str> = names.iter().copied().filter(|n| filter.passes(n)).collect();
        kept.join(" ")
    }

    const NAMES: &[&str] = &["/tf", "/tf_static", "/rqt_gui", "/r1/tf"];

    #[test]
    fn plain_names_match_only_themselves() {
        assert_eq!(passing("/tf", NAMES), "/tf");
        assert_eq!(passing(" /tf , /r1/tf", NAMES), "/tf /r1/tf");
    }

    #[test]
    fn patterns_are_anchored_at_the_start_only() {
        assert_eq!(passing("/tf.*", NAMES), "/tf /tf_static");
        assert_eq!(passing("/t.", NAMES), "/tf /tf_static");
        assert_eq!(passing("tf.*", NAMES), "");
        assert_eq!(passing("/x|/r1", NAMES), "/r1/tf");
    }

    #[test]
    fn a_dash_excludes_and_alone_includes_the_rest() {
        assert_eq!(passing("-/rqt.*", NAMES), "/tf /tf_static /r1/tf");
        assert_eq!(passing("/.*,-/tf", NAMES), "/tf_static /rqt_gui /r1/tf");
        assert_eq!(passing("/,-/tf", NAMES), "/tf_static /rqt_gui /r1/tf");
    }

    #[test]
    fn an_empty_filter_or_a_lone_slash_matches_everything() {
        for all in ["", "/", "  "] {
            assert_eq!(passing(all, NAMES), NAMES.join(" "));
        }
        assert_eq!(passing("/,/tf", NAMES), "/tf");
        // An empty token is an empty pattern, which matches everything, as in Python.
        assert_eq!(passing("/tf,", NAMES), NAMES.join(" "));
        assert_eq!(passing("-", NAMES), "");
    }

    #[test]
    fn an_invalid_pattern_is_a_usage_error() {
        for bad in ["/a(", "-[", "a)(b", "(?=/tf)"] {
            assert!(NameFilter::parse(bad).unwrap_err().is_usage(), "{bad}");
        }
    }
}
