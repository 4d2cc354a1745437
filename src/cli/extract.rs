//! `bagreel extract`: from arguments to tables of messages.

use crate::bag::Input;
use crate::base::error::Error;
use crate::base::notice::Notices;
use crate::base::words;
use crate::cli::args::ExtractArgs;
use crate::cli::terminal::Terminal;
use crate::export::tables::TableFormat;
use crate::export::target::Target;
use crate::pipeline::{self, Extract};
use crate::view::NameFilter;

/// Writes the tables; returns the notices, and the number of messages that could not be decoded.
pub(super) fn extract(
    args: &ExtractArgs,
    inputs: Vec<Input>,
    terminal: &mut Terminal,
) -> Result<(Notices, u64), Error> {
    let job = job(args, inputs)?;
    if job.target == Target::Stdout {
        terminal.make_room();
    }
    let done = pipeline::extract(&job, terminal)?;
    terminal.notices(&done.notices);
    if job.target != Target::Stdout {
        let tables = match (job.fields, done.tables) {
            (false, _) => String::new(),
            (true, 1) => "1 table, ".to_owned(),
            (true, count) => format!("{count} tables, "),
        };
        let rows = usize::try_from(done.rows).unwrap_or(usize::MAX);
        let rows = words::count(rows, "row");
        terminal.wrote([job.target.path()], &format!("{tables}{rows}"));
    }
    Ok((done.notices, done.undecoded))
}

fn job(args: &ExtractArgs, inputs: Vec<Input>) -> Result<Extract, Error> {
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
        inputs,
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
fn format(args: &ExtractArgs, target: &Target) -> Result<TableFormat, Error> {
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
