//! The keys of a mapping: unknown keys and wrong types are errors with the position and the nearest known key.

use std::path::Path;

use super::super::pattern::Pattern;
use super::super::range::{During, Range};
use super::{At, YamlPlace};
use crate::base::error::{Error, Result};
use crate::base::nearest::suggestion;
use crate::base::time::parse_nanos;
use crate::base::yaml::{YamlData, YamlPart};

/// The document.
#[derive(Clone, Copy)]
pub(super) struct Document<'a> {
    pub(super) path: &'a Path,
}

impl<'a> Document<'a> {
    /// The error at a position, with a hint.
    pub(super) fn bad(
        self,
        at: YamlPlace,
        reason: impl Into<String>,
        hint: impl Into<String>,
    ) -> Error {
        Error::BadFile {
            path: self.path.to_owned(),
            line: at.line,
            column: at.column,
            reason: reason.into(),
            hint: hint.into(),
        }
    }

    /// The error for an unknown word.
    pub(super) fn unknown<'w>(
        self,
        at: YamlPlace,
        what: &str,
        word: &str,
        known: impl Iterator<Item = &'w str> + Clone,
    ) -> Error {
        let near = suggestion(word, known.clone());
        let all: Vec<&str> = known.collect();
        self.bad(
            at,
            format!("unknown {what} `{word}`{near}"),
            format!("expected one of {}", all.join(", ")),
        )
    }

    /// The pairs of a mapping; none of an empty value.
    pub(super) fn pairs(
        self,
        part: &'a YamlPart,
        what: &str,
    ) -> Result<&'a [(String, YamlPlace, YamlPart)]> {
        match &part.data {
            YamlData::Map(pairs) => Ok(pairs),
            YamlData::Scalar(text) if text.is_empty() => Ok(&[]),
            _ => Err(self.bad(
                part.at,
                format!("{what} is not a mapping"),
                "write `key: value`",
            )),
        }
    }

    /// The members of a list; none of an empty value.
    pub(super) fn list(self, part: &'a YamlPart, what: &str) -> Result<&'a [YamlPart]> {
        match &part.data {
            YamlData::List(list) => Ok(list),
            YamlData::Scalar(text) if text.is_empty() => Ok(&[]),
            _ => Err(self.bad(
                part.at,
                format!("{what} is not a list"),
                "write `[one, two]`",
            )),
        }
    }

    /// The text of a scalar that is not empty.
    pub(super) fn text(self, part: &'a YamlPart, what: &str) -> Result<&'a str> {
        match &part.data {
            YamlData::Scalar(text) if !text.is_empty() => Ok(text),
            _ => Err(self.bad(
                part.at,
                format!("{what} is not a string"),
                "write one value",
            )),
        }
    }

    /// The mapping `part` with its allowed keys, separated by spaces.
    pub(super) fn fields(
        self,
        part: &'a YamlPart,
        what: &'a str,
        known: &'static str,
    ) -> Result<Fields<'a>> {
        let pairs = self.pairs(part, what)?;
        let fields = Fields {
            document: self,
            at: part.at,
            pairs,
        };
        match fields.other(known) {
            Some((key, at)) => Err(self.unknown(at, "key", key, known.split(' '))),
            None => Ok(fields),
        }
    }
}

/// A mapping whose keys are all known.
#[derive(Clone, Copy)]
pub(super) struct Fields<'a> {
    pub(super) document: Document<'a>,
    pub(super) at: YamlPlace,
    pairs: &'a [(String, YamlPlace, YamlPart)],
}

