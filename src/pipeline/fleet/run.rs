//! The job of `bagreel tables`: a file per bag and table, written atomically, so that query engines can read the folder
//! and the next run resumes a killed one.

use std::collections::BTreeMap;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::UNIX_EPOCH;

use super::count::{CountedBag, Tally, try_count, unreadable};
use super::counts::SCHEMA_VERSION;
use super::plan::{CountDetail, FleetPlan, PlannedBag, Planning, plan};
use super::rows::{bags_table, counts_table};
use crate::bag::{self, Input};
use crate::base::digest::hex;
use crate::base::error::{Error, Result};
use crate::base::table::Batch;
use crate::export::check::check_folder;
use crate::export::sink::OutputSink;
use crate::export::tables::{TableFormat, writer::Writer};
use crate::export::target::Target;
use crate::pipeline::read::files;
use crate::pipeline::survey::no_bags;
use crate::pipeline::{Stage, Watch};

/// The treatment of unreadable bags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnError {
    /// Add a row with the reason to `bags`.
    #[default]
    Row,
    /// Stop.
    Fail,
}

/// The whole job of `bagreel tables`.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct FleetJob {
    /// Bags; folders with bags below them.
    pub sources: Vec<String>,
    /// The options of the plan.
    pub planning: Planning,
    /// The detail in which messages are counted.
    pub detail: CountDetail,
    /// The shard of missions to count: its number, counted from 1, and the number of shards; `None` for all missions.
    pub shard: Option<(usize, usize)>,
    /// Whether to skip bags whose tables exist, made from the same version with the same options.
    pub skip_existing: bool,
    /// The treatment of unreadable bags.
    pub on_error: OnError,
    /// The number of bags to count in parallel; by default one per processor.
    pub jobs: Option<NonZeroUsize>,
    /// The folder for the folders `counts` and `bags`.
    pub folder: PathBuf,
}

impl FleetJob {
    /// A job that counts these bags into that folder, with the command line's defaults.
    pub fn new(sources: Vec<String>, folder: PathBuf) -> Self {
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
    /// The number of bags whose tables were written.
    pub bags: usize,
    /// The number of bags whose tables existed already.
    pub kept: usize,
    /// The number of written bags that could not be read.
    pub unreadable: usize,
    /// The number of written bags with losses.
    pub incomplete: usize,
    /// The number of messages counted.
    pub messages: u64,
    /// The number of rows of `counts`.
    pub rows: usize,
    /// The bags that contain the same messages as another one of this run, sorted; all of them are counted.
    pub copies: Vec<String>,
}

/// Counts every bag of the job and writes its rows.
///
/// # Errors
/// If nothing can be listed or written, and for the first unreadable bag with [`OnError::Fail`].
pub fn tables(job: &FleetJob, watch: &mut dyn Watch) -> Result<Tabled> {
    watch.stage(Stage::Count);
    let mut plan = plan(&job.sources, &job.planning)?;
    if let (true, [first, ..]) = (plan.bags.is_empty(), &job.sources[..]) {
        return Err(no_bags(Path::new(first)));
    }
    if let Some((index, count)) = job.shard {
        plan = plan.shard(index, count)?;
    }
    let inputs: Vec<Input> = plan.bags.iter().map(PlannedBag::input).collect();
    let kept = files(&inputs);
    for folder in ["counts", "bags"] {
        check_folder(&job.folder.join(folder), "parquet", &kept)?;
    }
    let work = FleetWork {
        job,
        files: FleetFiles::open(&job.folder)?,
        plan: &plan,
        next: AtomicUsize::new(0),
        is_stopped: AtomicBool::new(false),
    };
    let (to, from) = channel();
    thread::scope(|scope| {
        for _ in 0..jobs(job, &plan) {
            let (work, to) = (&work, to.clone());
            scope.spawn(move || work.run(&to));
        }
        drop(to);
        let mut done = Tabled::default();
        let mut alike: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut outcome = Ok(());
        for (at, one) in from.into_iter().enumerate() {
            watch.progress(at as u64 + 1, plan.bags.len() as u64);
            if let Ok(BagOutcome::Written { counted }) = &one
                && let Some(content) = &counted.bag.content
            {
                let same = alike.entry(content.clone()).or_default();
                same.push(counted.bag.uri.clone());
            }
            outcome = outcome.and(one.map(|one| done.take(one)));
            if watch.stopped() {
                outcome = Err(Error::Interrupted);
            }
            if outcome.is_err() {
                work.is_stopped.store(true, Ordering::Relaxed);
            }
        }
        let copies = alike.into_values().filter(|same| same.len() > 1);
        done.copies = copies.flatten().collect();
        done.copies.sort();
        outcome.map(|()| done)
    })
}

fn jobs(job: &FleetJob, plan: &FleetPlan) -> usize {
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let jobs = job.jobs.map_or(cores, NonZeroUsize::get);
    jobs.min(plan.bags.len())
}

/// The outcome of one bag.
enum BagOutcome {
    Kept,
    Written { counted: Box<CountedBag> },
}

impl Tabled {
    fn take(&mut self, one: BagOutcome) {
        match one {
            BagOutcome::Kept => self.kept += 1,
            BagOutcome::Written { counted } => {
                self.bags += 1;
                self.unreadable += usize::from(counted.bag.error.is_some());
                let is_damaged = counted.bag.error.is_none() && !counted.bag.is_complete;
                self.incomplete += usize::from(is_damaged);
                self.messages += counted.bag.messages;
                self.rows += counted.counts.len();
            }
        }
    }
}

/// The job, shared by the threads that work on it.
struct FleetWork<'a> {
    job: &'a FleetJob,
    plan: &'a FleetPlan,
    files: FleetFiles,
    next: AtomicUsize,
    is_stopped: AtomicBool,
}

