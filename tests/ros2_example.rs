//! Tests that the ROS 2 recordings in `examples/` contain the mission that `support/mission.rs` describes.
//!
//! `cargo test --release --test tests -- --ignored write_the_ros2_examples` rewrites them.

use std::fs;
use std::path::{Path, PathBuf};

use bagreel::bag::{Tier, Want};

use crate::support::mission::mission;
use crate::support::{mcap, read, sqlite3};

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

#[test]
#[ignore = "writes the examples anew"]
fn write_the_ros2_examples() {
    let mission = mission();
    let folder = examples().join("courier");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir(&folder).unwrap();
    sqlite3::write(&mission, &folder.join("courier_0.db3"));
    sqlite3::write_metadata(&mission, &folder, "sqlite3", &["courier_0.db3"]);
    let options = mcap::Options {
        profile: "ros2",
        chunk: 128 * 1024,
        ..mcap::Options::default()
    };
    fs::write(
        examples().join("courier.mcap"),
        mcap::write(&mission, &options),
    )
    .unwrap();
}

#[test]
fn both_contain_the_mission_and_are_small() {
    let mission = mission();
    for name in ["courier", "courier.mcap"] {
        let (report, kept) = read(&examples().join(name), Want::Payload).unwrap();
        assert_eq!(kept.counts(), mission.counts(), "{name}");
        assert_eq!(
            (report.tier, report.complete),
            (Tier::Index, true),
            "{name}"
        );
        assert!(
            report.file_bytes < 1_000_000,
            "{name}: {} bytes",
            report.file_bytes
        );
        assert!(kept.connections.iter().all(|c| c.qos.is_some()), "{name}");
    }
}

#[test]
fn both_have_the_same_payloads() {
    let payloads = |name| {
        read(&examples().join(name), Want::Payload)
            .unwrap()
            .1
            .payloads()
    };
    assert!(payloads("courier") == payloads("courier.mcap"));
}
