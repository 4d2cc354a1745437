//! Every output format behind one trait. Adding a format is one file below `encode/` and one row in [`FORMATS`].

mod animated_svg;
mod apng;
mod csv;
mod dot;
mod gif;
mod html;
mod json;
mod markdown;
mod mermaid;
mod pdf;
mod png;
mod svg;
mod video;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::film::{Film, Shot};
use crate::output::{self, Sink, Target};
use crate::palette::Palette;
use crate::pixels::Pixels;
use crate::scene::Scene;

/// What an encoder wants of every frame; each includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Needs {
    /// No frames at all: it writes from the film when that is over.
    Nothing,
    /// The drawing.
    Scene,
    /// The drawing as pixels.
    Pixels,
    /// The pixels as places in the film's one palette.
    Indices,
}

/// One frame as all encoders of its size share it.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// The index of its window.
    pub index: usize,
    /// What it shows and for how long.
    pub shot: Shot,
    /// The drawing.
    pub scene: &'a Scene,
    /// The drawing as pixels; empty unless somebody needs them.
    pub pixels: &'a Pixels,
    /// The palette of the whole film, 255 colours at most; one black unless somebody needs indices.
    pub palette: &'a Palette,
    /// The place in the palette of every pixel; empty unless somebody needs them.
    pub indices: &'a [u8],
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// The file as it was asked for; `-` for standard output, `{n}` for a file per window.
    pub path: PathBuf,
    /// How many files.
    pub files: usize,
    /// Their bytes in all.
    pub bytes: u64,
    /// What the user should know, such as what was given up to stay small; lower case, no period.
    pub remarks: Vec<String>,
}

impl Written {
    /// Nothing yet.
    fn to(target: &Target) -> Self {
        Self {
            path: target.path().to_owned(),
            ..Self::default()
        }
    }

    /// One more file.
    fn add(&mut self, bytes: u64) {
        self.files += 1;
        self.bytes += bytes;
    }
}

/// What a format of single drawings does with a target.
#[derive(Clone, Copy)]
enum Single<'a> {
    /// A file per window, or the only window.
    Windows,
    /// The strip in one file.
    Strip(&'a Scene),
}

/// How a drawing format uses a target: with `{n}`, or for one window, a file per window; else the strip, if there
/// is one and it may stand here.
fn single<'a>(film: &Film<'a>, target: &Target, strip: bool) -> Result<Single<'a>> {
    let windows = film.view.frames.len();
    if target.is_numbered() {
        return Ok(Single::Windows);
    }
    match film.strip.filter(|_| strip) {
        Some(scene) => Ok(Single::Strip(scene)),
        None if windows <= 1 => Ok(Single::Windows),
        None => Err(Error::usage(
            format!(
                "`{}` is one file for {windows} windows",
                target.path().display()
            ),
            "put `{n}` into the name for a file per window, or ask for a `--strip`",
        )),
    }
}

/// A format at work on one output. What it has not finished leaves no trace when it is dropped.
pub trait Encoder: Send {
    /// What it wants of every frame; nothing where it writes from the film when that is over.
    fn needs(&self) -> Needs {
        Needs::Nothing
    }

    /// Whether it plays: then it is given the staged frames too, not only the windows.
    fn plays(&self) -> bool {
        false
    }

    /// Takes the next frame. All frames have one size.
    ///
    /// # Errors
    /// [`Error::Io`] with the output's path where it cannot be written.
    fn frame(&mut self, _frame: &Frame<'_>) -> Result<()> {
        Ok(())
    }

    /// Ends the output and gives it its final name.
    ///
    /// # Errors
    /// As [`Encoder::frame`].
    fn finish(self: Box<Self>) -> Result<Written>;
}

/// An output of one file that is written when the film is over.
struct AtOnce<W> {
    target: Target,
    /// The text, and what the user should know of it.
    write: W,
}

