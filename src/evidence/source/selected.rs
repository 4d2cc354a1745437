//! The choice that a mux reports on `<mux>/selected`: it subscribes to that topic and forwards it from then on.

use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind};
use crate::evidence::observation::{Name, SourceId};

/// The name of the topic below that of the mux.
const SELECTED: &str = "/selected";

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    let is_report = |topic: &Name| known.text(*topic).ends_with(SELECTED);
    let reports = known.topics_of(|kind| kind == "std_msgs/String");
    let reports: Vec<Name> = reports.into_iter().filter(is_report).collect();
    if reports.is_empty() {
        return;
    }
    let (_, shown) = known.facts.logged.sorted();
    for report in reports {
        let text = known.text(report);
        let node = known.facts.known(text.trim_end_matches(SELECTED));
        let Some(node) = node.filter(|node| known.nodes().contains(node)) else {
            continue;
        };
        let of_report = shown
            .iter()
            .filter(|value| known.streams[value.stream].topic == report);
        let chosen =
            of_report.filter_map(|value| Some((value.time, known.facts.known(&value.value)?)));
        let chosen: Vec<(Stamp, Name)> = chosen.collect();
        for output in outputs(known, node) {
            select(source, known, (node, output), &chosen);
        }
    }
}

/// The topics that a node publishes besides its reports and its log.
fn outputs(known: &Conclusions<'_>, node: Name) -> Vec<Name> {
    let own = known.publications().filter(|(of, _)| *of == node);
    let topics = own.map(|(_, topic)| topic);
    let is_recorded = |topic: &Name| known.is_recorded(*topic);
    topics.filter(is_recorded).collect()
}

/// Adds the inputs of a mux that have the type of its output, and the times at which it switches from one to
/// another.
fn select(
    source: SourceId,
    known: &mut Conclusions<'_>,
    (node, output): (Name, Name),
    chosen: &[(Stamp, Name)],
) {
    let kind = known.kind(output);
    let is_input =
        |topic: Name| topic != output && known.is_recorded(topic) && known.kind(topic) == kind;
    let inputs: Vec<(Stamp, Name)> = chosen
        .iter()
        .copied()
        .filter(|(_, t)| is_input(*t))
        .collect();
    for (_, input) in &inputs {
        let what = ElementKey::Subscribe(*input, node);
        known.infer(source, what, ElementKey::Publish(node, output), |known| {
            format!(
                "{} reports that it forwards {}",
                known.text(node),
                known.text(*input)
            )
        });
    }
    let what = ElementKey::Topic(output);
    if known.incidents.iter().any(|incident| incident.what == what) {
        return;
    }
    for pair in inputs.windows(2).filter(|pair| pair[0].1 != pair[1].1) {
        known.incident(
            source,
            what,
            IncidentKind::Turn(pair[0].1, pair[1].1),
            pair[1].0,
        );
    }
}
