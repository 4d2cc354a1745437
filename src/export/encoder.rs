//! The interface of output formats: an encoder that takes frames and writes bytes, and its row in the table.

use std::io::{self, Write as _};
use std::path::PathBuf;

use super::palette::{Area, Palette};
use super::sequence::{FrameTime, Sequence};
use super::sink::{OutputSink, write_file};
use super::target::Target;
use crate::base::error::Result;
use crate::draw::paint::raster::Pixels;
use crate::draw::scene::Scene;
use crate::view::union;
use crate::view::{SeenWindow, View};

/// The data that an encoder needs for every frame; each includes the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Needs {
    /// None: it writes from the sequence at the end.
    Nothing,
    /// The drawing.
    Scene,
    /// The drawing as pixels.
    Pixels,
    /// The pixels as indices into the sequence's palette.
    Indices,
}

/// A frame, shared by all encoders of its size, on the core that drew it.
#[derive(Clone, Copy)]
pub struct DrawnFrame<'a> {
    /// The drawing.
    pub scene: &'a Scene,
    /// The drawing as pixels; empty unless an encoder needs them.
    pub pixels: &'a Pixels,
    /// The palette of the whole sequence, 255 colours at most; only black unless an encoder needs indices.
    pub palette: &'a Palette,
    /// The palette index of every pixel; empty unless an encoder needs them.
    pub indices: &'a [u8],
    /// The palette indices of the previous frame; empty for the first.
    pub before: &'a [u8],
}

/// An encoded frame: far smaller than its pixels, so that many can be queued.
#[derive(Debug)]
pub enum Packet {
    /// No data, or no change.
    Nothing,
    /// Bytes to write, or a separate file.
    Bytes(Vec<u8>),
    /// The bytes of pixels that replace an area of the previous frame.
    Patch(Area, Vec<u8>),
    /// The drawing itself.
    Drawing(Box<Scene>),
}

/// A function that encodes a frame. It runs on any core, concurrently and in any order.
pub(crate) type Pack = fn(&DrawnFrame<'_>) -> Result<Packet>;

/// The files that an output wrote.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// The file as given; `-` for standard output, `{n}` for a file per window.
    pub path: PathBuf,
    /// The number of files.
    pub files: usize,
    /// Their total number of bytes.
    pub bytes: u64,
    /// Remarks for the user, such as windows dropped to meet a size limit; lower case, no period.
    pub remarks: Vec<String>,
}

impl Written {
    /// An empty record for an output.
    pub(crate) fn to(target: &Target) -> Self {
        Self {
            path: target.path().to_owned(),
            ..Self::default()
        }
    }

    /// Counts one more file of `bytes` bytes.
    pub(crate) fn add(&mut self, bytes: u64) {
        self.files += 1;
        self.bytes += bytes;
    }
}

/// The writer of one output in a format. An unfinished output leaves no files when dropped.
pub trait Encoder: Send {
    /// The data that it needs for every frame; none if it writes from the sequence at the end.
    fn needs(&self) -> Needs {
        Needs::Nothing
    }

    /// The function that encodes its packets, which [`Encoder::take`] receives in order.
    fn pack(&self) -> Pack {
        |_| Ok(Packet::Nothing)
    }

    /// Begins, before the first packet, with the size of all frames and their palette; called again before further
    /// packets.
    ///
    /// # Errors
    /// [`Error::Io`](crate::base::error::Error::Io) with the output's path if it cannot be written, or an error of output
    /// if the format cannot represent it.
    fn begin(&mut self, _size: (u32, u32), _palette: &Palette) -> Result<()> {
        Ok(())
    }

    /// Takes the packet of the next frame.
    ///
    /// # Errors
    /// [`Error::Io`](crate::base::error::Error::Io) with the output's path if it cannot be written.
    fn take(&mut self, _frame_time: FrameTime, _packet: Packet) -> Result<()> {
        Ok(())
    }

    /// Ends the output and gives it its final name.
    ///
    /// # Errors
    /// As [`Encoder::take`].
    fn finish(self: Box<Self>) -> Result<Written>;
}

/// The beginning of an output.
pub(crate) type Started<'a> = Result<Box<dyn Encoder + 'a>>;

/// An output that takes no frames is a function that writes it at the end.
impl<W: FnOnce() -> Result<Written> + Send> Encoder for W {
    fn finish(self: Box<Self>) -> Result<Written> {
        self()
    }
}

/// Begins an output of one drawing, of these bytes.
pub(crate) fn one_drawing<'a>(
    target: &Target,
    bytes: impl FnOnce() -> Result<Vec<u8>> + Send + 'a,
) -> Box<dyn Encoder + 'a> {
    let target = target.clone();
    Box::new(move || {
        let mut written = Written::to(&target);
        written.add(write_file(&target, &bytes()?)?);
        Ok(written)
    })
}

/// Begins an output of one file that takes no frames; `write` returns remarks for the user.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) with the reason for a name with `{n}`.
pub(crate) fn one_file<'a>(
    target: &Target,
    reason: &str,
    write: impl FnOnce(&mut OutputSink) -> io::Result<Vec<String>> + Send + 'a,
) -> Started<'a> {
    target.must_be_one(reason)?;
    let target = target.clone();
    Ok(Box::new(move || {
        let mut written = Written::to(&target);
        let mut sink = OutputSink::create(&target, None)?;
        written.remarks = write(&mut sink).map_err(sink.error())?;
        written.add(sink.commit()?);
        Ok(written)
    }))
}

