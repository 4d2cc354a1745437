//! Tests of the command on a terminal: the final screen, the width of results, colours.
#![cfg(target_os = "linux")]

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Stdio};

use bagreel::bag::{self, Connection, ConnectionId, Input, Message, OpenOptions, Sink, Want};
use bagreel::internals::base::notice::Notice;
use bagreel::internals::base::time::Stamp;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

const WAREHOUSE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
const COURIER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");

/// The streams of a command that are the terminal; the other one is discarded.
#[derive(Clone, Copy, PartialEq)]
enum On {
    Both,
    Output,
    Errors,
}

/// All output of the command to a terminal of this many columns.
fn typed(folder: &Path, args: &[&str], on: On, columns: u16, colour: bool) -> String {
    written_by(folder, args, on, columns, |command| {
        command.env("TERM", "xterm").env_remove("NO_COLOR");
        if !colour {
            command.env("NO_COLOR", "1");
        }
    })
}

/// As [`typed`], in an environment that `set` changes.
fn written_by(
    folder: &Path,
    args: &[&str],
    on: On,
    columns: u16,
    set: impl FnOnce(&mut Command),
) -> String {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let size = Winsize {
        ws_row: 50,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    tcsetwinsize(&master, size).unwrap();
    let name = ptsname(&master, Vec::new()).unwrap();
    let slave = File::options()
        .read(true)
        .write(true)
        .open(name.to_str().unwrap())
        .unwrap();
    let terminal = |is: bool| {
        if is {
            Stdio::from(slave.try_clone().unwrap())
        } else {
            Stdio::null()
        }
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command
        .current_dir(folder)
        .args(args)
        .stdin(Stdio::null())
        .stdout(terminal(on != On::Errors))
        .stderr(terminal(on != On::Output));
    set(&mut command);
    let mut child = command.spawn().unwrap();
    drop((command, slave));
    let mut all = Vec::new();
    let mut master = File::from(master);
    let mut part = [0; 4096];
    // Reading from a terminal that was closed is an error.
    while let Ok(n @ 1..) = master.read(&mut part) {
        all.extend_from_slice(&part[..n]);
    }
    child.wait().unwrap();
    String::from_utf8(all).unwrap()
}

/// The lines that a terminal of this many columns shows at the end, without cleared ones.
fn screen(written: &str, columns: usize) -> Vec<String> {
    let mut lines = vec![Vec::new()];
    let (mut row, mut column) = (0, 0);
    let mut chars = written.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\r' => column = 0,
            '\n' => row += 1,
            '\u{1b}' if chars.next_if_eq(&'[').is_some() => {
                let mut number = String::new();
                let end = loop {
                    match chars.next().unwrap() {
                        digit @ ('0'..='9' | '?' | ';') => number.push(digit),
                        end => break end,
                    }
                };
                let n: usize = number.parse().unwrap_or(1);
                let line: &mut Vec<char> = &mut lines[row];
                match (end, number.as_str()) {
                    ('A', _) => row = row.saturating_sub(n),
                    ('B', _) => row += n,
                    ('K', "2") => line.clear(),
                    ('K', _) => line.truncate(column),
                    ('J', _) => {
                        line.truncate(column);
                        lines.truncate(row + 1);
                    }
                    ('m' | 'h' | 'l', _) => {}
                    (end, number) => panic!("unknown sequence {number}{end}"),
                }
            }
            c => {
                if column == columns {
                    (row, column) = (row + 1, 0);
                }
                while lines.len() <= row {
                    lines.push(Vec::new());
                }
                let line = &mut lines[row];
                while line.len() <= column {
                    line.push(' ');
                }
                line[column] = c;
                column += 1;
            }
        }
        while lines.len() <= row {
            lines.push(Vec::new());
        }
    }
    let lines = lines.into_iter().map(String::from_iter);
    let mut lines: Vec<String> = lines
        .map(|line: String| line.trim_end().to_owned())
        .collect();
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines
}

/// The lines with all numbers masked, as times differ between runs.
fn timeless(lines: Vec<String>) -> Vec<String> {
    let digit = |c: char| if c.is_ascii_digit() { '0' } else { c };
    let seconds = |line: String| match line.rfind(", in ") {
        Some(at) => line[..at].to_owned(),
        None => line.chars().map(digit).collect(),
    };
    lines.into_iter().map(seconds).collect()
}

/// Every command that reads or draws, with its arguments.
const COMMANDS: &[&str] = &[
    "render W -o x.gif --size 320x200",
    "render W -o x.json",
    "render W -o - --format json --period all",
    "render C -o x.html",
    "render gone.bag -o x.gif",
    "figure W -o fig.pdf",
    "info W",
    "info W --why /map_server",
    "info E",
    "info E --format csv",
    "events W",
    "events W --parts --phases auto",
    "extract C -o x.csv",
    "extract C -o - --format csv",
    "extract C -o fields --fields",
    "tables W -o fleet",
    "baseline W -o x.yaml",
    "baseline W",
    "check W --expect expected.yaml",
    "diff W C",
    "styles",
    "styles light",
    "completions bash",
    "man render",
    "--help",
    "render --help",
];

