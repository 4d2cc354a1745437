//! Every output format behind one trait. Adding a format is one file below `export/` and one row in [`FORMATS`].
//!
//! In comes a [`Sequence`](sequence::Sequence): a mission, its view, and the drawings of its windows; out come files, each whole
//! or not at all. Open `encoder` first: what a format is. `run` draws each frame once and passes it to every output;
//! `target`, `check` and `sink` are about files; the other files are formats.

pub(crate) mod check;
pub(crate) mod dot;
pub(crate) mod encoder;
mod gif;
pub(crate) mod html;
mod json;
pub(crate) mod markdown;
pub(crate) mod mermaid;
pub(crate) mod palette;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
#[cfg(feature = "pdf")]
mod pdf;
pub(crate) mod report;
pub mod run;
pub mod sequence;
pub(crate) mod sink;
mod still;
pub(crate) mod tables;
pub(crate) mod target;
mod tex;

use std::ffi::OsStr;
use std::path::PathBuf;

use crate::base::error::{Error, Result};

use self::still::StillKind;
pub(crate) use encoder::Pack;
pub use encoder::Written;
use encoder::{DATA, GRAPH, IMAGE, LOOK, PICTURE, WORDS};
pub use encoder::{DrawnFrame, Encoder, Needs, OneDrawing, OutputFormat, Packet};
pub(crate) use encoder::{Started, one_drawing, one_file, one_text, text_per_window};
use tables::TableFormat;
use target::Target;
pub(crate) use tex::needs_figure;

/// All formats.
pub const FORMATS: &[OutputFormat] = &[
    OutputFormat {
        word: "gif",
        what: "the animation",
        start: gif::start,
        takes: &[LOOK, WORDS, "bare frame-ms max-bytes"],
        ..PICTURE
    },
    OutputFormat {
        word: "svg",
        what: "a drawing per window with `{n}`, otherwise an animation",
        start: |sequence, target| still::start(sequence, target, StillKind::Svg),
        whole: OneDrawing::Asked,
        takes_together: "frame-ms strip",
        ..IMAGE
    },
    OutputFormat {
        word: "png",
        what: "an image per window with `{n}`, otherwise a film strip",
        start: |sequence, target| still::start(sequence, target, StillKind::Png),
        ..IMAGE
    },
    OutputFormat {
        word: "webp",
        what: "an image per window with `{n}`, otherwise a film strip",
        start: |sequence, target| still::start(sequence, target, StillKind::WebP),
        ..IMAGE
    },
    OutputFormat {
        word: "dot",
        what: "a graph that `rqt_graph` loads",
        start: dot::start,
        ..GRAPH
    },
    OutputFormat {
        word: "mmd",
        what: "a Mermaid flow chart",
        start: mermaid::start,
        ..GRAPH
    },
    #[cfg(feature = "pdf")]
    OutputFormat {
        word: "pdf",
        what: "vectors, one page per window",
        start: pdf::start,
        whole: OneDrawing::Asked,
        takes: &[LOOK, WORDS, "width bare"],
        ..IMAGE
    },
    OutputFormat {
        word: "tex",
        what: "LaTeX lines that include a figure, with a caption",
        start: tex::start,
        whole: OneDrawing::Asked,
        takes_alone: "",
        ..IMAGE
    },
    OutputFormat {
        word: "html",
        what: "a page to step through the mission, in one file",
        start: html::start,
        is_unfolded: true,
        ..PICTURE
    },
    OutputFormat {
        word: "md",
        what: "a report for a pull request or a job summary",
        start: report::start,
        is_unfolded: true,
        takes: &[WORDS, "link"],
        ..PICTURE
    },
    OutputFormat {
        word: "json",
        what: "the mission as data; can be read again as an input",
        start: json::start,
        ..DATA
    },
    OutputFormat {
        word: "csv",
        what: "tidy tables: `x.edges.csv`, `x.topics.csv`, `x.nodes.csv`, changes, log, phases, bags",
        check: Some(tables::check),
        start: |sequence, target| tables::start(sequence, target, TableFormat::Csv),
        ..DATA
    },
    OutputFormat {
        word: "parquet",
        what: "the same tables as Apache Parquet: `x.edges.parquet` and others",
        check: Some(|target| {
            let built = TableFormat::Parquet.built();
            built.and_then(|_| tables::check(target))
        }),
        start: |sequence, target| tables::start(sequence, target, TableFormat::Parquet),
        ..DATA
    },
];

