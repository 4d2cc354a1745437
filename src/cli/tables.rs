//! `bagreel tables`: from arguments to a table per bag.

use super::{DONE, SKIPPED};
use crate::base::error::Result;
use crate::base::words;
use crate::cli::args::tables::TablesArgs;
use crate::cli::terminal::Terminal;
use crate::pipeline::{self, Counting, Tabled, Tables};

/// Writes the tables; returns the exit code.
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
    let messages = words::count(
        usize::try_from(done.messages).unwrap_or(usize::MAX),
        "message",
    );
    if of.is_empty() {
        format!("{tables} of {messages}")
    } else {
        format!("{tables} of {messages} ({})", of.join(", "))
    }
}
