//! A page per window, or the strip, as one PDF file.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use super::{Encoder, Needs, OneDrawing, Pack, Packet, Started, Written, one_drawing};
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::draw::paint::pdf::{self, PdfPage};
use crate::export::sequence::{FrameTime, Sequence, Shows};
use crate::export::sink::write_file;
use crate::export::target::Target;

/// The most queued pages.
const WAITING: usize = 4;

struct Book<'a> {
    sequence: &'a Sequence<'a>,
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
    if let Shows::Whole(scene) = sequence.shows(target, OneDrawing::Asked) {
        let own = target.clone();
        return Ok(one_drawing(target, move || {
            let (scene, entry) = (scene.clone(), scene.title.clone());
            let page = std::iter::once(PdfPage { scene, entry });
            pdf::write(page, sequence.fonts).map_err(|reason| failed(&own, &reason))
        }));
    }
    let (sheets, waiting) = sync_channel(WAITING);
    let fonts = sequence.fonts.clone();
    Ok(Box::new(Book {
        sequence,
        target: target.clone(),
        sheets,
        press: thread::spawn(move || pdf::write(waiting.iter(), &fonts)),
    }))
}

fn failed(target: &Target, reason: &str) -> Error {
    Error::output(target.path(), reason, "write `.svg` with `{n}` instead")
}

impl Book<'_> {
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
        Needs::Scene
    }

    fn pack(&self) -> Pack {
        |frame| Ok(Packet::Drawing(Box::new(frame.scene.clone())))
    }

    fn take(&mut self, frame_time: FrameTime, packet: Packet) -> Result<()> {
        if let Packet::Drawing(scene) = packet {
            let (scene, entry) = (*scene, self.entry(frame_time.window));
            let sent = self.sheets.send(PdfPage { scene, entry });
            sent.map_err(|_| failed(&self.target, "the document ended early"))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Written> {
        // Dropping the sender ends the thread.
        drop(self.sheets);
        let pressed = self.press.join();
        let pressed = pressed.unwrap_or_else(|_| Err("the document is not valid".to_owned()));
        let bytes = pressed.map_err(|reason| failed(&self.target, &reason))?;
        let mut written = Written::to(&self.target);
        written.add(write_file(&self.target, &bytes)?);
        Ok(written)
    }
}
