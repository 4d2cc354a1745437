//! Prints the publishers of a topic, with times, rates and evidence.
//!
//! `cargo run --release --example publishers -- examples/warehouse.bag /robot1/cmd_vel`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use bagreel::{Reading, read};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let bag = arguments.next().ok_or("give a bag")?;
    let topic = arguments.next().ok_or("give a topic")?;
    let reading = Reading::of([bag]);
    let mission = read(&reading)?;
    for (window, graph) in mission.each() {
        println!("{:.0} s", mission.offset(window.span.start) as f64 / 1e9);
        let all = graph.publications(&mission.elements);
        for (node, _, state) in all.filter(|(_, of, _)| of.name.as_str() == topic) {
            let evidence = mission.elements.evidence(state.what);
            let evidence: Vec<&str> = evidence.words().collect();
            let rate = state
                .hz
                .map_or_else(|| "?".to_owned(), |hz| format!("{hz:.1} Hz"));
            println!(
                "  {}  {rate}  {} by {}",
                node.name,
                state.confidence.word(),
                evidence.join(", ")
            );
        }
    }
    Ok(())
}
