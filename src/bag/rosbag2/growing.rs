//! A rosbag2 folder that is still being written: its storage files, including those added by splits.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::{Joined, Metadata, PartConnections, PartsAdapter, metadata, storage};
use crate::bag::model::{Growing, Growth, Sink};
use crate::bag::{self, Input};
use crate::base::budget::FILES;
use crate::base::error::Result;

/// The number of polls without growth after which a recording with metadata is over: two seconds, in which a recorder
/// closes its last file.
const QUIET: u32 = 8;

/// A folder's storage files, each with its read position.
#[derive(Default)]
pub(super) struct GrowingFolder {
    path: PathBuf,
    parts: Vec<Part>,
    /// The files found so far, including those that cannot be followed.
    seen: BTreeSet<PathBuf>,
    joined: Joined,
    quiet: u32,
}

/// A storage file.
struct Part {
    file: Box<dyn Growing>,
    connections: PartConnections,
    is_over: bool,
}

impl Growing for GrowingFolder {
    fn poll(&mut self, sink: &mut dyn Sink) -> Result<Growth> {
        self.find();
        let none = Metadata::default();
        let mut grew = false;
        for part in self.parts.iter_mut().filter(|part| !part.is_over) {
            let mut adapter = PartsAdapter::new(&none, sink, 0);
            adapter.joined = std::mem::take(&mut self.joined);
            adapter.part = std::mem::take(&mut part.connections);
            let growth = part.file.poll(&mut adapter);
            (self.joined, part.connections) = (adapter.joined, adapter.part);
            grew |= matches!(growth, Ok(Growth::More));
            // A file that disappeared was full and has been compressed; its content was read before.
            part.is_over = matches!(growth, Ok(Growth::Ended) | Err(_));
        }
        self.quiet = if grew { 0 } else { self.quiet + 1 };
        Ok(if grew {
            Growth::More
        } else if self.quiet >= QUIET && self.is_closed() {
            Growth::Ended
        } else {
            Growth::Same
        })
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl GrowingFolder {
    pub(super) fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            ..Self::default()
        }
    }

    /// Finds new storage files. One that cannot be followed yet is retried.
    fn find(&mut self) {
        for file in storage(&self.path) {
            if self.seen.contains(&file) || self.seen.len() >= FILES {
                continue;
            }
            if let Ok(growing) = bag::follow(&Input::Path(file.clone())) {
                self.seen.insert(file);
                self.parts.push(Part {
                    file: growing,
                    connections: PartConnections::default(),
                    is_over: false,
                });
            }
        }
    }

    /// Whether the metadata, which is written at the end, lists all files.
    fn is_closed(&self) -> bool {
        let named = metadata::read(&self.path).ok().flatten();
        named.is_some_and(|named| named.files.len() >= storage(&self.path).len())
    }
}