impl FleetWork<'_> {
    /// Counts one bag after the other until none is left.
    fn run(&self, to: &Sender<Result<BagOutcome>>) {
        while !self.is_stopped.load(Ordering::Relaxed) {
            let at = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(bag) = self.plan.bags.get(at) else {
                return;
            };
            // The receiver is gone after a failure.
            if to.send(self.one(bag)).is_err() {
                return;
            }
        }
    }

    fn one(&self, bag: &PlannedBag) -> Result<BagOutcome> {
        let name = self.name(bag);
        if self.job.skip_existing && self.files.hold(&name) {
            return Ok(BagOutcome::Kept);
        }
        let tally = Tally {
            period: self.plan.period,
            detail: self.job.detail,
            part: None,
        };
        let counted = match (try_count(bag, &tally), self.job.on_error) {
            (Err(error), OnError::Row) => unreadable(bag, &tally, &error),
            (counted, _) => counted?,
        };
        self.files.write(&name, &counted)?;
        Ok(BagOutcome::Written {
            counted: Box::new(counted),
        })
    }

    /// The names of a bag's files, from a digest of its location and one of everything that determines its rows.
    fn name(&self, bag: &PlannedBag) -> FileName {
        let input = bag.input();
        let changed = match &input {
            Input::Path(path) => changed(path),
            Input::Stdin => None,
        };
        let made_of = format!(
            "{:?} {changed:?} {} {} {} {} {SCHEMA_VERSION}",
            bag::size_on_disk(&input),
            bag.mission,
            bag.origin.0,
            self.plan.period.nanos(),
            self.job.detail.word(),
        );
        FileName {
            bag: hex(&bag.uri, DIGITS),
            made_of: hex(&made_of, DIGITS),
        }
    }
}

/// The modification time of a file, or of the newest in a folder, in nanoseconds since 1970.
fn changed(path: &Path) -> Option<u128> {
    let of = |meta: &fs::Metadata| {
        let at = meta.modified().ok()?;
        Some(at.duration_since(UNIX_EPOCH).ok()?.as_nanos())
    };
    let own = fs::metadata(path).ok()?;
    if !own.is_dir() {
        return of(&own);
    }
    let inside = fs::read_dir(path).into_iter().flatten().flatten();
    let inside = inside.filter_map(|file| of(&fs::metadata(file.path()).ok()?));
    inside.chain(of(&own)).max()
}

/// The number of hexadecimal digits of a digest, 64 bits: among a million bags the chance of a collision is one in
/// 30 million.
const DIGITS: usize = 16;

/// The names of the files of one bag.
struct FileName {
    bag: String,
    made_of: String,
}

impl FileName {
    fn file(&self) -> String {
        format!("{}-{}.parquet", self.bag, self.made_of)
    }
}

/// The two folders, and the files in them before.
struct FleetFiles {
    counts: PathBuf,
    bags: PathBuf,
    /// The files in either folder, by the part of their names that identifies the bag.
    earlier: [BTreeMap<String, Vec<String>>; 2],
}

impl FleetFiles {
    fn open(folder: &Path) -> Result<Self> {
        let (counts, bags) = (folder.join("counts"), folder.join("bags"));
        for folder in [&counts, &bags] {
            fs::create_dir_all(folder).map_err(Error::io("create the folder", folder))?;
        }
        let earlier = [earlier(&counts)?, earlier(&bags)?];
        Ok(Self {
            counts,
            bags,
            earlier,
        })
    }

    /// Whether both files of this name exist.
    fn hold(&self, name: &FileName) -> bool {
        let file = name.file();
        let holds = |all: &BTreeMap<String, Vec<String>>| {
            all.get(&name.bag)
                .is_some_and(|files| files.contains(&file))
        };
        self.earlier.iter().all(holds)
    }

    /// Writes both files, `bags` last, and removes those of earlier versions.
    fn write(&self, name: &FileName, counted: &CountedBag) -> Result<()> {
        let file = name.file();
        write(&self.counts.join(&file), &counts_table(&counted.counts))?;
        let bag = std::slice::from_ref(&counted.bag);
        write(&self.bags.join(&file), &bags_table(bag))?;
        for (folder, earlier) in [&self.counts, &self.bags].into_iter().zip(&self.earlier) {
            let old = earlier.get(&name.bag).into_iter().flatten();
            for old in old.filter(|old| **old != file) {
                let path = folder.join(old);
                match fs::remove_file(&path) {
                    Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                        return Err(Error::io("replace", &path)(e));
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

fn earlier(folder: &Path) -> Result<BTreeMap<String, Vec<String>>> {
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let files = fs::read_dir(folder).map_err(Error::io("read", folder))?;
    for file in files.flatten() {
        let name = file.file_name().to_string_lossy().into_owned();
        if let Some((bag, _)) = name.split_once('-').filter(|(bag, _)| bag.len() == DIGITS) {
            all.entry(bag.to_owned()).or_default().push(name);
        }
    }
    Ok(all)
}

fn write(path: &Path, table: &Batch) -> Result<()> {
    let sink = OutputSink::create(&Target::Path(path.to_owned()), None)?;
    let failed = || Error::io("write", path);
    let mut writer = Writer::new(TableFormat::Parquet, sink, table, &[]).map_err(failed())?;
    writer.write(table).map_err(failed())?;
    writer.finish().map_err(failed())?.commit()?;
    Ok(())
}
