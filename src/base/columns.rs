//! Text fitted to a terminal: tables whose columns shrink to its width, and lines with a hanging indent.

use std::collections::BTreeSet;

/// A column of a table for people.
pub(crate) struct Column {
    /// Its header; empty if the cells need none.
    pub(crate) head: &'static str,
    /// Whether its cells are right-aligned, as for numbers.
    pub(crate) is_right: bool,
    /// The minimum width in characters; [`WHOLE`] if it does not shrink.
    pub(crate) least: usize,
    /// The orders in which columns shrink and are dropped if the table is too wide: 1 is first. Those with 0 shrink
    /// last and are never dropped.
    pub(crate) gives: (u8, u8),
}

impl Column {
    pub(crate) const fn new(
        head: &'static str,
        is_right: bool,
        least: usize,
        gives: (u8, u8),
    ) -> Self {
        Self {
            head,
            is_right,
            least,
            gives,
        }
    }
}

/// The minimum width of a column that does not shrink.
pub(crate) const WHOLE: usize = usize::MAX;

/// A cell of a table.
pub(crate) enum Cell {
    /// Text without control characters; cut in the middle if too long.
    Text(String),
    /// A message type; its package is dropped first.
    Type(String),
    /// Numbers over time, drawn as bars in the available width.
    Bars(Vec<u64>),
}

/// The most characters of bars.
const MOST_BARS: usize = 32;
const BARS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// The space between columns, and before the first of them.
const GAP: usize = 2;

impl Cell {
    fn width(&self) -> usize {
        match self {
            Self::Text(text) | Self::Type(text) => text.chars().count(),
            Self::Bars(numbers) => numbers.len().clamp(1, MOST_BARS),
        }
    }

    fn fitted(&self, width: usize, thirds: usize) -> String {
        match self {
            Self::Text(text) => middle(text, width, thirds),
            Self::Type(text) if text.chars().count() > width => {
                middle(text.rsplit('/').next().unwrap_or(text), width, thirds)
            }
            Self::Type(text) => text.clone(),
            Self::Bars(numbers) => bars(numbers, width),
        }
    }
}

