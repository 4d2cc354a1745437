//! The writer of all our SVG: it closes all tags and escapes all text.

use std::fmt::{self, Display, Write as _};

use crate::base::cast;
use crate::base::words::is_invisible;

/// XML being written. Values and texts are escaped as they are written; tags close themselves in order.
#[derive(Debug, Default)]
pub(crate) struct Xml {
    out: String,
    /// Tags that are open, the innermost last.
    tags: Vec<&'static str>,
    /// Whether attributes can still be added to the innermost tag.
    is_start: bool,
}

impl Xml {
    /// Empty XML with capacity for `bytes` bytes.
    pub(crate) fn with_capacity(bytes: usize) -> Self {
        Self {
            out: String::with_capacity(bytes),
            ..Self::default()
        }
    }

    /// Opens a tag inside the one that is open.
    pub(crate) fn open(&mut self, tag: &'static str) -> &mut Self {
        self.end_start();
        self.out.push('<');
        self.out.push_str(tag);
        self.tags.push(tag);
        self.is_start = true;
        self
    }

    /// Adds an attribute to the tag that was just opened; no effect after its start.
    pub(crate) fn attribute(&mut self, key: impl Display, value: impl Display) -> &mut Self {
        if self.is_start {
            // Writing to a string cannot fail.
            let _ = write!(self.out, " {key}=\"");
            let _ = write!(Escaped(&mut self.out), "{value}");
            self.out.push('"');
        }
        self
    }

    /// Writes text inside the tag that is open.
    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        self.end_start();
        escape(&mut self.out, text);
        self
    }

    /// Writes trusted text without escapes: style sheets, and line ends for readers of the source.
    pub(crate) fn raw(&mut self, text: &str) -> &mut Self {
        self.end_start();
        self.out.push_str(text);
        self
    }

    /// Closes the innermost tag: `</g>`.
    pub(crate) fn close(&mut self) -> &mut Self {
        self.end_start();
        if let Some(tag) = self.tags.pop() {
            self.out.push_str("</");
            self.out.push_str(tag);
            self.out.push('>');
        }
        self
    }

    /// Closes the innermost tag, which is empty: `<rect/>`.
    pub(crate) fn close_empty(&mut self) -> &mut Self {
        if !self.is_start {
            return self.close();
        }
        self.is_start = false;
        self.tags.pop();
        self.out.push_str("/>");
        self
    }

    /// Writes a tag with text and no attributes; nothing if the text is empty.
    pub(crate) fn leaf(&mut self, tag: &'static str, text: &str) -> &mut Self {
        if !text.is_empty() {
            self.open(tag).text(text).close();
        }
        self
    }

    /// The text, every tag closed.
    pub(crate) fn finish(mut self) -> String {
        while !self.tags.is_empty() {
            self.close();
        }
        self.out
    }

    fn end_start(&mut self) {
        if self.is_start {
            self.out.push('>');
            self.is_start = false;
        }
    }
}

/// A writer that escapes all text formatted into it.
struct Escaped<'a>(&'a mut String);

impl fmt::Write for Escaped<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        escape(self.0, text);
        Ok(())
    }
}

/// `text` for use between tags and in attributes; characters that XML does not allow are written as `\u{…}`,
/// and those that would hide or reverse the page's own text as a number.
fn escape(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' | '\r' => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            '\0'..='\u{1f}' | '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => {
                let _ = write!(out, "\\u{{{:x}}}", u32::from(c));
            }
            c if is_invisible(c) => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            _ => out.push(c),
        }
    }
}

/// A number in whole units of 1/`parts`, without trailing zeros; 0 for a value that is not finite.
pub(crate) struct Decimal {
    value: f64,
    /// The number of units per 1: 10 or 100.
    parts: i64,
}

/// A coordinate, to a tenth of a pixel.
pub(crate) fn tenth(value: f64) -> Decimal {
    Decimal { value, parts: 10 }
}

/// A width, a dash or an opacity, to a hundredth.
pub(crate) fn hundredth(value: f64) -> Decimal {
    Decimal { value, parts: 100 }
}

/// `value` in whole units of 1/`parts` (1 to 100); 0 for a value that is not finite.
pub(crate) fn units(value: f64, parts: i64) -> i64 {
    let value = if value.is_finite() {
        value.clamp(-1e7, 1e7)
    } else {
        0.0
    };
    cast::to_i64(libm::round(value * parts as f64))
}

impl Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = units(self.value, self.parts);
        let sign = if units < 0 { "-" } else { "" };
        let (whole, rest) = (units.abs() / self.parts, units.abs() % self.parts);
        match (rest, self.parts) {
            (0, _) => write!(f, "{sign}{whole}"),
            (_, 10) => write!(f, "{sign}{whole}.{rest}"),
            _ if rest % 10 == 0 => write!(f, "{sign}{whole}.{}", rest / 10),
            _ => write!(f, "{sign}{whole}.{rest:02}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_short() {
        let table = [
            (tenth(1.04), "1"),
            (tenth(-0.25), "-0.3"),
            (tenth(-0.04), "0"),
            (hundredth(1.05), "1.05"),
            (hundredth(0.9), "0.9"),
            (tenth(f64::NAN), "0"),
            (tenth(f64::INFINITY), "0"),
        ];
        for (number, expected) in table {
            assert_eq!(number.to_string(), expected);
        }
    }

    #[test]
    fn text_cannot_leave_its_quotes_and_tags() {
        let mut xml = Xml::default();
        xml.open("g").attribute("data-name", "\"><script>");
        xml.open("text").text("</text>&\u{1}\n\u{202e}").close();
        xml.open("rect").attribute("x", tenth(1.0)).close_empty();
        assert_eq!(
            xml.finish(),
            "<g data-name=\"&quot;&gt;&lt;script&gt;\"><text>&lt;/text&gt;&amp;\\u{1}&#10;&#8238;</text><rect x=\"1\"/></g>"
        );
    }
}
