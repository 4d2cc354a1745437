//! Tests of the tables of many bags: a row per bag, shards and interrupted runs that add up, parts that merge, and
//! counts that equal those of a mission read at once.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use bagreel::bag::Tier;
use bagreel::fleet::{
    Count, CountDetail, CountedBag, PlannedBag, Planning, Tally, count, finish, merge, plan,
};
use bagreel::internals::graph::window::Align;
use bagreel::internals::mission::write_json;
use bagreel::values::{Length, Period, Span, Stamp};
use bagreel::{Mission, Reading, read};
use parquet::record::{Field, Row};
use proptest::prelude::*;

use crate::support::{self, mcap, parquet_rows, rosbag1};

const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier");
/// Bags in the project: several chunks or one, every storage, damaged ones, empty ones.
const OURS: &[&str] = &[
    WAREHOUSE,
    COURIER,
    FOLDER,
    concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/hostile/01_escapes.bag"
    ),
    concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/hostile/08_jump1970.bag"
    ),
];

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

/// Every file of a table, in order of names.
fn files(folder: &Path, table: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder.join(table)).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// All rows of a table, from all its files.
fn table(folder: &Path, table: &str) -> impl Iterator<Item = Row> {
    let files = files(folder, table).into_iter();
    files.flat_map(|file| parquet_rows(&file))
}

/// The rows of a table as text, sorted, so that the division into files does not matter.
fn rows(folder: &Path, name: &str) -> Vec<String> {
    let mut all: Vec<String> = table(folder, name).map(|row| row.to_string()).collect();
    all.sort();
    all
}

/// The fields of a column.
fn column(folder: &Path, name: &str, column: &str) -> impl Iterator<Item = Field> {
    let rows = table(folder, name);
    rows.map(move |row| {
        let mut fields = row.into_columns().into_iter();
        fields.find(|(name, _)| name == column).unwrap().1
    })
}

fn texts(folder: &Path, name: &str, of: &str) -> Vec<String> {
    let text = |field| match field {
        Field::Str(text) => text,
        Field::Null => String::new(),
        other => panic!("{of}: {other}"),
    };
    column(folder, name, of).map(text).collect()
}

fn sum(folder: &Path, name: &str, of: &str) -> i64 {
    let number = |field| match field {
        Field::Long(number) => number,
        Field::Null => 0,
        other => panic!("{of}: {other}"),
    };
    column(folder, name, of).map(number).sum()
}

/// A folder of bags: good ones, an empty one, a cut one, a foreign file with a bag's extension.
fn fleet(folder: &Path) {
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::None, 4000);
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    put("bags/a.bag", &bag);
    put("bags/b/run_0.bag", &bag);
    put("bags/b/run_1.bag", &bag);
    put("bags/c.mcap", &fs::read(COURIER).unwrap());
    put("bags/cut.bag", &bag[..bag.len() / 2]);
    put(
        "bags/empty.bag",
        &rosbag1::write(&support::Recording::default(), rosbag1::Pack::None, 4000),
    );
    put("bags/foreign.bag", b"no bag at all");
}

#[test]
fn every_bag_has_exactly_one_row() {
    let dir = tempfile::tempdir().unwrap();
    fleet(dir.path());
    fs::write(
        dir.path().join("list"),
        "bags/a.bag\nbags/gone.bag\r\n\nbags/c.mcap",
    )
    .unwrap();
    let said = ends(
        dir.path(),
        &["tables", "bags", "--manifest", "list", "-o", "t"],
        3,
    );
    assert!(said.contains("8 bags (2 unreadable, 1 damaged)"), "{said}");
    let mut uris = texts(&dir.path().join("t"), "bags", "uri");
    uris.sort();
    let expected = [
        "bags/a.bag",
        "bags/b/run_0.bag",
        "bags/b/run_1.bag",
        "bags/c.mcap",
        "bags/cut.bag",
        "bags/empty.bag",
        "bags/foreign.bag",
        "bags/gone.bag",
    ];
    assert_eq!(uris, expected);
    let table = dir.path().join("t");
    assert_eq!(sum(&table, "bags", "messages"), sum(&table, "counts", "n"));
    let missions: BTreeSet<String> = texts(&table, "bags", "mission").into_iter().collect();
    assert!(
        missions.contains("bags/b/run") && missions.len() == 7,
        "{missions:?}"
    );
    let errors = texts(&table, "bags", "error");
    assert_eq!(errors.iter().filter(|error| !error.is_empty()).count(), 2);
    ends(
        dir.path(),
        &["tables", "bags", "-o", "u", "--on-error", "fail"],
        1,
    );
}

