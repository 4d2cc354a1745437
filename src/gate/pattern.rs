//! Patterns with wildcards: `*` matches any characters except `/`, `**` any characters, `?` one that is not `/`.

use std::collections::BTreeSet;
use std::fmt;

/// A name that may contain wildcards.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Pattern {
    text: String,
    parts: Vec<PatternPart>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum PatternPart {
    This(char),
    One,
    Some,
    All,
}

impl Pattern {
    /// The pattern of this text.
    pub(crate) fn new(text: &str) -> Self {
        let mut parts = Vec::new();
        for c in text.chars() {
            match (c, parts.last()) {
                ('*', Some(PatternPart::Some | PatternPart::All)) => {
                    parts.pop();
                    parts.push(PatternPart::All);
                }
                ('*', _) => parts.push(PatternPart::Some),
                ('?', _) => parts.push(PatternPart::One),
                (c, _) => parts.push(PatternPart::This(c)),
            }
        }
        Self {
            text: text.to_owned(),
            parts,
        }
    }

    /// The pattern as written.
    pub(crate) fn as_str(&self) -> &str {
        &self.text
    }

    /// Whether it has no wildcards.
    pub(crate) fn is_name(&self) -> bool {
        self.parts.iter().all(|p| matches!(p, PatternPart::This(_)))
    }

    /// Whether it matches a name. The cost is at most the product of both lengths.
    pub(crate) fn matches(&self, name: &str) -> bool {
        if self.is_name() {
            return self.text == name;
        }
        // Which prefixes of the pattern match the part of the name read so far.
        let mut fits = vec![false; self.parts.len() + 1];
        fits[0] = true;
        self.skip_blanks(&mut fits);
        for c in name.chars() {
            let mut next = vec![false; fits.len()];
            for (at, part) in self.parts.iter().enumerate().filter(|(at, _)| fits[*at]) {
                match part {
                    PatternPart::This(own) => next[at + 1] |= *own == c,
                    PatternPart::One => next[at + 1] |= c != '/',
                    PatternPart::Some => next[at] |= c != '/',
                    PatternPart::All => next[at] = true,
                }
            }
            self.skip_blanks(&mut next);
            fits = next;
        }
        fits.last().copied().unwrap_or(false)
    }

    /// Lets wildcards match nothing.
    fn skip_blanks(&self, fits: &mut [bool]) {
        for (at, part) in self.parts.iter().enumerate() {
            if fits[at] && matches!(part, PatternPart::Some | PatternPart::All) {
                fits[at + 1] = true;
            }
        }
    }
}

/// A set of names and patterns.
#[derive(Debug, Default)]
pub(crate) struct NamePatterns<'a> {
    exact: BTreeSet<&'a str>,
    patterns: Vec<&'a Pattern>,
}

impl<'a> FromIterator<&'a Pattern> for NamePatterns<'a> {
    fn from_iter<I: IntoIterator<Item = &'a Pattern>>(all: I) -> Self {
        let mut names = Self::default();
        for pattern in all {
            if pattern.is_name() {
                names.exact.insert(pattern.as_str());
            } else {
                names.patterns.push(pattern);
            }
        }
        names
    }
}

impl NamePatterns<'_> {
    /// Whether one of them matches this name.
    pub(crate) fn hold(&self, name: &str) -> bool {
        self.exact.contains(name) || self.patterns.iter().any(|p| p.matches(name))
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_contains_what_one_of_its_patterns_matches() {
        let all = ["/a", "/cam_*", "/b"].map(Pattern::new);
        let names: NamePatterns<'_> = all.iter().collect();
        let held = ["/a", "/b", "/cam_1", "/c", "/cam_1/x"].map(|name| names.hold(name));
        assert_eq!(held, [true, true, true, false, false]);
    }

    #[test]
    fn wildcards_match_parts_of_names() {
        let table = [
            ("/scan", "/scan", true),
            ("/scan", "/scan2", false),
            ("/nav/*", "/nav/planner", true),
            ("/nav/*", "/nav/a/b", false),
            ("/nav/**", "/nav/a/b", true),
            ("/cam_*/image", "/cam_front/image", true),
            ("/cam_*/image", "/cam_/raw/image", false),
            ("/cam_?", "/cam_1", true),
            ("/cam_?", "/cam_", false),
            ("*", "a", true),
            ("**", "/a/b", true),
            ("/a*b*c", "/aXbbYc", true),
        ];
        for (pattern, name, fits) in table {
            assert_eq!(
                Pattern::new(pattern).matches(name),
                fits,
                "{pattern} {name}"
            );
        }
    }
}