impl<'a, W: FnOnce() -> (String, Vec<String>) + Send + 'a> AtOnce<W> {
    /// # Errors
    /// [`Error::Usage`] for a name with `{n}`.
    fn start(target: &Target, write: W) -> Result<Box<dyn Encoder + 'a>> {
        if target.is_numbered() {
            return Err(Error::usage(
                format!("`{}` asks for a file per window", target.path().display()),
                "all windows are in one file: leave `{n}` out",
            ));
        }
        Ok(Box::new(Self {
            target: target.clone(),
            write,
        }))
    }
}

impl<W: FnOnce() -> (String, Vec<String>) + Send> Encoder for AtOnce<W> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut written = Written::to(&self.target);
        let mut sink = Sink::create(&self.target, None)?;
        let (text, remarks) = (self.write)();
        sink.write_all(text.as_bytes()).map_err(sink.error())?;
        written.remarks = remarks;
        written.add(sink.commit()?);
        Ok(written)
    }
}

/// Begins an output. Under `max_bytes`, an animation of more bytes fails as [`std::io::ErrorKind::FileTooLarge`].
pub type Start = for<'a> fn(&'a Film<'a>, &Target) -> Result<Box<dyn Encoder + 'a>>;

/// An output format.
#[derive(Debug)]
pub struct Format {
    /// Its extension and its word for `--format`.
    pub word: &'static str,
    /// What it is, for `--help` and the README.
    pub what: &'static str,
    /// Whether `--max-bytes` binds it.
    pub is_limited: bool,
    /// Whether, without `{n}`, several windows become a film strip unless one asks for another.
    pub is_strip: bool,
    /// What else it needs, checked before anything is read.
    pub check: Option<fn(&Target) -> Result<()>>,
    /// How an output begins.
    pub start: Start,
}

impl Format {
    /// Whether it shows the picture; the others write the graph itself, whose size no page limits.
    pub fn is_drawn(&self) -> bool {
        let data = ["dot", "mmd", "json", "csv", "parquet", "gexf", "graphml"];
        !data.contains(&self.word)
    }
}

/// All formats.
pub const FORMATS: &[Format] = &[
    Format {
        word: "gif",
        what: "the animation",
        is_limited: true,
        is_strip: false,
        check: None,
        start: gif::start,
    },
    Format {
        word: "apng",
        what: "the animation, lossless for all but antialiasing",
        is_limited: true,
        is_strip: false,
        check: None,
        start: apng::start,
    },
    Format {
        word: "svg",
        what: "a drawing per window with `{n}`, the only window, the `--strip`, or an animation",
        is_limited: false,
        is_strip: false,
        check: None,
        start: start_svg,
    },
    Format {
        word: "png",
        what: "an image per window with `{n}`, the only window, or a film strip",
        is_limited: false,
        is_strip: true,
        check: None,
        start: png::start_png,
    },
    Format {
        word: "webp",
        what: "an image per window with `{n}`, the only window, or a film strip",
        is_limited: false,
        is_strip: true,
        check: None,
        start: png::start_webp,
    },
    Format {
        word: "dot",
        what: "a graph that `rqt_graph` loads, per window with `{n}`, else the union",
        is_limited: false,
        is_strip: false,
        check: None,
        start: dot::start,
    },
    Format {
        word: "mmd",
        what: "a Mermaid flow chart, per window with `{n}`, else the union",
        is_limited: false,
        is_strip: false,
        check: None,
        start: mermaid::start,
    },
    Format {
        word: "pdf",
        what: "a page per window as vectors, or the `--strip`",
        is_limited: false,
        is_strip: false,
        check: None,
        start: pdf::start,
    },
    Format {
        word: "mp4",
        what: "a video, through `ffmpeg`",
        is_limited: false,
        is_strip: false,
        check: Some(video::check),
        start: video::start_mp4,
    },
    Format {
        word: "webm",
        what: "a video, through `ffmpeg`",
        is_limited: false,
        is_strip: false,
        check: Some(video::check),
        start: video::start_webm,
    },
    Format {
        word: "html",
        what: "one page that plays the mission, with everything in it",
        is_limited: false,
        is_strip: false,
        check: None,
        start: html::start,
    },
    Format {
        word: "md",
        what: "a report for a pull request or a job summary",
        is_limited: false,
        is_strip: false,
        check: None,
        start: markdown::start,
    },
    Format {
        word: "json",
        what: "the evolution as data, which can be read again",
        is_limited: false,
        is_strip: false,
        check: None,
        start: json::start,
    },
    Format {
        word: "csv",
        what: "tidy tables: `x.edges.csv`, `x.topics.csv`, `x.nodes.csv`, `x.changes.csv`, `x.bags.csv`",
        is_limited: false,
        is_strip: false,
        check: None,
        start: csv::start,
    },
];

