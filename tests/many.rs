//! Tests of the counts of many bags: a table per recording, the same as counted by other code, whole after a kill.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, SystemTime};

use bagreel::values::{Align, Length, Period};
use bagreel::{Reading, read};

use crate::support::{self, rosbag1};

const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier");
const JUMPS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/data/hostile/08_jump1970.bag"
);

fn bagreel(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.current_dir(folder).args(args).output().unwrap()
}

#[track_caller]
fn ends(folder: &Path, args: &[&str], code: i32) -> String {
    let output = bagreel(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

/// Every file below a folder with its contents, by its path in it.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(top: &Path, folder: &Path, all: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(top, &path, all);
            } else {
                let name = path.strip_prefix(top).unwrap().to_string_lossy();
                all.insert(name.into_owned(), fs::read(&path).unwrap());
            }
        }
    }
    let mut all = BTreeMap::new();
    walk(folder, folder, &mut all);
    all
}

type Row = BTreeMap<String, String>;

/// The rows of a table by the names of their columns.
fn rows(table: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(table).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

fn number(row: &Row, column: &str) -> i64 {
    row[column].parse().unwrap()
}

fn put(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// A folder of bags: good ones, two parts of one recording, an empty one, a cut one, a foreign file with a bag's extension.
fn many(folder: &Path) {
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::None, 4000);
    let mut later = support::small();
    later
        .messages
        .iter_mut()
        .for_each(|message| message.1 += 3_600_000_000_000);
    let later = rosbag1::write(&later, rosbag1::Pack::None, 4000);
    put(folder, "bags/a.bag", &bag);
    put(folder, "bags/day/r_2024-05-03-14-03-22_0.bag", &bag);
    put(folder, "bags/day/r_2024-05-03-14-08-22_1.bag", &later);
    put(folder, "bags/c.mcap", &fs::read(COURIER).unwrap());
    put(folder, "bags/cut.bag", &bag[..bag.len() / 2]);
    let empty = support::Recording::default();
    put(
        folder,
        "bags/empty.bag",
        &rosbag1::write(&empty, rosbag1::Pack::None, 4000),
    );
    put(folder, "bags/foreign.bag", b"no bag at all");
}

#[test]
fn every_readable_recording_has_one_table() {
    let dir = tempfile::tempdir().unwrap();
    many(dir.path());
    let args = ["tables", "bags", "gone.bag", "-o", "t"];
    let said = ends(dir.path(), &args, 3);
    for line in [
        "warning: `bags/foreign.bag` is not a bag",
        "warning: cannot read `gone.bag`",
        "warning: `cut.bag`: the bag is cut at byte",
        "(2 unreadable, 1 damaged)",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
    let made = files(&dir.path().join("t"));
    let names: Vec<&str> = made.keys().map(String::as_str).collect();
    let first = "day/r_2024-05-03-14-03-22_0.bag.csv";
    assert_eq!(
        names,
        [
            "a.bag.csv",
            "c.mcap.csv",
            "cut.bag.csv",
            first,
            "empty.bag.csv"
        ]
    );
    let bags = names
        .iter()
        .flat_map(|name| rows(&dir.path().join("t").join(name)));
    let sum: i64 = bags.map(|row| number(&row, "n")).sum();
    assert!(
        said.contains(&format!("5 tables of {sum} messages")),
        "{sum}: {said}"
    );
    let split = rows(&dir.path().join("t").join(first));
    let name = "day/r_2024-05-03-14-03-22_0.bag to r_2024-05-03-14-08-22_1.bag";
    assert!(split.iter().all(|row| row["bag"] == name), "{split:?}");
    let both: i64 = split.iter().map(|row| number(row, "n")).sum();
    assert_eq!(
        both,
        2 * i64::try_from(support::small().messages.len()).unwrap()
    );
    assert_eq!(rows(&dir.path().join("t/empty.bag.csv")), []);
    // The same bags, the same bytes, whichever is counted first.
    ends(dir.path(), &["tables", "bags", "-o", "u"], 3);
    assert!(made == files(&dir.path().join("u")));
}

#[test]
fn tables_of_one_name_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["x/run.mcap", "y/run.mcap"] {
        put(dir.path(), name, &fs::read(COURIER).unwrap());
    }
    let said = ends(dir.path(), &["tables", "x", "y", "-o", "t"], 2);
    assert!(
        said.contains("`x/run.mcap` and `y/run.mcap` would both be counted in"),
        "{said}"
    );
    assert!(!dir.path().join("t").exists());
    ends(dir.path(), &["tables", ".", "-o", "t"], 0);
    // One bag that is named twice is one bag; a recording that is given has its own name.
    ends(
        dir.path(),
        &["tables", "x", "x/run.mcap", FOLDER, "-o", "u"],
        0,
    );
    let names = |folder: &str| {
        files(&dir.path().join(folder))
            .into_keys()
            .collect::<Vec<_>>()
    };
    assert_eq!(names("t"), ["x/run.mcap.csv", "y/run.mcap.csv"]);
    assert_eq!(names("u"), ["courier.csv", "run.mcap.csv"]);
}

#[test]
#[cfg(target_os = "linux")]
fn bags_with_unusual_names_are_counted() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let dir = tempfile::tempdir().unwrap();
    let names: &[&[u8]] = &[
        b"a b/\xc3\xbc 'q\".mcap",
        b"line\nend/x,y.mcap",
        b"-d/--help.mcap",
        b"%20#?.mcap",
        b"s3:",
        b"gr\xfc\xdfe/\xff.mcap",
    ];
    for name in names {
        let path = dir.path().join("odd").join(OsStr::from_bytes(name));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::copy(COURIER, path).unwrap();
    }
    let said = ends(dir.path(), &["tables", "odd", "-o", "t"], 0);
    assert!(said.contains("6 tables of 19416 messages"), "{said}");
    for name in names {
        let table = [*name, b".csv"].concat();
        let rows = rows(&dir.path().join("t").join(OsStr::from_bytes(&table)));
        assert!(rows.len() > 100, "{}", name.escape_ascii());
    }
}

