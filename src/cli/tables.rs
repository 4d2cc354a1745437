//! `bagreel extract` and `bagreel tables`: tables of messages, and of their counts.

use std::path::PathBuf;

use clap::Args;

use super::args::RangeArgs;
use super::terminal::Terminal;
use super::values::{one_of, period};
use super::{DONE, SKIPPED};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::time::Period;
use crate::base::words;
use crate::export::tables::TableFormat;
use crate::export::target::Target;
use crate::pipeline::{self, Counting, Extract, Tabled, Tables};
use crate::view::NameFilter;

#[derive(Debug, Args)]
pub(super) struct ExtractArgs {
    /// Bags, as for `render`; the messages of several bags go into one table.
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Output file, `.csv` or `.parquet`, or `-` for standard output; with `--fields`, a folder.
    #[arg(long, short, value_name = "FILE|FOLDER")]
    output: String,
    /// Output format, if the name has no known extension. [default with `--fields`: csv]
    #[arg(long, value_name = "csv|parquet", value_parser = one_of(TableFormat::ALL))]
    format: Option<TableFormat>,
    /// Decode messages into a table per topic with a column per field.
    #[arg(long)]
    fields: bool,
    /// Folder of `.msg`, `.srv`, `.action` and `.idl` files for types that the bag does not define (repeatable; common types are built in).
    #[arg(long, value_name = "DIR", requires = "fields")]
    msg_path: Vec<PathBuf>,
    /// Topics to export, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    topic_filter: Option<String>,
    #[command(flatten)]
    range: RangeArgs,
}

pub(super) const EXTRACT_HELP: &str = "Columns without `--fields`: time_ns, topic, type, publisher, size_bytes; rows are sorted by time.";

#[derive(Debug, Args)]
pub(super) struct TablesArgs {
    /// Bags, or folders with bags below them.
    #[arg(required = true, value_name = "BAG|FOLDER")]
    bags: Vec<PathBuf>,
    /// Output folder, for a table per bag: `day1/run.bag.csv` for `bags/day1/run.bag`, if `bags/` is given.
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Output format.
    #[arg(long, value_name = "csv|parquet", default_value = "csv", value_parser = one_of(TableFormat::ALL))]
    format: TableFormat,
    /// Length of a window; windows begin at whole periods of UTC.
    #[arg(long, short, value_parser = period, default_value = "10s")]
    period: Period,
    /// Skip bags that are older than their table, whatever options it was made with.
    #[arg(long)]
    skip_existing: bool,
}

pub(super) const HELP: &str = "\
Columns: bag, format, period_ns, win, start_ns, end_ns, topic, type, node, node_role, n, bytes, first_ns, last_ns,
         max_gap_ns; a row per publisher, topic and window with messages.

Exit codes: 0 done, 1 failed, 2 usage error, 3 done, but some bags are unreadable or damaged.";

/// Writes the messages; returns the exit code.
pub(super) fn extract(args: &ExtractArgs, terminal: &mut Terminal) -> Result<u8> {
    let job = job(args)?;
    if job.target == Target::Stdout {
        terminal.make_room();
    }
    let done = pipeline::extract(&job, terminal)?;
    terminal.notices(&done.notices);
    if job.target != Target::Stdout {
        let rows = words::count(done.rows, "row");
        let what = if job.fields {
            format!("{}, {rows}", words::count(done.tables, "table"))
        } else {
            rows
        };
        terminal.wrote([job.target.path()], &what);
    }
    let is_whole = done.undecoded == 0 && !done.notices.any_loss();
    Ok(if is_whole { DONE } else { SKIPPED })
}

fn job(args: &ExtractArgs) -> Result<Extract> {
    let target = Target::parse(&args.output);
    target.must_be_one("all messages are in one table, or one folder of tables")?;
    if args.fields && target == Target::Stdout {
        return Err(Error::usage(
            "`--fields` writes several tables, which do not fit on standard output",
            "give a folder: `-o tables/`",
        ));
    }
    let format = format(args, &target)?;
    Ok(Extract {
        inputs: args.bags.iter().map(Input::parse).collect(),
        format,
        target,
        fields: args.fields,
        topics: NameFilter::parse(args.topic_filter.as_deref().unwrap_or_default())?,
        msg_paths: args.msg_path.clone(),
        start: args.range.start,
        end: args.range.end,
    })
}

/// The requested format, by name or file extension.
fn format(args: &ExtractArgs, target: &Target) -> Result<TableFormat> {
    match (&args.format, target.extension()) {
        (Some(format), _) => format.built(),
        (None, _) if args.fields => Ok(TableFormat::Csv),
        (None, word) => match word.as_deref().and_then(TableFormat::from_word) {
            Some(format) => format.built(),
            None => Err(Error::usage(
                format!("`{}` has no known extension", args.output),
                "choose one with `--format`: csv, parquet",
            )),
        },
    }
}

/// Writes the counts; returns the exit code.
pub(super) fn tables(args: &TablesArgs, terminal: &mut Terminal) -> Result<u8> {
    let job = Tables {
        sources: args.bags.clone(),
        folder: args.output.clone(),
        format: args.format.built()?,
        counting: Counting {
            period: args.period,
            ..Counting::default()
        },
        skip_existing: args.skip_existing,
    };
    let done = pipeline::tables(&job, terminal)?;
    terminal.notices(&done.notices);
    terminal.wrote([&*args.output], &summary(&done));
    let is_whole = done.unreadable == 0 && done.damaged == 0;
    Ok(if is_whole { DONE } else { SKIPPED })
}

/// `12 tables of 4711 messages (1 unreadable, 3 already there)`.
fn summary(done: &Tabled) -> String {
    let of = [
        (done.unreadable, "unreadable"),
        (done.damaged, "damaged"),
        (done.kept, "already there"),
    ];
    let tables = words::count(done.files, "table");
    let messages = words::count(done.messages, "message");
    match words::counted(&of, |count, what| format!("{count} {what}")) {
        none if none.is_empty() => format!("{tables} of {messages}"),
        some => format!("{tables} of {messages} ({some})"),
    }
}