/// Begins an output of one text.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for a name with `{n}`.
pub(crate) fn one_text<'a>(
    target: &Target,
    text: impl FnOnce() -> String + Send + 'a,
) -> Started<'a> {
    one_file(target, "all windows are in one file", |sink| {
        sink.write_all(text().as_bytes()).map(|()| Vec::new())
    })
}

/// Begins a text per window if the name contains `{n}`; otherwise one of the only window, or of the union of all.
pub(crate) fn text_per_window<'a>(
    view: &'a View,
    target: &Target,
    text: impl Fn(&mut OutputSink, &SeenWindow) -> io::Result<()> + Send + 'a,
) -> Box<dyn Encoder + 'a> {
    let target = target.clone();
    Box::new(move || {
        let mut written = Written::to(&target);
        let mut write = |target: &Target, seen: &SeenWindow| -> Result<()> {
            let mut sink = OutputSink::create(target, None)?;
            text(&mut sink, seen).map_err(sink.error())?;
            written.add(sink.commit()?);
            Ok(())
        };
        let frames = &view.frames;
        if target.is_numbered() {
            for (k, frame) in frames.iter().enumerate() {
                write(&target.numbered(frame.index, frames.len()), &view.seen(k))?;
            }
        } else if frames.len() == 1 {
            write(&target, &view.seen(0))?;
        } else if let Some(all) = union(view) {
            write(&target, &all)?;
        }
        Ok(written)
    })
}

/// Begins an output. Under `max_bytes`, an animation of more bytes fails as [`std::io::ErrorKind::FileTooLarge`].
pub(crate) type Start = for<'a> fn(&'a Sequence<'a>, &Target) -> Started<'a>;

/// Whether a format can contain one drawing of the whole mission: a film strip or a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OneDrawing {
    /// No: it contains the sequence, or the graph itself.
    Never,
    /// Yes, on request.
    Asked,
    /// Yes: without `{n}` several windows become a film strip by default.
    Always,
}

/// An output format.
#[derive(Debug)]
pub struct OutputFormat {
    /// Its extension and its name for `--format`.
    pub word: &'static str,
    /// Its description, for `--help` and the README.
    pub what: &'static str,
    /// Whether it shows the picture; the others write the graph itself, independent of a page.
    pub is_drawn: bool,
    /// Whether it shows the view; the others write the whole mission.
    pub is_viewed: bool,
    /// Whether it contains all elements of the view separately, even those that the picture groups.
    pub is_unfolded: bool,
    /// Whether it can contain one drawing of the whole.
    pub whole: OneDrawing,
    /// The options of `render` that apply to every output in this format but not to all formats, separated by spaces.
    pub takes: &'static [&'static str],
    /// Those that apply to outputs of a single window.
    pub takes_alone: &'static str,
    /// Those that apply to outputs of several windows.
    pub takes_together: &'static str,
    /// A check of other requirements before anything is read.
    pub check: Option<fn(&Target) -> Result<()>>,
    /// The function that begins an output.
    pub start: Start,
}

impl OutputFormat {
    /// Whether it is always an animation, whose frames last as long as their news takes to read.
    pub(crate) fn is_film(&self) -> bool {
        self.takes("frame-ms", true)
    }

    /// Whether an option of `render`, such as `frame-ms`, applies to an output in this format, which is of a single
    /// window or of several.
    pub fn takes(&self, option: &str, is_alone: bool) -> bool {
        let these = if is_alone {
            self.takes_alone
        } else {
            self.takes_together
        };
        let mut lists = self.takes.iter().chain([&these]);
        lists.any(|list| list.split(' ').any(|one| one == option))
    }
}

/// The options for everything on a page that shows a graph.
pub(crate) const LOOK: &str = "style for size fit orientation layout layout-from font";
/// The options for pictures and reports.
pub(crate) const WORDS: &str = "title phases group collapse";

/// The properties that formats of drawings have in common.
pub(crate) const PICTURE: OutputFormat = OutputFormat {
    word: "",
    what: "",
    is_drawn: true,
    is_viewed: true,
    is_unfolded: false,
    whole: OneDrawing::Never,
    takes: &[LOOK, WORDS],
    takes_alone: "",
    takes_together: "",
    check: None,
    start: nothing,
};

/// The properties that formats of single images have in common.
pub(crate) const IMAGE: OutputFormat = OutputFormat {
    whole: OneDrawing::Always,
    takes: &[LOOK, WORDS, "width"],
    takes_alone: "bare",
    takes_together: "strip",
    ..PICTURE
};

/// The properties that formats of the view as a graph have in common.
pub(crate) const GRAPH: OutputFormat = OutputFormat {
    is_drawn: false,
    takes: &["group collapse"],
    ..PICTURE
};

/// The properties that formats of the whole mission have in common.
pub(crate) const DATA: OutputFormat = OutputFormat {
    is_viewed: false,
    takes: &["phases"],
    ..GRAPH
};

/// The default start, which each row overrides.
fn nothing<'a>(_: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    one_text(target, String::new)
}