#[test]
fn columns_match_the_help_and_both_formats_have_the_same_contents() {
    let dir = tempfile::tempdir().unwrap();
    ends(dir.path(), &["tables", WAREHOUSE, "-o", "t"], 0);
    let table = fs::read_to_string(dir.path().join("t/warehouse.bag.csv")).unwrap();
    let help = String::from_utf8(bagreel(dir.path(), &["tables", "--help"]).stdout).unwrap();
    let shown = help.split("Columns: ").nth(1).unwrap();
    let shown: Vec<&str> = shown
        .split(';')
        .next()
        .unwrap()
        .split_whitespace()
        .collect();
    assert_eq!(
        shown.join("").replace(' ', ""),
        table.lines().next().unwrap()
    );
    #[cfg(feature = "parquet")]
    {
        let args = ["tables", WAREHOUSE, "-o", "t", "--format", "parquet"];
        ends(dir.path(), &args, 0);
        let cells = |row: &parquet::record::Row| -> Row {
            let cell = |(name, field): (&String, &parquet::record::Field)| {
                let text = match field {
                    parquet::record::Field::Null => String::new(),
                    parquet::record::Field::Str(text) => text.clone(),
                    other => other.to_string(),
                };
                (name.clone(), text)
            };
            row.get_column_iter().map(cell).collect()
        };
        let other = support::parquet_rows(&dir.path().join("t/warehouse.bag.parquet"));
        let other: Vec<Row> = other.iter().map(cells).collect();
        assert!(other == rows(&dir.path().join("t/warehouse.bag.csv")));
    }
}

