//! Tests of folders with the parts of one recording: one part alone, parts in any order, and compressed copies.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use bagreel::bag::Want;

use crate::support::{Kept, Recording, mcap, read, rosbag1, shared, small, sqlite3, tiny};

/// A command with `F` for its input, and every byte that it prints: exit code, standard error, standard output.
fn printed(folder: &Path, line: &str, what: &str) -> String {
    let args = line
        .split(' ')
        .map(|word| if word == "F" { what } else { word });
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap();
    let [errors, text] = [&done.stderr, &done.stdout].map(|text| String::from_utf8_lossy(text));
    format!("{:?}\n{errors}\n{text}", done.status.code())
}

/// Commands that read one mission.
const COMMANDS: &[&str] = &[
    "info F",
    "info F --format json --bytes",
    "events F -v",
    "events F --start 2s --end 20s",
    "render F -q -o - --format json",
    "render F -q -o - --format svg",
    "extract F -q -o - --format csv",
    "baseline F -q -o -",
    "check F --expect ../expected.yaml",
];

/// The same in half the time, for many bags.
const FEW: &[&str] = &["info F", "events F -v", "check F --expect ../expected.yaml"];

/// Checks that a folder with one part gives what the part gives: `files` with the format that `metadata.yaml` names, if
/// any.
fn assert_same(bag: &Path, commands: &[&str]) {
    let all = tempfile::tempdir().unwrap();
    let expected = "schema: bagreel.expect/1\ntopics:\n  /scan: { rate: [0, 1000] }\n";
    fs::write(all.path().join("expected.yaml"), expected).unwrap();
    // The folder has the name of the file, so that all that is printed can be equal.
    let name = bag.file_name().unwrap().to_str().unwrap();
    let is_rosbag2 = [".db3", ".mcap", ".zstd"]
        .iter()
        .any(|end| name.ends_with(end));
    let [file, folder, described] =
        ["file", "folder", "described"].map(|kind| all.path().join(kind));
    for at in [&file, &folder.join(name), &described.join(name)] {
        fs::create_dir_all(at).unwrap();
        fs::copy(bag, at.join(name)).unwrap();
    }
    let metadata = format!("rosbag2_bagfile_information:\n  relative_file_paths:\n    - {name}\n");
    fs::write(described.join(name).join("metadata.yaml"), metadata).unwrap();
    // An error names the file in the folder.
    let printed = |folder: &Path, line: &str, what: &str| {
        printed(folder, line, what).replace(&format!("{name}/{name}"), name)
    };
    for line in commands {
        let of_file = printed(&file, line, name);
        assert_eq!(
            printed(&folder, line, name),
            of_file,
            "{line} of {}",
            bag.display()
        );
        if is_rosbag2 {
            assert_eq!(
                printed(&described, line, name),
                of_file,
                "{line} of {} with metadata",
                bag.display()
            );
        }
    }
}

/// A database in which every topic has two rows, as for two qualities of service.
fn with_two_rows(path: &Path) {
    sqlite3::write(&small(), path);
    let db = rusqlite::Connection::open(path).unwrap();
    let columns = "name, type, serialization_format, offered_qos_profiles, type_description_hash";
    db.execute_batch(&format!(
        "INSERT INTO topics (id, {columns}) SELECT id + 100, {columns} FROM topics;
         UPDATE messages SET topic_id = topic_id + 100 WHERE id % 3 = 0;"
    ))
    .unwrap();
}

/// Two publishers of one topic and type whose definitions differ.
fn with_two_definitions() -> Recording {
    let mut bag = Recording::default();
    for (node, definition, start) in [
        ("/a", "int32 left\nint32 right\n", 0),
        ("/b", "int32 right\nint32 left\n", 50),
    ] {
        let id = bag.publisher(node, "/wheels", "my_msgs/msg/Wheels");
        definition.clone_into(&mut bag.publishers[id].definition);
        bag.send(
            id,
            (start, 8000),
            100,
            &[0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0],
        );
    }
    bag
}

fn ros2() -> mcap::Options {
    mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    }
}