impl<'a> Fields<'a> {
    /// The value of a key, if present.
    pub(super) fn get(&self, key: &str) -> Option<&'a YamlPart> {
        self.pairs.iter().find(|(k, ..)| k == key).map(|(.., v)| v)
    }

    /// The value of a required key.
    pub(super) fn need(&self, key: &str, hint: &str) -> Result<&'a YamlPart> {
        let missing = || {
            self.document
                .bad(self.at, format!("`{key}` is missing"), hint)
        };
        self.get(key).ok_or_else(missing)
    }

    /// The first key that is not one of these.
    pub(super) fn other(&self, keys: &str) -> Option<(&'a str, YamlPlace)> {
        let is_other = |key: &str| keys.split(' ').all(|known| known != key);
        let mut pairs = self.pairs.iter();
        let other = pairs.find(|(key, ..)| is_other(key));
        other.map(|(key, at, _)| (key.as_str(), *at))
    }

    /// The value of a key, read by `parse`; `hint` explains the syntax.
    pub(super) fn read<T>(
        &self,
        key: &str,
        hint: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<At<T>>> {
        let Some(part) = self.get(key) else {
            return Ok(None);
        };
        let text = self.document.text(part, &format!("`{key}`"))?;
        let wrong = || {
            self.document
                .bad(part.at, format!("`{key}: {text}` is not valid"), hint)
        };
        let value = parse(text).ok_or_else(wrong)?;
        Ok(Some(At { at: part.at, value }))
    }

    pub(super) fn string(&self, key: &str) -> Result<Option<At<String>>> {
        self.read(key, "", |text| Some(text.to_owned()))
    }

    pub(super) fn name(&self, key: &str) -> Result<Option<At<Pattern>>> {
        self.read(key, "", |text| Some(Pattern::new(text)))
    }

    pub(super) fn flag(&self, key: &str) -> Result<Option<At<bool>>> {
        self.read(key, "write `true` or `false`", |text| text.parse().ok())
    }

    /// A flag, `false` by default.
    pub(super) fn is_set(&self, key: &str) -> Result<bool> {
        Ok(self.flag(key)?.is_some_and(|flag| flag.value))
    }

    pub(super) fn range(&self, key: &str) -> Result<Option<At<Range>>> {
        self.read(
            key,
            "write a range: `13.5..16.5`, `5..` or `..1`, the smaller number first",
            Range::parse,
        )
    }

    pub(super) fn length(&self, key: &str) -> Result<Option<At<i64>>> {
        self.read(key, "write a duration: `20s`, `500ms`, `1m`", parse_nanos)
    }

    /// The time range in which an element may end: the whole mission if `true`.
    pub(super) fn may_end(&self) -> Result<Option<At<During>>> {
        let parse = |text: &str| match text {
            "true" => Some(Some(During::WHOLE)),
            "false" => Some(None),
            text => During::parse(text).map(Some),
        };
        let hint = "write `true`, or when it may end: `1:30..`, `-20s..`, the earlier time first";
        let found = self.read("may_end", hint, parse)?;
        Ok(found.and_then(|At { at, value }| Some(At { at, value: value? })))
    }

    /// The time range in which an element must start: `within`, or a length from the start, `present_within`.
    pub(super) fn within(&self) -> Result<Option<At<During>>> {
        if let Some(length) = self.length("present_within")? {
            if self.get("within").is_some() {
                let reason = "`present_within` cannot be combined with `within`";
                let hint = "`present_within: 20s` means `within: ..20s`";
                return Err(self.document.bad(length.at, reason, hint));
            }
            return Ok(Some(At {
                at: length.at,
                value: During::until(length.value),
            }));
        }
        let hint = "write an interval: `1:30..2m`, `..20s`, the earlier time first";
        self.read("within", hint, During::parse)
    }

    pub(super) fn during(&self) -> Result<Option<During>> {
        let hint = "write an interval: `1:30..2m`, `-30s..`, the earlier time first";
        Ok(self.read("during", hint, During::parse)?.map(|d| d.value))
    }

    /// A list of names, or one name.
    pub(super) fn names(&self, key: &str) -> Result<Option<At<Vec<At<Pattern>>>>> {
        let Some(part) = self.get(key) else {
            return Ok(None);
        };
        let what = format!("`{key}`");
        let mut names = Vec::new();
        let list = match &part.data {
            YamlData::Scalar(text) if !text.is_empty() => std::slice::from_ref(part),
            _ => self.document.list(part, &what)?,
        };
        for one in list {
            names.push(At {
                at: one.at,
                value: Pattern::new(self.document.text(one, &what)?),
            });
        }
        Ok(Some(At {
            at: part.at,
            value: names,
        }))
    }
}
