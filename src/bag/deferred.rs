//! Many bags, only a few of them open at a time: some systems allow a process only 256 open files.

use super::input::Input;
use super::model::{OpenOptions, Reader, Report, Sink};
use crate::base::error::Result;
use crate::base::time::Span;

/// The number of bags that stay open until they are read; each may be a folder that keeps as many files open.
const STAY_OPEN: usize = 8;

/// A bag that is opened on demand.
struct Deferred {
    input: Input,
    options: OpenOptions,
    /// The open reader, if there is one.
    open: Option<Box<dyn Reader>>,
}

/// The readers of `inputs`, in order; each is opened once up front, so that an input that is not a bag is reported
/// immediately.
pub(crate) fn open_each(
    inputs: impl IntoIterator<Item = Input>,
    options: &OpenOptions,
) -> impl Iterator<Item = Result<Box<dyn Reader>>> {
    inputs.into_iter().enumerate().map(|(place, input)| {
        let open = if place < STAY_OPEN {
            Some(super::open(&input, options)?)
        } else {
            super::sniff(&input)?;
            None
        };
        let options = options.clone();
        Ok(Box::new(Deferred {
            input,
            options,
            open,
        }) as Box<dyn Reader>)
    })
}

impl Deferred {
    /// What a reader that is open now says.
    fn ask<T>(&self, ask: impl Fn(&dyn Reader) -> T) -> Option<T> {
        match &self.open {
            Some(reader) => Some(ask(reader.as_ref())),
            // Errors are reported when the bag is read.
            None => Some(ask(super::open(&self.input, &self.options).ok()?.as_ref())),
        }
    }
}

impl Reader for Deferred {
    fn is_straight(&self) -> bool {
        self.ask(|reader| reader.is_straight()).unwrap_or(true)
    }

    fn stated(&self) -> Option<Span> {
        self.ask(|reader| reader.stated()).flatten()
    }

    fn span(&mut self) -> Result<Option<Span>> {
        match &mut self.open {
            Some(reader) => reader.span(),
            None => super::open(&self.input, &self.options)?.span(),
        }
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let open = self.open.take();
        let mut reader = open.map_or_else(|| super::open(&self.input, &self.options), Ok)?;
        reader.read(range, sink)
    }
}