/// Every number of every row, computed again from the table of all messages.
#[test]
fn counts_follow_from_the_messages() {
    let period = 7_000_000_000;
    for (bag, table) in [
        (WAREHOUSE, "warehouse.bag.csv"),
        (COURIER, "courier.mcap.csv"),
        (FOLDER, "courier.csv"),
        (JUMPS, "08_jump1970.bag.csv"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        bagreel(dir.path(), &["tables", bag, "-o", "t", "-p", "7"]);
        bagreel(dir.path(), &["extract", bag, "-o", "m.csv"]);
        let mut sent: BTreeMap<_, Vec<i64>> = BTreeMap::new();
        for row in &rows(&dir.path().join("m.csv")) {
            let time = number(row, "time_ns");
            let [topic, type_name, node] =
                ["topic", "type", "publisher"].map(|column| row[column].clone());
            sent.entry((time.div_euclid(period), topic, type_name, node))
                .or_default()
                .push(time);
        }
        let counts = rows(&dir.path().join("t").join(table));
        assert_eq!(counts.len(), sent.len(), "{bag}");
        for (row, ((win, topic, type_name, node), times)) in counts.iter().zip(&sent) {
            let found = ["topic", "type", "node"].map(|column| &row[column]);
            assert_eq!(found, [topic, type_name, node], "{bag}");
            let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
            for (column, expected) in [
                ("win", Some(*win)),
                ("start_ns", Some(win * period)),
                ("end_ns", Some((win + 1) * period)),
                ("period_ns", Some(period)),
                ("n", Some(i64::try_from(times.len()).unwrap())),
                ("first_ns", times.first().copied()),
                ("last_ns", times.last().copied()),
                ("max_gap_ns", gaps.max()),
            ] {
                let expected = expected.map_or_else(String::new, |n| n.to_string());
                assert_eq!(row[column], expected, "{bag} {column}: {row:?}");
            }
        }
    }
}

#[test]
fn counts_are_those_of_the_mission() {
    for (bag, table) in [(WAREHOUSE, "warehouse.bag.csv"), (FOLDER, "courier.csv")] {
        let dir = tempfile::tempdir().unwrap();
        ends(dir.path(), &["tables", bag, "-o", "t"], 0);
        let mut counted: BTreeMap<(i64, String), u64> = BTreeMap::new();
        for row in rows(&dir.path().join("t").join(table)) {
            let of = counted.entry((number(&row, "start_ns"), row["topic"].clone()));
            *of.or_default() += row["n"].parse::<u64>().unwrap();
        }
        let mut reading = Reading::of([bag]);
        let period = Period::parse("10").unwrap();
        reading.division.length = Length::Fixed(period);
        reading.division.align = Align::Clock;
        let mission = read(&reading).unwrap();
        let mut seen = BTreeMap::new();
        for (window, graph) in mission.each() {
            let start = window.span.start.0.div_euclid(period.nanos()) * period.nanos();
            for (id, topic) in graph.topics().filter(|(_, topic)| topic.messages() > 0) {
                let name = mission.elements.topics[id].name.to_string();
                seen.insert((start, name), topic.messages());
            }
        }
        assert_eq!(counted, seen, "{bag}");
    }
}

#[test]
fn existing_tables_are_kept_unless_the_bag_is_newer() {
    let dir = tempfile::tempdir().unwrap();
    many(dir.path());
    let args = ["tables", "bags", "-o", "t", "--skip-existing"];
    ends(dir.path(), &args, 3);
    let before = files(&dir.path().join("t"));
    let said = ends(dir.path(), &args, 3);
    assert!(
        said.contains("0 tables of 0 messages (1 unreadable, 5 already there)"),
        "{said}"
    );
    assert!(before == files(&dir.path().join("t")));
    // A bag that has become readable, a part that is newer, and a table that is gone.
    let bag = fs::read(dir.path().join("bags/a.bag")).unwrap();
    fs::write(dir.path().join("bags/foreign.bag"), bag).unwrap();
    let part = dir.path().join("bags/day/r_2024-05-03-14-08-22_1.bag");
    let later = SystemTime::now() + Duration::from_mins(1);
    File::options()
        .append(true)
        .open(part)
        .unwrap()
        .set_modified(later)
        .unwrap();
    fs::remove_file(dir.path().join("t/c.mcap.csv")).unwrap();
    let said = ends(dir.path(), &args, 0);
    assert!(
        said.contains("3 tables") && said.contains("(3 already there)"),
        "{said}"
    );
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_complete_tables_and_can_be_resumed() {
    let dir = tempfile::tempdir().unwrap();
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::None, 4000);
    for k in 0..300 {
        put(dir.path(), &format!("bags/{k}.bag"), &bag);
    }
    let args = ["tables", "bags", "-o", "t", "--skip-existing"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(dir.path())
        .args(args)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let tables: PathBuf = dir.path().join("t");
    while fs::read_dir(&tables).map_or(0, Iterator::count) < 20
        && child.try_wait().unwrap().is_none()
    {
        std::thread::sleep(Duration::from_millis(1));
    }
    // A signal that cannot be caught.
    child.kill().unwrap();
    child.wait().unwrap();
    let killed = files(&tables);
    ends(dir.path(), &["tables", "bags", "-o", "whole"], 0);
    let whole = files(&dir.path().join("whole"));
    for (name, table) in &killed {
        assert!(name.starts_with('.') || whole[name] == *table, "{name}");
    }
    ends(dir.path(), &args, 0);
    assert!(files(&tables) == whole && whole.len() == 300);
}
