//! Prints a line per window of a bag: the size of its graph, and the number of changes since the previous
//! window.
//!
//! `cargo run --release --example windows -- examples/courier.mcap`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use bagreel::{Reading, read};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bag = std::env::args().nth(1).ok_or("give a bag")?;
    let reading = Reading::of([bag]);
    let mission = read(&reading)?;
    println!(
        "{} messages, windows of {}",
        mission.messages, mission.period
    );
    for (window, graph) in mission.each() {
        println!(
            "{:>4}  {:>3} nodes  {:>3} topics  {:>3} edges  {:>3} changes",
            window.index,
            graph.nodes().count(),
            graph.topics().count(),
            graph.publishes().chain(graph.subscribes()).count(),
            window.changes.len()
        );
    }
    Ok(())
}