/// One output: its format and its target.
#[derive(Clone, Debug)]
pub struct Output {
    /// The format.
    pub(crate) format: &'static OutputFormat,
    /// The file or files, or standard output.
    pub target: Target,
}

impl Output {
    /// Parses an output: `a.gif`, `f/{n}.svg`, `-`. The format is `word` if given, else the
    /// name's extension.
    ///
    /// # Errors
    /// [`Error::Usage`] for a format that does not exist, and for standard output without a format.
    pub fn parse(text: &str, word: Option<&str>) -> Result<Self> {
        Self::named(text.as_ref(), word)
    }

    /// As [`Output::parse`], for any file name.
    ///
    /// # Errors
    /// As [`Output::parse`].
    pub fn named(name: &OsStr, word: Option<&str>) -> Result<Self> {
        let target = Target::parse(name);
        let word = word.map(str::to_lowercase).or_else(|| target.extension());
        let all: Vec<&str> = FORMATS.iter().map(|f| f.word).collect();
        let all = all.join(", ");
        let Some(word) = word else {
            let what = format!("`{}` has no known extension", name.display());
            let hint = format!("choose one with `--format`: {all}");
            return Err(Error::usage(what, hint));
        };
        let format = FORMATS.iter().find(|f| f.word == word);
        let what = format!("unknown format `{word}`");
        let format = format.ok_or_else(|| Error::usage(what, format!("formats: {all}")))?;
        Ok(Self { format, target })
    }
}

/// Checks all outputs before the inputs are read: their names, their folders, and what their formats need. `kept` are
/// the inputs and other files that are read, which are never overwritten.
///
/// # Errors
/// As [`check::check`], and [`Error::Output`] if a format's requirements are not met.
pub(crate) fn check(outputs: &[Output], kept: &[PathBuf]) -> Result<()> {
    let targets: Vec<Target> = outputs.iter().flat_map(files).collect();
    check::check(&targets, kept)?;
    let mut each = outputs.iter();
    each.try_for_each(|o| o.format.check.map_or(Ok(()), |check| check(&o.target)))
}

/// The files of an output: for most formats the one of its name.
fn files(output: &Output) -> Vec<Target> {
    match output.format.word {
        word @ ("csv" | "parquet") => tables::files(&output.target, word),
        _ => vec![output.target.clone()],
    }
}

/// Whether a sequence of this many windows needs a strip for these outputs even if none was requested.
pub(crate) fn needs_strip(outputs: &[Output], windows: usize) -> bool {
    let strip = |o: &Output| o.format.whole == OneDrawing::Always && !o.target.is_numbered();
    windows > 1 && outputs.iter().any(strip)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word_of(text: &str, word: Option<&str>) -> Option<&'static str> {
        Output::parse(text, word).ok().map(|o| o.format.word)
    }

    #[test]
    fn the_extension_or_the_option_selects_the_format() {
        assert_eq!(word_of("out/a.gif", None), Some("gif"));
        assert_eq!(word_of("A.GIF", None), Some("gif"));
        assert_eq!(word_of("-", Some("json")), Some("json"));
        assert_eq!(word_of("a.dat", Some("svg")), Some("svg"));
        assert_eq!(word_of("-", None), None);
    }

    #[test]
    fn an_unknown_format_lists_the_known_ones() {
        let error = Output::parse("a.gfi", None).unwrap_err();
        assert_eq!(error.to_string(), "unknown format `gfi`");
        assert!(error.hint().contains("gif, svg, png, webp"));
    }
}
