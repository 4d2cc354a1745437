//! Writes the rows of a table as CSV or Parquet.

use std::io::{self, Write};
use std::path::Path;

use crate::base::csv;
use crate::base::error::{Error, Result};
use crate::base::table::{Batch, TableWriter};
use crate::base::words::worded;
#[cfg(feature = "parquet")]
use crate::export::parquet;

worded! {
    /// The format of a table; its word is also its file extension.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum TableFormat {
        /// Comma-separated values, stamps as nanoseconds since 1970.
        #[default]
        Csv = "csv",
        /// Apache Parquet, stamps as timestamps; written with the feature `parquet`.
        Parquet = "parquet",
    }
}

impl TableFormat {
    /// The format, if this build writes it.
    ///
    /// # Errors
    /// [`Error::Usage`] if not, with the builds that do.
    pub(crate) fn built(self) -> Result<Self> {
        if self == Self::Parquet && cfg!(not(feature = "parquet")) {
            return Err(Error::usage(
                NO_PARQUET,
                "packages and the Python wheel do, and `cargo install --path . --features parquet`",
            ));
        }
        Ok(self)
    }
}

const NO_PARQUET: &str = "this build of bagreel does not write Parquet";

/// A whole small table as bytes.
///
/// # Errors
/// [`Error::Io`] if the format cannot represent it.
pub(crate) fn whole(format: TableFormat, table: &Batch) -> Result<Vec<u8>> {
    let write = || {
        let mut writer = begin(format, Vec::new(), table, &[])?;
        writer.write(table)?;
        writer.finish()
    };
    write().map_err(Error::io("write", Path::new("-")))
}

/// Begins a table with the columns of `batch`; `facts` about it are stored if the format supports it.
pub(crate) fn begin<'a, W: Write + Send + 'a>(
    format: TableFormat,
    to: W,
    batch: &Batch,
    facts: &[(&str, &str)],
) -> io::Result<Box<dyn TableWriter<W> + 'a>> {
    let _ = facts;
    Ok(match format {
        TableFormat::Csv => Box::new(csv::CsvRows::new(to, batch)?),
        #[cfg(feature = "parquet")]
        TableFormat::Parquet => Box::new(parquet::Rows::new(to, batch, facts)?),
        #[cfg(not(feature = "parquet"))]
        TableFormat::Parquet => return Err(io::Error::other(NO_PARQUET)),
    })
}