#[test]
fn copies_and_conversions_are_counted_and_named() {
    let dir = tempfile::tempdir().unwrap();
    let bags = dir.path().join("bags");
    fs::create_dir(&bags).unwrap();
    let bag = support::small();
    let mut other = bag.clone();
    let last = other.messages.last_mut().unwrap();
    last.1 += 1;
    for (name, bytes) in [
        ("a.bag", rosbag1::write(&bag, rosbag1::Pack::None, 4000)),
        ("b.bag", rosbag1::write(&bag, rosbag1::Pack::Lz4, 9000)),
        ("c.mcap", mcap::write(&bag, &mcap::Options::default())),
        ("d.bag", rosbag1::write(&other, rosbag1::Pack::None, 4000)),
        (
            "empty.bag",
            rosbag1::write(&support::Recording::default(), rosbag1::Pack::None, 4000),
        ),
    ] {
        fs::write(bags.join(name), bytes).unwrap();
    }
    let said = ends(dir.path(), &["tables", "bags", "-o", "t"], 0);
    let note = "note: 3 of 5 bags contain the same messages as another, and all are counted: \
        bags/a.bag, bags/b.bag and bags/c.mcap\n";
    assert!(said.contains(note), "{said}");
    let table = dir.path().join("t");
    let uris = texts(&table, "bags", "uri");
    let contents = texts(&table, "bags", "content");
    let of = |name: &str| {
        let at = uris.iter().position(|uri| uri.ends_with(name)).unwrap();
        contents[at].as_str()
    };
    assert!(
        of("a.bag") == of("b.bag") && of("a.bag") == of("c.mcap"),
        "{contents:?}"
    );
    assert!(
        of("d.bag") != of("a.bag") && of("d.bag").len() == 16,
        "{contents:?}"
    );
    assert_eq!(of("empty.bag"), "");
    assert_eq!(sum(&table, "bags", "messages"), sum(&table, "counts", "n"));
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
    let mut list = Vec::new();
    for name in names {
        let path = dir.path().join("odd").join(OsStr::from_bytes(name));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::copy(COURIER, path).unwrap();
        list.extend([b"odd/", *name, b"\0"].concat());
    }
    let said = ends(dir.path(), &["tables", "odd", "-o", "t"], 0);
    assert!(said.contains("6 bags, 19416 messages"), "{said}");
    // A list with zero bytes, as `find -print0` makes it.
    fs::write(dir.path().join("list"), list).unwrap();
    ends(dir.path(), &["tables", "--manifest", "list", "-o", "u"], 0);
    assert_eq!(
        rows(&dir.path().join("t"), "counts"),
        rows(&dir.path().join("u"), "counts")
    );
}

