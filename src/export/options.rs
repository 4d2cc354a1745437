//! How a sequence runs and how its formats are written, as the user asked for it.

use std::path::PathBuf;

use crate::base::error::{Error, Result};
pub use crate::draw::figure::FigureOptions;
pub use crate::draw::strip::Choice;
pub use crate::mission::JsonForm;

/// How the sequence runs.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceOptions {
    /// How long a window is shown, in milliseconds, 20...
    pub frame_ms: u32,
    /// How many staged frames lead into a window in which something changed, 0...
    pub tween: u32,
    /// How many times longer such a window is shown, 1...
    pub hold_changes: u32,
    /// Every how many windows one is shown, 1..; windows with a change in any case.
    pub every: usize,
    /// Whether windows without a change are left out altogether.
    pub changes_only: bool,
    /// Pixels of an image per pixel of the picture, above 0.
    pub scale: f64,
    /// The most bytes that an animation may have.
    pub max_bytes: Option<u64>,
    /// How DOT is written.
    pub dot_profile: Profile,
    /// How JSON is written.
    pub json: JsonForm,
    /// Whether tables of elements have a row per run of equal windows.
    pub has_runs: bool,
    /// The windows of a film strip, if one was asked for: it takes the place of a sequence of drawings too.
    pub strip: Option<Choice>,
    /// The figure, if one was asked for: it stands where a strip would.
    pub figure: Option<FigureOptions>,
    /// Links for the report: name and address.
    pub links: Vec<(String, String)>,
    /// A file that reports are appended to, where all others are written anew.
    pub append_to: Option<PathBuf>,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            frame_ms: 1000,
            tween: 0,
            hold_changes: 1,
            every: 1,
            changes_only: false,
            scale: 1.0,
            max_bytes: None,
            dot_profile: Profile::default(),
            json: JsonForm::Auto,
            has_runs: false,
            strip: None,
            figure: None,
            links: Vec::new(),
            append_to: None,
        }
    }
}

impl SequenceOptions {
    /// Whether one drawing of the whole was asked for, which takes the place of a sequence.
    pub fn is_one_drawing(&self) -> bool {
        self.strip.is_some() || self.figure.is_some()
    }
}

/// How a DOT file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// As `rqt_graph` saves it: every place is in the file.
    #[default]
    Rqt,
    /// Without places, with a title and colours, for `dot -Tpdf`.
    Plain,
}

impl Profile {
    /// The profiles by the words of the command line.
    pub const ALL: [(&'static str, Self); 2] = [("rqt", Self::Rqt), ("plain", Self::Plain)];

    /// The profile of this word.
    ///
    /// # Errors
    /// [`Error::Usage`] for another word.
    pub fn parse(word: &str) -> Result<Self> {
        let found = Self::ALL.iter().find(|(name, _)| *name == word);
        found.map(|(_, profile)| *profile).ok_or_else(|| {
            let what = format!("`{word}` is no profile of DOT");
            Error::usage(what, "profiles: rqt, plain")
        })
    }
}
