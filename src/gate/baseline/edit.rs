//! An editor of YAML that changes one value and leaves every other character as it is.

use crate::base::yaml::{BadYaml, YamlData, YamlPart, YamlPlace, parse_placed};

/// A YAML text being edited.
#[derive(Clone, Debug)]
pub(super) struct EditedText(pub(super) String);

/// A pair of a mapping: the key, its position, and the value.
type Pair = (String, YamlPlace, YamlPart);

impl EditedText {
    /// Sets `key` of an entry to `value`, both as YAML; does nothing without such an entry.
    pub(super) fn set(
        &mut self,
        section: &str,
        entry: &str,
        key: &str,
        value: &str,
    ) -> Result<(), BadYaml> {
        let whole = parse_placed(&self.0)?;
        let Some((_, at, body)) = find(&whole, section).and_then(|s| find_pair(s, entry)) else {
            return Ok(());
        };
        if let YamlData::Map(pairs) = &body.data {
            match pairs.iter().find(|(own, ..)| own == key) {
                Some(pair) => self.replace(pair, value),
                None => self.add(body, pairs, key, value),
            }
        } else {
            let colon = self.after_key(*at);
            self.0.insert_str(colon, &format!(" {{{key}: {value}}}"));
        }
        Ok(())
    }

    /// Removes `key` of an entry.
    pub(super) fn unset(&mut self, section: &str, entry: &str, key: &str) -> Result<(), BadYaml> {
        let whole = parse_placed(&self.0)?;
        let body = find(&whole, section).and_then(|s| find_pair(s, entry));
        if let Some((_, _, body)) = body
            && let Some(pair) = find_pair(body, key)
        {
            self.remove(body, pair);
        }
        Ok(())
    }

    /// Removes an entry.
    pub(super) fn drop_entry(&mut self, section: &str, entry: &str) -> Result<(), BadYaml> {
        let whole = parse_placed(&self.0)?;
        if let Some(section) = find(&whole, section)
            && let Some(pair) = find_pair(section, entry)
        {
            self.remove(section, pair);
        }
        Ok(())
    }

    /// Adds an entry in sorted position; `key` is the name as YAML.
    pub(super) fn insert(
        &mut self,
        section: &str,
        entry: &str,
        key: &str,
        value: &str,
    ) -> Result<(), BadYaml> {
        let whole = parse_placed(&self.0)?;
        let pairs = find(&whole, section).map(|s| (s, &s.data));
        let Some((body, YamlData::Map(pairs))) = pairs else {
            self.begin(&whole, section, key, value);
            return Ok(());
        };
        if pairs.is_empty() || self.is_flow(body) {
            self.add(body, pairs, key, value);
            return Ok(());
        }
        let next = pairs.iter().find(|(name, ..)| name.as_str() > entry);
        let indent = pairs
            .first()
            .map_or(2, |(_, at, _)| at.column.saturating_sub(1));
        let line = format!("{}{key}: {value}\n", " ".repeat(indent));
        let at = match (next, pairs.last()) {
            (Some((_, at, _)), _) => self.line_start(at.line),
            (None, Some(last)) => self.line_end(self.end(last)),
            (None, None) => self.0.len(),
        };
        self.insert_line(at, &line);
        Ok(())
    }

    /// Adds a section that is missing or empty.
    fn begin(&mut self, whole: &YamlPart, section: &str, key: &str, value: &str) {
        let line = format!("  {key}: {value}\n");
        if let Some((_, at, _)) = find_pair(whole, section) {
            let end = self.line_end(self.after_key(*at));
            self.insert_line(end, &line);
        } else {
            let end = self.0.len();
            self.insert_line(end, &format!("{section}:\n{line}"));
        }
    }

    /// Puts a whole line at `at`, which begins one.
    fn insert_line(&mut self, at: usize, line: &str) {
        let open = at > 0 && !self.0[..at].ends_with('\n');
        self.0
            .insert_str(at, &format!("{}{line}", if open { "\n" } else { "" }));
    }

    fn replace(&mut self, pair: &Pair, value: &str) {
        let colon = self.after_key(pair.1);
        let end = self.end(pair);
        // An inline value stays inline; a block list becomes inline.
        let start = if self.line_of(colon) == pair.2.at.line {
            self.offset(pair.2.at).max(colon)
        } else {
            colon
        };
        let gap = if self.0[..start].ends_with(':') {
            " "
        } else {
            ""
        };
        self.0
            .replace_range(start..end.max(start), &format!("{gap}{value}"));
    }

