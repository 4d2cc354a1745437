//! The arguments of `bagreel tables`.

use std::path::PathBuf;

use clap::Args;

use super::values::{one_of, period};
use crate::base::time::Period;
use crate::export::tables::TableFormat;

#[derive(Debug, Args)]
pub(crate) struct TablesArgs {
    /// Bags, or folders with bags below them.
    #[arg(required = true, value_name = "BAG|FOLDER")]
    pub(crate) bags: Vec<PathBuf>,
    /// Output folder, for a table per bag: `day1/run.bag.csv` for `bags/day1/run.bag`, if `bags/` is given.
    #[arg(long, short, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Output format.
    #[arg(long, value_name = "csv|parquet", default_value = "csv", value_parser = one_of(TableFormat::ALL))]
    pub(crate) format: TableFormat,
    /// Length of a window; windows begin at whole periods of UTC.
    #[arg(long, short, value_parser = period, default_value = "10s")]
    pub(crate) period: Period,
    /// Skip bags that are older than their table, whatever options it was made with.
    #[arg(long)]
    pub(crate) skip_existing: bool,
}

pub(crate) const HELP: &str = "\
Columns: bag, format, period_ns, win, start_ns, end_ns, topic, type, node, node_role, n, bytes, first_ns, last_ns,
         max_gap_ns; a row per publisher, topic and window with messages.

Exit codes: 0 done, 1 failed, 2 usage error, 3 done, but some bags are unreadable or damaged.";
