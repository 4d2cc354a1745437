//! Tests that every option of every command changes the output or is refused with a hint: one row each, none missing.
//!
//! A row is a command line and the added arguments, of which the first word is the option.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::source;
use crate::support::{ORIGIN, Recording, rosbag1, small, sqlite3};

/// Command, its arguments, and an option that changes the files or the results.
#[rustfmt::skip]
const CHANGES: &[(&str, &str, &str)] = &[
    ("render", "r.bag -o out/x.json", "--output out/y.json"),
    ("render", "r.bag -o -", "--format json"),
    ("render", "r.bag -o out/x.json", "--period 7s"),
    ("render", "r.bag -p 10 -o out/x.json", "--step 5s"),
    ("render", "r.bag -o out/x.json", "--start 20"),
    ("render", "r.bag -o out/x.json", "--offset r.bag=+0.35s"),
    ("events", "bags/a.bag --format csv", "--offset bags=-2s"),
    ("info", "r.bag --format json", "--offset r.bag=5"),
    ("render", "r.bag -o out/x.json", "--ns r.bag=/robot2"),
    ("events", "bags/a.bag --format csv --all", "--ns bags=/robot2"),
    ("info", "r.bag --format json", "--ns r.bag=/robot2"),
    ("figure", "r.bag cam.bag --kind lives -o out/x.svg", "--ns cam.bag=/robot2"),
    ("figure", "r.bag cam.bag --kind lives -o out/x.svg", "--offset cam.bag=20s"),
    ("render", "r.bag -o out/x.json", "--end -20s"),
    ("render", "r.bag -p 7 -o out/x.json", "--align clock"),
    ("render", "r.bag -o out/x.json", "--rate-change 5"),
    ("render", "r.bag -o out/x.json", "--topology t.csv"),
    ("render", "s.mcap -o out/x.json", "--source ws"),
    ("render", "r.bag -o out/x.json", "--infer stamps"),
    ("render", "r.bag -o out/x.dot", "--mode nodes"),
    ("render", "r.bag -o out/x.dot", "--ns-filter /ns/.*"),
    ("render", "r.bag -o out/x.dot", "--topic-filter /ns/.*"),
    ("render", "r.bag -o out/x.dot", "--hide none"),
    ("render", "r.bag -o out/x.json", "--mode nodes"),
    ("render", "r.bag -o out/x.json", "--hide debug"),
    ("render", "r.bag -o out/x.csv", "--ns-filter /ns/.*"),
    ("render", "r.bag -o out/x.json", "--topic-filter /ns/.*"),
    ("render", "r.bag -o out/x.json", "--rqt-defaults"),
    ("render", "r.bag -o out/x.dot", "--group none"),
    ("render", "r.bag -o out/x.dot", "--collapse /ns"),
    ("render", "r.bag -p all --size 100x100 -o out/x.svg", "--collapse -/ns"),
    ("render", "r.bag -o out/x.dot", "--rqt-defaults"),
    ("render", "r.bag -p all -o out/x.svg", "--style dark"),
    ("render", "r.bag -p all -o out/x.svg", "--mode topics"),
    ("render", "r.bag -p all -o out/x.svg", "--for column"),
    ("render", "r.bag -p all -o out/x.png", "--size 300x200"),
    ("render", "r.bag -p all -o out/x.svg", "--width 88mm"),
    ("render", "r.bag -p all --size 100x100 -o out/x.svg", "--fit none"),
    ("render", "r.bag -p all -o out/x.html", "--orientation TB"),
    ("render", "r.bag -p all -o out/x.svg", "--layout layout-rs"),
    ("render", "r.bag -p all -o out/x.svg", "--layout-from wide.json"),
    ("render", "r.bag -p all -o out/x.svg", "--title Hello"),
    ("render", "r.bag -p all -o out/x.svg", "--bare"),
    ("render", "r.bag -p 20 --size 200x200 -o out/x.gif", "--frame-ms 500"),
    ("render", "r.bag -p 20 --size 200x200 -o out/x.gif", "--max-bytes 6kB"),
    ("render", "r.bag -p 20 -o out/x.svg", "--strip 0,1"),
    ("render", "r.bag -o out/x.md", "--link player=https://example.org"),
    ("render", "r.bag -o out/x.json", "--phases p.txt"),
    ("render", "r.bag -o out/x.json", "--cut changes"),
    ("figure", "r.bag", "--output out/x.svg"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--kind steps"),
    ("figure", "r.bag -o out/x.svg", "--width 180mm"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--rows topics"),
    ("figure", "r.bag --width 180mm --phases p.txt --kind steps -o out/x.svg", "--steps 2"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--text 9pt"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--phases p.txt"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--bare"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--start 20"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--end -20s"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--rate-change 5"),
    ("figure", "r.bag --width 180mm -o out/x.svg", "--ns-filter /ns/.*"),
    ("figure", "r.bag --width 180mm --rows topics -o out/x.svg", "--topic-filter /ns/.*"),
    ("figure", "r.bag --width 180mm --kind graph -o out/x.svg", "--topology t.csv"),
    ("figure", "r.bag --width 180mm --kind graph -o out/x.svg", "--infer stamps"),
    ("info", "r.bag", "--format json"),
    ("info", "r.bag", "--output out/x.json"),
    ("info", "r.bag", "--why /chat"),
    ("info", "r.bag", "--topology t.csv"),
    ("info", "s.mcap", "--source ws"),
    ("info", "r.bag", "--infer stamps"),
    ("extract", "r.bag", "--output out/y.csv"),
    ("extract", "r.bag -o out/x.dat", "--format csv"),
    ("extract", "r.bag -o out", "--fields"),
    ("extract", "own.db3 --fields -o out", "--msg-path msgs"),
    ("extract", "r.bag -o out/x.csv", "--topic-filter /chat"),
    ("extract", "r.bag -o out/x.csv", "--start 20"),
    ("extract", "r.bag -o out/x.csv", "--end 20"),
    ("tables", "r.bag", "--output out"),
    #[cfg(feature = "parquet")]
    ("tables", "r.bag -o out", "--format parquet"),
    ("tables", "r.bag -o out", "--period 7s"),
    ("events", "r.bag", "--format csv"),
    ("events", "r.bag", "--rate-change 5"),
    ("events", "r.bag", "--parts"),
    ("events", "r.bag", "--all"),
    ("events", "r.bag --all", "--phases auto"),
    ("events", "r.bag", "--output out/x.csv"),
    ("events", "r.bag", "--start 20"),
    ("events", "r.bag", "--end -20s"),
    ("events", "r.bag --parts", "--topology t.csv"),
    ("events", "r.bag --parts", "--infer stamps"),
    ("baseline", "r.bag", "--output out/x.yaml"),
    ("baseline", "r.bag", "--period 7s"),
    ("baseline", "r.bag", "--start 20"),
    ("baseline", "r.bag", "--end 20"),
    ("baseline", "r.bag", "--update few.yaml"),
    ("baseline", "r.bag --update out/few.yaml", "--only /chat"),
    ("baseline", "r.bag", "--topology t.csv"),
    ("check", "r.bag --expect all.yaml", "--format json"),
    ("check", "r.bag --expect all.yaml", "--output out/x.json"),
    ("check", "r.bag --expect all.yaml", "--start 20"),
    ("check", "r.bag --expect all.yaml", "--end 8"),
    ("check", "r.bag", "--expect all.yaml"),
    ("check", "", "--explain topic-gap"),
    ("check", "r.bag --expect late.yaml", "--undecidable error"),
    ("check", "r.bag --expect new.yaml", "--topology t.csv"),
    ("check", "r.bag --expect stamps.yaml", "--infer stamps"),
    ("check", "s.mcap --expect code.yaml", "--source ws"),
    ("follow", "r.bag", "--format ndjson"),
    ("follow", "r.bag", "--expect all.yaml"),
    ("follow", "r.bag", "--output out/x.json"),
    ("diff", "r.bag s.mcap", "--format json"),
    ("diff", "r.bag s.mcap", "--output out/x.json"),
    ("diff", "r.bag slow.bag", "--rate-change 5"),
    ("diff", "r.bag slow.bag", "--start 20"),
    ("diff", "r.bag slow.bag", "--end 5"),
];

/// Command, its arguments, an option, and the message that it causes.
#[rustfmt::skip]
const SAYS: &[(&str, &str, &str, &str)] = &[
    ("render", "r.bag -o out/x.json", "--ns-filter /ns/.*", "data contains what the filters choose: 2 of "),
    ("info", "r.bag", "--verify", "a second reader counts the same"),
    ("render", "r.bag -o out/x.svg", "--hide services", "`--hide services` leaves nothing out"),
    ("extract", "r.bag -o out/x.csv", "--topic-filter /chat,/chta", "matches no topic; the nearest name is `/chat`"),
    ("extract", "r.bag -o out/x.csv --topic-filter /chat", "--start 22.1", "no message of these topics is in that time"),
    ("events", "s.mcap", "--source ws", "have no times"),
    ("follow", "r.bag", "--idle 1ms", "nothing was written for"),
    ("tables", "r.bag -o kept", "--skip-existing", "1 already there"),
];

/// Command, its arguments, an option without effect, and the hint.
#[rustfmt::skip]
const REFUSED: &[(&str, &str, &str, &str)] = &[
    ("render", "r.bag -o out/x.gif", "--font c.txt", "hint: give `--font` a .ttf"),
    ("render", "old.json -o out/x.svg", "--offset old.json=1", "hint: give the bag itself"),
    ("render", "r.bag -o out/x.svg", "--offset q.bag=1", "hint: write the bag as on the command line"),
    ("render", "r.bag -o out/x.svg", "--offset r.bag", "write a bag and a time"),
    ("render", "old.json -o out/x.svg", "--ns old.json=/a", "hint: give the bag itself"),
    ("render", "r.bag -o out/x.svg", "--ns q.bag=/a", "hint: write the bag as on the command line"),
    ("render", "r.bag -o out/x.svg", "--ns r.bag=a", "write a bag and a namespace"),
    ("render", "old.json -o out/x.svg", "--period 7s", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--step 7s", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--start 7s", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--end 7s", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--align clock", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--rate-change 3", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--topology t.csv", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--source ws", "hint: give the bag itself"),
    ("render", "old.json -o out/x.svg", "--infer stamps", "hint: give the bag itself"),
    ("info", "old.json", "--verify", "hint: give the bag itself"),
    ("info", "old.json", "--topology t.csv", "hint: give the bag itself"),
    ("events", "old.json", "--start 9", "hint: give the bag itself"),
    ("info", "r.bag --why /chat", "--format json", "cannot be used with"),
    ("info", "r.bag --why /chat", "--verify", "cannot be used with"),
    ("info", "bags", "--why /chat", "hint: give one of the bags"),
    ("render", "r.bag -o out/x.json", "--style dark", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.dot", "--style dark", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.mmd", "--orientation TB", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.dot", "--layout layout-rs", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.csv", "--layout-from wide.json", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.md", "--size 300x200", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.json", "--fit none", "hint: it applies to pictures"),
    ("render", "r.bag -o out/x.json", "--width 88mm", "hint: it is a width on paper"),
    ("render", "r.bag -o out/x.gif", "--width 88mm", "hint: it is a width on paper"),
    ("events", "r.bag", "--start 0:70", "invalid value '0:70'"),
    ("info", "r.bag", "--why /chta", "hint: the nearest name is `/chat`"),
    ("info", "r.bag", "--why /chat /chta", "no node or topic `/chta`"),
    ("extract", "r.bag --fields -o out/t", "--topic-filter /chta", "hint: the nearest name is `/chat`"),
    ("render", "r.bag -o out/x.json", "--title Hello", "hint: it applies to pictures and reports"),
    ("render", "r.bag -o out/x.html", "--bare", "hint: it applies to animations, pages and"),
    ("render", "r.bag -o out/x.json", "--group none", "hint: data contains every element by itself"),
    ("render", "r.bag -o out/x.csv", "--collapse /ns", "hint: data contains every element by itself"),
    ("render", "r.bag -o out/x.pdf", "--frame-ms 500", "hint: it applies to animations"),
    ("render", "r.bag -o out/x.gif", "--strip 3x2", "hint: it applies to pictures of the whole"),
    ("render", "r.bag -o out/{n}.svg", "--strip 3x2", "hint: it applies to pictures of the whole"),
    ("render", "r.bag -o out/x.svg", "--max-bytes 1MB", "hint: it applies to `x.gif`"),
    ("render", "r.bag -o out/x.gif", "--link a=https://b.c", "hint: it applies to reports"),
    ("render", "r.bag -o out/x.json", "--mode topics", "hint: write a picture"),
    ("render", "r.bag --mode topics -o out/x.svg", "--hide none", "hint: omit it, or use `--mode all`"),
    ("render", "r.bag -o out/x.md", "--link player=data:text/html,x", "write an address on the web"),
    ("render", "r.bag -o out/x.dot", "--phases p.txt", "hint: it applies to pictures, pages"),
    ("extract", "own.db3 -o out/x.csv", "--msg-path msgs", "--fields"),
    ("extract", "own.db3 --fields -o out", "--msg-path bags", "contains no file of messages"),
    ("tables", "r.bag -o out/t", "--format gif", "invalid value 'gif'"),
    #[cfg(not(feature = "parquet"))]
    ("tables", "r.bag -o out/t", "--format parquet", "hint: packages and the Python wheel do"),
    ("diff", "r.bag old.json", "--start 9", "hint: give the bag itself"),
    ("diff", "r.bag all.yaml", "--rate-change 3", "hint: give two missions"),
    ("baseline", "r.bag", "--only /chat", "--update <FILE>"),
    ("baseline", "r.bag --update few.yaml", "--only /chats", "the nearest is `/chat`"),
    ("baseline", "old.json", "--period 9", "hint: give the bag itself"),
    ("check", "r.bag --source ws --expect all.yaml", "--infer source", "never checked"),
    ("check", "old.json --expect all.yaml", "--end 9", "hint: give the bag itself"),
    ("check", "r.bag --expect all.yaml", "--explain topic-gap", "cannot be used with"),
    ("figure", "r.bag -o out/x.svg", "--font c.txt", "hint: give `--font` a .ttf"),
    ("figure", "r.bag -o out/x.json", "--width 88mm", "hint: figures are `.pdf`"),
    ("figure", "r.bag -o out/{n}.svg", "--width 88mm", "hint: figures are `.pdf`"),
    ("figure", "r.bag -o out/x.svg", "--steps 2", "hint: it chooses the panels"),
    ("figure", "old.json -o out/x.svg", "--start 9", "hint: give the bag itself"),
    ("figure", "old.json -o out/x.svg", "--source ws", "hint: give the bag itself"),
];

/// Half a minute with something for every option: a rate that drops, a publisher that stops, one that returns under
/// another name, a filter that copies stamps, housekeeping, a recorder.
fn recording() -> Recording {
    let mut bag = Recording::default();
    let mut header = |node: &str, topic: &str| {
        let place = bag.publisher(node, topic, "test_msgs/Stamped");
        "Header header\n================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n".clone_into(&mut bag.publishers[place].definition);
        place
    };
    let image = header("/ns/cam/driver", "/ns/cam/image");
    let filtered = header("/ns/nav/filter", "/ns/nav/points");
    for (place, late) in [(image, 0), (filtered, 20_000_000)] {
        for k in 0..150_i64 {
            // From 10 Hz to 4 Hz.
            let at = if k < 100 {
                k * 100
            } else {
                10_000 + (k - 100) * 250
            };
            if late > 0 && at < 5000 {
                continue;
            }
            let stamp = ORIGIN + at * 1_000_000;
            let mut payload = vec![u8::from(late > 0); 4];
            payload.extend(u32::try_from(stamp / 1_000_000_000).unwrap().to_le_bytes());
            payload.extend(u32::try_from(stamp % 1_000_000_000).unwrap().to_le_bytes());
            payload.extend([0; 4]);
            bag.messages.push((place, stamp + late, payload));
        }
    }
    for (node, topic, from, to) in [
        ("/talker_1_1704067200123", "/chat", 0, 10_000),
        ("/talker_2_1704067230123", "/chat", 15_000, 22_000),
        ("/late", "/ns/nav/found", 18_000, 22_000),
        ("/rosbag2_recorder", "/ns/log", 0, 22_000),
        ("/ns/cam/driver", "/ns/cam/image/compressed", 0, 22_000),
        ("/ns/cam/driver", "/rosout_agg", 0, 22_000),
    ] {
        let place = bag.publisher(node, topic, "std_msgs/String");
        bag.send(place, (from, to), 200, b"\x05\0\0\0hello");
    }
    bag.messages.sort_by_key(|m| m.1);
    bag
}

/// Another run of the same robot: the log at half its rate, and no publisher that returns.
fn slow() -> Recording {
    let mut bag = recording();
    let of = |node: &str| bag.publishers.iter().position(|p| p.node == node);
    let (log, again) = (of("/rosbag2_recorder"), of("/talker_2_1704067230123"));
    let mut nth = 0;
    bag.messages.retain(|message| {
        nth += usize::from(Some(message.0) == log);
        Some(message.0) != again && (Some(message.0) != log || nth % 2 == 0)
    });
    bag
}

/// A camera of another robot, for a minute.
fn camera() -> Recording {
    let mut bag = Recording::default();
    let place = bag.publisher("/camera", "/image", "std_msgs/String");
    bag.send(place, (0, 70_000), 1000, b"\x01\0\0\0a");
    bag
}

/// A folder with all files used in the rows.
fn folder() -> TempDir {
    let folder = TempDir::new().unwrap();
    let bag = rosbag1::write(&recording(), rosbag1::Pack::Lz4, 4000);
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    put("r.bag", &bag);
    put(
        "cam.bag",
        &rosbag1::write(&camera(), rosbag1::Pack::Lz4, 4000),
    );
    put("bags/a.bag", &bag);
    put(
        "bags/b.bag",
        &rosbag1::write(&small(), rosbag1::Pack::None, 4000),
    );
    put(
        "t.csv",
        b"Name,Publish,Subscribe,Node-start,Node-end\n/new,[],\"['/chat']\",,\n",
    );
    let expects = |topics: &str| format!("schema: bagreel.expect/1\ntopics:\n{topics}");
    let gone = "  /chat: {type: gone/Gone}\n  /ns/log: {type: gone/Gone}\n";
    put("few.yaml", expects(gone).as_bytes());
    put("gone.yaml", expects(gone).as_bytes());
    put("new.yaml", expects("  /chat: {to: [/new]}\n").as_bytes());
    put(
        "late.yaml",
        expects("  /chat: {to: [/ns/cam/driver]}\n").as_bytes(),
    );
    let merged = "  /ns/cam/image: {to: [/ns/nav/filter]}\n";
    put("stamps.yaml", expects(merged).as_bytes());
    put(
        "slow.bag",
        &rosbag1::write(&slow(), rosbag1::Pack::Lz4, 4000),
    );
    put(
        "code.yaml",
        expects("  /in: {to: [/talker_late]}\n").as_bytes(),
    );
    put("c.txt", b"0|here it begins\n");
    put("p.txt", b"0:00 first\n0:11 second\n0:16 third\n");
    put("msgs/my_msgs/msg/Thing.msg", b"string data # words\n");
    let mut own = Recording::default();
    let thing = own.publisher("", "/thing", "my_msgs/msg/Thing");
    own.send(thing, (0, 1000), 100, b"\0\x01\0\0\x03\0\0\0hi\0");
    sqlite3::write(&own, &folder.path().join("own.db3"));
    let topics = [("/out_late", source::STRING), ("/in", source::STRING)];
    put("s.mcap", &source::bag(&topics, &["/talker_late"]));
    let (package, xml) = source::PACKAGE;
    put(&format!("ws/{package}"), xml.as_bytes());
    put(
        "ws/p/p/talker.py",
        source::node("talker_late", "out_late", "/in").as_bytes(),
    );
    let written = bagreel(folder.path(), "baseline", "r.bag -o all.yaml", "");
    assert_eq!(written.status.code(), Some(0), "{}", text(&written.stderr));
    let kept = bagreel(folder.path(), "tables", "r.bag -o kept", "");
    assert_eq!(kept.status.code(), Some(0), "{}", text(&kept.stderr));
    for (with, name) in [("", "old.json"), ("--orientation=LR", "wide.json")] {
        let args = format!("r.bag -p 20 -o {name} -o pic.svg {with}");
        let output = bagreel(folder.path(), "render", &args, "");
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    folder
}

fn bagreel(folder: &Path, command: &str, args: &str, with: &str) -> Output {
    fs::create_dir_all(folder.join("out")).unwrap();
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    run.current_dir(folder).arg(command);
    run.args(args.split_whitespace())
        .args(with.split_whitespace());
    run.output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The results and the files of one run.
type Outcome = (Vec<u8>, BTreeMap<String, Vec<u8>>);

/// The outcome of a command line; `None` if it is refused.
fn outcome(folder: &Path, command: &str, args: &str, with: &str) -> Option<Outcome> {
    let _ = fs::remove_dir_all(folder.join("out"));
    // An existing file to update.
    if args.contains("out/few.yaml") {
        fs::create_dir(folder.join("out")).unwrap();
        fs::copy(folder.join("gone.yaml"), folder.join("out/few.yaml")).unwrap();
    }
    let output = bagreel(folder, command, args, &format!("{with} -q"));
    let said = text(&output.stderr);
    match output.status.code() {
        // 3: some topics cannot be decoded.
        Some(0 | 3) => {}
        // Findings are results.
        Some(1) if command == "check" || command == "diff" => {}
        Some(1 | 2) => return None,
        code => panic!("{command} {args} {with}: {code:?} {said}"),
    }
    let mut files = BTreeMap::new();
    written(&folder.join("out"), "", &mut files);
    Some((output.stdout, files))
}

/// Adds every file in a folder, and in those below it.
fn written(folder: &Path, below: &str, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = format!("{below}{}", path.file_name().unwrap().to_string_lossy());
        if path.is_dir() {
            written(&path, &format!("{name}/"), files);
        } else {
            files.insert(name, fs::read(path).unwrap());
        }
    }
}

fn changes(command: &str) {
    let folder = folder();
    let mut without: BTreeMap<&str, Option<Outcome>> = BTreeMap::new();
    let mut wrong = Vec::new();
    for (_, args, with) in CHANGES.iter().filter(|row| row.0 == command) {
        let run = |with| outcome(folder.path(), command, args, with);
        let plain = without.entry(args).or_insert_with(|| run(""));
        let changed = run(with);
        if changed.is_none() || *plain == changed {
            wrong.push(format!("{command} {args} {with}"));
        }
    }
    assert!(
        wrong.is_empty(),
        "these do nothing, or are refused:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn every_option_of_render_changes_something() {
    changes("render");
}

#[test]
fn every_option_of_figure_changes_something() {
    changes("figure");
}

#[test]
fn every_option_of_info_changes_something() {
    changes("info");
}

#[test]
fn every_option_of_events_changes_something() {
    changes("events");
}

#[test]
fn every_option_of_extract_changes_something() {
    changes("extract");
}

#[test]
fn every_option_of_tables_changes_something() {
    changes("tables");
}

#[test]
fn every_option_of_baseline_changes_something() {
    changes("baseline");
}

#[test]
fn every_option_of_diff_changes_something() {
    changes("diff");
}

#[test]
fn every_option_of_follow_changes_something() {
    changes("follow");
}

#[test]
fn every_option_of_check_changes_something() {
    changes("check");
}

#[test]
fn notes_of_an_option_are_printed_only_with_it() {
    let folder = folder();
    for (command, args, with, says) in SAYS {
        let said = |with| text(&bagreel(folder.path(), command, args, with).stderr);
        let (without, with_it) = (said(""), said(with));
        assert!(with_it.contains(says), "{command} {args} {with}: {with_it}");
        assert!(!without.contains(says), "{command} {args}: {without}");
    }
}

#[test]
fn options_without_effect_are_refused_with_a_hint() {
    let folder = folder();
    for (command, args, with, hint) in REFUSED {
        let output = bagreel(folder.path(), command, args, with);
        let said = text(&output.stderr);
        let code = output.status.code();
        assert!(
            matches!(code, Some(1 | 2)),
            "{command} {args} {with}: {code:?} {said}"
        );
        assert!(said.contains(hint), "{command} {args} {with}: {said}");
        let files = fs::read_dir(folder.path().join("out")).unwrap().count();
        assert_eq!(files, 0, "{command} {args} {with} wrote something");
    }
}

/// The options that `--help` of a command lists.
pub(crate) fn listed(command: &str) -> BTreeSet<String> {
    let output = bagreel(Path::new("."), command, "", "--help");
    let help = text(&output.stdout);
    let options = help.lines().filter_map(|line| {
        let line = line.trim_start();
        let line = line
            .strip_prefix('-')
            .filter(|rest| !rest.starts_with('-'))
            .map_or(line, |rest| {
                rest.split_once(", ").map_or(line, |(_, long)| long)
            });
        let long = line.strip_prefix("--")?;
        let end = long.find(|c: char| c != '-' && !c.is_ascii_lowercase());
        Some(long[..end.unwrap_or(long.len())].to_owned())
    });
    // These belong to the command line itself.
    options
        .filter(|o| !["help", "version", "quiet", "verbose", "color"].contains(&o.as_str()))
        .collect()
}

/// The commands that `--help` lists, without `help`.
pub(crate) fn commands() -> Vec<String> {
    let help = text(&bagreel(Path::new("."), "--help", "", "").stdout);
    let commands = help.lines().skip_while(|l| *l != "Commands:").skip(1);
    let commands = commands.take_while(|l| !l.is_empty());
    let named = commands.filter_map(|l| l.split_whitespace().next());
    let commands: Vec<String> = named.filter(|c| *c != "help").map(str::to_owned).collect();
    assert!(
        commands.iter().any(|c| c == "render") && commands.len() > 5,
        "{commands:?}"
    );
    commands
}

#[test]
fn every_option_has_a_row() {
    let rows = CHANGES.iter().map(|row| (row.0, row.2));
    let said = SAYS.iter().chain(REFUSED).map(|row| (row.0, row.2));
    let rows: BTreeSet<(&str, &str)> = rows
        .chain(said)
        .filter_map(|(command, with)| {
            Some((command, with.split_whitespace().next()?.strip_prefix("--")?))
        })
        .collect();
    for command in &commands() {
        let listed = listed(command);
        let missing: Vec<&String> = listed
            .iter()
            .filter(|o| !rows.contains(&(command.as_str(), o.as_str())))
            .collect();
        assert!(
            missing.is_empty(),
            "`bagreel {command}`: no row for {missing:?}"
        );
        let gone = rows
            .iter()
            .filter(|row| row.0 == command && !listed.contains(row.1));
        assert_eq!(
            gone.count(),
            0,
            "`bagreel {command}`: a row for what is not listed"
        );
    }
}
