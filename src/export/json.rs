//! The mission as JSON, which every command reads back.

use super::{Started, one_file};
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::mission::Json;

/// Begins the data file.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let json = Json {
        mission: sequence.data,
        places: sequence.places,
    };
    one_file(target, "the data of all windows is one file", move |sink| {
        json.write(sink).map(|()| Vec::new())
    })
}
