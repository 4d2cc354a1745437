//! Counts the messages of many bags, several at a time: a table per recording.

mod count;

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::{fs, thread};

use super::survey::{alone, recordings};
use super::{Stage, Watch};
use crate::bag::{Recording, written};
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::export::check::make_folder;
use crate::export::sink::write_file;
use crate::export::tables::{self, TableFormat};
use crate::export::target::{Target, resolved};
pub use count::{Counted, Counting, count};

/// The whole job of `bagreel tables`.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Tables {
    /// Bags, and folders with bags below them.
    pub sources: Vec<PathBuf>,
    /// The folder for the tables, in which they have the names of the recordings.
    pub folder: PathBuf,
    /// The format of the tables.
    pub format: TableFormat,
    /// The windows.
    pub counting: Counting,
    /// Whether to skip recordings whose table is newer, whatever options it was made with.
    pub skip_existing: bool,
}

impl Tables {
    /// A job that counts these bags into that folder, with the command line's defaults.
    pub fn new(sources: Vec<PathBuf>, folder: PathBuf) -> Self {
        Self {
            sources,
            folder,
            ..Self::default()
        }
    }
}

/// The outcome of `bagreel tables`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Tabled {
    /// The number of tables written, one per recording.
    pub files: usize,
    /// The number of recordings that were skipped because their tables are newer.
    pub kept: usize,
    /// The number of recordings that could not be read; they have no table.
    pub unreadable: usize,
    /// The number of recordings with losses.
    pub damaged: usize,
    /// The number of messages counted.
    pub messages: u64,
    /// The notices for the user, with the names of the recordings.
    pub notices: Notices,
}

/// Counts every recording and writes its table, whole or not at all.
///
/// # Errors
/// If nothing can be listed or written.
pub fn tables(job: &Tables, watch: &mut dyn Watch) -> Result<Tabled> {
    watch.stage(Stage::Count);
    let bags = listed(job)?;
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let (next, is_stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (to, from) = channel();
    thread::scope(|scope| {
        for _ in 0..cores.min(bags.len()) {
            let (bags, next, is_stopped, to) = (&bags, &next, &is_stopped, to.clone());
            scope.spawn(move || {
                while !is_stopped.load(Ordering::Relaxed)
                    && let Some(bag) = bags.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    // The receiver outlives this thread.
                    let _ = to.send(bag.tabled(job));
                }
            });
        }
        drop(to);
        let (mut done, mut outcome) = (Tabled::default(), Ok(()));
        for (at, one) in (1..).zip(from) {
            watch.progress(at, bags.len() as u64);
            outcome = outcome.and(one.map(|one| done.add(&one)));
            if watch.stopped() {
                outcome = Err(Error::Interrupted);
            }
            is_stopped.fetch_or(outcome.is_err(), Ordering::Relaxed);
        }
        outcome.map(|()| done)
    })
}

impl Tabled {
    fn add(&mut self, other: &Self) {
        self.files += other.files;
        self.kept += other.kept;
        self.unreadable += other.unreadable;
        self.damaged += other.damaged;
        self.messages += other.messages;
        self.notices.extend(other.notices.iter());
    }
}

/// A recording, and the file for its table.
struct Listed {
    name: String,
    recording: Recording,
    file: PathBuf,
}

/// Every recording of the job, once.
///
/// # Errors
/// If a folder cannot be listed or has no bags, or if a table would replace another one or a bag.
fn listed(job: &Tables) -> Result<Vec<Listed>> {
    let mut all = Vec::new();
    for source in &job.sources {
        // `.` has no name.
        let source = &match source.file_name() {
            Some(_) => source.clone(),
            None => source.canonicalize().map_err(Error::io("read", source))?,
        };
        let own = Recording::of(source.clone());
        let found = if source.is_dir() {
            recordings(source)?
        } else {
            vec![own.clone()]
        };
        for recording in found {
            let is_own = recording == own;
            let folder = source.parent().filter(|_| is_own).unwrap_or(source);
            all.push(Listed::new(folder, recording, job));
        }
    }
    all.sort_by(|a, b| (&a.file, &a.recording).cmp(&(&b.file, &b.recording)));
    all.dedup_by(|a, b| a.recording == b.recording);
    if let Some(pair) = all.windows(2).find(|pair| pair[0].file == pair[1].file) {
        let [one, other] = [&pair[0], &pair[1]].map(|bag| bag.recording.name_in(Path::new("")));
        let file = pair[0].file.display();
        return Err(Error::usage(
            format!("`{one}` and `{other}` would both be counted in `{file}`"),
            "give the folder that contains both of them",
        ));
    }
    let read = all.iter().flat_map(|bag| bag.recording.paths());
    let read: BTreeSet<PathBuf> = read.map(|path| resolved(path)).collect();
    let is_read = |bag: &&Listed| read.contains(&resolved(&bag.file));
    match all.iter().find(is_read) {
        None => Ok(all),
        Some(bag) => {
            let file = bag.file.display();
            let what = format!("a table would overwrite `{file}`, which is read");
            Err(Error::usage(what, "give another folder"))
        }
    }
}

impl Listed {
    /// A recording in `folder`; the table of `day1/run.bag` there is `day1/run.bag.csv`.
    fn new(folder: &Path, recording: Recording, job: &Tables) -> Self {
        let first = recording.paths().first().map_or(folder, PathBuf::as_path);
        let below = first.strip_prefix(folder).unwrap_or(first);
        Self {
            name: recording.name_in(folder),
            file: with_suffix(&job.folder.join(below), &format!(".{}", job.format.word())),
            recording,
        }
    }

    /// Counts the recording and writes its table.
    fn tabled(&self, job: &Tables) -> Result<Tabled> {
        let mut done = Tabled::default();
        if job.skip_existing && self.is_tabled() {
            done.kept = 1;
            return Ok(done);
        }
        let inputs = self.recording.inputs();
        match alone(&self.name, || count(&self.name, &inputs, &job.counting)) {
            Err(error) => {
                done.unreadable = 1;
                done.notices
                    .add(Notice::new(NoticeKind::Damaged, error.to_string()));
            }
            Ok(counted) => {
                let target = Target::Path(self.file.clone());
                make_folder(&target)?;
                write_file(&target, &tables::whole(job.format, &counted.rows)?)?;
                done.files = 1;
                done.damaged = usize::from(counted.notices.any_loss());
                done.messages = counted.messages;
                done.notices
                    .extend(counted.notices.iter().map(|notice| Notice {
                        text: format!("`{}`: {}", self.name, notice.text),
                        ..notice
                    }));
            }
        }
        Ok(done)
    }

    /// Whether its table is newer than its files.
    fn is_tabled(&self) -> bool {
        let changed = self.recording.paths().iter().map(|path| written(path));
        let changed = changed.max();
        let tabled = fs::metadata(&self.file).and_then(|file| file.modified());
        tabled.is_ok_and(|tabled| changed.flatten().is_some_and(|changed| changed <= tabled))
    }
}
