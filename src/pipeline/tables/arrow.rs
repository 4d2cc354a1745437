//! Tables as Arrow record batches, for zero-copy exchange.
//!
//! The crate `arrow-array` is part of the public API: a program that uses these batches needs the same version.

use super::count::{Counting, count};
use crate::bag::Input;
use crate::base::error::Result;
use crate::base::notice::Notices;
use crate::export::arrow::to_arrow;
use crate::export::tables::whole;
use crate::mission::Mission;

pub use crate::export::arrow::RecordBatch;

/// The table of a recording as `bagreel tables` writes it, and the notices about the recording.
#[derive(Clone, Debug)]
pub struct Counts {
    /// A row per publisher, topic and window with messages.
    pub rows: RecordBatch,
    /// The notices for the user, such as those about losses.
    pub notices: Notices,
}

/// Counts the messages of a recording; its name in the rows is `name`.
///
/// # Errors
/// If an input cannot be read at all, and [`Error::Usage`](crate::Error::Usage) for texts of more than 2 GB in total.
pub fn counts(name: &str, inputs: &[Input], counting: &Counting) -> Result<Counts> {
    let counted = count(name, inputs, counting)?;
    Ok(Counts {
        rows: to_arrow(&counted.rows)?,
        notices: counted.notices,
    })
}

/// Every table of a mission by name: `edges`, `topics`, `nodes`, `changes`, `ledger`, `phases`, `bags`.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) for texts of more than 2 GB in total.
pub fn mission_batches(mission: &Mission) -> Result<Vec<(&'static str, RecordBatch)>> {
    let tables = whole(mission).into_iter();
    tables
        .map(|(word, batch)| Ok((word, to_arrow(&batch)?)))
        .collect()
}