/// Bags of every format and oddity that are at hand everywhere.
fn own_bags(folder: &Path) -> Vec<PathBuf> {
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let mut all: Vec<PathBuf> = tiny::bags()
        .iter()
        .map(|(name, bytes)| put(name, bytes))
        .collect();
    with_two_rows(&folder.join("rows_0.db3"));
    all.push(folder.join("rows_0.db3"));
    let ros2 = ros2();
    all.push(put(
        "definitions_0.mcap",
        &mcap::write(&with_two_definitions(), &ros2),
    ));
    let packed = zstd::encode_all(&fs::read(folder.join("rows_0.db3")).unwrap()[..], 1).unwrap();
    all.push(put("packed_0.db3.zstd", &packed));
    let cut = mcap::write(&small(), &ros2);
    all.push(put("cut_0.mcap", &cut[..cut.len() / 2]));
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    for below in ["examples", "tests/data/hostile"] {
        all.extend(bags_in(&project.join(below)));
    }
    all
}

/// The bag files in a folder.
fn bags_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let is_bag = |path: &PathBuf| {
        path.extension()
            .is_some_and(|e| e == "bag" || e == "mcap" || e == "db3")
    };
    let mut bags: Vec<PathBuf> = entries.filter(is_bag).collect();
    bags.sort();
    bags
}

#[test]
fn a_folder_with_one_part_gives_what_the_part_gives() {
    let folder = tempfile::tempdir().unwrap();
    for bag in own_bags(folder.path()) {
        assert_same(&bag, COMMANDS);
    }
}

#[test]
fn a_folder_with_one_recorded_part_gives_what_the_part_gives() {
    let Some(folder) = shared("data") else {
        return;
    };
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().path());
        folders.extend(entries.filter(|path| path.is_dir()));
        for bag in bags_in(&folder) {
            // Copying a large bag tests nothing else.
            if bag.metadata().unwrap().len() < 8 << 20 {
                assert_same(&bag, FEW);
            }
        }
    }
}

#[test]
fn connections_stay_apart_in_a_part_and_are_joined_across_parts() {
    let described = |kept: &Kept| {
        let all = kept.connections.iter();
        let all = all.map(|c| (c.topic.to_string(), c.definition.clone(), c.qos.clone()));
        all.collect::<Vec<_>>()
    };
    let [rows, definitions] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    for part in ["run_0", "run_1"] {
        with_two_rows(&rows.path().join(part).with_extension("db3"));
        let bytes = mcap::write(&with_two_definitions(), &ros2());
        fs::write(definitions.path().join(part).with_extension("mcap"), bytes).unwrap();
    }
    for (dir, part) in [(rows, "run_0.db3"), (definitions, "run_0.mcap")] {
        let alone = read(&dir.path().join(part), Want::Stamps).unwrap().1;
        let joined = read(dir.path(), Want::Stamps).unwrap().1;
        assert_eq!(described(&joined), described(&alone), "{part}");
        assert_eq!(joined.stamps.len(), 2 * alone.stamps.len(), "{part}");
        let twice = alone
            .count(|c| c.id)
            .into_iter()
            .map(|(id, count)| (id, 2 * count));
        assert_eq!(joined.count(|c| c.id), twice.collect(), "{part}");
    }
}

/// Messages of one topic from one tenth of a second up to another.
fn tenths(path: &Path, from: i64, to: i64) {
    let mut bag = Recording::default();
    let topic = bag.publisher("/talker", "/chatter", "std_msgs/msg/String");
    bag.send(topic, (from * 100, to * 100), 100, &[0; 16]);
    sqlite3::write(&bag, path);
}

#[test]
fn parts_are_read_in_order_of_time_whatever_their_names() {
    let spans = [(0, 50), (45, 65), (60, 100)];
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    for is_described in [false, true] {
        let all = orders.map(|order| {
            let dir = tempfile::tempdir().unwrap();
            let run = dir.path().join("run");
            fs::create_dir(&run).unwrap();
            for (number, at) in order.into_iter().enumerate() {
                let (from, to) = spans[at];
                tenths(&run.join(format!("run_{number}.db3")), from, to);
            }
            if is_described {
                let files = ["run_0.db3", "run_1.db3", "run_2.db3"];
                sqlite3::write_metadata(&Recording::default(), &run, "sqlite3", &files);
            }
            ["info F", "events F", "render F -q -o - --format json"]
                .map(|line| printed(dir.path(), line, "run"))
        });
        assert!(
            all[0][0].contains("00:09.9 long, 110 messages"),
            "{}",
            all[0][0]
        );
        for other in &all[1..] {
            assert_eq!(*other, all[0]);
        }
    }
}

