//! `bagreel tables`: from arguments to the tables of a fleet.

use std::path::Path;

use super::{DONE, SKIPPED};
use crate::base::error::Result;
use crate::base::{budget, file, words};
use crate::cli::args::tables::TablesArgs;
use crate::cli::terminal::Terminal;
use crate::pipeline::fleet::{self, FleetJob, Planning, Tabled};

/// Writes the tables; returns the exit code.
pub(super) fn tables(args: &TablesArgs, terminal: &mut Terminal) -> Result<u8> {
    let mut sources = args.bags.clone();
    if let Some(manifest) = &args.manifest {
        sources.extend(listed(manifest)?);
    }
    let mut job = FleetJob::new(sources, args.output.clone());
    job.planning = Planning {
        period: args.period,
        align: args.align,
        mission: args.mission.clone(),
    };
    job.detail = args.tier;
    job.shard = args.shard;
    job.skip_existing = args.skip_existing;
    job.on_error = args.on_error;
    job.jobs = args.jobs;
    let done = fleet::tables(&job, terminal)?;
    if !done.copies.is_empty() {
        terminal.note(&format!(
            "{} of {} contain the same messages as another, and all are counted: {}",
            done.copies.len(),
            words::count(done.bags, "bag"),
            words::some_of(&done.copies, 4)
        ));
    }
    terminal.wrote([&*args.output], &summary(&done));
    Ok(if done.unreadable + done.incomplete > 0 {
        SKIPPED
    } else {
        DONE
    })
}

/// `12 bags (1 unreadable, 3 already there), 4711 messages`.
fn summary(done: &Tabled) -> String {
    let of = [
        (done.unreadable, "unreadable"),
        (done.incomplete, "damaged"),
        (done.kept, "already there"),
    ];
    let of: Vec<String> = of
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    let bags = words::count(done.bags, "bag");
    let bags = if of.is_empty() {
        bags
    } else {
        format!("{bags} ({})", of.join(", "))
    };
    let messages = usize::try_from(done.messages).unwrap_or(usize::MAX);
    format!("{bags}, {}", words::count(messages, "message"))
}

/// The bags in a list: names that may contain line ends are separated by zero bytes.
fn listed(manifest: &Path) -> Result<Vec<String>> {
    let bytes = if manifest == Path::new("-") {
        file::read_from(std::io::stdin(), manifest, budget::MANIFEST)?
    } else {
        file::read(manifest, budget::MANIFEST)?
    };
    // A name that is not UTF-8 is converted lossily.
    let text = String::from_utf8_lossy(&bytes);
    let between = if text.contains('\0') { '\0' } else { '\n' };
    let lines = text.split(between).map(|line| line.trim_end_matches('\r'));
    let lines = lines.filter(|line| !line.trim().is_empty());
    Ok(lines.map(str::to_owned).collect())
}
