//! Tests for Unix processes: signals at any stage, stalled pipes, verbose child processes.

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{COURIER, command, errors, names};

/// The time limit for an exit: half a second, plus the delay of a loaded machine.
const SOON: Duration = Duration::from_secs(15);

fn signal(child: &Child, name: &str) {
    let done = Command::new("kill")
        .args([format!("-{name}"), child.id().to_string()])
        .status();
    assert!(done.unwrap().success());
}

/// Waits for a process that was signalled to stop; returns its exit code.
#[track_caller]
fn ended(mut child: Child) -> Option<i32> {
    let since = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if since.elapsed() > SOON {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("still there after {SOON:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A command that waits forever.
fn stalled(folder: &Path, args: &[&str]) -> Child {
    let child = command(folder, args)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    await_handlers(&child);
    std::thread::sleep(Duration::from_millis(300));
    child
}

/// Waits until the process handles signals, if the system reports it: a loaded machine may be slow.
fn await_handlers(child: &Child) {
    let is_caught = || {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:"))?;
        // One bit per signal, the lowest for signal 1; SIGTERM is 15.
        Some(u64::from_str_radix(mask.trim(), 16).ok()? >> 14 & 1 == 1)
    };
    let since = Instant::now();
    while is_caught() == Some(false) && since.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Whether the process inherited an ignored SIGHUP.
fn ignores_hangups(child: &Child) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    mask.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & 1 == 1))
}

#[test]
fn every_signal_ends_waiting_with_its_exit_code() {
    let dir = tempfile::tempdir().unwrap();
    fifo(&dir.path().join("pipe.bag"));
    fifo(&dir.path().join("pipe.toml"));
    fifo(&dir.path().join("pipe.yaml"));
    fifo(&dir.path().join("pipe.json"));
    let before = names(dir.path());
    let stalls: &[(&[&str], &str, i32)] = &[
        (&["info", "-"], "INT", 130),
        (&["info", "pipe.bag"], "TERM", 143),
        (
            &["render", COURIER, "--style", "pipe.toml", "-o", "x.gif"],
            "HUP",
            129,
        ),
        (&["events", COURIER, "--topology", "pipe.yaml"], "INT", 130),
        (&["render", COURIER, "-o", "pipe.json"], "TERM", 143),
    ];
    for (args, name, code) in stalls {
        let child = stalled(dir.path(), args);
        if *name == "HUP" && ignores_hangups(&child) {
            println!("skipped: a hang-up, since these tests run under `nohup`");
            signal(&child, "TERM");
            assert_eq!(ended(child), Some(143), "{args:?}");
            continue;
        }
        signal(&child, name);
        assert_eq!(ended(child), Some(*code), "{args:?}");
    }
    assert_eq!(names(dir.path()), before);
}

#[test]
fn a_second_signal_ends_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let child = stalled(dir.path(), &["info", "-"]);
    let since = Instant::now();
    signal(&child, "INT");
    signal(&child, "INT");
    assert_eq!(ended(child), Some(130));
    assert!(since.elapsed() < Duration::from_secs(1));
}

#[test]
fn a_signal_while_writing_leaves_no_files() {
    let dir = tempfile::tempdir().unwrap();
    let warehouse = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/warehouse.bag");
    let args = [
        "render",
        warehouse,
        // Enough frames for several seconds on a fast machine.
        "-p",
        "0.2",
        "--frame-ms",
        "50",
        "-o",
        "x.gif",
        "-o",
        "x.json",
        "-o",
        "x.html",
        "-o",
        "x.csv",
    ];
    let child = stalled(dir.path(), &args);
    std::thread::sleep(Duration::from_millis(700));
    signal(&child, "TERM");
    let mut child = child;
    let mut said = String::new();
    let mut pipe = child.stderr.take().unwrap();
    assert_eq!(ended(child), Some(143));
    pipe.read_to_string(&mut said).unwrap();
    assert!(said.contains("interrupted"), "{said}");
    assert_eq!(names(dir.path()), [""; 0]);
}

#[test]
fn ignored_signals_stay_ignored() {
    let dir = tempfile::tempdir().unwrap();
    if Command::new("nohup").arg("true").status().is_err() {
        println!("skipped: there is no nohup");
        return;
    }
    let mut child = Command::new("nohup")
        .arg(env!("CARGO_BIN_EXE_bagreel"))
        .args(["info", "-"])
        .current_dir(dir.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    await_handlers(&child);
    signal(&child, "HUP");
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&fs::read(COURIER).unwrap()).unwrap();
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("messages")
    );
}

/// A mission of a minute has cells of a second: elements that exist throughout must not take memory in each.
#[cfg(target_os = "linux")]
#[test]
fn a_hundred_thousand_nodes_fit_into_memory() {
    let dir = tempfile::tempdir().unwrap();
    let node = |k: usize| format!("<node pkg=\"p\" type=\"t\" name=\"n{k:05}\"/>\n");
    let nodes: String = (0..90_000).map(node).collect();
    let launch = format!("<launch>\n{nodes}</launch>\n");
    fs::write(dir.path().join("many.launch"), launch).unwrap();
    let bagreel = env!("CARGO_BIN_EXE_bagreel");
    let limited = format!("ulimit -v 450000; exec {bagreel} info {COURIER} --topology many.launch");
    let run = Command::new("sh")
        .args(["-c", &limited])
        .current_dir(dir.path())
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", errors(&run));
}
