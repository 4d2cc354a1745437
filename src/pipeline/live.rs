//! A live system, recorded to a temporary MCAP file that is followed like any other recording: its graph whenever it
//! changes, a heartbeat each second, and the messages of requested topics.
//!
//! Nothing is published, set or called that changes the system. While it is unreachable nothing is recorded, so that
//! its elements do not count as stopped.

#[cfg(feature = "live")]
mod bridge;
mod connection;
mod graph;
mod master;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::bag::source::Temporary;
#[cfg(feature = "live")]
use crate::base::budget::DEFINITIONS;
use crate::base::error::{Error, Result};
use crate::base::name::HEARTBEAT;
use crate::base::time::Stamp;
use crate::base::words::shorten;
use crate::export::mcap::{GRAPH, GraphFile};
use graph::LiveGraph;

/// The heartbeat interval.
const BEAT: Duration = Duration::from_secs(1);
/// The payload of a heartbeat: a message without a field, in CDR.
const EMPTY: [u8; 5] = [0, 1, 0, 0, 0];
/// The longest wait before reconnecting.
const MOST_WAIT: Duration = Duration::from_secs(16);
/// The most bytes of graphs recorded per second, so that a system that changes all the time does not fill the disk.
const MOST_RECORDED: f64 = 1e6;
/// The most channels of requested topics, including those that are advertised again with another type: forty times the
/// topics that anyone requests.
#[cfg(feature = "live")]
const MOST_CHANNELS: usize = 1 << 12;
/// The most characters of the reason for a failure, which may quote the server.
const MOST_REASON: usize = 300;

/// The supported protocols by URL scheme; `None` for those disabled in this build.
const WAYS: [(&str, Option<Watch>); 2] = [("ros1://", Some(master::watch)), ("ws://", BRIDGE)];
#[cfg(feature = "live")]
const BRIDGE: Option<Watch> = Some(bridge::watch);
#[cfg(not(feature = "live"))]
const BRIDGE: Option<Watch> = None;

/// Watches the system at an address (`host:port`) until the connection fails, or [`Watched::is_over`].
type Watch = fn(&str, &mut Watched) -> io::Result<()>;

/// A recording of a live system, which continues until it is dropped or finished.
pub(crate) struct Live {
    path: PathBuf,
    is_over: Arc<AtomicBool>,
    statuses: Receiver<String>,
    recorder: Option<JoinHandle<()>>,
    _folder: Temporary,
}

