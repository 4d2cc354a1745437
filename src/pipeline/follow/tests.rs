use std::path::Path;

use super::*;

#[test]
fn dropped_messages_keep_their_printed_events() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/courier.mcap");
    let mut reading = Reading::of([path]);
    reading.collect.sizes = true;
    let keep = Period::from_nanos(20_000_000_000).unwrap();
    let mut follow = Follow::new(reading, keep).unwrap();
    while follow.poll().unwrap() != Growth::Ended {}
    let known = follow.so_far(u64::MAX, Length::All).unwrap().unwrap();
    assert_eq!(known.from, follow.forgotten.unwrap());
    assert!(known.now.since(known.from) <= 25_000_000_000);
    let topic = |name: &str| {
        known
            .mission
            .elements
            .topics
            .iter()
            .any(|t| t.name.as_str() == name)
    };
    assert!(topic("/robot_description"), "a latched message stays valid");
    // Times are still counted from the first message.
    assert_eq!(Some(known.mission.span.start), follow.origin);
}
