//! Tests of how each command treats a folder: as one recording, several, a copy, or none.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{Recording, mcap, rosbag1, small};

/// A recording that differs from others in its messages.
fn run(number: i64) -> Recording {
    let mut bag = small();
    let topic = bag.publisher("/extra", "/extra", "std_msgs/String");
    bag.send(topic, (number * 1000, 50_000), 1000, b"\x05\0\0\0found");
    bag
}

fn bag1(path: &Path, number: i64) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(
        path,
        rosbag1::write(&run(number), rosbag1::Pack::None, 50_000),
    )
    .unwrap();
}

fn mcap2(path: &Path, number: i64) {
    let options = mcap::Options {
        profile: "ros2",
        ..mcap::Options::default()
    };
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, mcap::write(&run(number), &options)).unwrap();
}

const METADATA: &str = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n    - run_0.mcap\n";

/// Two parts of one ROS 1 recording, and the first of the next.
const PARTS: [&str; 3] = [
    "r_2024-05-03-14-03-22_0.bag",
    "r_2024-05-03-14-08-22_1.bag",
    "r_2024-05-03-15-00-00_0.bag",
];

/// How commands that take one mission treat a folder.
enum Is {
    /// One recording.
    One,
    /// One recording, with a note that contains this text.
    Noted(&'static str),
    /// An error that contains this text.
    Refused(&'static str),
}

/// The name, the function that creates the folder, the result of commands that take one mission, and the rows of a
/// survey; 0 rows: `info` shows the one recording.
type Row = (&'static str, fn(&Path), Is, usize);

#[rustfmt::skip]
const FOLDERS: &[Row] = &[
    ("one.bag", |f| bag1(&f.join("a.bag"), 1), Is::One, 0),
    ("one.mcap", |f| mcap2(&f.join("a.mcap"), 1), Is::One, 0),
    ("rosbag2", |f| { mcap2(&f.join("run_0.mcap"), 1); fs::write(f.join("metadata.yaml"), METADATA).unwrap(); }, Is::One, 0),
    ("split", |f| { mcap2(&f.join("run_0.mcap"), 1); mcap2(&f.join("run_1.mcap"), 2); }, Is::One, 0),
    ("below", |f| mcap2(&f.join("deep/run/a.mcap"), 1), Is::One, 0),
    ("rosbag2 and a bag", |f| {
        mcap2(&f.join("run_0.mcap"), 1);
        fs::write(f.join("metadata.yaml"), METADATA).unwrap();
        bag1(&f.join("old.bag"), 2);
    }, Is::Noted("`old.bag` is not named in `metadata.yaml` and was left out"), 2),
    ("two formats", |f| { bag1(&f.join("a.bag"), 1); mcap2(&f.join("b.mcap"), 2); }, Is::Refused("2 recordings: a.bag and b.mcap"), 2),
    ("two bags", |f| { bag1(&f.join("a.bag"), 1); bag1(&f.join("b.bag"), 2); }, Is::Refused("2 recordings: a.bag and b.bag"), 2),
    ("two files", |f| { mcap2(&f.join("a.mcap"), 1); mcap2(&f.join("b.mcap"), 2); }, Is::Refused("2 recordings: a.mcap and b.mcap"), 2),
    ("two names", |f| { mcap2(&f.join("a_0.mcap"), 1); mcap2(&f.join("b_0.mcap"), 2); }, Is::Refused("2 recordings: a_0.mcap and b_0.mcap"), 2),
    ("copies", |f| { mcap2(&f.join("a.mcap"), 1); mcap2(&f.join("b.mcap"), 1); }, Is::Refused("2 recordings: a.mcap and b.mcap"), 2),
    ("two below", |f| { mcap2(&f.join("x/a.mcap"), 1); bag1(&f.join("y/b.bag"), 2); }, Is::Refused("2 recordings: x/a.mcap and y/b.bag"), 2),
    ("split bags", |f| { bag1(&f.join(PARTS[0]), 1); bag1(&f.join(PARTS[1]), 2); }, Is::One, 0),
    ("split bags twice", |f| {
        for (number, name) in (1..).zip(PARTS) { bag1(&f.join("day").join(name), number); }
    }, Is::Refused("2 recordings: day/r_2024-05-03-14-03-22_0.bag to r_2024-05-03-14-08-22_1.bag and day/r_2024-05-03-15-00-00_0.bag"), 2),
    ("a split bag is missing", |f| { bag1(&f.join(PARTS[0]), 1); bag1(&f.join("r_2024-05-03-14-08-22_2.bag"), 2); },
        Is::Refused("2 recordings: r_2024-05-03-14-03-22_0.bag and r_2024-05-03-14-08-22_2.bag"), 2),
    ("empty", |f| fs::write(f.join("notes.txt"), "no bag").unwrap(), Is::Refused("a folder without a recording"), 0),
];

/// Commands that take one mission.
const COMMANDS: &[&str] = &[
    "render F -o out.json",
    "figure F --kind lives --rows topics --width 181mm -o out.svg",
    "extract F -o out.csv",
    "baseline F",
    "check F --expect expected.yaml",
    "diff F F",
];

/// The exit code, and the text on standard error and output.
fn bagreel(folder: &Path, line: &str, what: &str) -> (i32, String, String) {
    let args = line
        .split(' ')
        .map(|word| if word == "F" { what } else { word });
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        done.status.code().unwrap(),
        text(done.stderr),
        text(done.stdout),
    )
}

/// Creates every folder of the table.
fn made() -> tempfile::TempDir {
    let all = tempfile::tempdir().unwrap();
    for (name, make, ..) in FOLDERS {
        let folder = all.path().join(name);
        fs::create_dir(&folder).unwrap();
        make(&folder);
    }
    fs::write(
        all.path().join("expected.yaml"),
        "schema: bagreel.expect/1\ntopics:\n  /scan: {}\n",
    )
    .unwrap();
    all
}

#[test]
fn a_folder_is_one_recording_or_an_error_that_lists_them() {
    let all = made();
    for (name, _, is, _) in FOLDERS {
        for line in COMMANDS {
            let (code, said, _) = bagreel(all.path(), line, name);
            let at = format!("{line} of {name}: {code}: {said}");
            match is {
                Is::One => {
                    assert_eq!(code, 0, "{at}");
                    assert!(!said.contains("left out"), "{at}");
                }
                Is::Noted(words) => assert!(code == 0 && said.contains(words), "{at}"),
                Is::Refused(words) => {
                    assert!(code == 1 || code == 2, "{at}");
                    assert!(said.contains(words) && said.contains("hint: give "), "{at}");
                }
            }
        }
    }
}

#[test]
fn a_folder_of_one_recording_has_the_counts_of_its_files() {
    let all = made();
    let messages = |what: &str| {
        let (_, _, text) = bagreel(all.path(), "info F --format json", what);
        let info: serde_json::Value = serde_json::from_str(&text).unwrap();
        info["messages"].as_u64().unwrap()
    };
    assert_eq!(messages("one.bag"), messages("one.bag/a.bag"));
    assert_eq!(messages("one.mcap"), messages("one.mcap/a.mcap"));
    let parts = messages("split/run_0.mcap") + messages("split/run_1.mcap");
    assert_eq!(messages("split"), parts);
}

#[test]
fn a_folder_of_split_bags_is_the_mission_of_its_parts() {
    let all = made();
    let parts = [PARTS[0], PARTS[1]].map(|part| format!("split bags/{part}"));
    let run = |inputs: &[&str]| {
        let args = ["render", "-o", "-", "--format", "json", "-q"];
        let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(all.path())
            .args(args.iter().chain(inputs))
            .output()
            .unwrap();
        assert!(done.status.success() && done.stderr.is_empty(), "{done:?}");
        String::from_utf8(done.stdout).unwrap()
    };
    assert_eq!(run(&["split bags"]), run(&[&parts[0], &parts[1]]));
}

#[test]
fn a_missing_part_is_a_loss() {
    let all = tempfile::tempdir().unwrap();
    for (folder, number, said) in [
        (
            "one",
            2,
            "part 1 is missing between `run_0.mcap` and `run_2.mcap`",
        ),
        (
            "many",
            12,
            "parts 1 to 11 are missing between `run_0.mcap` and `run_12.mcap`",
        ),
    ] {
        mcap2(&all.path().join(folder).join("run_0.mcap"), 1);
        mcap2(
            &all.path().join(folder).join(format!("run_{number}.mcap")),
            2,
        );
        for line in [
            "render F -o out.json",
            "events F",
            "info F",
            "extract F -o out.csv",
            "tables F -o fleet",
        ] {
            let (code, errors, text) = bagreel(all.path(), line, folder);
            assert_eq!(code, 3, "{line}: {errors}");
            assert!(
                line.starts_with("tables") || errors.contains(said),
                "{line}: {errors} {text}"
            );
        }
    }
}

#[test]
fn info_events_and_tables_take_folders_of_recordings() {
    let all = made();
    for (name, _, is, rows) in FOLDERS {
        if name == &"empty" {
            for line in ["info F", "events F", "tables F -o counts"] {
                let (code, said, _) = bagreel(all.path(), line, name);
                let is_refused = said.contains("a folder without bags");
                assert!(code == 1 && is_refused, "{line}: {said}");
            }
            continue;
        }
        let (_, said, text) = bagreel(all.path(), "info F --format csv", name);
        assert_eq!(text.lines().count() - 1, (*rows).max(1), "{name}: {said}");
        let (code, said, text) = bagreel(all.path(), "events F --format csv", name);
        let is_one = matches!(is, Is::One) || *rows == 0;
        let head = if is_one {
            "time_ns,kind,"
        } else {
            "bag,time_ns,kind,"
        };
        assert!(code == 0 && text.starts_with(head), "{name}: {said}");
        let bags: BTreeSet<&str> = text
            .lines()
            .skip(1)
            .filter_map(|row| row.split(',').next())
            .collect();
        assert!(is_one || bags.len() == *rows, "{name}: {bags:?}");
        let (code, said, _) = bagreel(all.path(), "tables F -o counts", name);
        let tables = if *rows < 2 {
            "1 table of".to_owned()
        } else {
            format!("{rows} tables of")
        };
        assert!(code == 0 && said.contains(&tables), "{name}: {said}");
        fs::remove_dir_all(all.path().join("counts")).unwrap();
    }
}

/// Which bag has a restart: the rows of the logs of all bags, each with its bag.
#[test]
fn the_log_of_a_folder_names_the_bag_of_every_event() {
    let all = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| {
        let path = all.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    put(
        "bags/a, b/w.bag",
        &fs::read(example.join("warehouse.bag")).unwrap(),
    );
    put(
        "bags/c.mcap",
        &fs::read(example.join("courier.mcap")).unwrap(),
    );
    put(
        "bags/empty.bag",
        &rosbag1::write(&Recording::default(), rosbag1::Pack::None, 50_000),
    );
    put("bags/foreign.bag", b"no bag");
    let shown = |line: &str| {
        let (code, said, text) = bagreel(all.path(), line, "bags");
        assert_eq!(code, 3, "{line}: {said}");
        assert!(
            said.contains("warning: `bags/foreign.bag` is not a bag"),
            "{said}"
        );
        assert!(
            said.contains("note: `empty.bag` contains no messages"),
            "{said}"
        );
        text
    };
    // Each row is that of the bag's own log, with the name in front.
    let own = |bag: &str, options: &str, lead: &str| {
        let (_, _, text) = bagreel(
            all.path(),
            format!("events F {options}").trim_end(),
            &format!("bags/{bag}"),
        );
        let rows = text.lines().map(|row| format!("{lead}{row}\n"));
        rows.collect::<Vec<_>>()
    };
    let csv = shown("events F --format csv --parts --phases auto");
    let [w, c] = [("a, b/w.bag", "\"a, b/w.bag\","), ("c.mcap", "c.mcap,")]
        .map(|(bag, lead)| own(bag, "--format csv --parts --phases auto", lead));
    assert_eq!(
        csv,
        format!(
            "bag,{}{}{}",
            &c[0]["c.mcap,".len()..],
            w[1..].concat(),
            c[1..].concat()
        )
    );
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    let restarts = rows
        .records()
        .map(|row| row.unwrap())
        .filter(|row| &row[2] == "restarted");
    let restarted: BTreeSet<String> = restarts.map(|row| row[0].to_owned()).collect();
    assert_eq!(restarted, BTreeSet::from(["a, b/w.bag".to_owned()]));
    let ndjson = shown("events F --format ndjson");
    let [w, c] = ["a, b/w.bag", "c.mcap"].map(|bag| own(bag, "--format ndjson", "").concat());
    let named =
        |bag: &str, rows: &str| rows.replace("{\"id\"", &format!("{{\"bag\":\"{bag}\",\"id\""));
    assert_eq!(ndjson, named("a, b/w.bag", &w) + &named("c.mcap", &c));
    let json: serde_json::Value = serde_json::from_str(&shown("events F --format json")).unwrap();
    assert_eq!(
        json["events"].as_array().unwrap().len(),
        ndjson.lines().count()
    );
    let text = shown("events F");
    let [w, c] = ["a, b/w.bag", "c.mcap"].map(|bag| own(bag, "", "").concat());
    assert_eq!(text, format!("a, b/w.bag\n{w}c.mcap\n{c}"));
    let markdown = shown("events F --format markdown");
    assert!(
        markdown.contains("\n### c.mcap\n\n| when | what |\n"),
        "{markdown}"
    );
}

#[test]
fn the_order_of_bags_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    mcap2(&at("late.mcap"), 2);
    bag1(&at("early.bag"), 1);
    let mut later = run(3);
    let begin = later.messages[0].1;
    later
        .messages
        .retain(|(_, time, _)| *time > begin + 1_000_000_000);
    let bytes = rosbag1::write(&later, rosbag1::Pack::None, 4000);
    fs::write(at("afternoon.bag"), bytes).unwrap();
    let shown = |line: &str| {
        let (code, said, text) = bagreel(folder.path(), line, "");
        assert_eq!(code, 0, "{line}: {said}");
        text
    };
    for line in [
        "info",
        "events",
        "render -o - --format json",
        "render -o - --format md",
        "render -o - --format svg",
    ] {
        let one = shown(&format!("{line} late.mcap early.bag afternoon.bag"));
        let other = shown(&format!("{line} afternoon.bag late.mcap early.bag"));
        assert_eq!(one, other, "{line}");
    }
    let info = shown("info afternoon.bag late.mcap early.bag");
    let order = ["early.bag", "late.mcap", "afternoon.bag"].map(|name| info.find(name).unwrap());
    assert!(order.is_sorted(), "{info}");
}

#[test]
fn copies_of_one_recording_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    mcap2(&at("run.mcap"), 1);
    fs::copy(at("run.mcap"), at("copy.mcap")).unwrap();
    bag1(&at("converted.bag"), 1);
    mcap2(&at("other.mcap"), 2);
    for line in [
        "render F -o out.json",
        "events F",
        "info F",
        "extract F -o out.csv",
    ] {
        for other in ["copy.mcap", "converted.bag"] {
            let both = line.replace('F', &format!("F {other}"));
            let (code, said, _) = bagreel(folder.path(), &both, "run.mcap");
            assert_eq!(code, 2, "{both}: {said}");
            let advice = format!("`run.mcap` contains the same messages as `{other}`");
            assert!(said.contains(&advice), "{both}: {said}");
        }
        let both = line.replace('F', "F other.mcap");
        let (code, said, _) = bagreel(folder.path(), &both, "run.mcap");
        assert_eq!(code, 0, "{both}: {said}");
    }
}
