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

#[test]
fn what_is_written_is_growth_before_it_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.db3");
    let mut bytes = b"SQLite format 3\0".to_vec();
    std::fs::write(&path, &bytes).unwrap();
    let keep = Period::from_nanos(20_000_000_000).unwrap();
    let mut follow = Follow::new(Reading::of([&path]), keep).unwrap();
    assert_eq!(follow.poll().unwrap(), Growth::More);
    assert_eq!(follow.poll().unwrap(), Growth::Same);
    bytes.extend([0; 100]);
    std::fs::write(&path, &bytes).unwrap();
    // The database is not opened again yet, and then cannot be read.
    for _ in 0..3 {
        assert_eq!(follow.poll().unwrap(), Growth::More);
    }
    assert_eq!(follow.poll().unwrap(), Growth::Same);
}
