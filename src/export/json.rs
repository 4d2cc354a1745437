//! The evolution as JSON, as it is read back by every command.

use super::{Encoder, Written};
use crate::base::error::Result;
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::mission::Json;

struct JsonEncoder<'a> {
    json: Json<'a>,
    target: Target,
}

/// Begins the data file.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for a name with `{n}`.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    target.must_be_one("the data of all windows is one file")?;
    Ok(Box::new(JsonEncoder {
        json: Json {
            mission: sequence.data,
            places: sequence.places,
            form: sequence.options.json,
        },
        target: target.clone(),
    }))
}

impl Encoder for JsonEncoder<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut sink = OutputSink::create(&self.target, None)?;
        self.json.write(&mut sink).map_err(sink.error())?;
        let mut written = Written::to(&self.target);
        written.add(sink.commit()?);
        Ok(written)
    }
}
