//! The arguments of `bagreel tables`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use super::values::{align, period};
use crate::base::time::Period;
use crate::graph::window::Align;
use crate::pipeline::fleet::{CountDetail, OnError};

#[derive(Debug, Args)]
pub(crate) struct TablesArgs {
    /// Bags, folders of bags, or `-` for standard input.
    #[arg(required_unless_present = "manifest", value_name = "BAG|FOLDER")]
    pub(crate) bags: Vec<String>,
    /// Output folder; `counts/` and `bags/` in it get one Parquet file per bag.
    #[arg(long, short, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// File that lists bags, separated by newlines or zero bytes; `-` is standard input.
    #[arg(long, value_name = "FILE")]
    pub(crate) manifest: Option<PathBuf>,
    /// Length of a window.
    #[arg(long, short, value_parser = period, default_value = "10s")]
    pub(crate) period: Period,
    /// Align windows with whole periods of UTC (`clock`) or with each mission's first message (`bag`).
    #[arg(long, value_parser = align, value_name = "clock|bag", default_value = "clock")]
    pub(crate) align: Align,
    /// Regular expression whose first group, or whole match, in a bag's path names its mission. [default: one mission per
    /// recording]
    #[arg(long, value_name = "PATTERN")]
    pub(crate) mission: Option<String>,
    /// Count messages by the full index, or whole chunks (faster, but no first and last times).
    #[arg(long, value_parser = detail, value_name = "index|chunks", default_value = "index")]
    pub(crate) tier: CountDetail,
    /// Count only shard I of N; the shards 1/N to N/N together count everything.
    #[arg(long, value_parser = shard, value_name = "I/N")]
    pub(crate) shard: Option<(usize, usize)>,
    /// Skip unchanged bags that were already counted with the same options.
    #[arg(long)]
    pub(crate) skip_existing: bool,
    /// For an unreadable bag, write a row with the error, or fail.
    #[arg(long, value_parser = on_error, value_name = "row|fail", default_value = "row")]
    pub(crate) on_error: OnError,
    /// Number of bags to count in parallel. [default: one per processor]
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

pub(crate) const HELP: &str = "\
counts: mission, bag, format, period_ns, win, start_ns, end_ns, topic, type, node, node_role, n, bytes,
        first_ns, last_ns, max_gap_ns
bags:   uri, mission, file_bytes, format, tier, is_complete, messages, content, start_ns, end_ns, period_ns,
        origin_ns, lost, error, bagreel, schema_version

Exit codes: 0 done, 1 failed, 2 usage error, 3 done, but `bags` lists unreadable or damaged bags.";

fn detail(text: &str) -> Result<CountDetail, String> {
    CountDetail::from_word(text).ok_or_else(|| "write `index` or `chunks`".to_owned())
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