impl Live {
    /// Begins to record the system at `address`, with the messages of `topics`; `None` if the scheme is unknown.
    ///
    /// # Errors
    /// If the file cannot be created.
    pub(crate) fn start(address: &Path, topics: &[String]) -> Result<Option<Self>> {
        let text = address.to_string_lossy();
        let mut ways = WAYS.into_iter();
        let found = ways.find_map(|(scheme, way)| Some((text.strip_prefix(scheme)?, way)));
        if !topics.is_empty() && !text.starts_with("ws://") {
            let what = "`--rates` subscribes to topics, which only a bridge (`ws://`) supports";
            return Err(Error::usage(what, "leave it out"));
        }
        let Some((place, way)) = found else {
            let scheme = text.split_once("://").filter(|_| !address.exists());
            let unknown = scheme.map(|(scheme, _)| {
                Error::usage(
                    format!("`{scheme}://` is not a live system that can be followed"),
                    "live systems are `ros1://localhost:11311` and `ws://localhost:8765`",
                )
            });
            return unknown.map_or(Ok(None), Err);
        };
        let watch = way.ok_or_else(|| {
            let what = "this build of bagreel has no WebSockets";
            let hint = "build with the feature `live`: `cargo install bagreel --features live`";
            Error::unsupported(address, what, hint)
        })?;
        let host = place.split('/').next().unwrap_or_default();
        let parts = host.rsplit_once(':');
        if !parts.is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok()) {
            return Err(Error::usage(
                format!("`{text}` is not the address of a system"),
                "name host and port: `ros1://localhost:11311`, `ws://localhost:8765`",
            ));
        }
        let folder = Temporary::new()?;
        let path = folder.path().join("live.mcap");
        let file = File::create(&path).map_err(Error::io("write", &path))?;
        let begun = GraphFile::new(BufWriter::new(file), false).and_then(|mut file| {
            let heartbeat = file.own_channel(HEARTBEAT, "std_msgs/msg/Empty", String::new())?;
            file.flush()?;
            Ok((file, heartbeat))
        });
        let (file, heartbeat) = begun.map_err(Error::io("write", &path))?;
        let is_over = Arc::new(AtomicBool::new(false));
        let (reported, statuses) = channel();
        let watched = Watched {
            file,
            heartbeat,
            topics: topics.iter().cloned().collect(),
            channels: BTreeMap::new(),
            described: 0,
            ignored: 0,
            graph: LiveGraph::default(),
            written: None,
            due: Instant::now(),
            is_over: is_over.clone(),
            reported,
        };
        let (name, place) = (text.to_string(), place.trim_end_matches('/').to_owned());
        let recorder = spawn(move || record(watch, &name, &place, watched));
        Ok(Some(Self {
            path,
            is_over,
            statuses,
            recorder: Some(recorder),
            _folder: folder,
        }))
    }

    /// The growing file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The connection's status messages since the last call.
    pub(crate) fn new_statuses(&self) -> impl Iterator<Item = String> + '_ {
        self.statuses.try_iter()
    }

    /// Ends the recording and writes the file's summary.
    pub(crate) fn finish(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(recorder) = self.recorder.take() {
            // A panic of the thread was printed already.
            let _ = recorder.join();
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Watches the system and reconnects if the connection fails.
fn record(watch: Watch, name: &str, place: &str, mut watched: Watched) {
    let mut wait = BEAT;
    while !watched.is_over() {
        watched.written = None;
        let failed = watch(place, &mut watched);
        if watched.is_over() {
            break;
        }
        if watched.written.is_some() {
            wait = BEAT;
        }
        let why = failed
            .err()
            .map_or_else(|| "it was closed".to_owned(), |e| e.to_string());
        let text = format!(
            "no connection to {name}: {}; trying again in {} s",
            shorten(&why, MOST_REASON),
            wait.as_secs()
        );
        if watched.reported.send(text).is_err() {
            break;
        }
        watched.rest(wait);
        wait = (wait * 2).min(MOST_WAIT);
    }
    if watched.ignored > 0 {
        let text = format!("{} channels of {name} were ignored", watched.ignored);
        let _ = watched.reported.send(text);
    }
    if let Err(error) = watched.file.finish() {
        let text = format!("the recording of {name} could not be finished: {error}");
        let _ = watched.reported.send(text);
    }
}

/// A watched live system and its recording.
struct Watched {
    file: GraphFile<BufWriter<File>>,
    heartbeat: usize,
    /// The topics whose messages are recorded.
    #[cfg_attr(not(feature = "live"), expect(dead_code, reason = "a master has none"))]
    topics: BTreeSet<String>,
    /// The channels of those topics in the file, by topic, encoding, type, encoding of the definition, and definition.
    #[cfg_attr(not(feature = "live"), expect(dead_code, reason = "a master has none"))]
    channels: BTreeMap<[String; 5], usize>,
    /// The bytes of those texts.
    #[cfg_attr(not(feature = "live"), expect(dead_code, reason = "a master has none"))]
    described: usize,
    /// The number of channels beyond the limits.
    ignored: u64,
    graph: LiveGraph,
    /// The last graph written since the connection was established.
    written: Option<Vec<u8>>,
    /// The time at which the next graph may be written.
    due: Instant,
    is_over: Arc<AtomicBool>,
    reported: Sender<String>,
}

impl Watched {
    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Waits, but not beyond the end.
    fn rest(&self, most: Duration) {
        let until = Instant::now() + most;
        while !self.is_over() && Instant::now() < until {
            sleep(BEAT / 10);
        }
    }

    /// The channel in the file for a requested topic, see [`Watched::channels`]; `None` beyond the limits.
    #[cfg(feature = "live")]
    fn channel(&mut self, parts: [String; 5]) -> io::Result<Option<usize>> {
        if let Some(known) = self.channels.get(&parts) {
            return Ok(Some(*known));
        }
        let bytes = parts.iter().map(String::len).sum::<usize>();
        if self.channels.len() >= MOST_CHANNELS || self.described + bytes > DEFINITIONS {
            if self.ignored == 0 {
                let text = format!(
                    "further channels are ignored: there are more than {MOST_CHANNELS}, or {} of definitions",
                    crate::base::words::bytes(DEFINITIONS as u64)
                );
                let _ = self.reported.send(text);
            }
            self.ignored += 1;
            return Ok(None);
        }
        let [topic, encoding, kind, of_schema, schema] = &parts;
        let schema = (&**kind, &**of_schema, schema.clone());
        let number = self
            .file
            .channel(topic, encoding, schema, &BTreeMap::new())?;
        self.described += bytes;
        self.channels.insert(parts, number);
        Ok(Some(number))
    }

    /// Records a heartbeat, and the graph if it has changed.
    ///
    /// # Errors
    /// If the graph is too large, or the file cannot be written.
    fn beat(&mut self) -> io::Result<()> {
        let now = now();
        if self.written.is_none() || Instant::now() >= self.due {
            self.graph.check()?;
            let payload = self.graph.payload();
            if self.written.as_ref() != Some(&payload) {
                self.file.write(GRAPH, now, &payload)?;
                let rest = Duration::from_secs_f64(payload.len() as f64 / MOST_RECORDED);
                self.due = Instant::now() + rest;
                self.written = Some(payload);
            }
        }
        self.file.write(self.heartbeat, now, &EMPTY)?;
        self.file.flush()
    }
}

/// The current time of this machine.
fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Stamp(since.map_or(0, |since| {
        i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
    }))
}