/// A single image of the first window, beside an animation.
const POSTER: &Format = &Format {
    word: "png",
    what: "the first window as an image",
    is_limited: false,
    is_strip: false,
    check: None,
    start: png::start_poster,
};

/// Drawings where that is what is asked for, else one that moves.
fn start_svg<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    let is_sequence = film.view.frames.len() > 1 && film.options.strip.is_none();
    if is_sequence && !target.is_numbered() {
        animated_svg::start(film, target)
    } else {
        svg::start(film, target)
    }
}

/// One output: what and where.
#[derive(Clone, Debug)]
pub struct Output {
    /// What.
    pub format: &'static Format,
    /// Where.
    pub target: Target,
}

impl Output {
    /// The poster: the first window as a PNG image.
    pub fn poster(path: &Path) -> Self {
        Self {
            format: POSTER,
            target: Target::Path(path.to_owned()),
        }
    }

    /// Reads an output as the user writes it: `a.gif`, `f/{n}.svg`, `-`. The format is `word` if given, else the
    /// name's extension.
    ///
    /// # Errors
    /// [`Error::Usage`] for a format that does not exist, and for standard output without a format.
    pub fn parse(text: &str, word: Option<&str>) -> Result<Self> {
        let target = Target::parse(text);
        let word = word.map(str::to_lowercase).or_else(|| target.extension());
        let all: Vec<&str> = FORMATS.iter().map(|f| f.word).collect();
        let all = all.join(", ");
        let Some(word) = word else {
            let what = format!("`{text}` does not say its format");
            return Err(Error::usage(what, format!("say it with `--format`: {all}")));
        };
        match FORMATS.iter().find(|f| f.word == word) {
            Some(format) => Ok(Self { format, target }),
            None => Err(Error::usage(
                format!("unknown format `{word}`"),
                format!("formats: {all}"),
            )),
        }
    }
}

/// Checks all outputs before the inputs are read: their names, their folders, and what their formats need.
///
/// # Errors
/// As [`output::check`], and [`Error::Output`] where a format lacks something.
pub fn check(outputs: &[Output], inputs: &[PathBuf]) -> Result<()> {
    let targets: Vec<Target> = outputs.iter().map(|o| o.target.clone()).collect();
    output::check(&targets, inputs)?;
    outputs
        .iter()
        .try_for_each(|o| o.format.check.map_or(Ok(()), |check| check(&o.target)))
}

/// Whether a film of this many windows needs a strip for these outputs even if none was asked for.
pub fn needs_strip(outputs: &[Output], windows: usize) -> bool {
    let strip = |o: &Output| o.format.is_strip && !o.target.is_numbered();
    windows > 1 && outputs.iter().any(strip)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word_of(text: &str, word: Option<&str>) -> Option<&'static str> {
        Output::parse(text, word).ok().map(|o| o.format.word)
    }

    #[test]
    fn the_name_or_the_user_says_the_format() {
        assert_eq!(word_of("out/a.gif", None), Some("gif"));
        assert_eq!(word_of("A.GIF", None), Some("gif"));
        assert_eq!(word_of("-", Some("json")), Some("json"));
        assert_eq!(word_of("a.dat", Some("svg")), Some("svg"));
        assert_eq!(word_of("-", None), None);
    }

    #[test]
    fn an_unknown_format_is_told_with_the_known_ones() {
        let error = Output::parse("a.gfi", None).unwrap_err();
        assert_eq!(error.to_string(), "unknown format `gfi`");
        assert!(error.hint().contains("gif, apng, svg, png"));
    }
}
