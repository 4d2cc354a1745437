//! The options of a sequence and of its formats.

use std::path::PathBuf;

pub use crate::draw::figure::FigureOptions;
pub use crate::draw::strip::Choice;
use crate::draw::timeline::Timeline;

/// The options of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceOptions {
    /// The time for which each window is shown, in milliseconds, ≥ 20; `None`: as long as its headline takes to read.
    pub frame_ms: Option<u32>,
    /// The step from one window that is shown to the next, in windows, ≥ 1; windows with a change are shown in any
    /// case.
    pub every: usize,
    /// Whether windows without a change are left out.
    pub changes_only: bool,
    /// Pixels of an image per pixel of the picture, above 0.
    pub scale: f64,
    /// The size limit of an animation in bytes.
    pub max_bytes: Option<u64>,
    /// The windows of a film strip, if requested; it also replaces a sequence of drawings.
    pub strip: Option<Choice>,
    /// The figure, if requested; it replaces a strip.
    pub figure: Option<FigureOptions>,
    /// The lifelines of two compared missions, which replace the mission's own.
    pub pairs: Option<Timeline>,
    /// Links for the report: name and address.
    pub links: Vec<(String, String)>,
    /// A file to which reports are appended; all others are overwritten.
    pub append_to: Option<PathBuf>,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            frame_ms: None,
            every: 1,
            changes_only: false,
            scale: 1.0,
            max_bytes: None,
            strip: None,
            figure: None,
            pairs: None,
            links: Vec::new(),
            append_to: None,
        }
    }
}