fn words(line: &str) -> Vec<&str> {
    let word = |word| match word {
        "W" => WAREHOUSE,
        "C" => COURIER,
        "E" => EXAMPLES,
        other => other,
    };
    line.split(' ').map(word).collect()
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("expected.yaml"),
        "schema: bagreel.expect/1\nnodes:\n  /planner: {}\n",
    )
    .unwrap();
    folder
}

#[test]
fn only_results_and_messages_stay_on_the_screen() {
    let folder = folder();
    let mut bars = 0;
    for line in COMMANDS {
        let run = |on| {
            let written = typed(folder.path(), &words(line), on, 80, true);
            (
                written.contains("\u{1b}[2K"),
                timeless(screen(&written, 80)),
            )
        };
        let (has_bar, both) = run(On::Both);
        let (results, messages) = (run(On::Output).1, run(On::Errors).1);
        bars += usize::from(has_bar);
        let before = [messages.clone(), results.clone()].concat();
        let after = [results, messages].concat();
        assert!(
            both == before || both == after,
            "{line}:\n{}\nshould be\n{}",
            both.join("\n"),
            after.join("\n")
        );
    }
    assert!(bars > 8, "{bars} commands showed a bar");
}

#[test]
fn results_fit_the_terminal() {
    let folder = folder();
    fs::create_dir(folder.path().join("long")).unwrap();
    for name in ["first", "second"] {
        let name = format!("long/{name}_recording_of_the_morning.mcap");
        fs::copy(COURIER, folder.path().join(name)).unwrap();
    }
    for columns in [60, 80, 120] {
        for line in [
            "info W",
            "info W --why /map_server",
            "info C",
            "info E",
            "info long",
            "diff W C",
            "events W",
            "events W --parts",
            "events C",
            "follow W",
            "check C --expect expected.yaml",
            "check --explain topic-gap",
            "render W -o x.svg",
            "render C -o x.svg --mode topics --collapse /nav",
        ] {
            let on = if line.starts_with("render") {
                On::Errors
            } else {
                On::Output
            };
            let written = typed(folder.path(), &words(line), on, columns, true);
            let widest = screen(&written, 1000)
                .into_iter()
                .max_by_key(|line| line.chars().count())
                .unwrap_or_default();
            let is_one_word = !widest.trim().contains(' ');
            assert!(
                is_one_word || widest.chars().count() <= usize::from(columns),
                "{line} at {columns}: {widest}"
            );
        }
    }
}

#[test]
fn table_headers_align_with_their_columns() {
    let folder = folder();
    let written = typed(folder.path(), &["info", WAREHOUSE], On::Output, 80, true);
    let lines = screen(&written, 1000);
    let head = lines
        .iter()
        .find(|line| line.starts_with("  topic "))
        .unwrap();
    let row = lines
        .iter()
        .find(|line| line.starts_with("  /robot1/odom "))
        .unwrap();
    let end =
        |text: &str, line: &str| line.split(text).next().unwrap().chars().count() + text.len();
    assert_eq!(end("messages", head), end("1627", row), "{head}\n{row}");
    assert!(
        head.contains("while sending") && head.contains("activity"),
        "{head}"
    );
    assert!(lines.iter().any(|line| line.starts_with("  node ")));
}

#[test]
fn the_start_of_a_recording_is_whole_in_a_narrow_table() {
    let folder = folder();
    for day in 1..4 {
        let name = format!("2024-03-0{day}_morning_round_of_the_warehouse_robot.mcap");
        fs::copy(COURIER, folder.path().join(name)).unwrap();
    }
    for (columns, start) in [
        (60, "2024-01-01 "),
        (80, "2024-01-01 "),
        (100, "2024-01-01T00:00 "),
        (120, "2024-01-01T00:00:00 "),
    ] {
        let written = typed(folder.path(), &["info", "."], On::Output, columns, true);
        let lines = screen(&written, 1000);
        let names: BTreeSet<&str> = lines.iter().map(|line| line.split_at(22).0).collect();
        assert!(
            lines[1..].iter().all(|line| line.contains(start)),
            "{lines:#?}"
        );
        assert_eq!(
            names.len(),
            4,
            "a name cannot be told from another: {lines:#?}"
        );
    }
}

