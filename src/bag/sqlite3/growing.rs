//! A database that is still being written: its new rows, read without a lock.
//!
//! rosbag2 writes with `journal_mode=MEMORY` and aborts if the database is locked, so SQLite opens it as immutable and
//! takes no lock; a half-written page ends a poll, and the next one continues there. With a log beside it (`-wal`) a
//! reader never blocks the writer, and a short transaction reads both.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::ready::Ready;
use super::rows::RowReader;
use super::{Db, bag};
use crate::bag::model::{Growing, Growth, OpenOptions, Sink, Want};
use crate::bag::source::FileSource;
use crate::base::error::Result;
use crate::base::file::with_suffix;

/// The number of polls between two openings of the database: polling is cheap, starting SQLite is not.
const EVERY: u32 = 4;

/// A database, read up to the last reported row.
#[derive(Default)]
pub(super) struct GrowingDb {
    path: PathBuf,
    /// The sizes and times of change of the database and its log when it was last read.
    seen: Vec<(u64, Option<SystemTime>)>,
    /// The polls since then.
    looks: u32,
    /// The first row that has not been reported.
    next: i64,
    wants: Vec<Want>,
}

impl GrowingDb {
    pub(super) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            looks: EVERY,
            next: i64::MIN,
            ..Self::default()
        }
    }
}

impl Growing for GrowingDb {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        self.looks += 1;
        let source = FileSource::open(&self.path)?;
        let wal = with_suffix(&self.path, "-wal");
        let state = |path: &Path| {
            let meta = path.metadata().ok()?;
            Some((meta.len(), meta.modified().ok()))
        };
        let now: Vec<_> = [&self.path, &wal]
            .into_iter()
            .filter_map(|p| state(p))
            .collect();
        if now == self.seen || self.looks < EVERY {
            return Ok(Growth::Same);
        }
        (self.seen, self.looks) = (now, 0);
        let has_log = wal.metadata().is_ok_and(|log| log.len() > 0);
        let ready = Ready::growing(&self.path, has_log);
        // The table may not exist yet.
        let Ok(bag) = bag(ready, &source, &OpenOptions::default()) else {
            return Ok(Growth::Same);
        };
        for topic in bag.topics.iter().skip(self.wants.len()) {
            self.wants.push(sink.connection(topic));
        }
        let before = self.next;
        if let Ok(db) = Db::open(&bag.ready) {
            self.next = RowReader::new(&bag, &self.wants, None).read_from(&db, self.next, sink);
        }
        Ok(if self.next > before {
            Growth::More
        } else {
            Growth::Same
        })
    }

    fn path(&self) -> &Path {
        &self.path
    }
}
