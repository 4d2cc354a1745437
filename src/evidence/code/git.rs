//! The code as of the recording, from git: the only place that runs a program.
//!
//! Code changes between a recording and its analysis; the code as of the recording yields two thirds more
//! edges. The git program reads the objects, since it supports packs, alternates and all object formats. The
//! commands for the commit, its files and their bytes run no hook, filter, pager or file-system monitor,
//! prompt for nothing and fetch nothing. They inherit the environment, without variables that would point to
//! another repository.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use super::Version;
use super::files::{FileKind, Files, LONGEST, MOST_FILES, kind};
use super::git_link;
use crate::base::error::{Error, Result};
use crate::base::time::Stamp;

/// The result of querying git for a folder.
pub(super) enum Checkout {
    /// The files of a commit, with its description.
    Commit { files: Files, words: String },
    /// The working tree is to be read, with a note about that, if any.
    Lying { note: Option<String> },
}

/// Commits up to this many seconds after a recording count too: recorders often change first and commit afterwards.
const DAY: i64 = 86_400;

/// The files of the wanted version; `end` is the recording's end.
///
/// # Errors
/// If a requested commit does not exist.
pub(super) fn files(folder: &Path, version: &Version, end: Stamp) -> Result<Checkout> {
    if *version == Version::Worktree {
        return Ok(Checkout::Lying { note: None });
    }
    let lying = |why: &str| {
        let note = Some(format!(
            "the code was read from the working tree, since {why}"
        ));
        Ok(Checkout::Lying { note })
    };
    if !git_link::is_plain(folder) {
        return lying("there are pipes or devices in its repository");
    }
    let prefix = match (prefix(folder), version) {
        (Ok(prefix), _) => prefix,
        (Err(reason), Version::Commit(name)) => return Err(unknown(folder, name, &reason)),
        (Err(reason), _) if reason.contains("not a git repository") => {
            return lying(&format!(
                "it is not in a git repository; it may have changed since {}",
                day(end)
            ));
        }
        (Err(reason), _) => return lying(&format!("git refuses: {reason}")),
    };
    let commit = commit(folder, version, end)?;
    if commit.is_empty() {
        return lying("git has no commit before the recording's end");
    }
    let reason = match of_commit(folder, &commit, &prefix) {
        Some(files) if !files.list.is_empty() => {
            return Ok(Checkout::Commit {
                files,
                words: words(folder, &commit, version),
            });
        }
        Some(_) => "has no source code of this folder in",
        None => "does not have all files of",
    };
    lying(&format!("git {reason} commit {}", short(&commit)))
}

/// The wanted commit; empty if there is none before the recording's end.
fn commit(folder: &Path, version: &Version, end: Stamp) -> Result<String> {
    if let Version::Commit(name) = version {
        let wanted = format!("{name}^{{commit}}");
        let found = ask(
            folder,
            &["rev-parse", "--verify", "--end-of-options", &wanted],
        );
        return found.map_err(|reason| unknown(folder, name, &reason));
    }
    let seconds = end.0.div_euclid(1_000_000_000).saturating_add(DAY);
    let before = format!("--before=@{seconds}");
    let found = ask(folder, &["rev-list", "--max-count=1", &before, "HEAD"]);
    Ok(found.unwrap_or_default())
}

/// The day of a time, such as `2025-12-03`.
fn day(time: Stamp) -> String {
    time.to_string().chars().take(10).collect()
}

/// The path of the folder in its repository, which ends in a slash or is empty; else the reason why git is not used, or
/// its first error.
fn prefix(folder: &Path) -> std::result::Result<String, String> {
    let setting = |file: &Path, name: &str| {
        let file = file.to_str()?;
        ask(folder, &["config", "--file", file, "--get", name]).ok()
    };
    if !git_link::is_own(folder, setting) {
        return Err(
            "its `.git` refers to a repository that does not refer back to this folder".to_owned(),
        );
    }
    ask(folder, &["rev-parse", "--show-prefix"])
}

/// `code of 2025-12-03 (8e54c1a), the last commit before the recording's end`
fn words(folder: &Path, commit: &str, version: &Version) -> String {
    let stated = ask(
        folder,
        &["rev-list", "--max-count=1", "--timestamp", commit],
    )
    .unwrap_or_default();
    let seconds: i64 = stated
        .split(' ')
        .next()
        .and_then(|t| t.parse().ok())
        .unwrap_or(0);
    let day = day(Stamp(seconds.saturating_mul(1_000_000_000)));
    let which = match version {
        Version::Recording => ", the last commit before the recording's end",
        _ => "",
    };
    format!("code of {day} ({}){which}", short(commit))
}

fn short(commit: &str) -> &str {
    commit.get(..7).unwrap_or(commit)
}

fn unknown(folder: &Path, name: &str, reason: &str) -> Error {
    Error::usage(
        format!(
            "git has no commit `{name}` in `{}`: {reason}",
            folder.display()
        ),
        "give a commit, branch or tag, or `worktree` for the files in the working tree",
    )
}

