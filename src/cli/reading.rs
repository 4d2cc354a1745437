//! From input options to a reading.

use super::args::{GraphArgs, Inference, Inputs};
use crate::bag::Input;
use crate::base::error::Error;
use crate::evidence::code::SourceCode;
use crate::evidence::{conclude, given};
use crate::pipeline::Reading;

/// The reading of a mission, with the defaults of all other options.
pub(super) fn reading(inputs: &Inputs, graph: &GraphArgs) -> Result<Reading, Error> {
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
fn source_code(graph: &GraphArgs) -> Result<Option<SourceCode>, Error> {
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