#[test]
fn columns_match_the_help() {
    let dir = tempfile::tempdir().unwrap();
    ends(dir.path(), &["tables", WAREHOUSE, "-o", "t"], 0);
    let names = |name: &str| {
        let row = table(&dir.path().join("t"), name).next().unwrap();
        let names = row.get_column_iter().map(|(name, _)| name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    let help = bagreel(dir.path(), &["tables", "--help"]);
    let help = String::from_utf8(help.stdout).unwrap();
    let shown = help.split("counts: ").nth(1).unwrap();
    let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(plain(shown).starts_with(&names("counts")), "{shown}");
    assert!(plain(shown).contains(&names("bags")), "{shown}");
}

#[test]
fn shards_add_up_to_the_whole() {
    let dir = tempfile::tempdir().unwrap();
    fleet(dir.path());
    bagreel(dir.path(), &["tables", "bags", "-o", "whole"]);
    for shard in ["1/3", "2/3", "3/3"] {
        bagreel(
            dir.path(),
            &["tables", "bags", "-o", "parts", "--shard", shard],
        );
    }
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    for table in ["counts", "bags"] {
        assert_eq!(rows(&whole, table), rows(&parts, table));
        let bytes = |folder: &Path| -> BTreeMap<_, _> {
            let files = files(folder, table).into_iter();
            files
                .map(|f| (f.file_name().unwrap().to_owned(), fs::read(&f).unwrap()))
                .collect()
        };
        assert!(
            bytes(&whole) == bytes(&parts),
            "the same bags, the same bytes"
        );
    }
}

#[test]
fn existing_counts_are_kept_and_outdated_ones_replaced() {
    let dir = tempfile::tempdir().unwrap();
    fleet(dir.path());
    let args = ["tables", "bags", "-o", "t", "--skip-existing"];
    ends(dir.path(), &args, 3);
    let table = dir.path().join("t");
    let before = rows(&table, "counts");
    let said = ends(dir.path(), &args, 0);
    assert!(said.contains("0 bags (7 already there)"), "{said}");
    assert_eq!(rows(&table, "counts"), before);
    // A table with another period replaces the old one.
    let said = ends(dir.path(), &[&args[..], &["--period", "5s"]].concat(), 3);
    assert!(
        said.contains("7 bags (2 unreadable") || said.contains("7 bags (1 unreadable"),
        "{said}"
    );
    fs::write(
        dir.path().join("bags/foreign.bag"),
        fs::read(dir.path().join("bags/a.bag")).unwrap(),
    )
    .unwrap();
    let said = ends(dir.path(), &[&args[..], &["--period", "5s"]].concat(), 0);
    assert!(said.contains("1 bag (6 already there)"), "{said}");
    let uris = texts(&table, "bags", "uri");
    assert_eq!(uris.len(), 7);
    assert_eq!(uris.iter().collect::<BTreeSet<_>>().len(), 7, "a bag twice");
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_complete_files_and_can_be_resumed() {
    let dir = tempfile::tempdir().unwrap();
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::None, 4000);
    fs::create_dir(dir.path().join("bags")).unwrap();
    for k in 0..300 {
        fs::write(dir.path().join(format!("bags/{k}.bag")), &bag).unwrap();
    }
    let args = [
        "tables",
        "bags",
        "-o",
        "t",
        "--skip-existing",
        "--jobs",
        "1",
    ];
    let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(dir.path())
        .args(args)
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let bags = dir.path().join("t/bags");
    while fs::read_dir(&bags).map_or(0, Iterator::count) < 20 && child.try_wait().unwrap().is_none()
    {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    // A signal that cannot be caught.
    child.kill().unwrap();
    child.wait().unwrap();
    let table = dir.path().join("t");
    let visible = |table_of: &str| {
        files(&table, table_of)
            .into_iter()
            .filter(|f| !f.file_name().unwrap().to_string_lossy().starts_with('.'))
    };
    for file in visible("counts").chain(visible("bags")) {
        assert!(!parquet_rows(&file).is_empty(), "{file:?}");
    }
    ends(dir.path(), &args, 0);
    assert_eq!(texts(&table, "bags", "uri").len(), 300);
    bagreel(dir.path(), &["tables", "bags", "-o", "whole"]);
    assert_eq!(
        rows(&table, "counts"),
        rows(&dir.path().join("whole"), "counts")
    );
}

#[test]
fn parts_of_a_split_recording_have_common_windows() {
    let dir = tempfile::tempdir().unwrap();
    let mut halves = [support::small(), support::small()];
    halves[0]
        .messages
        .retain(|m| m.1 < support::ORIGIN + 33_300_000_000);
    halves[1]
        .messages
        .retain(|m| m.1 >= support::ORIGIN + 33_300_000_000);
    for (k, half) in halves.iter().enumerate() {
        let bytes = rosbag1::write(half, rosbag1::Pack::None, 4000);
        fs::write(dir.path().join(format!("run_{k}.bag")), bytes).unwrap();
    }
    let planning = Planning {
        align: Align::Bag,
        ..Planning::default()
    };
    let whole = dir.path().to_string_lossy().into_owned();
    let plan = plan(&[whole], &planning).unwrap();
    let origins: BTreeSet<Stamp> = plan.bags.iter().map(|bag| bag.origin).collect();
    assert_eq!(origins, BTreeSet::from([Stamp(support::ORIGIN)]));
    let tally = Tally::of(plan.period);
    let counts = plan
        .bags
        .iter()
        .flat_map(|bag| count(bag, &tally).unwrap().counts);
    let mission = finish(counts).unwrap();
    assert_eq!(mission.windows.len(), 6);
    assert_eq!(mission.messages, support::small().messages.len() as u64);
}

fn planned(path: &str) -> PlannedBag {
    PlannedBag {
        uri: path.to_owned(),
        mission: "m".to_owned(),
        origin: Stamp(0),
    }
}

fn counted(path: &str, part: Option<Span>, detail: CountDetail) -> CountedBag {
    let period = Period::parse("10").unwrap();
    let tally = Tally {
        part,
        detail,
        ..Tally::of(period)
    };
    count(&planned(path), &tally).unwrap()
}

/// The complete counts of each bag in the project, made once.
fn wholes() -> &'static Vec<CountedBag> {
    static ALL: OnceLock<Vec<CountedBag>> = OnceLock::new();
    ALL.get_or_init(|| {
        OURS.iter()
            .map(|path| counted(path, None, CountDetail::Index))
            .collect()
    })
}

fn json(mission: &Mission) -> Vec<u8> {
    let mut text = Vec::new();
    write_json(mission, &mut text).unwrap();
    text
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// For any bag, any cuts of its time and any order of the parts, the merged counts and the mission are identical to
    /// the byte.
    #[test]
    fn any_split_merges_to_the_whole(
        bag in 0..OURS.len(),
        mut cuts in prop::collection::vec(0.0..1.0_f64, 0..7),
        turn in 0..8_usize,
    ) {
        let whole = &wholes()[bag];
        let span = whole.bag.span.unwrap();
        cuts.sort_by(f64::total_cmp);
        #[expect(clippy::cast_possible_truncation, reason = "inside the span")]
        let cut = |share: &f64| span.start.plus((span.nanos() as f64 * share) as i64);
        let mut edges: Vec<Stamp> = vec![Stamp::MIN];
        edges.extend(cuts.iter().map(cut));
        edges.push(Stamp::MAX);
        let parts = edges.windows(2).map(|e| Span { start: e[0], end: e[1] });
        let mut parts: Vec<Vec<Count>> = parts
            .map(|part| counted(OURS[bag], Some(part), CountDetail::Index).counts)
            .collect();
        let many = parts.len();
        parts.rotate_left(turn % many);
        parts.reverse();
        let merged = merge(parts.into_iter().flatten());
        prop_assert_eq!(&merged, &merge(whole.counts.clone()));
        if whole.bag.span.unwrap().nanos() < 3_600_000_000_000 {
            let (a, b) = (finish(merged).unwrap(), finish(whole.counts.clone()).unwrap());
            prop_assert!(json(&a) == json(&b));
        }
    }
}

#[test]
fn merging_a_complete_table_changes_nothing() {
    for whole in wholes() {
        assert_eq!(merge(whole.counts.clone()), whole.counts);
        let n: u64 = whole.counts.iter().map(|count| count.n).sum();
        assert_eq!(n, whole.bag.messages);
    }
}

/// Counts, rates, bytes and gaps of each topic and publication per window: those of the mission that `render` reads.
#[test]
fn finished_counts_equal_the_mission_read_directly() {
    for path in [WAREHOUSE, COURIER, FOLDER] {
        let mut reading = Reading::of([path]);
        reading.division.length = Length::Fixed(Period::parse("10").unwrap());
        reading.division.align = Align::Clock;
        let read = read(&reading).unwrap();
        let made = finish(counted(path, None, CountDetail::Index).counts).unwrap();
        assert_eq!(made.span, read.span);
        let spans = |m: &Mission| {
            m.windows
                .iter()
                .map(|w| (w.span, w.messages))
                .collect::<Vec<_>>()
        };
        assert_eq!(spans(&made), spans(&read));
        for ((window, a), (_, b)) in made.each().zip(read.each()) {
            let topics = |m: &Mission, g: &bagreel::Graph| -> BTreeMap<String, String> {
                let sent = g.topics().filter(|(_, t)| t.messages() > 0);
                let name = |id| m.elements.topics[id].name.to_string();
                sent.map(|(id, t)| (name(id), format!("{:?} {:?}", t.count, t.hz)))
                    .collect()
            };
            assert_eq!(
                topics(&made, &a),
                topics(&read, &b),
                "{path} window {}",
                window.index
            );
            let edges = |m: &Mission, g: &bagreel::Graph| -> BTreeMap<String, String> {
                let sent = g.publishes().filter(|(_, e)| e.messages() > 0);
                let all = &m.elements;
                let name = |id| {
                    let edge = &all.publishes[id];
                    let node = all.nodes[edge.node].name.as_str();
                    format!("{node} {}", all.topics[edge.topic].name.as_str())
                };
                sent.map(|(id, e)| (name(id), format!("{:?} {:?}", e.count, e.hz)))
                    .collect()
            };
            // In ROS 2, other evidence than the index names publishers.
            if path == WAREHOUSE {
                assert_eq!(
                    edges(&made, &a),
                    edges(&read, &b),
                    "window {}",
                    window.index
                );
            }
        }
    }
}

#[test]
fn counts_of_several_missions_are_not_merged() {
    let mut counts = counted(WAREHOUSE, None, CountDetail::Index).counts;
    let mut other = counts[0].clone();
    other.mission = "other".into();
    counts.push(other);
    assert!(
        finish(counts)
            .unwrap_err()
            .to_string()
            .contains("not one mission")
    );
    assert!(finish([]).is_err());
}

#[test]
fn counting_by_chunks_gives_the_same_totals() {
    let dir = tempfile::tempdir().unwrap();
    let mut paths: Vec<String> = vec![WAREHOUSE.to_owned(), COURIER.to_owned()];
    for pack in [rosbag1::Pack::None, rosbag1::Pack::Lz4] {
        let path = dir.path().join(format!("{pack:?}.bag"));
        fs::write(&path, rosbag1::write(&support::small(), pack, 4000)).unwrap();
        paths.push(path.to_string_lossy().into_owned());
    }
    for path in &paths {
        let index = counted(path, None, CountDetail::Index);
        let chunks = counted(path, None, CountDetail::Chunks);
        assert_eq!(chunks.bag.tier, Some(Tier::Chunks));
        let of = |counted: &CountedBag| -> Vec<_> {
            let counts = counted.counts.iter();
            counts
                .map(|c| (c.win, c.topic.clone(), c.node.clone(), c.n))
                .collect()
        };
        assert_eq!(of(&index), of(&chunks), "{path}");
        let lumped = chunks.counts.iter().filter(|c| c.first.is_none()).count();
        assert!(
            lumped > 0 || chunks.counts.len() < 50,
            "{path}: no chunk lies in one window"
        );
        let known = chunks
            .counts
            .iter()
            .zip(&index.counts)
            .filter(|(c, _)| c.first.is_some());
        for (chunk, index) in known {
            assert_eq!((chunk.first, chunk.last), (index.first, index.last));
        }
    }
}
