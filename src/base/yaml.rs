//! YAML text as plain data, protected against documents with aliases that expand to far more than their size.

#[cfg(feature = "render")]
mod placed;

use std::ops::Range;

use serde::de::Deserialize;
use serde_saphyr::{Error, Location};

use super::budget::{YAML, YAML_VALUES};
use super::nearest::suggestion;

#[cfg(feature = "render")]
pub(crate) use placed::{At, Keyed, Pairs, YamlData, YamlNode, YamlPair};
pub(crate) use serde_json::Value;

/// A mistake in a YAML document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BadYaml {
    pub(crate) at: YamlPlace,
    /// The mistake on one line.
    pub(crate) reason: String,
    /// How to write it; empty for a mistake in the syntax of YAML.
    pub(crate) hint: String,
}

impl BadYaml {
    pub(crate) fn new(at: YamlPlace, reason: impl Into<String>, hint: impl Into<String>) -> Self {
        Self {
            at,
            reason: reason.into(),
            hint: hint.into(),
        }
    }

    /// The mistake of a key that is none of these.
    pub(crate) fn unknown_key(at: YamlPlace, key: &str, known: &[&str]) -> Self {
        let near = suggestion(key, known.iter().copied());
        let reason = format!("unknown key `{key}`{near}");
        Self::new(at, reason, format!("expected one of {}", known.join(", ")))
    }
}

/// The document as JSON data: mappings as objects with keys in order, scalars typed as in YAML 1.2.
///
/// # Errors
/// [`BadYaml`] with its line: broken syntax, several documents, nesting past 64, more than 8 MiB or 250,000 values, or
/// aliases that expand to more than 100,000 of them.
pub(crate) fn parse(text: &str) -> Result<Value, BadYaml> {
    read(text)
}

/// The document as this type, whose errors are hints on how to write a value.
///
/// # Errors
/// As for [`parse`], and for unknown keys and values of another type.
pub(crate) fn read<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, BadYaml> {
    if text.len() > YAML {
        return Err(BadYaml::new(YamlPlace::default(), "longer than 8 MiB", ""));
    }
    let options = serde_saphyr::options! {
        budget: serde_saphyr::budget! { max_nodes: YAML_VALUES },
        alias_limits: serde_saphyr::alias_limits! {
            max_total_replayed_events: 100_000,
            max_replay_stack_depth: 16,
            max_alias_expansions_per_anchor: 10_000,
        },
    };
    serde_saphyr::from_str_with_options(text, options).map_err(|error| mistake(text, &error))
}

/// The mistake that the parser or a type found, with a hint for a value of another type.
fn mistake(text: &str, error: &Error) -> BadYaml {
    let location = error.location();
    let at = location.map_or(YamlPlace::default(), YamlPlace::from);
    let mut inner = error.without_snippet();
    while let Error::AliasError { error, .. } = inner {
        inner = error;
    }
    let (key, pair) = location.map_or_else(Default::default, |at| pair_at(text, at));
    let key = match key {
        "" => "this".to_owned(),
        key => format!("`{key}`"),
    };
    let is_not = |what: &str, hint: &str| BadYaml::new(at, format!("{key} is not {what}"), hint);
    let is_invalid = |hint: &str| BadYaml::new(at, format!("`{pair}` is not valid"), hint);
    match inner {
        Error::SerdeUnknownField {
            field, expected, ..
        } => BadYaml::unknown_key(at, field, expected),
        Error::Unexpected { expected, .. } if expected.starts_with("mapping") => {
            is_not("a mapping", "write `key: value`")
        }
        Error::Unexpected { expected, .. } if expected.starts_with("sequence") => {
            is_not("a list", "write `[one, two]`")
        }
        Error::SerdeInvalidType { expected, .. } => is_not(expected, "write `[one, two]`"),
        Error::Unexpected { .. } => is_not("a string", "write one value"),
        Error::NullIntoString { .. } => {
            BadYaml::new(at, format!("{key} has no value"), "write one value")
        }
        Error::InvalidScalar { ty: "boolean", .. } => is_invalid("write `true` or `false`"),
        Error::Message { msg, .. } => is_invalid(msg),
        _ => BadYaml::new(at, reason(error), ""),
    }
}

/// The key before a value, and both as written: `hz` and `hz: 5..4`. The key of a value in a list is empty.
fn pair_at(text: &str, value: Location) -> (&str, &str) {
    let Range { start, end } = bytes(value);
    let (Some(before), Some(from)) = (text.get(..start), text.get(start..)) else {
        return Default::default();
    };
    let before = before.trim_end();
    // A missing value is where the colon is.
    let colon = before.strip_suffix(':');
    let key = colon.or_else(|| from.starts_with(':').then_some(before));
    let key = key.map_or("", |key| {
        let begin = key.rfind([' ', '\n', '{', ',']).map_or(0, |at| at + 1);
        &key[begin..]
    });
    let begin = match key {
        "" => start,
        key => before.rfind(key).unwrap_or(start),
    };
    let pair = text.get(begin..end).and_then(|pair| pair.lines().next());
    (key, pair.unwrap_or_default())
}