/// A table with a header, empty without rows, at most `width` characters wide if columns can shrink that far; no trailing spaces.
pub(crate) fn table(columns: &[Column], rows: &[Vec<Cell>], width: Option<usize>) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let natural = |at: usize| {
        let cells = rows.iter().filter_map(|row| row.get(at)).map(Cell::width);
        let head = columns[at].head.chars().count();
        cells.max().unwrap_or(0).max(head)
    };
    let mut widths: Vec<usize> = (0..columns.len()).map(natural).collect();
    if let Some(width) = width {
        shrink(columns, &mut widths, width);
    }
    let cuts = (0..columns.len()).map(|at| cut(rows, at, widths[at]));
    let cuts: Vec<usize> = cuts.collect();
    let heads = columns.iter().map(|c| Cell::Text(c.head.to_owned()));
    let heads: Vec<Cell> = heads.collect();
    let mut out = String::new();
    let lines = std::iter::once(&heads).filter(|_| columns.iter().any(|c| !c.head.is_empty()));
    for cells in lines.chain(rows) {
        let mut line = String::new();
        for (((cell, column), width), cut) in cells.iter().zip(columns).zip(&widths).zip(&cuts) {
            if *width == 0 {
                continue;
            }
            line.push_str("  ");
            let text = cell.fitted(*width, *cut);
            let padded = if column.is_right {
                format!("{text:>width$}")
            } else {
                format!("{text:<width$}")
            };
            line.push_str(&padded);
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
    out
}

/// Drops columns in their order until the minimum widths of the others fit; then shrinks those in their order.
fn shrink(columns: &[Column], widths: &mut [usize], room: usize) {
    let excess = |widths: &[usize]| {
        let shown = widths.iter().filter(|width| **width > 0);
        let taken = shown.map(|width| width + GAP).sum::<usize>();
        taken.saturating_sub(room)
    };
    let in_order = |by: fn(&Column) -> u8| {
        let mut order: Vec<usize> = (0..columns.len()).collect();
        order.sort_by_key(|at| by(&columns[*at]).wrapping_sub(1));
        order
    };
    let least = |(width, column): (&usize, &Column)| *width.min(&column.least);
    for at in in_order(|column| column.gives.1) {
        let smallest: Vec<usize> = widths.iter().zip(columns).map(least).collect();
        if columns[at].gives.1 > 0 && excess(&smallest) > 0 {
            widths[at] = 0;
        }
    }
    for at in in_order(|column| column.gives.0) {
        let most = widths[at].saturating_sub(columns[at].least);
        widths[at] -= most.min(excess(widths));
    }
}

/// The thirds of the width of a column that show the beginnings of its cut texts: one, unless more texts can be told
/// apart with two or three.
fn cut(rows: &[Vec<Cell>], at: usize, width: usize) -> usize {
    let distinct = |thirds: usize| {
        let texts = rows.iter().filter_map(|row| match row.get(at) {
            Some(Cell::Text(text)) => Some(middle(text, width, thirds)),
            _ => None,
        });
        texts.collect::<BTreeSet<String>>().len()
    };
    let best = (1..=3).rev().max_by_key(|thirds| distinct(*thirds));
    best.unwrap_or(1)
}

/// `text` in at most `width` characters, cut where `thirds` of them are shown: the end of a name is in general more
/// informative than its beginning.
fn middle(text: &str, width: usize, thirds: usize) -> String {
    let length = text.chars().count();
    if length <= width {
        return text.to_owned();
    }
    let kept = width.saturating_sub(1);
    let head = kept * thirds / 3;
    let start: String = text.chars().take(head).collect();
    let end: String = text.chars().skip(length - (kept - head)).collect();
    format!("{start}…{end}")
}

/// Numbers over time as bars; a blank for 0.
fn bars(numbers: &[u64], width: usize) -> String {
    let columns = numbers.len().clamp(1, width.clamp(1, MOST_BARS));
    let start = |part: usize| part * numbers.len() / columns;
    let sum = |part| numbers[start(part)..start(part + 1)].iter().sum::<u64>();
    let most = (0..columns).map(sum).max().unwrap_or(0).max(1);
    // Rounded up, so that a single message is a bar.
    let eighths = |n: u64| usize::try_from(n.saturating_mul(8).div_ceil(most)).unwrap_or(8);
    let bar = |part| BARS[eighths(sum(part)).min(8)];
    (0..columns).map(bar).collect()
}

/// `lead` and `text` on lines of at most `width` characters, broken at spaces; all lines but the first are indented by
/// `indent`. A word longer than a line gets its own. Ends with a newline.
pub(crate) fn hang(lead: &str, text: &str, indent: usize, width: Option<usize>) -> String {
    broken((lead, text), indent, width, "")
}

/// As [`hang`], with `end` after every line but the last.
fn broken((lead, text): (&str, &str), indent: usize, width: Option<usize>, end: &str) -> String {
    let width = width.map(|width| width.saturating_sub(end.len()));
    let mut out = lead.to_owned();
    let mut used = shown(lead);
    let mut is_first = true;
    for word in text.split(' ') {
        let length = shown(word);
        let space = usize::from(!is_first);
        if width.is_some_and(|width| used + space + length > width) && used > indent {
            out.truncate(out.trim_end().len());
            out.extend([end, "\n"]);
            out.push_str(&" ".repeat(indent));
            used = indent;
        } else if !is_first {
            out.push(' ');
            used += 1;
        }
        out.push_str(word);
        used += length;
        is_first = false;
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

/// The number of characters that a terminal shows, without those that set colours.
fn shown(text: &str) -> usize {
    let mut parts = text.split("\u{1b}[");
    let first = parts.next().unwrap_or_default().chars().count();
    let rest = parts.filter_map(|part| Some(part.split_once('m')?.1.chars().count()));
    first + rest.sum::<usize>()
}

/// The text with lines of at most `width` characters; the rest of a longer one is below the start of the last
/// column that begins in its first half. A command can still be copied.
pub(crate) fn fitted(text: &str, width: usize) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let widest = line.char_indices().nth(width / 2);
        let half = widest.map_or("", |(at, _)| &line[..at]);
        let column = half.rfind("  ");
        let indent = column.map_or(2, |at| half[..at + 2].chars().count());
        let is_command = cfg!(unix) && line.contains(": bagreel ");
        let end = if is_command { " \\" } else { "" };
        out.push_str(&broken(("", line), indent, Some(width), end));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_show_silence_as_blanks() {
        assert_eq!(bars(&[0, 1, 4, 8], 32), " ▁▄█");
        assert_eq!(bars(&[], 32), " ");
        assert_eq!(bars(&[1; 100], 32).chars().count(), MOST_BARS);
        assert_eq!(bars(&[1; 100], 8), "████████");
    }

    #[test]
    fn a_long_line_goes_on_below_its_last_column() {
        let text = "+ node  /é  only in the first of two\nshort\n";
        let expected = "+ node  /é  only in the\n            first of two\nshort\n";
        assert_eq!(fitted(text, 25), expected);
        let expected = "+ node  /é  only in\n        the first of\n        two\nshort\n";
        assert_eq!(fitted(text, 22), expected);
        assert_eq!(fitted(text, 40), text);
        let coloured = "\u{1b}[31merror:\u{1b}[0m one two three\n";
        let expected = "\u{1b}[31merror:\u{1b}[0m one\n  two three\n";
        assert_eq!(fitted(coloured, 11), expected);
        let command = "   =  accept: bagreel baseline run.bag --only /a\n";
        let expected = "   =  accept: bagreel \\\n      baseline run.bag \\\n      --only /a\n";
        #[cfg(unix)]
        assert_eq!(fitted(command, 25), expected);
    }

    #[test]
    fn columns_shrink_and_are_dropped_in_order() {
        let columns = [
            Column {
                head: "topic",
                is_right: false,
                least: 6,
                gives: (0, 0),
            },
            Column {
                head: "n",
                is_right: true,
                least: WHOLE,
                gives: (0, 0),
            },
            Column {
                head: "type",
                is_right: false,
                least: 4,
                gives: (1, 1),
            },
        ];
        let cell = |text: &str| Cell::Text(text.to_owned());
        let rows = [vec![
            cell("/long/name"),
            cell("12"),
            cell("std_msgs/String"),
        ]];
        let at = |width| table(&columns, &rows, width);
        assert_eq!(
            at(None),
            "  topic        n  type\n  /long/name  12  std_msgs/String\n"
        );
        assert_eq!(
            at(Some(24)),
            "  topic        n  type\n  /long/name  12  s…ring\n"
        );
        assert_eq!(at(Some(20)), "  topic      n  type\n  /l…/name  12  s…ng\n");
        assert_eq!(at(Some(12)), "  topic    n\n  /…name  12\n");
    }

    #[test]
    fn names_are_cut_where_they_can_be_told_apart() {
        let columns = [Column {
            head: "",
            is_right: false,
            least: 6,
            gives: (0, 0),
        }];
        let row = |text: &str| vec![Cell::Text(text.to_owned())];
        let shown = |texts: [&str; 2]| table(&columns, &texts.map(row), Some(14));
        let shown = [
            shown(["/robot1/camera_left", "/robot1/camera_right"]),
            shown(["2024-03-01_morning_run", "2024-03-02_morning_run"]),
        ];
        assert_eq!(
            shown,
            [
                "  /ro…era_left\n  /ro…ra_right\n",
                "  2024-03-01_…\n  2024-03-02_…\n",
            ]
        );
    }

    #[test]
    fn long_lines_have_a_hanging_indent() {
        let at = |width| hang("00:01  ", "/a started: publishes b", 7, width);
        assert_eq!(at(None), "00:01  /a started: publishes b\n");
        assert_eq!(at(Some(18)), "00:01  /a started:\n       publishes b\n");
        assert_eq!(
            at(Some(3)),
            "00:01  /a\n       started:\n       publishes\n       b\n"
        );
    }
}
