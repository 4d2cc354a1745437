//! Prints the event log of a mission: starts, stops, restarts and changes, with times and their uncertainty.
//!
//! `cargo run --release --example story -- examples/warehouse.bag`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use bagreel::values::{Detail, Event, NodeId};
use bagreel::{Mission, Reading, read};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bag = std::env::args().nth(1).ok_or("give a bag")?;
    let mission = read(&Reading::of([bag]))?;
    let log = &mission.log;
    let mut phases = log.phases.iter().peekable();
    for (id, event) in log.headlines(mission.span) {
        while let Some(phase) = phases.next_if(|phase| phase.span.start <= event.time) {
            println!("-- {}", phase.name);
        }
        let doubt = event.latest.since(event.earliest) as f64 / 2e9;
        println!(
            "{:7.1} s ± {doubt:.1}  {} {}{}, {} parts",
            mission.offset(event.time) as f64 / 1e9,
            name(&mission, event),
            event.kind.word(),
            detail(&mission, event),
            log.parts(id).count()
        );
    }
    Ok(())
}

/// The element that an event is about.
fn name(mission: &Mission, event: &Event) -> String {
    let elements = &mission.elements;
    let (node, topic) = elements.ends(event.what);
    let node = node.map(|id| elements.nodes[id].name.as_str());
    let topic = topic.map(|id| elements.topics[id].name.as_str());
    let names: Vec<&str> = node.into_iter().chain(topic).collect();
    names.join(" ")
}

/// The details of an event: rates, senders, values before and after.
fn detail(mission: &Mission, event: &Event) -> String {
    let nodes = |ids: &[NodeId]| {
        let names = ids
            .iter()
            .map(|id| mission.elements.nodes[*id].name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    match &event.detail {
        Detail::Rates { from_hz, to_hz } => format!(" from {from_hz:.2} to {to_hz:.2} Hz"),
        Detail::Senders { from, to } => format!(" from {} to {}", nodes(from), nodes(to)),
        Detail::Values { from, to } => format!(" from `{from}` to `{to}`"),
        _ => String::new(),
    }
}
