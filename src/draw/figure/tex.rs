//! A figure for `LaTeX`: the code that includes it, and a caption that describes it.

use std::path::{Component, Path, PathBuf};

use super::{FigureKind, FigureOptions};
use crate::base::words;
use crate::draw::timeline::FigureSource;
use crate::draw::timeline::drawer::clock;
use crate::draw::timeline::notes::title;

/// The caption: the content, the phases with their times, bag and length, the legend in words.
pub(crate) fn caption(
    source: &FigureSource<'_>,
    options: &FigureOptions,
    remarks: &[String],
) -> String {
    let mut parts = vec![what(options.kind).to_owned()];
    if !source.phases.is_empty() {
        let start = source.span().start;
        let reported = source.phases.iter().enumerate().map(|(k, phase)| {
            let at = clock(phase.span.start.since(start));
            format!("{} {} from {at}", k + 1, escaped(&title(source, k)))
        });
        let reported: Vec<String> = reported.collect();
        parts.push(format!("Phases: {}.", reported.join("; ")));
    }
    if let Some(bag) = source.mission.bags.first() {
        let length = words::duration(source.span().nanos());
        let name = escaped(&words::visible(&bag.name));
        let version = env!("CARGO_PKG_VERSION");
        parts.push(format!(
            "Bag \\texttt{{{name}}}, {length}; bagreel {version}."
        ));
    }
    if options.is_bare {
        parts.push(legend(options.kind).to_owned());
    }
    parts.extend(remarks.iter().map(|r| format!("{}.", escaped(&capital(r)))));
    parts.join(" ")
}

fn what(kind: FigureKind) -> &'static str {
    match kind {
        FigureKind::Lives => "When each element was running, how busy it was, and its changes.",
        FigureKind::Graph => "Publishers and subscribers, and the times at which they ran.",
        FigureKind::Holders => "Senders of the topics that change hands or have several senders.",
        FigureKind::Steps => "The reconfigurations one by one: starts, stops and takeovers.",
    }
}

fn legend(kind: FigureKind) -> &'static str {
    match kind {
        FigureKind::Lives => {
            "Bars: publishing, with the height of the rate relative to the row's highest; thin lines: silent, dashed: inferred; tick: start; cross: end; arrows from a dot: another node takes over a topic; circled letters: returns and steps of rates."
        }
        FigureKind::Graph => {
            "Bar in a box: when the node ran, from the start of the mission to its end; ticks: starts, ends and restarts; \
             lines: topics with their rates, dashed if inferred."
        }
        FigureKind::Holders => {
            "Bars: the node that sends the topic; bars above each other: several at once; hatched: nobody."
        }
        FigureKind::Steps => {
            "Green with plus: starts; orange with minus: stops; purple: changes in another way; others: their direct partners."
        }
    }
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(chars).collect()
    })
}

/// The text with everything escaped that `LaTeX` would interpret; our signs become those of `LaTeX`.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\textbackslash{}"),
            '{' | '}' | '$' | '&' | '#' | '%' | '_' => {
                out.push('\\');
                out.push(c);
            }
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '−' => out.push_str("$-$"),
            '→' => out.push_str("$\\rightarrow$"),
            '←' => out.push_str("$\\leftarrow$"),
            '\u{2026}' => out.push_str("\\ldots{}"),
            '<' => out.push_str("\\textless{}"),
            '>' => out.push_str("\\textgreater{}"),
            _ => out.push(c),
        }
    }
    out
}

/// The `LaTeX` code that includes a figure.
#[derive(Clone, Debug)]
pub struct Latex {
    /// The file of the picture, as given.
    pub(crate) picture: PathBuf,
    pub(crate) caption: String,
    /// Whether it is wider than a column.
    pub(crate) is_wide: bool,
}

impl Latex {
    /// The text of the file `tex`: the picture's path counts from its folder, and its name is the label.
    pub(crate) fn file(&self, tex: &Path) -> String {
        let star = if self.is_wide { "*" } else { "" };
        let stem = tex.file_stem().unwrap_or_default().to_string_lossy();
        let label = stem.replace(|c: char| !c.is_alphanumeric(), "-");
        format!(
            "% Written by bagreel. Needs \\usepackage{{graphicx}}.\n\\begin{{figure{star}}}[t]\n  \\centering\n  \
             \\includegraphics{{{}}}\n  \\caption{{{}}}\n  \\label{{fig:{label}}}\n\\end{{figure{star}}}\n",
            relative(&self.picture, tex.parent().unwrap_or(Path::new(""))),
            self.caption,
        )
    }
}

/// A path counted from a folder, both from the same place; absolute if one of them is, or if the folder is above that place.
fn relative(path: &Path, folder: &Path) -> String {
    let (mut own, mut steps) = (path.components().peekable(), folder.components().peekable());
    while own.peek().is_some() && own.peek() == steps.peek() {
        own.next();
        steps.next();
    }
    let is_near = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    let path = if steps.clone().all(is_near) {
        let up = steps.filter(|part| *part != Component::CurDir);
        let up = up.map(|_| Component::ParentDir);
        up.chain(own).collect()
    } else {
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
    };
    path.display().to_string().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_found_from_the_folder_of_the_text() {
        let from = |picture: &str, folder: &str| relative(Path::new(picture), Path::new(folder));
        assert_eq!(from("fig/a.pdf", "fig"), "a.pdf");
        assert_eq!(from("fig/a.pdf", ""), "fig/a.pdf");
        assert_eq!(from("fig/a.pdf", "text/parts"), "../../fig/a.pdf");
        assert_eq!(from("./a.pdf", "./text"), "../a.pdf");
    }

    #[test]
    fn names_are_escaped_for_latex() {
        assert_eq!(
            escaped("/a_b%{x}\\input"),
            "/a\\_b\\%\\{x\\}\\textbackslash{}input"
        );
        assert_eq!(escaped("(+4 −3)"), "(+4 $-$3)");
    }
}
