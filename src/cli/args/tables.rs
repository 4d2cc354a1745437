//! What can be typed after `bagreel tables`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use super::{align, period};
use crate::base::time::Period;
use crate::graph::window::Align;
use crate::pipeline::fleet::{CountDetail, OnError};

#[derive(Debug, Args)]
pub(crate) struct TablesArgs {
    /// Bags; folders with bags below them; objects (`s3://`, `gs://`, `az://`, `https://`), and all below a prefix that
    /// ends in a slash; `-` for a bag on standard input.
    #[arg(required_unless_present = "manifest", value_name = "BAG|FOLDER|URL")]
    pub(crate) bags: Vec<String>,
    /// The folder to write: `counts/` and `bags/` in it get a Parquet file per bag.
    #[arg(long, short, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// A list of bags, one per line or with zero bytes between them; `-` is standard input.
    #[arg(long, value_name = "FILE")]
    pub(crate) manifest: Option<PathBuf>,
    /// The length of a window.
    #[arg(long, short, value_parser = period, default_value = "10s")]
    pub(crate) period: Period,
    /// Windows on whole periods of UTC, or from the first message of each mission, for which its bags are opened first.
    #[arg(long, value_parser = align, value_name = "clock|bag", default_value = "clock")]
    pub(crate) align: Align,
    /// A regular expression: its first group, or all that it matches in a bag's path or URL, is its mission. [default:
    /// parts of a split recording are one, any other bag is one by itself]
    #[arg(long, value_name = "PATTERN")]
    pub(crate) mission: Option<String>,
    /// How to count: the times of all messages from the index, or whole chunks from the tail where that is enough, which
    /// leaves their first and last times unknown; `auto` counts chunks where an object has more than 64 of them.
    #[arg(long, value_parser = detail, value_name = "auto|index|chunks", default_value = "auto")]
    pub(crate) tier: CountDetail,
    /// Count only the missions that are number I of N, 1 to N; N such runs count all of them.
    #[arg(long, value_parser = shard, value_name = "I/N")]
    pub(crate) shard: Option<(usize, usize)>,
    /// Leave out bags that were counted in the same way and have not changed since.
    #[arg(long)]
    pub(crate) skip_existing: bool,
    /// A bag that cannot be read gets a row that says why, or ends the run.
    #[arg(long, value_parser = on_error, value_name = "row|fail", default_value = "row")]
    pub(crate) on_error: OnError,
    /// How many bags to count at a time. [default: one per processor; eight where bags are objects]
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

pub(crate) const HELP: &str = "\
counts: mission, bag, format, period_ns, win, start_ns, end_ns, topic, type, node, n, bytes, first_ns, last_ns, max_gap_ns
bags:   uri, mission, etag, file_bytes, format, tier, is_complete, messages, start_ns, end_ns, period_ns, origin_ns,
        lost, error, bagreel, schema_version

Exit codes: 0 done; 1 failed, or a store did not give a bag (run again); 2 usage; 3 done, and `bags` tells of bags that
could not be read or were damaged.";

fn detail(text: &str) -> Result<CountDetail, String> {
    let found = CountDetail::ALL
        .into_iter()
        .find(|detail| detail.word() == text);
    found.ok_or_else(|| "write `auto`, `index` or `chunks`".to_owned())
}

fn on_error(text: &str) -> Result<OnError, String> {
    match text {
        "row" => Ok(OnError::Row),
        "fail" => Ok(OnError::Fail),
        _ => Err("write `row` or `fail`".to_owned()),
    }
}

fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/');
    let shard = parts.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    let shard = shard.filter(|(i, n)| (1..=*n).contains(i));
    shard.ok_or_else(|| "write `1/8` to `8/8` for eight shards".to_owned())
}
