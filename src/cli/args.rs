//! The arguments that several commands share, and what they say.

use std::path::PathBuf;

use clap::Args;

use super::values::{length, moment, namespace, offset, one_of, period, phases, share};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::time::{Moment, Period};
use crate::base::words::worded;
use crate::evidence::code::SourceCode;
use crate::evidence::{conclude, given};
use crate::graph::window::{Align, Cut, Division, Length};
use crate::mission::RATE_CHANGE;
use crate::pipeline::{Phases, Reading};

#[derive(Debug, Default, Args)]
pub(super) struct Inputs {
    /// Bags (`.bag`, `.bag.active`, `.db3`, `.mcap`, a rosbag2 folder, `-` for standard input) or a mission's `.json`;
    /// several are read as one mission.
    #[arg(required = true, value_name = "BAG")]
    pub(super) bags: Vec<PathBuf>,
    /// Put the names of a bag in a namespace: `robot2.bag=/robot2`; once per bag.
    #[arg(long, value_name = "BAG=NAMESPACE", value_parser = namespace)]
    pub(super) ns: Vec<(PathBuf, String)>,
    /// Correct the clock of the computer that recorded a bag: `robot2.bag=+0.35s`; once per bag.
    #[arg(long, value_name = "BAG=TIME", value_parser = offset)]
    pub(super) offset: Vec<(PathBuf, i64)>,
}

impl Inputs {
    /// Inputs without corrections.
    pub(super) fn of(bags: &[PathBuf]) -> Self {
        Self {
            bags: bags.to_vec(),
            ..Self::default()
        }
    }
}

/// The part of a recording.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(super) struct RangeArgs {
    /// Start time: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) start: Option<Moment>,
    /// End time, in the same forms as `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) end: Option<Moment>,
}

impl RangeArgs {
    /// This part in windows of this length.
    pub(super) fn in_windows(self, length: Option<Length>) -> Division {
        Division {
            length: length.unwrap_or(Length::Auto),
            start: self.start,
            end: self.end,
            ..Division::default()
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct TimeArgs {
    /// Length of a window: `60`, `30s`, `1m`, `500ms`, or `all` for one window. [default: 60 s, shorter for bags below
    /// five minutes, longer above ten hours]
    #[arg(long, short, value_parser = length)]
    pub(super) period: Option<Length>,
    /// Time from one window's start to the next; windows overlap if it is below `--period`. [default: the period]
    #[arg(long, value_parser = period)]
    pub(super) step: Option<Period>,
    /// Align windows with the first message (`bag`) or with whole periods of UTC (`clock`).
    #[arg(long, value_parser = one_of(Align::ALL), value_name = "bag|clock", default_value = "bag")]
    pub(super) align: Align,
    /// Make one window per phase or per reconfiguration instead of per period.
    #[arg(long, value_parser = one_of(Cut::ALL), value_name = "phases|changes", conflicts_with_all = ["period", "step", "align"])]
    pub(super) cut: Option<Cut>,
    #[command(flatten)]
    pub(super) range: RangeArgs,
}

impl TimeArgs {
    pub(super) fn division(&self) -> Division {
        Division {
            step: self.step,
            align: self.align,
            cut: self.cut,
            ..self.range.in_windows(self.period)
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct RateArgs {
    /// Report rates that change by more than this fraction.
    #[arg(long, value_name = "SHARE", default_value_t = RATE_CHANGE, value_parser = share)]
    pub(super) rate_change: f64,
}

#[derive(Clone, Debug, Default, Args)]
pub(super) struct GraphArgs {
    /// Add nodes and edges from a CSV, YAML, MCAP (`/rosgraph`) or launch file, or from DOT saved by rqt_graph.
    #[arg(long, value_name = "FILE")]
    pub(super) topology: Vec<PathBuf>,
    /// Add the publishers and subscribers that this workspace's source code declares for nodes in the bag. Nothing is
    /// executed.
    #[arg(long, value_name = "DIR")]
    pub(super) source: Option<PathBuf>,
    /// Also infer subscriptions from equal header stamps, from equal payloads in bags above 64 MB, or unnamed nodes
    /// from source code.
    #[arg(long, value_name = "stamps,payloads,source", value_parser = one_of(Inference::ALL), value_delimiter = ',')]
    pub(super) infer: Vec<Inference>,
}

worded! {
    /// What is inferred on request.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum Inference {
        /// Subscriptions, from equal header stamps.
        Stamps = "stamps",
        /// Subscriptions, from equal payloads in large bags.
        Payloads = "payloads",
        /// Unnamed nodes, from source code.
        Source = "source",
    }
}

#[derive(Debug, Args)]
pub(super) struct PhaseArgs {
    /// Phases of the mission: detected (`auto`), `none`, or a file of lines such as `0:38 navigation` or names alone.
    #[arg(long, value_name = "FILE|auto|none", default_value = "auto", value_parser = phases)]
    pub(super) phases: Phases,
}

/// The reading of a mission, with the defaults of all other options.
pub(super) fn reading(inputs: &Inputs, graph: &GraphArgs) -> Result<Reading> {
    let mut reading = Reading {
        inputs: inputs.bags.iter().map(Input::parse).collect(),
        offsets: inputs.offset.clone(),
        namespaces: inputs.ns.clone(),
        conclude: conclude::ConcludeOptions {
            topology: given::read_all(&graph.topology)?,
            code: None,
        },
        code: source_code(graph)?,
        ..Reading::default()
    };
    reading.collect.infer_stamps = graph.infer.contains(&Inference::Stamps);
    if graph.infer.contains(&Inference::Payloads) {
        reading.collect.payload_bytes = u64::MAX;
    }
    Ok(reading)
}

/// The source code to read, if any.
fn source_code(graph: &GraphArgs) -> Result<Option<SourceCode>> {
    let infers = graph.infer.contains(&Inference::Source);
    match graph.source.clone() {
        Some(folder) => Ok(Some(SourceCode { folder, infers })),
        None if infers => Err(Error::usage(
            "`--infer source` requires source code",
            "add `--source DIR` for a workspace or repository",
        )),
        None => Ok(None),
    }
}
