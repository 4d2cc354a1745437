//! The evolution as JSON, as it is read back by every command.

use super::{Encoder, Written};
use crate::error::Result;
use crate::evolution::{self, Evolution};
use crate::film::Film;
use crate::output::{Sink, Target};

struct Data<'a> {
    evolution: &'a Evolution,
    target: Target,
}

/// Begins the data file.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(super) fn start<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    target.must_be_one("the data of all windows is one file")?;
    Ok(Box::new(Data {
        evolution: film.data,
        target: target.clone(),
    }))
}

impl Encoder for Data<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut sink = Sink::create(&self.target, None)?;
        evolution::write_json(self.evolution, &mut sink).map_err(sink.error())?;
        let mut written = Written::to(&self.target);
        written.add(sink.commit()?);
        Ok(written)
    }
}
