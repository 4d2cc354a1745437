//! Tests of messages and missions as tables: the files compared with each other and with independent counts.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");

fn bagreel(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// Runs the command, which must exit with `code`; returns its messages.
#[track_caller]
fn ends(folder: &Path, args: &[&str], code: i32) -> String {
    let output = bagreel(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

/// The rows of a CSV file, header first.
fn csv(path: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_path(path)
        .unwrap();
    let rows = reader.records().map(|row| row.unwrap());
    rows.map(|row| row.iter().map(str::to_owned).collect())
        .collect()
}

#[test]
fn each_message_is_a_row_sorted_by_time() {
    let dir = tempfile::tempdir().unwrap();
    ends(dir.path(), &["extract", WAREHOUSE, "-o", "m.csv"], 0);
    let rows = csv(&dir.path().join("m.csv"));
    assert_eq!(
        rows[0],
        ["time_ns", "topic", "type", "publisher", "size_bytes"]
    );
    assert_eq!(rows.len(), 26_719 + 1);
    let times: Vec<i64> = rows[1..].iter().map(|r| r[0].parse().unwrap()).collect();
    assert!(times.is_sorted());
    assert!(rows[1..].iter().all(|r| r[3].starts_with('/')));
    assert!(rows[1..].iter().all(|r| r[4].parse::<u64>().is_ok()));
}

#[test]
fn rows_are_filtered_by_topic_and_time() {
    let dir = tempfile::tempdir().unwrap();
    let filter = ["--topic-filter", "/robot1/odom"];
    let all = [&["extract", WAREHOUSE, "-o", "all.csv"], &filter[..]].concat();
    ends(dir.path(), &all, 0);
    let part = [
        &[
            "extract", WAREHOUSE, "-o", "part.csv", "--start", "60", "--end", "1:30",
        ],
        &filter[..],
    ]
    .concat();
    ends(dir.path(), &part, 0);
    let (all, part) = (
        csv(&dir.path().join("all.csv")),
        csv(&dir.path().join("part.csv")),
    );
    assert!(part.len() > 2 && part.len() < all.len());
    let all: BTreeSet<_> = all.into_iter().collect();
    assert!(part.iter().all(|row| all.contains(row)));
    let said = ends(
        dir.path(),
        &["extract", WAREHOUSE, "-o", "x.csv", "--start", "1h"],
        2,
    );
    assert!(said.contains("select nothing"), "{said}");
    assert!(!dir.path().join("x.csv").exists());
    // A mistyped name is an error.
    let nothing = [
        "extract",
        WAREHOUSE,
        "-o",
        "x.csv",
        "--topic-filter",
        "/robot1/odm",
    ];
    let said = ends(dir.path(), &nothing, 2);
    assert!(
        said.contains("hint: the nearest name is `/robot1/odom`"),
        "{said}"
    );
    assert!(!dir.path().join("x.csv").exists());
}

#[test]
fn several_bags_make_one_sorted_table() {
    let dir = tempfile::tempdir().unwrap();
    ends(
        dir.path(),
        &["extract", WAREHOUSE, COURIER, "-o", "m.csv"],
        0,
    );
    let rows = csv(&dir.path().join("m.csv"));
    let times: Vec<i64> = rows[1..].iter().map(|r| r[0].parse().unwrap()).collect();
    assert!(times.is_sorted());
    let ros2 = rows.iter().find(|r| r[2] == "std_msgs/msg/String").unwrap();
    assert_eq!(ros2[3], "", "ROS 2 bags do not record publishers");
}

#[test]
fn every_field_has_a_column() {
    let dir = tempfile::tempdir().unwrap();
    let args = ["extract", COURIER, "-o", "t", "--fields", "--format", "csv"];
    ends(dir.path(), &args, 0);
    let scan = csv(&dir.path().join("t/scan.csv"));
    let head: Vec<&str> = scan[0].iter().map(String::as_str).collect();
    assert_eq!(
        &head[..4],
        ["time_ns", "publisher", "header.stamp", "header.frame_id"]
    );
    let ranges = head.iter().position(|c| *c == "ranges").unwrap();
    let ranges: Vec<f32> = serde_json::from_str(&scan[1][ranges]).unwrap();
    assert_eq!(ranges.len(), 60);
    let frame = &scan[1][3];
    assert_eq!(frame, "laser");
    // As many rows as messages, and no other files.
    ends(dir.path(), &["extract", COURIER, "-o", "m.csv"], 0);
    let index = csv(&dir.path().join("t/index.csv"));
    assert_eq!(index[0], ["topic", "type", "file", "n"]);
    let is_scan = |row: &&Vec<String>| row[0] == "/scan";
    let scans = index.iter().find(is_scan).unwrap();
    assert_eq!(scans[1..3], ["sensor_msgs/msg/LaserScan", "scan.csv"]);
    let rows = index[1..].iter().map(|row| {
        let rows = csv(&dir.path().join("t").join(&row[2])).len() - 1;
        assert_eq!(row[3], rows.to_string());
        rows
    });
    let rows: usize = rows.sum();
    assert_eq!(rows, csv(&dir.path().join("m.csv")).len() - 1);
    let files = fs::read_dir(dir.path().join("t")).unwrap().count();
    assert_eq!(files, index.len(), "a table each, and the index");
    // A stamp is near the log time, in the same unit; a ROS 1 bag contains the publisher.
    let number = |text: &String| text.parse::<i64>().unwrap();
    assert!((number(&scan[1][2]) - number(&scan[1][0])).abs() < 1_000_000_000);
    let args = [
        "extract", WAREHOUSE, "-o", "w", "--fields", "--format", "csv",
    ];
    let odometry = [&args[..], &["--topic-filter", "/robot1/odom"]].concat();
    ends(dir.path(), &odometry, 0);
    let rows = csv(&dir.path().join("w/robot1.odom.csv"));
    assert!(rows[1][1].starts_with("/robot1/"), "{:?}", rows[1]);
}

#[test]
fn undecodable_messages_are_reported() {
    let dir = tempfile::tempdir().unwrap();
    let mut bag = crate::support::Recording::default();
    let place = bag.publisher("/a", "/known", "std_msgs/String");
    bag.publishers[place].definition = "string data\n".to_owned();
    let other = bag.publisher("/a", "/unknown", "a/B");
    bag.publishers[other].definition = "C c\n".to_owned();
    for k in 0..10 {
        let text = vec![2, 0, 0, 0, b'h', b'i'];
        bag.messages.push((place, crate::support::ORIGIN + k, text));
        bag.messages
            .push((other, crate::support::ORIGIN + k, vec![1]));
    }
    bag.messages
        .push((place, crate::support::ORIGIN + 20, vec![9]));
    let bytes = crate::support::mcap::write(&bag, &crate::support::mcap::Options::default());
    fs::write(dir.path().join("a.mcap"), bytes).unwrap();
    let args = [
        "extract", "a.mcap", "-o", "t", "--fields", "--format", "csv",
    ];
    let said = ends(dir.path(), &args, 3);
    assert!(
        said.contains("messages of `/unknown` (a/B) were left out: its definition lacks the type `C`; `--msg-path` adds it (10 times)"),
        "{said}"
    );
    assert!(
        said.contains(
            "messages of `/known` (std_msgs/String) were left out: they do not match its definition"
        ),
        "{said}"
    );
    assert_eq!(csv(&dir.path().join("t/known.csv")).len(), 10 + 1);
    assert!(!dir.path().join("t/unknown.csv").exists());
}

#[test]
fn recordings_without_definitions_use_common_and_given_types() {
    let dir = tempfile::tempdir().unwrap();
    let mut bag = crate::support::Recording::default();
    let known = bag.publisher("", "/point", "geometry_msgs/msg/Point");
    let numbers = [1.5_f64, 2.5, -3.5].map(f64::to_le_bytes).concat();
    bag.send(
        known,
        (0, 1000),
        100,
        &[b"\0\x01\0\0", &numbers[..]].concat(),
    );
    let own = bag.publisher("", "/thing", "my_msgs/msg/Thing");
    bag.send(own, (0, 1000), 100, b"\0\x01\0\0\x03\0\0\0hi\0");
    crate::support::sqlite3::write(&bag, &dir.path().join("a.db3"));
    let args = ["extract", "a.db3", "-o", "t", "--fields", "--format", "csv"];
    let said = ends(dir.path(), &args, 3);
    assert!(
        said.contains("contains no definition of its type"),
        "{said}"
    );
    let point = csv(&dir.path().join("t/point.csv"));
    assert_eq!(point.len(), 11);
    assert!(point[1].ends_with(&["1.5", "2.5", "-3.5"].map(str::to_owned)));
    // An empty result is an error that names what is missing, and creates no folder.
    let only = [
        &args[..3],
        &["new/er", "--fields", "--topic-filter", "/thing"],
    ]
    .concat();
    let said = ends(dir.path(), &only, 1);
    assert!(
        said.contains("my_msgs/msg/Thing") && said.contains("--msg-path"),
        "{said}"
    );
    assert!(!dir.path().join("new").exists());
    fs::create_dir_all(dir.path().join("ws/my_msgs/msg")).unwrap();
    fs::write(dir.path().join("ws/my_msgs/msg/Thing.msg"), "string data\n").unwrap();
    let defined = [&only[..], &["--format", "csv", "--msg-path", "ws"]].concat();
    ends(dir.path(), &defined, 0);
    let thing = csv(&dir.path().join("new/er/thing.csv"));
    assert_eq!(thing[1].last().unwrap(), "hi");
    fs::remove_file(dir.path().join("ws/my_msgs/msg/Thing.msg")).unwrap();
    let idl = "module my_msgs {\n  module msg {\n    struct Thing {\n      string data;\n    };\n  };\n};\n";
    fs::write(dir.path().join("ws/my_msgs/msg/Thing.idl"), idl).unwrap();
    let defined = [&only[..], &["--format", "csv", "--msg-path", "ws"]].concat();
    ends(dir.path(), &defined, 0);
    assert_eq!(csv(&dir.path().join("new/er/thing.csv")), thing);
    let none = [&args[..], &["--topic-filter", "/nothing"]].concat();
    let said = ends(dir.path(), &none, 2);
    assert!(said.contains("matches none of 2 names"), "{said}");
}

#[test]
fn malformed_definitions_are_errors_of_the_topics_that_need_them() {
    let dir = tempfile::tempdir().unwrap();
    let mut bag = crate::support::Recording::default();
    for (topic, type_name) in [
        ("/thing", "my_msgs/msg/Thing"),
        ("/outer", "my_msgs/msg/Outer"),
        ("/good", "my_msgs/msg/Good"),
    ] {
        let place = bag.publisher("", topic, type_name);
        bag.send(place, (0, 1000), 100, b"\0\x01\0\0\x03\0\0\0hi\0");
    }
    crate::support::sqlite3::write(&bag, &dir.path().join("a.db3"));
    let put = |name: &str, text: &[u8]| {
        let path = dir.path().join("ws/my_msgs/msg").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let args = [
        "extract",
        "a.db3",
        "-o",
        "t",
        "--fields",
        "--msg-path",
        "ws",
    ];
    put(
        "Good.msg",
        b"# A word\nuint8 A=1\nstring data \"hi\"\n=====\n",
    );
    put("Outer.msg", b"Thing thing\n");
    for (name, text, why) in [
        (
            "Thing.msg",
            &b"# Its data\nfloat64[x] data\n"[..],
            "line 2 of its definition is not a field: `float64[x] data`",
        ),
        (
            "Thing.msg",
            b"int8 a\nfloat64\n",
            "line 2 of its definition is not a field: `float64`",
        ),
        (
            "Thing.msg",
            b"\n\n??? data\n",
            "line 3 of its definition is not a field: `??? data`",
        ),
        (
            "Thing.msg",
            b"\xff\xfe",
            "line 1 of its definition is not a field: `\u{fffd}\u{fffd}`",
        ),
        (
            "Thing.idl",
            b"hello",
            "its definition in IDL ends early in line 1",
        ),
        (
            "Thing.idl",
            b"module my_msgs { module msg {\n  struct Thing {\n    double x;\n",
            "its definition in IDL ends early in line 3",
        ),
        (
            "Thing.idl",
            b"module my_msgs { module msg {\n  struct Thing {\n    double;\n}; }; };\n",
            "in line 3",
        ),
    ] {
        put(name, text);
        let said = ends(dir.path(), &args, 3);
        for topic in ["/thing", "/outer"] {
            let lines: Vec<&str> = said.lines().filter(|l| l.contains(topic)).collect();
            let is_named = lines.len() == 1
                && lines[0].contains(&format!("ws/my_msgs/msg/{name}"))
                && lines[0].ends_with("(10 times)")
                && lines[0].contains(why);
            assert!(is_named, "{name} {topic}: {said}");
        }
        assert!(said.contains("1 table, 10 rows"), "{said}");
        // A topic that does not need it is not affected.
        let only = [&args[..], &["--topic-filter", "/good"]].concat();
        assert!(!ends(dir.path(), &only, 0).contains("Thing"));
        fs::remove_file(dir.path().join("ws/my_msgs/msg").join(name)).unwrap();
    }
}

/// The tables of a recording in `tests/data/fields`, with `more` options, by the names of their files.
fn fields_of(name: &str, more: &[&str]) -> (BTreeMap<String, Vec<Vec<String>>>, String) {
    let dir = tempfile::tempdir().unwrap();
    let bag = format!("{}/tests/data/fields/{name}", env!("CARGO_MANIFEST_DIR"));
    let args = ["extract", &bag, "-o", "t", "--fields", "--format", "csv"];
    let output = bagreel(dir.path(), &[&args, more].concat());
    let files = fs::read_dir(dir.path().join("t")).unwrap();
    let tables = files.map(|file| {
        let path = file.unwrap().path();
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        (stem, csv(&path))
    });
    (tables.collect(), String::from_utf8(output.stderr).unwrap())
}

/// The rows without the columns of the time and the publisher, header first.
fn decoded(table: &[Vec<String>]) -> Vec<&[String]> {
    table.iter().map(|row| &row[2..]).collect()
}

#[test]
fn poor_definitions_are_replaced_by_known_ones() {
    let (tables, said) = fields_of("poor.bag", &[]);
    let good = decoded(&tables["good"]);
    assert_eq!(good.len(), 20 + 1);
    assert_eq!(
        good[0][..4],
        [
            "header.seq",
            "header.stamp",
            "header.frame_id",
            "pose.position.x"
        ]
    );
    assert_eq!(
        good[20][1..6],
        ["1700000001900000000", "map", "1", "2", "3"]
    );
    for poor in ["empty", "unnested", "sentence", "cut", "backslash"] {
        assert_eq!(decoded(&tables[poor]), good, "{poor}");
    }
    assert!(!tables.contains_key("custom"));
    let why = "messages of `/custom` (my_msgs/Reading) were left out: \
               line 3 of its definition is not a field: `encoder_msgs/MeasurementMe`; `--msg-path` replaces it (20 times)";
    assert!(said.contains(why), "{said}");

    // The user's files take precedence over a text that fails.
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        (
            "my_msgs/msg/Reading.msg",
            "sensor_msgs/Imu imu\nencoder_msgs/Measurement enc\n",
        ),
        ("encoder_msgs/msg/Measurement.msg", "float64 angle\n"),
    ] {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    let path = folder.path().display().to_string();
    let (tables, said) = fields_of("poor.bag", &["--msg-path", &path]);
    assert!(!said.contains("left out"), "{said}");
    let custom = &tables["custom"];
    assert_eq!(custom.len(), 20 + 1);
    assert_eq!(custom[0].last().unwrap(), "enc.angle");
    assert_eq!(custom[20].last().unwrap(), "19");
}

#[test]
fn headers_of_other_packages_and_types_without_fields_are_decoded() {
    let (tables, said) = fields_of("headers.bag", &[]);
    assert!(!said.contains("left out"), "{said}");
    let own = decoded(&tables["own"]);
    let header = [
        "header.seq",
        "header.stamp",
        "header.frame_id",
        "radar.cycle",
        "radar.mode",
        "last",
    ];
    assert_eq!(own[0], header);
    assert_eq!(
        own[1],
        ["0", "1700000000000000000", "radar", "7", "2", "99"]
    );
    for empty in ["ping", "states"] {
        assert_eq!(tables[empty][0], ["time_ns", "publisher"]);
        assert_eq!(tables[empty].len(), 10 + 1);
    }
}

#[test]
fn a_definition_is_in_idl_if_the_bag_says_so() {
    let (tables, said) = fields_of("idl.mcap", &[]);
    assert!(!said.contains("left out"), "{said}");
    // Its comments contain the words `module` and `struct`.
    let battery = decoded(&tables["battery"]);
    assert_eq!(
        (battery.len(), battery[0]),
        (41, &["voltage", "current"].map(str::to_owned)[..])
    );
    assert_eq!(battery[1], ["24.0", "1.5"]);
    let motor = decoded(&tables["motor"]);
    assert_eq!(
        (motor.len(), motor[40]),
        (41, &["1", "0", "[20.0,30.0,40.0]"].map(str::to_owned)[..])
    );
    let lateral = &tables["lateral"];
    assert_eq!(lateral[0].last().unwrap(), "steering_tire_rotation_rate");
    assert_eq!(lateral.len(), 41);
}

#[test]
fn bytes_that_are_not_utf8_are_replaced() {
    for name in ["latin1.mcap", "latin1.bag"] {
        let (tables, said) = fields_of(name, &[]);
        assert!(!said.contains("left out"), "{said}");
        let angle = decoded(&tables["angle"]);
        assert_eq!(angle[0], ["angle", "name"]);
        assert_eq!((angle.len(), angle[20][0].as_str()), (21, "19"), "{name}");
    }
}

#[test]
fn other_encodings_are_named() {
    let (tables, said) = fields_of("cdr.mcap", &[]);
    for topic in ["/xcdr2", "/xcdr2_string", "/xcdr2_delimited"] {
        let line = said
            .lines()
            .find(|line| line.contains(&format!("`{topic}`")));
        let why = "they are encoded as XCDR2, which is not decoded (20 times)";
        assert!(line.is_some_and(|line| line.ends_with(why)), "{said}");
    }
    for topic in [
        "normal",
        "big_endian",
        "zero_length",
        "xcdr1",
        "empty_std",
        "empty_header_only",
    ] {
        assert_eq!(tables[topic].len(), 20 + 1, "{topic}");
    }
}

#[test]
fn texts_of_services_and_actions_are_split() {
    let (composed, _) = fields_of("good.mcap", &[]);
    let (raw, said) = fields_of("kilted.mcap", &[]);
    assert!(!said.contains("left out"), "{said}");
    let tables = composed.iter().filter(|(name, _)| *name != "index");
    for (name, table) in tables.clone() {
        assert_eq!(&raw[name], table, "{name}");
    }
    assert_eq!(tables.map(|(_, table)| table.len() - 1).sum::<usize>(), 123);
    let goal = decoded(&raw["count._action.send_goal._service_event"]);
    assert_eq!(
        goal[0][5..],
        ["request.goal.order", "response.accepted", "response.stamp"]
    );
    assert_eq!(goal[1][5..], ["[20]", "[]", "[]"]);
    assert_eq!(goal[4][5..], ["[]", "[true]", "[1700000000000000000]"]);
    let cancel = decoded(&raw["count._action.cancel_goal._service_event"]);
    assert_eq!(cancel[0][6], "response.return_code");
    assert_eq!(
        cancel[4][6..],
        [
            "[0]",
            "[[[100,101,102,103,104,105,106,107,108,109,110,111,112,113,114,115]]]",
            "[[1700000018000000000]]"
        ]
    );
}

#[test]
fn invalid_requests_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |args: &[&str], says: &str| {
        let said = ends(dir.path(), &[&["extract", WAREHOUSE], args].concat(), 2);
        assert!(said.contains(says), "{said}");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    };
    refused(&["-o", "x.gif"], "`x.gif` has no known extension");
    refused(&["-o", "x"], "has no known extension");
    refused(&["-o", "-", "--fields"], "do not fit on standard output");
    refused(&["-o", "{n}.csv"], "a file per window");
    refused(&["-o", WAREHOUSE, "--format", "csv"], "overwrite an input");
}

/// A folder with all kinds of recordings: a rosbag2 folder with a foreign file, parts without metadata, loose files,
/// broken ones, subfolders.
fn mixed(folder: &Path) {
    let mcap = fs::read(COURIER).unwrap();
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    put("loose.mcap", &mcap);
    put("a.bag", b"#ROSBAG V2.0\n");
    put("broken.db3", b"");
    put("deep/er/b.bag", b"");
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - run_0.mcap\n";
    put("ros2/metadata.yaml", metadata.as_bytes());
    put("ros2/run_0.mcap", &mcap);
    put("ros2/stranger.bag", b"");
    put("ros2/below/c.mcap", &mcap);
    put("parts/run_0.mcap", &mcap);
    put("parts/run_1.mcap", &mcap);
    put("notes.txt", b"no bag");
}

#[test]
fn a_survey_lists_every_recording() {
    let dir = tempfile::tempdir().unwrap();
    mixed(dir.path());
    let output = bagreel(dir.path(), &["info", ".", "--format", "csv"]);
    fs::write(dir.path().join("survey.csv"), &output.stdout).unwrap();
    let rows = csv(&dir.path().join("survey.csv"));
    let paths: Vec<&str> = rows[1..].iter().map(|r| r[0].as_str()).collect();
    let expected = [
        "a.bag",
        "broken.db3",
        "deep/er/b.bag",
        "loose.mcap",
        "parts",
        "ros2",
        "ros2/below/c.mcap",
        "ros2/stranger.bag",
    ];
    assert_eq!(paths, expected);
    let error = rows[0].iter().position(|c| c == "error").unwrap();
    let failed: Vec<&str> = rows[1..]
        .iter()
        .filter(|r| !r[error].is_empty())
        .map(|r| r[0].as_str())
        .collect();
    assert_eq!(
        failed,
        ["a.bag", "broken.db3", "deep/er/b.bag", "ros2/stranger.bag"]
    );
    // An unreadable bag has its size and is not complete.
    let cell = |path: &str, column: &str| {
        let at = rows[0].iter().position(|c| c == column).unwrap();
        let row = rows.iter().find(|r| r[0] == path).unwrap();
        row[at].clone()
    };
    assert_eq!(cell("a.bag", "file_bytes"), "13");
    assert_eq!(cell("a.bag", "is_complete"), "false");
    assert_eq!(cell("loose.mcap", "is_complete"), "true");
    // A single recording is not a survey.
    let one = bagreel(dir.path(), &["info", "parts"]);
    assert!(String::from_utf8(one.stdout).unwrap().contains("messages"));
}

#[test]
#[cfg(unix)]
fn links_to_bags_are_followed_and_links_to_folders_are_not() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("fleet")).unwrap();
    symlink(COURIER, dir.path().join("fleet/a.mcap")).unwrap();
    symlink(COURIER, dir.path().join("fleet/b.mcap")).unwrap();
    symlink(dir.path().join("gone"), dir.path().join("fleet/c.mcap")).unwrap();
    symlink("/dev/zero", dir.path().join("fleet/d.mcap")).unwrap();
    symlink(dir.path(), dir.path().join("fleet/round")).unwrap();
    let output = bagreel(dir.path(), &["info", "fleet", "--format", "csv"]);
    fs::write(dir.path().join("survey.csv"), &output.stdout).unwrap();
    let rows = csv(&dir.path().join("survey.csv"));
    let paths: Vec<&str> = rows[1..].iter().map(|r| r[0].as_str()).collect();
    assert_eq!(paths, ["a.mcap", "b.mcap", "c.mcap"]);
    let said = ends(dir.path(), &["tables", "fleet", "-o", "t"], 3);
    assert!(
        said.contains("2 tables of 6472 messages (1 unreadable)"),
        "{said}"
    );
}

#[test]
fn a_recorder_is_not_a_subscriber() {
    let dir = tempfile::tempdir().unwrap();
    let counted = |nodes: &str| -> u64 {
        let text = format!("Name,Publish,Subscribe\n{nodes}");
        fs::write(dir.path().join("nodes.csv"), text).unwrap();
        let topology = ["--topology", "nodes.csv", "--format", "json"];
        let output = bagreel(dir.path(), &[&["info", COURIER][..], &topology].concat());
        let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let confidences = info["subscribes_by_degree"].as_object().unwrap();
        confidences.values().map(|n| n.as_u64().unwrap()).sum()
    };
    let recorder = counted("/record_12345,[],['/scan']\n");
    let both = counted("/record_12345,[],['/scan']\n/listens,[],['/scan']\n");
    assert_eq!(both, recorder + 1);
    assert_eq!(recorder, counted("/record_12345,[],[]\n"));
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_build_without_parquet_names_those_with_it() {
    println!("skipped: Parquet, which needs `--features parquet`");
    let dir = tempfile::tempdir().unwrap();
    for args in [
        &["render", WAREHOUSE, "-o", "x.parquet"][..],
        &["extract", WAREHOUSE, "-o", "x.parquet"],
        &[
            "extract", WAREHOUSE, "-o", "x", "--fields", "--format", "parquet",
        ],
        &["info", WAREHOUSE, "--format", "parquet"],
        &["tables", WAREHOUSE, "-o", "x", "--format", "parquet"],
    ] {
        let said = ends(dir.path(), args, 2);
        assert!(
            said.contains("does not write Parquet") && said.contains("--features parquet"),
            "{args:?}: {said}"
        );
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[cfg(feature = "parquet")]
mod parquet {
    use std::fs::File;

    use ::parquet::basic::{LogicalType, Type};
    use ::parquet::file::reader::{FileReader as _, SerializedFileReader};
    use ::parquet::record::{Field, Row};
    use ::parquet::schema::types::ColumnDescPtr;

    use super::*;
    use crate::support::parquet_rows;

    /// The leaf columns by their paths: `ranges.list.element`.
    fn columns(path: &Path) -> Vec<ColumnDescPtr> {
        let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        schema.columns().to_vec()
    }

    /// The text of a field as in CSV.
    fn cell((_, field): (&String, &Field)) -> String {
        match field {
            Field::Null => String::new(),
            Field::Str(text) => text.clone(),
            other => other.to_string(),
        }
    }

    #[test]
    fn parquet_and_csv_have_the_same_contents() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["m.csv", "m.parquet", "again.parquet"] {
            ends(dir.path(), &["extract", WAREHOUSE, COURIER, "-o", name], 0);
        }
        let bytes = |name: &str| fs::read(dir.path().join(name)).unwrap();
        assert!(
            bytes("m.parquet") == bytes("again.parquet"),
            "same bag, same bytes"
        );
        let path = dir.path().join("m.parquet");
        let cells = |row: &Row| row.get_column_iter().map(cell).collect::<Vec<_>>();
        let rows: Vec<Vec<String>> = parquet_rows(&path).iter().map(cells).collect();
        assert!(rows == csv(&dir.path().join("m.csv"))[1..]);
        // Only the ROS 1 bag contains publishers.
        let unknown = rows.iter().filter(|row| row[3].is_empty()).count();
        assert!(unknown > 0 && unknown < rows.len());
        let time = columns(&path).remove(0);
        let is_utc = |kind: &LogicalType| matches!(kind, LogicalType::Timestamp(t) if t.is_adjusted_to_u_t_c);
        assert!(time.logical_type_ref().is_some_and(is_utc), "{time:?}");
    }

    #[test]
    fn fields_keep_their_types() {
        let dir = tempfile::tempdir().unwrap();
        let args = [
            "extract", COURIER, "-o", "t", "--fields", "--format", "parquet",
        ];
        ends(dir.path(), &args, 0);
        let kind = |table: &str, path: &str| {
            let columns = columns(&dir.path().join(table));
            let column = columns.iter().find(|c| c.path().string() == path).unwrap();
            (column.physical_type(), column.max_rep_level())
        };
        assert_eq!(kind("t/scan.parquet", "header.stamp"), (Type::INT64, 0));
        assert_eq!(kind("t/scan.parquet", "range_max"), (Type::FLOAT, 0));
        let ranges = "ranges.list.element";
        assert_eq!(kind("t/scan.parquet", ranges), (Type::FLOAT, 1));
        let x = "transforms.transform.translation.x.list.element";
        assert_eq!(kind("t/tf.parquet", x), (Type::DOUBLE, 1));
        let row = parquet_rows(&dir.path().join("t/scan.parquet")).remove(0);
        let list = row.get_column_iter().find(|(name, _)| *name == "ranges");
        assert!(matches!(list, Some((_, Field::ListInternal(list))) if list.len() > 1));
    }

    #[test]
    fn a_mission_is_the_same_tables_in_both_formats() {
        let dir = tempfile::tempdir().unwrap();
        let args = ["render", WAREHOUSE, "-o", "x.csv", "-o", "x.parquet"];
        ends(dir.path(), &args, 0);
        for table in [
            "edges", "topics", "nodes", "changes", "events", "phases", "bags",
        ] {
            let expected = csv(&dir.path().join(format!("x.{table}.csv")));
            let rows = parquet_rows(&dir.path().join(format!("x.{table}.parquet")));
            let names = rows[0].get_column_iter().map(|(name, _)| name);
            assert!(names.eq(&expected[0]), "{table}");
            assert_eq!(rows.len(), expected.len() - 1, "{table}");
        }
        let columns = columns(&dir.path().join("x.edges.parquet"));
        let start = columns.iter().find(|c| c.name() == "start_ns").unwrap();
        let kind = start.logical_type_ref();
        assert!(matches!(kind, Some(LogicalType::Timestamp(_))), "{kind:?}");
    }
}
