//! Recorders: every way of writing a recording, step by step with random cuts.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};

use rusqlite::{Connection, params};

use crate::support::mission::mission;
use crate::support::rosbag1::{self, Pack};
use crate::support::{Recording, mcap, small, sqlite3};

/// Numbers that look random and are the same on every run.
pub(super) struct Chance(pub(super) u64);

impl Chance {
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        usize::try_from((self.0 >> 33) % n as u64).unwrap()
    }

    /// Sorted positions in `0..=len`, the last `len` itself.
    fn cuts(&mut self, len: usize) -> Vec<usize> {
        let count = 3 + self.below(12);
        let mut cuts: Vec<usize> = (0..count).map(|_| self.below(len)).collect();
        cuts.extend([40.min(len), len]);
        cuts.sort_unstable();
        cuts
    }
}

/// Called between two writes; `None` kills the recorder.
pub(super) type Step<'a> = &'a mut dyn FnMut(&mut Chance) -> Option<()>;

/// A kind of recorder: writes a recording into a folder step by step. Returns the closed recording; `None` if
/// the recorder was killed.
pub(super) type Recorder = fn(&Path, &mut Chance, Step<'_>) -> Option<PathBuf>;

/// Each kind of recorder: a name, the followed path, and the recorder.
pub(super) const RECORDERS: &[(&str, &str, Recorder)] = &[
    ("bag", "r.bag.active", |folder, chance, step| {
        rosbag(Pack::None, folder, chance, step)
    }),
    ("bag, lz4", "r.bag.active", |folder, chance, step| {
        rosbag(Pack::Lz4, folder, chance, step)
    }),
    ("mcap", "r.mcap", |folder, chance, step| {
        let bytes = mcap::write(&mission(), &options(true));
        append(&folder.join("r.mcap"), &bytes, chance, step)
    }),
    ("mcap without chunks", "r.mcap", |folder, chance, step| {
        let bytes = mcap::write(&mission(), &options(false));
        append(&folder.join("r.mcap"), &bytes, chance, step)
    }),
    ("folder of mcap", "r", |folder, chance, step| {
        let folder = made(folder);
        for (at, part) in halves().iter().enumerate() {
            let path = folder.join(format!("r_{at}.mcap"));
            append(&path, &mcap::write(part, &options(true)), chance, step)?;
        }
        Some(closed(folder, ["r_0.mcap", "r_1.mcap"], "mcap"))
    }),
    ("db3", "r.db3", |folder, chance, step| {
        database(&mission(), &folder.join("r.db3"), OPTIMISED, chance, step)
    }),
    ("db3 with a log", "r.db3", |folder, chance, step| {
        database(&mission(), &folder.join("r.db3"), RESILIENT, chance, step)
    }),
    ("folder of db3", "r", |folder, chance, step| {
        let folder = made(folder);
        for (at, part) in halves().iter().enumerate() {
            let path = folder.join(format!("r_{at}.db3"));
            database(part, &path, OPTIMISED, chance, step)?;
        }
        Some(closed(folder, ["r_0.db3", "r_1.db3"], "sqlite3"))
    }),
];

/// The examples, which are longer than the recorders' output.
pub(super) const EXAMPLES: &[(&str, &str, Recorder)] = &[
    ("courier", "courier.mcap", |folder, chance, step| {
        example("courier.mcap", folder, chance, step)
    }),
    ("warehouse", "warehouse.bag", |folder, chance, step| {
        example("warehouse.bag", folder, chance, step)
    }),
];

/// How rosbag2 opens a database, by default and with `--storage-preset-profile resilient`.
pub(super) const OPTIMISED: &str = "PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF;";
pub(super) const RESILIENT: &str = "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;";

pub(super) fn options(chunked: bool) -> mcap::Options {
    mcap::Options {
        profile: "ros2",
        chunked,
        ..mcap::Options::default()
    }
}

pub(super) fn made(folder: &Path) -> PathBuf {
    let folder = folder.join("r");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The metadata that rosbag2 writes when it closes a recording.
fn closed(folder: PathBuf, files: [&str; 2], storage: &str) -> PathBuf {
    sqlite3::write_metadata(&mission(), &folder, storage, &files);
    folder
}

/// The two files of a recording that was split.
fn halves() -> [Recording; 2] {
    let whole = mission();
    let middle = whole.messages.len() / 2;
    let part = |messages: &[(usize, i64, Vec<u8>)]| Recording {
        messages: messages.to_vec(),
        ..whole.clone()
    };
    [
        part(&whole.messages[..middle]),
        part(&whole.messages[middle..]),
    ]
}

fn append(path: &Path, bytes: &[u8], chance: &mut Chance, step: Step<'_>) -> Option<PathBuf> {
    let mut file = File::create(path).unwrap();
    let mut at = 0;
    for cut in chance.cuts(bytes.len()) {
        file.write_all(&bytes[at..cut]).unwrap();
        at = cut;
        step(chance)?;
    }
    Some(path.to_owned())
}

fn example(name: &str, folder: &Path, chance: &mut Chance, step: Step<'_>) -> Option<PathBuf> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let bytes = fs::read(examples.join(name)).unwrap();
    append(&folder.join(name), &bytes, chance, step)
}

/// Writes as `rosbag record` does: a head without an index, each chunk's lengths when it is closed, the new name last.
fn rosbag(how: Pack, folder: &Path, chance: &mut Chance, step: Step<'_>) -> Option<PathBuf> {
    let bytes = rosbag1::write(&small(), how, 20_000);
    let path = folder.join("r.bag.active");
    let mut file = OpenOptions::new()
        .create(true)
        .write(true)
        .truncate(true)
        .open(&path)
        .unwrap();
    for cut in chance.cuts(bytes.len()) {
        let now = if cut < bytes.len() {
            active(&bytes, cut)
        } else {
            bytes.clone()
        };
        file.rewind().unwrap();
        file.write_all(&now).unwrap();
        step(chance)?;
    }
    let closed = folder.join("r.bag");
    fs::rename(path, &closed).unwrap();
    Some(closed)
}

/// The first `cut` bytes of a bag while it is recorded.
pub(super) fn active(bytes: &[u8], cut: usize) -> Vec<u8> {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let mut now = bytes.to_vec();
    let index = bytes.windows(10).position(|w| w == b"index_pos=").unwrap() + 10;
    now[index..index + 8].fill(0);
    let mut at = 13;
    while at < cut {
        let header = at + 4..at + 4 + number(at);
        let body = header.end + 4;
        let end = body + number(header.end);
        let is_chunk = bytes[header.clone()].windows(4).any(|w| w == b"op=\x05");
        if is_chunk && cut < end {
            let size = bytes[header.clone()]
                .windows(5)
                .position(|w| w == b"size=")
                .unwrap();
            let size = header.start + size + 5;
            now[size..size + 4].fill(0);
            now[header.end..body].fill(0);
        }
        at = end;
    }
    now.truncate(cut);
    now
}

/// Writes as rosbag2 does: messages in transactions of any size.
fn database(
    recording: &Recording,
    path: &Path,
    pragmas: &str,
    chance: &mut Chance,
    step: Step<'_>,
) -> Option<PathBuf> {
    let empty = Recording {
        messages: Vec::new(),
        ..recording.clone()
    };
    sqlite3::write(&empty, path);
    let mut db = Connection::open(path).unwrap();
    db.execute_batch(pragmas).unwrap();
    let mut topics = BTreeMap::new();
    for publisher in &recording.publishers {
        let next = i64::try_from(topics.len()).unwrap() + 1;
        topics
            .entry((&publisher.topic, &publisher.type_name))
            .or_insert(next);
    }
    let mut at = 0;
    for cut in chance.cuts(recording.messages.len()) {
        let all = db.transaction().unwrap();
        for (publisher, time, payload) in &recording.messages[at..cut] {
            let publisher = &recording.publishers[*publisher];
            let row = params![
                topics[&(&publisher.topic, &publisher.type_name)],
                time,
                payload
            ];
            all.execute("INSERT INTO messages VALUES (NULL, ?1, ?2, ?3)", row)
                .unwrap();
        }
        all.commit().expect("the database is not locked");
        at = cut;
        if step(chance).is_none() {
            killed(db, path);
            return None;
        }
    }
    db.close().unwrap();
    Some(path.to_owned())
}

/// Leaves a database as a killed recorder does: the last rows are still in its log.
fn killed(db: Connection, path: &Path) {
    let files = [path.to_owned(), path.with_extension("db3-wal")];
    let kept = files.map(|file| fs::read(&file).map(|bytes| (file, bytes)));
    db.close().unwrap();
    for (file, bytes) in kept.into_iter().flatten() {
        fs::write(file, bytes).unwrap();
    }
}