#[test]
fn parts_of_a_clock_that_was_set_back_stay_in_their_order() {
    let dir = tempfile::tempdir().unwrap();
    tenths(&dir.path().join("run_0.db3"), 1000, 1600);
    tenths(&dir.path().join("run_1.db3"), 500, 1100);
    let text = printed(dir.path(), "events F", ".");
    assert!(
        text.contains("went back by 1 min 50 s") || text.contains("went back by 01:49.9"),
        "{text}"
    );
}

/// A folder with three parts, of which `files` says how each is stored.
fn copies(files: [Stored; 3]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (number, stored) in (0..).zip(files) {
        let path = dir.path().join(format!("run_{number}.db3"));
        tenths(&path, number * 50, number * 50 + 50);
        let whole = fs::read(&path).unwrap();
        let mut packed = zstd::bulk::compress(&whole, 1).unwrap();
        match stored {
            Stored::Plain => continue,
            Stored::Packed => fs::remove_file(&path).unwrap(),
            Stored::Both => {}
            Stored::PackedInPart => packed.truncate(packed.len() / 2),
            Stored::PackedEmpty => packed.clear(),
            Stored::UnpackedInPart => fs::write(&path, &whole[..whole.len() / 2]).unwrap(),
        }
        fs::write(dir.path().join(format!("run_{number}.db3.zstd")), packed).unwrap();
    }
    dir
}

/// How a part is stored.
#[derive(Clone, Copy)]
enum Stored {
    Plain,
    Packed,
    Both,
    /// Beside the original, a compressed copy whose writing was interrupted.
    PackedInPart,
    PackedEmpty,
    /// Beside the compressed part, an unpacked one whose writing was interrupted.
    UnpackedInPart,
}

#[test]
fn a_recording_beside_its_compressed_copy_is_one_part() {
    use Stored::{Both, Packed, PackedEmpty, PackedInPart, Plain, UnpackedInPart};
    for files in [
        [Packed, Packed, Packed],
        [Packed, Both, Plain],
        [Packed, PackedInPart, Plain],
        [Packed, PackedEmpty, Plain],
        [Packed, UnpackedInPart, Plain],
        [Both, Both, Both],
    ] {
        let dir = copies(files);
        for is_described in [false, true] {
            if is_described {
                let names = ["run_0.db3.zstd", "run_1.db3.zstd", "run_2.db3.zstd"];
                sqlite3::write_metadata(&Recording::default(), dir.path(), "sqlite3", &names);
            }
            let text = printed(dir.path(), "info F", ".");
            assert!(text.starts_with("Some(0)\n\n"), "{text}");
            assert!(text.contains("00:14.9 long, 150 messages"), "{text}");
        }
    }
}

#[test]
fn a_file_beside_its_compressed_copy_is_one_recording() {
    let dir = tempfile::tempdir().unwrap();
    let bytes = rosbag1::write(&small(), rosbag1::Pack::None, 4000);
    fs::write(dir.path().join("a.bag"), &bytes).unwrap();
    for end in ["zst", "zstd"] {
        let packed = zstd::bulk::compress(&bytes, 1).unwrap();
        fs::write(dir.path().join(format!("a.bag.{end}")), packed).unwrap();
    }
    let alone = printed(dir.path(), "events F", "a.bag");
    assert_eq!(printed(dir.path(), "events F", "."), alone);
    let both = printed(dir.path(), "events F a.bag.zstd", "a.bag");
    let note = "note: `a.bag` and `a.bag.zstd` are copies of one recording, which was read once\n";
    assert!(both.contains(note), "{both}");
    assert_eq!(both.replace(note, ""), alone);
}
