//! Measures a run of this process, and the median of several runs.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "each benchmark uses its part of it"
)]

use std::fs;

/// The cost of a run.
#[derive(Clone, Copy, Default)]
pub struct Took {
    pub wall: f64,
    pub cpu: f64,
    pub bytes: f64,
    pub peak_mb: f64,
    pub messages: f64,
}

pub fn proc(file: &str, key: &str) -> u64 {
    let text = fs::read_to_string(format!("/proc/self/{file}")).unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix(key));
    line.and_then(|l| l.split_whitespace().next()?.parse().ok())
        .unwrap_or(0)
}

/// Bytes read by this process so far.
pub fn io_bytes() -> u64 {
    proc("io", "rchar:")
}

/// The peak memory in megabytes.
pub fn peak_mb() -> f64 {
    proc("status", "VmHWM:") as f64 / 1024.0
}

/// Processor seconds of this process so far.
pub fn cpu() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or_default();
    let ticks = after
        .split_whitespace()
        .skip(11)
        .take(2)
        .filter_map(|t| t.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

/// Parses a child's `took …` line.
pub fn parse(out: &[u8]) -> Option<Took> {
    let text = String::from_utf8_lossy(out);
    let line = text.lines().find_map(|l| l.strip_prefix("took "))?;
    let n: Vec<f64> = line
        .split_whitespace()
        .filter_map(|x| x.parse().ok())
        .collect();
    Some(Took {
        wall: n[0],
        cpu: n[1],
        bytes: n[2],
        peak_mb: n[3],
        messages: n[4],
    })
}

/// The median of some runs of a command, by wall time.
pub fn median(times: usize, run: impl Fn() -> Option<Took>) -> Option<Took> {
    let mut all: Vec<Took> = (0..times).filter_map(|_| run()).collect();
    all.sort_by(|a, b| a.wall.total_cmp(&b.wall));
    all.get(all.len() / 2).copied()
}
