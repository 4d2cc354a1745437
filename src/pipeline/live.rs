//! A live system, recorded to a temporary MCAP file that is followed like any other recording: its graph whenever it
//! changes, a heartbeat each second, and the messages of requested topics.
//!
//! Nothing is published, set or called that changes the system. While it is unreachable nothing is recorded, so that
//! its elements do not count as stopped.

#[cfg(feature = "live")]
mod bridge;
mod master;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::net::{TcpStream, ToSocketAddrs as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::bag::source::Temporary;
use crate::base::budget::NAMES;
use crate::base::error::{Error, Result};
use crate::base::name::HEARTBEAT;
use crate::base::time::Stamp;
use crate::export::mcap::{GRAPH, GraphEnd, GraphFile, GraphNode, graph};

/// The heartbeat interval.
const BEAT: Duration = Duration::from_secs(1);
/// The payload of a heartbeat: a message without a field, in CDR.
const EMPTY: [u8; 5] = [0, 1, 0, 0, 0];
/// The time for connecting, and for a whole answer.
const WAIT: Duration = Duration::from_secs(5);
/// The longest wait before reconnecting.
const MOST_WAIT: Duration = Duration::from_secs(16);
/// The most bytes of graphs recorded per second, so that a system that changes all the time does not fill the disk.
const MOST_RECORDED: f64 = 1e6;

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
    news: Receiver<String>,
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
            return Ok(None);
        };
        let watch = way.ok_or_else(|| Error::Unsupported {
            path: address.to_owned(),
            what: "this build of bagreel has no WebSockets".to_owned(),
            hint: "build with the feature `live`: `cargo install bagreel --features live`"
                .to_owned(),
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
        let (reported, news) = channel();
        let watched = Watched {
            file,
            heartbeat,
            topics: topics.iter().cloned().collect(),
            graph: LiveGraph::default(),
            written: None,
            due: Instant::now(),
            is_over: is_over.clone(),
        };
        let (name, place) = (text.to_string(), place.trim_end_matches('/').to_owned());
        let recorder = spawn(move || record(watch, &name, &place, watched, &reported));
        Ok(Some(Self {
            path,
            is_over,
            news,
            recorder: Some(recorder),
            _folder: folder,
        }))
    }

    /// The growing file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The connection's status messages since the last call.
    pub(crate) fn news(&self) -> impl Iterator<Item = String> + '_ {
        self.news.try_iter()
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
fn record(watch: Watch, name: &str, place: &str, mut watched: Watched, reported: &Sender<String>) {
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
            "no connection to {name}: {why}; trying again in {} s",
            wait.as_secs()
        );
        if reported.send(text).is_err() {
            break;
        }
        let until = SystemTime::now() + wait;
        while !watched.is_over() && SystemTime::now() < until {
            sleep(BEAT / 10);
        }
        wait = (wait * 2).min(MOST_WAIT);
    }
    if let Err(error) = watched.file.finish() {
        let _ = reported.send(format!(
            "the recording of {name} could not be finished: {error}"
        ));
    }
}

/// A watched live system and its recording.
struct Watched {
    file: GraphFile<BufWriter<File>>,
    heartbeat: usize,
    /// The topics whose messages are recorded.
    #[cfg_attr(not(feature = "live"), expect(dead_code, reason = "a master has none"))]
    topics: BTreeSet<String>,
    graph: LiveGraph,
    /// The last graph written since the connection was established.
    written: Option<Vec<u8>>,
    /// The time at which the next graph may be written.
    due: Instant,
    is_over: Arc<AtomicBool>,
}

impl Watched {
    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Records a heartbeat, and the graph if it has changed.
    fn beat(&mut self) -> io::Result<()> {
        let now = now();
        if self.written.is_none() || Instant::now() >= self.due {
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

/// A connection whose reads end at a certain time, however slowly the server sends.
struct Patient {
    stream: TcpStream,
    until: Instant,
}

impl Patient {
    /// Sets the time for all reads from now on.
    fn wait(&mut self, most: Duration) {
        self.until = Instant::now() + most;
    }
}

impl Read for Patient {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let late = || io::Error::new(io::ErrorKind::TimedOut, "it did not respond in time");
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(late());
        }
        self.stream.set_read_timeout(Some(left))?;
        let read = self.stream.read(into);
        read.map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock => late(),
            _ => error,
        })
    }
}

impl Write for Patient {
    fn write(&mut self, from: &[u8]) -> io::Result<usize> {
        self.stream.write(from)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Connects to a server, which then has [`WAIT`] for its first answer.
fn connect(place: &str) -> io::Result<Patient> {
    let mut failed = io::Error::other("the host name cannot be resolved");
    for at in place.to_socket_addrs()? {
        match TcpStream::connect_timeout(&at, WAIT) {
            Ok(stream) => {
                stream.set_write_timeout(Some(WAIT))?;
                let until = Instant::now() + WAIT;
                return Ok(Patient { stream, until });
            }
            Err(error) => failed = error,
        }
    }
    Err(failed)
}

/// The current time of this machine.
fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    Stamp(since.map_or(0, |since| {
        i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
    }))
}

/// The ends of all connections: the names of publishers, subscribers, clients and servers by topic or
/// service.
#[derive(Default)]
struct LiveGraph {
    ends: [BTreeMap<String, BTreeSet<String>>; 4],
    /// The types of topics.
    types: BTreeMap<String, String>,
}

/// The indices in [`LiveGraph::ends`].
const PUBLISHERS: usize = 0;
const SUBSCRIBERS: usize = 1;
const SERVERS: usize = 3;

impl LiveGraph {
    #[cfg(feature = "live")]
    fn is_empty(&self) -> bool {
        self.ends.iter().all(BTreeMap::is_empty)
    }

    /// Sets the nodes of a topic or service; none if it no longer exists.
    fn set(&mut self, side: usize, name: &str, nodes: BTreeSet<String>) {
        if nodes.is_empty() {
            self.ends[side].remove(name);
        } else {
            self.ends[side].insert(name.to_owned(), nodes);
        }
    }

    /// # Errors
    /// If there are implausibly many names; each end counts once.
    fn check(&self) -> io::Result<()> {
        let ends = self
            .ends
            .iter()
            .flat_map(BTreeMap::values)
            .map(BTreeSet::len);
        if ends.sum::<usize>() + self.types.len() > NAMES {
            return Err(io::Error::other(format!("more than {NAMES} names")));
        }
        Ok(())
    }

    fn payload(&self) -> Vec<u8> {
        let mut nodes: BTreeMap<&str, GraphNode<'_>> = BTreeMap::new();
        for (side, ends) in self.ends.iter().enumerate() {
            for (name, at) in ends {
                let kind = self.types.get(name).map_or("", String::as_str);
                for node in at {
                    let node = nodes.entry(node).or_insert_with(|| GraphNode::new(node));
                    node.ends[side].push(GraphEnd {
                        name,
                        kind,
                        qos: None,
                    });
                }
            }
        }
        graph(&nodes.into_values().collect::<Vec<_>>())
    }
}