#[test]
fn long_messages_are_broken_between_words() {
    let folder = folder();
    let written = typed(
        folder.path(),
        &["render", "gone.bag", "--colour"],
        On::Errors,
        60,
        false,
    );
    let wide = typed(
        folder.path(),
        &["render", "gone.bag", "--colour"],
        On::Errors,
        500,
        false,
    );
    assert!(
        screen(&written, 1000)
            .iter()
            .all(|line| line.chars().count() <= 60),
        "{written}"
    );
    assert_eq!(
        written.split_whitespace().collect::<Vec<_>>(),
        wide.split_whitespace().collect::<Vec<_>>()
    );
    let args = [
        "render", COURIER, "-o", "x.svg", "--mode", "all", "--hide", "services",
    ];
    let written = typed(folder.path(), &args, On::Errors, 50, false);
    let lines = screen(&written, 1000);
    assert!(
        lines.iter().any(|line| line.starts_with("      ")),
        "{lines:#?}"
    );
    assert!(
        lines.iter().all(|line| line.chars().count() <= 50),
        "{lines:#?}"
    );
    let args = ["render", "a.bag", "--offset", "courier.mcap=x"];
    let written = typed(folder.path(), &args, On::Errors, 60, true);
    let lines = screen(&written, 1000);
    assert!(
        lines.iter().all(|line| line.chars().count() <= 60),
        "{lines:#?}"
    );
}

#[test]
fn colours_follow_one_rule() {
    let folder = folder();
    let has_colour = |line: &str, color: &str, term: &str, no_color: Option<&str>| {
        let mut args = words(line);
        args.extend(color.split_whitespace());
        let written = written_by(folder.path(), &args, On::Both, 80, |command| {
            command.env("TERM", term).env_remove("NO_COLOR");
            command.env("CLICOLOR_FORCE", "1");
            command.envs(no_color.map(|value| ("NO_COLOR", value)));
        });
        written.contains("\u{1b}[1m")
            || written.contains("\u{1b}[3")
            || written.contains("\u{1b}[1;3")
    };
    for line in [
        "--help",
        "render --help",
        "render --nosuch",
        "events C",
        "follow C",
        "info gone.bag",
    ] {
        for (color, term, no_color, is_coloured) in [
            ("", "xterm", None, true),
            ("", "xterm", Some(""), true),
            ("", "xterm", Some("1"), false),
            ("", "dumb", None, false),
            ("--color always", "dumb", Some("1"), true),
            ("--color=always", "xterm", Some("1"), true),
            ("--color never", "xterm", None, false),
        ] {
            assert_eq!(
                has_colour(line, color, term, no_color),
                is_coloured,
                "{line} {color} TERM={term} NO_COLOR={no_color:?}"
            );
        }
    }
}

#[test]
fn long_events_have_a_hanging_indent() {
    let folder = folder();
    let written = typed(folder.path(), &["events", WAREHOUSE], On::Output, 60, true);
    let lines = screen(&written, 1000);
    let hanging = lines
        .iter()
        .filter(|line| line.starts_with("               "));
    assert!(hanging.count() > 10, "{}", lines.join("\n"));
}

#[test]
fn events_are_sorted_by_their_printed_time() {
    let folder = folder();
    let written = typed(folder.path(), &["events", WAREHOUSE], On::Output, 500, true);
    // After the sentence about the mission.
    let shown = screen(&written, 1000).into_iter().skip(1).map(|line| {
        let time = line.trim_start_matches([' ', '~']);
        let time: String = time.chars().take(5).collect();
        time
    });
    let shown: Vec<String> = shown.collect();
    assert!(shown.len() > 30 && shown.is_sorted(), "{shown:?}");
}

#[test]
fn events_are_coloured_by_kind_unless_disabled() {
    let folder = folder();
    let run = |args: &[&str], colour| typed(folder.path(), args, On::Output, 80, colour);
    let coloured = run(&["events", WAREHOUSE], true);
    for colour in [
        "\u{1b}[32m",
        "\u{1b}[31m",
        "\u{1b}[33m",
        "\u{1b}[35m",
        "\u{1b}[36m",
    ] {
        assert!(coloured.contains(colour), "no {colour:?}");
    }
    assert!(
        !run(&["events", WAREHOUSE], false).contains("\u{1b}[3"),
        "NO_COLOR"
    );
    assert!(!run(&["events", WAREHOUSE, "--color", "never"], true).contains("\u{1b}[3"));
    assert!(run(&["events", WAREHOUSE, "--color", "always"], false).contains("\u{1b}[32m"));
    let piped = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .args(args)
            .output()
            .unwrap();
        String::from_utf8(run.stdout).unwrap()
    };
    let plain = piped(&["events", WAREHOUSE]);
    assert!(!plain.contains('\u{1b}'));
    assert!(piped(&["events", WAREHOUSE, "--color", "always"]).contains("\u{1b}[32m"));
    let wide = run(&["events", WAREHOUSE], true);
    assert_eq!(
        screen(&plain.replace('\n', "\r\n"), 1000)
            .join(" ")
            .split_whitespace()
            .collect::<Vec<_>>(),
        screen(&wide, 1000)
            .join(" ")
            .split_whitespace()
            .collect::<Vec<_>>(),
        "colours and breaks change no word"
    );
}

