//! Drawings as SVG text: one per window.

use std::io::Write as _;

use super::{Encoder, Frame, Needs, Written};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::{Sink, Target};
use crate::svg;

struct Drawings {
    target: Target,
    windows: usize,
    written: Written,
}

/// Begins a file per window; without `{n}` the single window.
///
/// # Errors
/// [`Error::Usage`] for several windows without `{n}`.
pub(super) fn start<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    let windows = film.view.frames.len();
    if windows > 1 && !target.is_numbered() {
        return Err(Error::usage(
            format!(
                "`{}` is one file for {windows} windows",
                target.path().display()
            ),
            "put `{n}` into the name for a file per window",
        ));
    }
    Ok(Box::new(Drawings {
        target: target.clone(),
        windows,
        written: Written::to(target),
    }))
}

impl Encoder for Drawings {
    fn needs(&self) -> Needs {
        Needs::Scene
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<()> {
        let target = self.target.numbered(frame.index, self.windows);
        let mut sink = Sink::create(&target, None)?;
        let text = svg::write(frame.scene);
        sink.write_all(text.as_bytes()).map_err(sink.error())?;
        self.written.add(sink.commit()?);
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<Written> {
        Ok(self.written)
    }
}
