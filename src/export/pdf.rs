//! A page per window, or the strip, as one PDF file.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::{Encoder, Needs, OneDrawing, Pack, Packet, Started, Written};
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::draw::paint::pdf::{self, PdfPage};
use crate::draw::scene::Scene;
use crate::export::sequence::{FrameTime, Sequence, Shows};
use crate::export::sink::write_file;
use crate::export::target::Target;

/// The most queued pages.
const WAITING: usize = 4;

struct Book<'a> {
    sequence: &'a Sequence<'a>,
    /// The only page, if it is not a sequence.
    strip: Option<&'a Scene>,
    target: Target,
    /// The channel for pages; a document cannot move between threads, so it has its own thread.
    sheets: SyncSender<PdfPage>,
    press: JoinHandle<std::result::Result<Vec<u8>, String>>,
}

/// Begins the document.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    target.must_be_one("a PDF has a page per window")?;
    let (sheets, waiting) = sync_channel(WAITING);
    let fonts = sequence.fonts.clone();
    Ok(Box::new(Book {
        sequence,
        strip: match sequence.shows(target, OneDrawing::Asked) {
            Shows::Whole(scene) => Some(scene),
            Shows::Film | Shows::Windows => None,
        },
        target: target.clone(),
        sheets,
        press: thread::spawn(move || pdf::write(waiting.iter(), &fonts)),
    }))
}

const HINT: &str = "write `.svg` with `{n}` instead";

impl Book<'_> {
    fn failed(&self, reason: &str) -> Error {
        Error::output(self.target.path(), reason, HINT)
    }

    fn add(&self, scene: Scene, entry: String) -> Result<()> {
        let sent = self.sheets.send(PdfPage { scene, entry });
        sent.map_err(|_| self.failed("the document ended early"))
    }

    /// The time of a window and its first change.
    fn entry(&self, place: usize) -> String {
        let frame = self.sequence.view.frames.get(place);
        frame.map_or_else(String::new, |frame| {
            let at = words::offset(self.sequence.mission.offset(frame.span.start));
            format!("{at} {}", frame.words(1)).trim_end().to_owned()
        })
    }
}

impl Encoder for Book<'_> {
    fn needs(&self) -> Needs {
        match self.strip {
            Some(_) => Needs::Nothing,
            None => Needs::Scene,
        }
    }

    fn pack(&self) -> Pack {
        |frame| Ok(Packet::Drawing(Box::new(frame.scene.clone())))
    }

    fn take(&mut self, _: usize, frame_time: FrameTime, packet: Packet) -> Result<()> {
        match packet {
            Packet::Drawing(scene) => self.add(*scene, self.entry(frame_time.window)),
            _ => Ok(()),
        }
    }

    fn finish(self: Box<Self>) -> Result<Written> {
        if let Some(scene) = self.strip {
            self.add(scene.clone(), scene.title.clone())?;
        }
        let Self {
            target,
            sheets,
            press,
            ..
        } = *self;
        // Dropping the sender ends the thread.
        drop(sheets);
        let bytes = match press.join() {
            Ok(Ok(bytes)) => bytes,
            Ok(Err(reason)) => {
                return Err(Error::output(target.path(), reason, HINT));
            }
            Err(_) => {
                let reason = "the document is not valid";
                return Err(Error::output(target.path(), reason, HINT));
            }
        };
        let mut written = Written::to(&target);
        written.add(write_file(&target, &bytes)?);
        Ok(written)
    }
}
