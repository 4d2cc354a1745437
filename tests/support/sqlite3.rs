//! Described bags as rosbag2 databases, schema version 4, and as folders with metadata.yaml.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use rusqlite::{Connection, params};

use super::Recording;

/// Writes a database; topics are distinguished by name and type only, as in rosbag2.
pub fn write(recording: &Recording, path: &Path) {
    let mut db = Connection::open(path).unwrap();
    db.execute_batch(
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
         CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
         CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
            encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);
         INSERT INTO schema VALUES (4, 'jazzy');",
    )
    .unwrap();
    let all = db.transaction().unwrap();
    let mut topics = BTreeMap::new();
    for publisher in &recording.publishers {
        let key = (&publisher.topic, &publisher.type_name);
        let id = i64::try_from(topics.len()).unwrap() + 1;
        if topics.contains_key(&key) {
            continue;
        }
        topics.insert(key, id);
        let row = params![id, publisher.topic, publisher.type_name, publisher.qos];
        all.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', ?4, '')", row)
            .unwrap();
        if !publisher.definition.is_empty() {
            let row = params![publisher.type_name, publisher.definition];
            let sql = "INSERT INTO message_definitions SELECT NULL, ?1, 'ros2msg', ?2, '' \
                       WHERE NOT EXISTS (SELECT 1 FROM message_definitions WHERE topic_type = ?1)";
            all.execute(sql, row).unwrap();
        }
    }
    {
        let mut insert = all
            .prepare("INSERT INTO messages VALUES (NULL, ?1, ?2, ?3)")
            .unwrap();
        for (publisher, at, payload) in &recording.messages {
            let publisher = &recording.publishers[*publisher];
            let id = topics[&(&publisher.topic, &publisher.type_name)];
            insert.execute(params![id, at, payload]).unwrap();
        }
    }
    all.commit().unwrap();
    db.close().unwrap();
}

/// Writes `metadata.yaml`, version 9, for storage files with the recording.
pub fn write_metadata(recording: &Recording, folder: &Path, storage: &str, files: &[&str]) {
    let counts = recording.counts();
    let times = || recording.messages.iter().map(|m| m.1);
    let (first, last) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
    let mut text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: {storage}\n  duration:\n    nanoseconds: {}\n  \
         starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {}\n  topics_with_message_count:\n",
        last - first,
        recording.messages.len(),
    );
    let mut seen = Vec::new();
    for publisher in &recording.publishers {
        if seen.contains(&&publisher.topic) {
            continue;
        }
        seen.push(&publisher.topic);
        let qos = if publisher.qos.is_empty() {
            "        offered_qos_profiles: []\n".to_owned()
        } else {
            format!("        offered_qos_profiles:\n{}", indent(&publisher.qos))
        };
        let _ = write!(
            text,
            "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n{qos}        \
             type_description_hash: \"\"\n      message_count: {}\n",
            publisher.topic,
            publisher.type_name,
            counts.get(&publisher.topic).unwrap_or(&0),
        );
    }
    text += "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n";
    for file in files {
        let _ = writeln!(text, "    - {file}");
    }
    text += "  custom_data: ~\n  ros_distro: jazzy\n";
    fs::write(folder.join("metadata.yaml"), text).unwrap();
}

fn indent(text: &str) -> String {
    text.lines()
        .fold(String::new(), |all, line| all + "          " + line + "\n")
}