/// The bytes of a value.
fn bytes(location: Location) -> Range<usize> {
    let span = location.span();
    let [start, len] = [span.byte_offset(), span.byte_len()]
        .map(|bytes| bytes.and_then(|n| usize::try_from(n).ok()).unwrap_or(0));
    start..start.saturating_add(len)
}

/// A position in a document.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct YamlPlace {
    /// The line, ≥ 1; 0 if unknown.
    pub line: usize,
    /// The character in the line, ≥ 1; 0 if unknown.
    pub column: usize,
}

impl From<Location> for YamlPlace {
    fn from(at: Location) -> Self {
        Self {
            line: usize::try_from(at.line()).unwrap_or(0),
            column: usize::try_from(at.column()).unwrap_or(0),
        }
    }
}

/// A line for each of the parser's messages: a part of it, and what a user can do about it. Messages about Rust or parser
/// options are never shown.
const MISTAKES: &str = r"budget: it contains too many values, or they are nested too deeply
tabs disallowed: a tab indents the line; YAML only allows spaces
found a tab: a tab indents a line after it; YAML only allows spaces
did not find expected key: the indentation of the line differs from that of its siblings
expected '-' indicator: the list ends here; begin the line with `- `, or indent it as its key
multiple YAML documents: a second document begins; remove the line `---`
unknown anchor: `*` refers to an undefined anchor; put text that begins with `*` in quotes
mapping values are not allowed: more than one key in the line, or wrong indentation; put text that contains `: ` in quotes
simple key expected ':': the line is neither a key with `:` nor part of a list
unknown escape character: `\` begins no known escape; put the text in single quotes
misplaced bracket: a closing bracket has no opening one
multiline quoted scalar: a quote is not closed, or the line after it is not indented
recursion: values are nested too deeply";

/// The mistake as advice that a user can act on.
fn reason(error: &serde_saphyr::Error) -> String {
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    let mut mistakes = MISTAKES.lines().filter_map(|line| line.split_once(": "));
    if let Some((_, words)) = mistakes.find(|(pattern, _)| first.contains(pattern)) {
        return words.to_owned();
    }
    // The position is shown already: `error: line 2 column 2: …`.
    let placed = first.strip_prefix("error: line ");
    let placed = placed.and_then(|rest| rest.split_once(": "));
    let plain = placed.map_or(first, |(_, plain)| plain);
    let twice = plain.strip_prefix("duplicate mapping key: ");
    if let Some((key, _)) = twice.and_then(|rest| rest.rsplit_once(", set ")) {
        return format!("the key `{key}` occurs twice; keep one of them");
    }
    let sign = plain.strip_prefix("unexpected character: `");
    match sign.map(|sign| sign.trim_end_matches('\'')) {
        Some(sign) => format!("no value begins with `{sign}`; put it in quotes"),
        None => plain.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn documents_are_parsed_to_plain_data() {
        let text = "a: 1\nb: [x, 2.5, true, null]\nc:\n  - d: 'yes'\n    e: \"0x10\"\n";
        let data = json!({"a": 1, "b": ["x", 2.5, true, null], "c": [{"d": "yes", "e": "0x10"}]});
        assert_eq!(parse(text), Ok(data));
    }

    #[test]
    fn numbers_past_an_i64_and_empty_documents_are_data_too() {
        assert_eq!(parse("a: 9223372036854775807"), Ok(json!({"a": i64::MAX})));
        assert_eq!(parse("a: 18446744073709551615"), Ok(json!({"a": u64::MAX})));
        assert_eq!(parse(""), Ok(Value::Null));
    }

    #[test]
    fn mistakes_are_reported_with_advice() {
        let table = [
            ("a:\n\tb: 1\n", "a tab indents the line"),
            ("a: 1\na: 2\n", "the key `a` occurs twice"),
            ("a:\n b: 1\n  c: 2\n", "indent"),
            ("a: 1\n---\nb: 2\n", "remove the line `---`"),
            ("a: *x\n", "in quotes"),
            ("a: @b\n", "no value begins with `@`"),
            ("a: {b: 1\n", "unclosed bracket '{'"),
            ("a: \"b\n", "a quote is not closed"),
        ];
        for (text, words) in table {
            let reason = parse(text).unwrap_err().reason;
            assert!(reason.contains(words), "{text}: {reason}");
            let is_clean = ["error:", "Options", "from_str", " column "];
            assert!(
                !is_clean.iter().any(|word| reason.contains(word)),
                "{reason}"
            );
        }
    }

    #[test]
    fn syntax_errors_have_a_line() {
        let bad = parse("a: 1\nb: [1, 2\nc: 3\n").unwrap_err();
        assert!(bad.at.line >= 2 && !bad.reason.is_empty(), "{bad:?}");
    }

    #[test]
    fn an_alias_bomb_is_refused() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for i in 1..12 {
            let one = format!("*a{}, ", i - 1).repeat(10);
            text = format!("{text}a{i}: &a{i} [{one}]\n");
        }
        assert!(parse(&text).is_err());
        assert!(parse(&"[".repeat(100_000)).is_err());
    }

    #[test]
    fn a_document_over_the_limits_is_refused_with_our_message() {
        let many = parse(&format!("[{}]", "a, ".repeat(400_000))).unwrap_err();
        assert!(many.reason.contains("too many values"), "{many:?}");
    }
}
