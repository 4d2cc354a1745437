//! `bagreel extract` and `bagreel tables`: from arguments to tables of messages, and of their counts.

use super::args::ExtractArgs;
use super::args::tables::TablesArgs;
use super::terminal::Terminal;
use super::{DONE, SKIPPED};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::export::tables::TableFormat;
use crate::export::target::Target;
use crate::pipeline::{self, Counting, Extract, Tabled, Tables};
use crate::view::NameFilter;

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
    let of = of.iter().filter(|(count, _)| *count > 0);
    let of: Vec<String> = of.map(|(count, what)| format!("{count} {what}")).collect();
    let tables = words::count(done.files, "table");
    let messages = words::count(done.messages, "message");
    if of.is_empty() {
        format!("{tables} of {messages}")
    } else {
        format!("{tables} of {messages} ({})", of.join(", "))
    }
}