/// A sink that records the reported progress: bytes done, bytes in total.
struct Progress(Vec<(u64, u64)>);

impl Sink for Progress {
    fn connection(&mut self, _: &Connection) -> Want {
        Want::Stamps
    }

    fn stamps(&mut self, _: ConnectionId, _: &[Stamp], _: Option<&[u32]>) {}

    fn message(&mut self, _: Message<'_>) {}

    fn notice(&mut self, _: Notice) {}

    fn progress(&mut self, done: u64, total: u64) {
        self.0.push((done, total));
    }
}

#[test]
fn progress_counts_the_bytes_of_the_files() {
    for bag in ["warehouse.bag", "courier.mcap", "courier"] {
        let path = Path::new(EXAMPLES).join(bag);
        let input = Input::Path(path.clone());
        let storage = if path.is_dir() {
            path.join("courier_0.db3")
        } else {
            path
        };
        let bytes = fs::metadata(storage).unwrap().len();
        let mut seen = Progress(Vec::new());
        let mut reader = bag::open(&input, &OpenOptions::default()).unwrap();
        reader.read(None, &mut seen).unwrap();
        assert!(seen.0.is_sorted(), "{bag}: {:?}", seen.0);
        assert!(
            seen.0.iter().all(|(_, total)| *total == bytes),
            "{bag}: {:?}",
            seen.0
        );
        assert_eq!(seen.0.last(), Some(&(bytes, bytes)), "{bag}");
    }
}

#[test]
fn routine_notes_are_one_line_unless_verbose() {
    let folder = folder();
    let notes = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(folder.path())
            .args(["render", WAREHOUSE, "--period", "all", "-o", "x.svg"])
            .args(args)
            .output()
            .unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        said.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let said = notes(&[]);
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(
        said[0].contains("left out") && said[0].contains("`-v`"),
        "{said:?}"
    );
    assert!(said[1].starts_with("wrote x.svg: "), "{said:?}");
    let all = notes(&["-v"]);
    assert!(
        all.len() > 2 && all.iter().any(|line| line.contains("--hide none")),
        "{all:?}"
    );
    assert_eq!(notes(&["-q"]), [""; 0]);
}

#[test]
fn names_without_a_match_are_reported_with_the_nearest() {
    let folder = folder();
    for (option, value, says) in [
        ("--collapse", "/robt1", "`/robot1`"),
        ("--topic-filter", "/robot1/.*,/scam", "matches no topic; "),
        ("--ns-filter", "/.*,-/map_servr", "`/map_server`"),
        (
            "--collapse",
            "-/robot11",
            "`--collapse -/robot11` matches no name",
        ),
    ] {
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(folder.path())
            .args([
                "render", WAREHOUSE, "--period", "all", "-o", "x.dot", option, value,
            ])
            .output()
            .unwrap();
        let said = String::from_utf8(run.stderr).unwrap();
        assert!(said.contains(says), "{option} {value}: {said}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let page = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .arg("man")
            .args(args)
            .output()
            .unwrap();
        (
            run.status.code(),
            String::from_utf8(run.stdout).unwrap(),
            String::from_utf8(run.stderr).unwrap(),
        )
    };
    for command in [
        "render", "figure", "info", "extract", "tables", "events", "diff", "baseline", "check",
        "styles",
    ] {
        let (code, text, _) = page(&[command]);
        assert_eq!(code, Some(0));
        assert!(
            text.contains(".SH OPTIONS") || command == "styles",
            "{command}: {text}"
        );
        assert!(
            text.contains(&format!("bagreel\\-{command}")),
            "{command}: {text}"
        );
    }
    assert!(page(&[]).1.contains("bagreel"));
    let (code, _, said) = page(&["rendr"]);
    assert_eq!(code, Some(2));
    assert!(said.contains("the nearest is `render`"), "{said}");
}

#[test]
fn every_command_is_silent_on_a_closed_pipe() {
    let folder = folder();
    for line in [
        "info W",
        "events W",
        "extract C -o - --format csv",
        "styles light",
        "completions bash",
        "man",
        "diff W C",
        "baseline W",
        "render W -o - --format json",
        "--help",
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(folder.path())
            .args(words(line))
            .arg("-q")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let done = child.wait_with_output().unwrap();
        assert_eq!(String::from_utf8(done.stderr).unwrap(), "", "{line}");
    }
}