/// A git command that changes nothing and prompts for nothing.
fn git(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new("git");
    command.arg("-C").arg(folder);
    for setting in [
        "core.fsmonitor=false",
        "core.hooksPath=/dev/null",
        "core.untrackedCache=false",
        "log.showSignature=false",
    ] {
        command.args(["-c", setting]);
    }
    command
        .args(["--no-pager", "--no-optional-locks", "--no-replace-objects"])
        .args(words);
    for (name, value) in [
        ("GIT_NO_LAZY_FETCH", "1"),
        ("GIT_TERMINAL_PROMPT", "0"),
        ("GIT_ALLOW_PROTOCOL", "none"),
        ("LC_ALL", "C"),
    ] {
        command.env(name, value);
    }
    for name in [
        "GIT_DIR",
        "GIT_WORK_TREE",
        "GIT_INDEX_FILE",
        "GIT_OBJECT_DIRECTORY",
        "GIT_ALTERNATE_OBJECT_DIRECTORIES",
        "GIT_NAMESPACE",
    ] {
        command.env_remove(name);
    }
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The most bytes of an answer: the paths of half a million files.
const LONGEST_ANSWER: u64 = 64 << 20;

/// The output of a git command without the final newline; else its first error.
fn ask(folder: &Path, words: &[&str]) -> std::result::Result<String, String> {
    let answer = git(folder, words)
        .output()
        .map_err(|e| format!("git does not start: {e}"))?;
    if answer.status.success() {
        return Ok(String::from_utf8_lossy(&answer.stdout)
            .trim_end_matches('\n')
            .to_owned());
    }
    let complaint = String::from_utf8_lossy(&answer.stderr);
    let first = complaint.lines().next().unwrap_or("it fails");
    Err(first.trim_start_matches("fatal: ").to_owned())
}

/// The files of a commit below `prefix` (which ends in a slash or is empty).
fn of_commit(folder: &Path, commit: &str, prefix: &str) -> Option<Files> {
    let tree = format!("{commit}:{prefix}");
    let mut listing = git(folder, &["ls-tree", "-r", "-z", "-l", "--full-tree", &tree])
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let mut list = Vec::new();
    let read = listing
        .stdout
        .take()?
        .take(LONGEST_ANSWER)
        .read_to_end(&mut list);
    // A listing that is too long is cut; git ends when the pipe is closed.
    let is_cut = list.len() as u64 >= LONGEST_ANSWER;
    let done = listing.wait().ok()?;
    if read.is_err() || !done.success() && !is_cut {
        return None;
    }
    let entries: Vec<GitEntry> = list.split(|b| *b == 0).filter_map(entry).collect();
    if entries.iter().any(|entry| entry.size.is_none()) {
        return None;
    }
    let (small, long): (Vec<_>, Vec<_>) =
        entries.into_iter().partition(|e| e.size <= Some(LONGEST));
    let mut wanted: Vec<(String, String)> = small.into_iter().map(|e| (e.path, e.id)).collect();
    let is_cut = is_cut || wanted.len() > MOST_FILES;
    wanted.truncate(MOST_FILES);
    let mut files = bytes(folder, wanted)?;
    files.is_cut |= is_cut;
    files.too_long = long.len();
    Some(files)
}

/// A relevant file in a commit.
struct GitEntry {
    path: String,
    /// The object with its bytes.
    id: String,
    /// In bytes; `None` if the object is missing, as in a partial clone: nothing is fetched.
    size: Option<u64>,
}

/// A relevant file in a line of a listing: `100644 blob <id> <size>\t<path>`.
fn entry(line: &[u8]) -> Option<GitEntry> {
    let line = std::str::from_utf8(line).ok()?;
    let (about, path) = line.split_once('\t')?;
    let about: Vec<&str> = about.split_whitespace().collect();
    let [mode, "blob", id, size] = about[..] else {
        return None;
    };
    // A script without an extension must be executable.
    let kind = kind(path).filter(|kind| *kind != FileKind::Script || mode == "100755");
    (mode.starts_with("100") && kind.is_some()).then(|| GitEntry {
        path: path.to_owned(),
        id: id.to_owned(),
        size: size.parse().ok(),
    })
}

/// The bytes of objects, under their paths.
fn bytes(folder: &Path, wanted: Vec<(String, String)>) -> Option<Files> {
    let mut command = git(folder, &["cat-file", "--batch", "--buffer"]);
    let mut running = command
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let mut input = running.stdin.take()?;
    let mut output = BufReader::new(running.stdout.take()?);
    let ids: String = wanted
        .iter()
        .flat_map(|(_, id)| [id.as_str(), "\n"])
        .collect();
    let files = std::thread::scope(|scope| {
        // Both pipes can fill up, so requests are written while answers are read.
        scope.spawn(move || input.write_all(ids.as_bytes()));
        let mut files = Files::default();
        for (path, _) in wanted {
            match object(&mut output) {
                Some(bytes) => files.add(path, &bytes),
                None => break,
            }
        }
        drop(output);
        files
    });
    running.wait().ok()?;
    Some(files)
}

/// The next answer: `<id> blob <size>`, a new line, the bytes, a new line.
fn object(output: &mut impl std::io::BufRead) -> Option<Vec<u8>> {
    let mut head = String::new();
    output.take(1000).read_line(&mut head).ok()?;
    let size: u64 = head.trim_end().rsplit(' ').next()?.parse().ok()?;
    let mut bytes = Vec::new();
    output
        .take(size.min(LONGEST) + 1)
        .read_to_end(&mut bytes)
        .ok()?;
    let is_whole = bytes.len() as u64 == size + 1;
    bytes.pop();
    is_whole.then_some(bytes)
}
