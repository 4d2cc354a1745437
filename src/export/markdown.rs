//! Markdown for pull requests and job summaries, written here alone. Texts from a bag are escaped, so that they create no
//! markup, HTML, mentions or links; long parts are cut or collapsed, since services refuse long texts.

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

/// A row of a table.
pub(crate) fn row(cells: &[String]) -> String {
    format!("| {} |\n", cells.join(" | "))
}

/// A table of these rows.
pub(crate) fn table(heads: &[&str], rows: &[String]) -> String {
    // The column of signs has no head.
    let heading = format!("| {} |", heads.join(" | ")).replacen("|  |", "| |", 1);
    let rule = "---|".repeat(heads.len());
    format!("{heading}\n|{rule}\n{}", rows.concat())
}

/// Keeps the first of these parts that have at most `most` bytes together; returns the number of the others.
pub(crate) fn cut(parts: &mut Vec<String>, most: usize) -> usize {
    let mut free = most;
    let fits = |part: &&String| match free.checked_sub(part.len()) {
        Some(rest) => {
            free = rest;
            true
        }
        None => false,
    };
    let (kept, all) = (parts.iter().take_while(fits).count(), parts.len());
    parts.truncate(kept);
    all - kept
}

/// Text that is collapsed until its summary is clicked.
pub(crate) fn folded(summary: &str, inside: &str) -> String {
    format!("<details><summary>{summary}</summary>\n\n{inside}\n</details>\n\n")
}

/// A block of code that can be copied, or that a service draws. Its fence is longer than any run of backticks inside.
pub(crate) fn block(language: &str, code: &str) -> String {
    let runs = code.split(|c| c != '`').map(str::len);
    let fence = "`".repeat((runs.max().unwrap_or(0) + 1).max(3));
    format!("{fence}{language}\n{code}\n{fence}")
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
