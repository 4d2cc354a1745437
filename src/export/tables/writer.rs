//! Writes the rows of a table as CSV or Parquet.

use std::io::{self, Write};
use std::path::Path;

use crate::base::csv;
use crate::base::error::{Error, Result};
use crate::base::table::Batch;
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
        let mut writer = Writer::new(format, Vec::new(), table, &[])?;
        writer.write(table)?;
        writer.finish()
    };
    write().map_err(Error::io("write", Path::new("-")))
}

/// A table in progress.
pub(crate) enum Writer<W: Write + Send> {
    Csv(Box<csv::CsvRows<W>>),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::Rows<W>>),
}

impl<W: Write + Send> Writer<W> {
    /// Begins a table with the columns of `batch`; `facts` about it are stored if the format supports it.
    pub(crate) fn new(
        format: TableFormat,
        to: W,
        batch: &Batch,
        facts: &[(&str, &str)],
    ) -> io::Result<Self> {
        let _ = facts;
        match format {
            TableFormat::Csv => Ok(Self::Csv(Box::new(csv::CsvRows::new(to, batch)?))),
            #[cfg(feature = "parquet")]
            TableFormat::Parquet => {
                let rows = parquet::Rows::new(to, batch, facts)?;
                Ok(Self::Parquet(Box::new(rows)))
            }
            #[cfg(not(feature = "parquet"))]
            TableFormat::Parquet => Err(io::Error::other(NO_PARQUET)),
        }
    }

    /// Writes all rows of `batch`, which must have the table's columns.
    pub(crate) fn write(&mut self, batch: &Batch) -> io::Result<()> {
        match self {
            Self::Csv(rows) => rows.write(batch),
            #[cfg(feature = "parquet")]
            Self::Parquet(rows) => rows.write(batch),
        }
    }

    /// The number of bytes of encoded rows in memory.
    pub(crate) fn held(&self) -> usize {
        match self {
            Self::Csv(_) => 0,
            #[cfg(feature = "parquet")]
            Self::Parquet(rows) => rows.held(),
        }
    }

    /// Writes the rows in memory.
    #[cfg_attr(
        not(feature = "parquet"),
        expect(clippy::unnecessary_wraps, reason = "nothing in a CSV table can fail")
    )]
    pub(crate) fn unload(&mut self) -> io::Result<()> {
        match self {
            Self::Csv(_) => Ok(()),
            #[cfg(feature = "parquet")]
            Self::Parquet(rows) => rows.unload(),
        }
    }

    /// Ends the table and returns the sink that it was written to.
    pub(crate) fn finish(self) -> io::Result<W> {
        match self {
            Self::Csv(rows) => rows.finish(),
            #[cfg(feature = "parquet")]
            Self::Parquet(rows) => rows.finish(),
        }
    }
}