    fn add(&mut self, body: &YamlPart, pairs: &[Pair], key: &str, value: &str) {
        if self.is_flow(body) {
            let close = self.close(self.offset(body.at)).saturating_sub(1);
            let comma = if pairs.is_empty() { "" } else { ", " };
            self.0.insert_str(close, &format!("{comma}{key}: {value}"));
        } else if let Some((_, at, _)) = pairs.first() {
            let indent = " ".repeat(at.column.saturating_sub(1));
            let start = self.line_start(at.line);
            self.0
                .insert_str(start, &format!("{indent}{key}: {value}\n"));
        }
    }

    fn remove(&mut self, body: &YamlPart, pair: &Pair) {
        let end = self.end(pair);
        if !self.is_flow(body) {
            let start = self.line_start(pair.1.line);
            let end = self.line_end(end);
            self.0.replace_range(start..end, "");
            return;
        }
        let start = self.offset(pair.1);
        let rest = self.0[end..].trim_start();
        if let Some(after) = rest.strip_prefix(',') {
            let end = self.0.len() - after.trim_start().len();
            self.0.replace_range(start..end, "");
        } else {
            let before = self.0[..start].trim_end();
            let start = before.strip_suffix(',').map_or(start, str::len);
            self.0.replace_range(start..end, "");
        }
    }

    /// The byte at which the value of a pair ends.
    fn end(&self, pair: &Pair) -> usize {
        let colon = self.after_key(pair.1);
        match &pair.2.data {
            YamlData::Scalar(text) if text.is_empty() && self.line_of(colon) != pair.2.at.line => {
                colon
            }
            YamlData::List(list) if !self.is_flow(&pair.2) => {
                list.last().map_or(colon, |last| self.end_of_value(last))
            }
            YamlData::Map(pairs) if !self.is_flow(&pair.2) => {
                pairs.last().map_or(colon, |last| self.end(last))
            }
            _ => self.end_of_value(&pair.2).max(colon),
        }
    }

    fn end_of_value(&self, value: &YamlPart) -> usize {
        let start = self.offset(value.at);
        if self.0[start..].starts_with(['[', '{', '"', '\'']) {
            return self.close(start);
        }
        let line = self.0[start..].split('\n').next().unwrap_or_default();
        let ends = [line.find(" #"), line.find([',', ']', '}'])];
        let end = ends.into_iter().flatten().min().unwrap_or(line.len());
        start + line[..end].trim_end().len()
    }

    /// The byte after the closing bracket or quote of the one at `start`.
    fn close(&self, start: usize) -> usize {
        let mut depth = 0_usize;
        let mut chars = self.0[start..].char_indices().peekable();
        while let Some((at, c)) = chars.next() {
            match c {
                '"' | '\'' => {
                    while let Some((_, inner)) = chars.next() {
                        match inner {
                            '\\' if c == '"' => drop(chars.next()),
                            '\'' if c == '\'' && chars.next_if(|(_, n)| *n == '\'').is_some() => {}
                            _ if inner == c => break,
                            _ => {}
                        }
                    }
                    if depth == 0 {
                        return chars.peek().map_or(self.0.len(), |(next, _)| start + next);
                    }
                }
                '#' if self.0[..start + at].ends_with([' ', '\n']) => {
                    while chars.next_if(|(_, n)| *n != '\n').is_some() {}
                }
                '[' | '{' => depth += 1,
                ']' | '}' => {
                    depth = depth.saturating_sub(1);
                    if depth == 0 {
                        return start + at + 1;
                    }
                }
                _ => {}
            }
        }
        self.0.len()
    }

    fn is_flow(&self, part: &YamlPart) -> bool {
        self.0[self.offset(part.at)..].starts_with(['{', '['])
    }

    /// The byte after the colon of a key.
    fn after_key(&self, at: YamlPlace) -> usize {
        let start = self.offset(at);
        let key = match self.0[start..].chars().next() {
            Some('"' | '\'') => self.close(start),
            _ => start,
        };
        let rest = &self.0[key..];
        let ends = rest.match_indices(':').map(|(at, _)| at + 1);
        // A colon inside a plain key is followed by a letter.
        let mut ends =
            ends.filter(|end| rest[*end..].chars().next().is_none_or(char::is_whitespace));
        ends.next().map_or(self.0.len(), |end| key + end)
    }

