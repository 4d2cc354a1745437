//! Graphs as Mermaid flow charts: one per window, or their union.

use std::io::Write as _;

use crate::base::error::Result;
use crate::draw::style::Style;
use crate::export::mermaid::chart;
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::export::{Encoder, Written};
use crate::view::union::union;
use crate::view::{self, View};

struct Charts<'a> {
    view: &'a View,
    style: Style,
    target: Target,
}

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    Ok(Box::new(Charts {
        view: sequence.view,
        style: Style::builtin("light")?,
        target: target.clone(),
    }))
}

impl Encoder for Charts<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut written = Written::to(&self.target);
        let frames = &self.view.frames;
        let mut write = |target: &Target, seen: &view::SeenWindow| -> Result<()> {
            let mut sink = OutputSink::create(target, None)?;
            let text = chart(self.view, &self.style, seen);
            sink.write_all(text.as_bytes()).map_err(sink.error())?;
            written.add(sink.commit()?);
            written
                .remarks
                .extend(too_large(target, seen.arrows.len(), text.len()));
            Ok(())
        };
        if self.target.is_numbered() {
            for (k, frame) in frames.iter().enumerate() {
                let target = self.target.numbered(frame.index, frames.len());
                write(&target, &self.view.seen(k))?;
            }
        } else if frames.len() == 1 {
            write(&self.target, &self.view.seen(0))?;
        } else if let Some(all) = union(self.view) {
            write(&self.target, &all)?;
        }
        Ok(written)
    }
}

/// The numbers of edges and of characters above which Mermaid refuses to draw unless it is configured otherwise (its
/// `maxEdges` and `maxTextSize`).
const MOST: (usize, usize) = (500, 50_000);

fn too_large(target: &Target, edges: usize, bytes: usize) -> Option<String> {
    (edges > MOST.0 || bytes > MOST.1).then(|| {
        format!(
            "`{}` has {edges} edges in {bytes} characters: Mermaid draws at most {} in {}; hide or collapse something",
            target.path().display(),
            MOST.0,
            MOST.1
        )
    })
}
