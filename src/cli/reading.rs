//! From input options to a reading.

use super::args::{GraphArgs, Inputs, RangeArgs, RateArgs, TimeArgs};
use crate::bag::Input;
use crate::base::error::Error;
use crate::evidence::code::SourceCode;
use crate::evidence::{collector, conclude, given};
use crate::graph::window::{Division, Length};
use crate::pipeline::{Phases, Reading};

/// The reading of a mission.
pub(super) fn reading(
    inputs: &Inputs,
    time: &TimeArgs,
    range: RangeArgs,
    rate: &RateArgs,
    graph: &GraphArgs,
) -> Result<Reading, Error> {
    let infers = |what: &str| graph.infer.iter().any(|word| word == what);
    Ok(Reading {
        inputs: inputs.bags.iter().map(Input::parse).collect(),
        offsets: inputs.offset.clone(),
        namespaces: inputs.ns.clone(),
        verify: inputs.verify,
        division: Division {
            length: time.period.unwrap_or(Length::Auto),
            step: time.step,
            start: range.start,
            end: range.end,
            align: time.align,
            cut: time.cut,
        },
        is_still_if_unchanged: false,
        collect: collector::CollectOptions {
            infer_stamps: infers("stamps"),
            payload_bytes: if infers("payloads") {
                u64::MAX
            } else {
                collector::PAYLOAD_BYTES
            },
            ..collector::CollectOptions::default()
        },
        grace: time.grace as usize,
        conclude: conclude::ConcludeOptions {
            topology: given::read_all(&graph.topology)?,
            code: None,
        },
        code: source_code(graph)?,
        rate_change: rate.rate_change,
        phases: Phases::Found,
    })
}

/// The source code to read, if any.
fn source_code(graph: &GraphArgs) -> Result<Option<SourceCode>, Error> {
    let infers = graph.infer.iter().any(|word| word == "source");
    let Some(folder) = graph.source.clone() else {
        return if infers {
            Err(Error::usage(
                "`--infer source` requires source code",
                "add `--source DIR` for a workspace or repository",
            ))
        } else {
            Ok(None)
        };
    };
    Ok(Some(SourceCode { folder, infers }))
}
