//! Escapes texts from a bag for Markdown, so that they create no markup, HTML, mentions or links.

use std::fmt::Write as _;

use crate::base::words::visible;

/// The most characters of a text; a longer one is cut, so that one hostile name cannot fill a report.
const LONGEST: usize = 600;

/// `text` verbatim, in one line of Markdown or a cell of a table.
pub(crate) fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 16);
    let shown = visible(text);
    let mut chars = shown.chars().take(LONGEST).peekable();
    while let Some(c) = chars.next() {
        match c {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            // A zero-width space prevents a mention or a reference.
            '@' | '#' => {
                let _ = write!(out, "&#{};&#8203;", u32::from(c));
            }
            // Prevents automatic links.
            ':' if chars.peek() == Some(&'/') => out.push_str("&#58;"),
            '.' if out.to_ascii_lowercase().ends_with("www") => out.push_str("&#46;"),
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '~' | '$' | '!' => {
                out.push('\\');
                out.push(c);
            }
            _ => out.push(c),
        }
    }
    if shown.chars().nth(LONGEST).is_some() {
        out.push('…');
    }
    out
}

/// A name in a cell of a table: as code if it only has harmless characters.
pub(crate) fn code(name: &str) -> String {
    let harmless = |c: char| c.is_alphanumeric() || matches!(c, '/' | '_' | '-' | '.' | '~' | ':');
    let is_name = !name.is_empty() && name.len() <= LONGEST && name.chars().all(harmless);
    if is_name {
        format!("`{name}`")
    } else {
        plain(name)
    }
}

/// An address inside `<…>`.
pub(crate) fn address(url: &str) -> String {
    let mut out = String::new();
    for c in visible(url).chars() {
        match c {
            '<' => out.push_str("%3C"),
            '>' => out.push_str("%3E"),
            '\\' => out.push_str("%5C"),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_create_no_markup() {
        let text = plain("<img src=x onerror=alert(1)> **@you** #12 [a](http://b) |x| www.c.d\n");
        assert_eq!(
            text,
            "&lt;img src=x onerror=alert(1)&gt; \\*\\*&#64;&#8203;you\\*\\* &#35;&#8203;12 \
             \\[a\\](http&#58;//b) \\|x\\| www&#46;c.d\\\\u{a}"
        );
    }

    #[test]
    fn harmless_names_are_code() {
        assert_eq!(code("/base/cmd_vel"), "`/base/cmd_vel`");
        assert_eq!(code("/a`b"), "/a\\`b");
        assert_eq!(address("https://a/<b>"), "https://a/%3Cb%3E");
    }
}