    /// The byte offset of a position.
    fn offset(&self, at: YamlPlace) -> usize {
        let start = self.line_start(at.line);
        let line = &self.0[start..];
        let mut chars = line.char_indices();
        let within = chars
            .nth(at.column.saturating_sub(1))
            .map_or(line.len(), |(byte, _)| byte);
        start + within
    }

    fn line_start(&self, line: usize) -> usize {
        let mut lines = self.0.split_inclusive('\n');
        (1..line).filter_map(|_| lines.next()).map(str::len).sum()
    }

    fn line_of(&self, at: usize) -> usize {
        self.0[..at].matches('\n').count() + 1
    }

    /// The beginning of the line after `at`.
    fn line_end(&self, at: usize) -> usize {
        self.0[at..]
            .find('\n')
            .map_or(self.0.len(), |end| at + end + 1)
    }
}

/// The value of a key.
fn find<'a>(part: &'a YamlPart, key: &str) -> Option<&'a YamlPart> {
    find_pair(part, key).map(|(.., value)| value)
}

fn find_pair<'a>(part: &'a YamlPart, key: &str) -> Option<&'a Pair> {
    match &part.data {
        YamlData::Map(pairs) => pairs.iter().find(|(own, ..)| own == key),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "\
# ours
nodes:
  /a: {} # first
  /c:   {restarts: ..0}   # kept

topics:
  /scan: {hz: 9..11, by: [/a, \"/b: x\"]} # fast
  /block:
    # slow, but even
    hz: 1..2   # rate
    by:
      - /a
      - /c
  /null:
";

    fn edited(edit: impl Fn(&mut EditedText) -> Result<(), BadYaml>) -> String {
        let mut text = EditedText(FILE.to_owned());
        edit(&mut text).unwrap();
        parse_placed(&text.0).unwrap();
        text.0
    }

    /// The lines that are not in both.
    fn differing(text: &str) -> (Vec<&str>, Vec<&str>) {
        let gone = FILE.lines().filter(|l| !text.lines().any(|o| o == *l));
        let new = text.lines().filter(|l| !FILE.lines().any(|o| o == *l));
        (gone.collect(), new.collect())
    }

    /// Checks that an edit replaces only this part of the file.
    fn replaces(edit: impl Fn(&mut EditedText) -> Result<(), BadYaml>, old: &str, new: &str) {
        assert_eq!(edited(edit), FILE.replace(old, new));
    }

    #[test]
    fn only_the_value_is_changed() {
        let topic = |name, key, value| move |t: &mut EditedText| t.set("topics", name, key, value);
        replaces(topic("/scan", "hz", "5..6"), "9..11", "5..6");
        replaces(topic("/scan", "by", "[/z]"), "[/a, \"/b: x\"]", "[/z]");
        replaces(topic("/block", "hz", "5..6"), "1..2", "5..6");
        let list = "by:\n      - /a\n      - /c";
        replaces(topic("/block", "by", "[/z]"), list, "by: [/z]");
    }

    #[test]
    fn keys_are_added_to_entries_with_or_without_keys() {
        let ends = |name| move |t: &mut EditedText| t.set("nodes", name, "may_end", "true");
        replaces(ends("/a"), "/a: {} #", "/a: {may_end: true} #");
        replaces(ends("/c"), "..0}", "..0, may_end: true}");
        let rate = |t: &mut EditedText| t.set("topics", "/null", "hz", "1..");
        replaces(rate, "/null:", "/null: {hz: 1..}");
        let text = edited(|t| t.set("topics", "/block", "latched", "true"));
        let added = differing(&text);
        assert_eq!(added, (vec![], vec!["    latched: true"]));
    }

    #[test]
    fn entries_are_added_and_removed_with_their_lines() {
        replaces(|t| t.drop_entry("nodes", "/a"), "  /a: {} # first\n", "");
        replaces(|t| t.drop_entry("topics", "/null"), "  /null:\n", "");
        replaces(|t| t.unset("topics", "/scan", "hz"), "hz: 9..11, ", "");
        let by = ", by: [/a, \"/b: x\"]";
        replaces(|t| t.unset("topics", "/scan", "by"), by, "");
        let insert = |name| move |t: &mut EditedText| t.insert("nodes", name, name, "{}");
        replaces(insert("/b"), "  /c:  ", "  /b: {}\n  /c:  ");
        replaces(insert("/d"), "# kept\n", "# kept\n  /d: {}\n");
        let text = edited(|t| t.insert("rules", "/d", "/d", "{}"));
        assert_eq!(text, format!("{FILE}rules:\n  /d: {{}}\n"));
    }
}
