//! A tiny bag builder: one description, written as ROS 1 bag, MCAP and SQLite; and a sink that keeps everything.

#![expect(unreachable_pub, reason = "a test binary has no outside")]

pub mod browser;
pub mod cdr;
pub mod mcap;
pub mod mission;
pub mod pdf;
pub mod rosbag1;
pub mod snapshot;
pub mod sqlite3;
pub mod tiny;
pub mod windows;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bagreel::bag::{
    self, Connection, ConnectionId, Input, Message, OpenOptions, Report, Sink, Want,
};
use bagreel::internals::base::error::Result;
use bagreel::internals::base::notice::Notice;
use bagreel::internals::base::time::{Span, Stamp};

/// A publisher in a described bag.
#[derive(Clone, Debug, Default)]
pub struct Publisher {
    pub node: String,
    pub topic: String,
    pub type_name: String,
    pub latching: bool,
    /// `offered_qos_profiles` (ROS 2).
    pub qos: String,
    /// The message definition; none if empty.
    pub definition: String,
}

/// A described bag: publishers, and messages sorted by time.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    pub publishers: Vec<Publisher>,
    /// The index of the publisher, nanoseconds since 1970, the payload.
    pub messages: Vec<(usize, i64, Vec<u8>)>,
}

impl Recording {
    /// Adds a publisher; returns its index.
    pub fn publisher(&mut self, node: &str, topic: &str, type_name: &str) -> usize {
        self.publishers.push(Publisher {
            node: node.to_owned(),
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            ..Publisher::default()
        });
        self.publishers.len() - 1
    }

    /// Sends `payload` every `period_ms` from `start_ms` up to `end_ms`.
    pub fn send(
        &mut self,
        publisher: usize,
        (start_ms, end_ms): (i64, i64),
        period_ms: i64,
        payload: &[u8],
    ) {
        let mut at = start_ms;
        while at < end_ms {
            self.messages
                .push((publisher, ORIGIN + at * 1_000_000, payload.to_vec()));
            at += period_ms;
        }
        self.messages.sort_by_key(|m| m.1);
    }

    /// Messages per topic.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        let mut counts = BTreeMap::new();
        for (publisher, ..) in &self.messages {
            *counts
                .entry(self.publishers[*publisher].topic.clone())
                .or_default() += 1;
        }
        counts
    }
}

/// The start of described bags: 2024-01-01, nanoseconds since 1970.
pub const ORIGIN: i64 = 1_704_067_200_000_000_000;

/// A minute of a small robot: a latched map, a fast scan, two publishers of one topic, a late node.
pub fn small() -> Recording {
    let mut bag = Recording::default();
    let map = bag.publisher("/map_server", "/map", "nav_msgs/OccupancyGrid");
    bag.publishers[map].latching = true;
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    let planner = bag.publisher("/planner", "/cmd_vel", "geometry_msgs/Twist");
    let joystick = bag.publisher("/joystick", "/cmd_vel", "geometry_msgs/Twist");
    let late = bag.publisher("/late", "/found", "std_msgs/String");
    bag.send(map, (0, 1), 1, &[7; 3000]);
    bag.send(scan, (100, 60_000), 100, &[1; 400]);
    bag.send(planner, (2_000, 30_000), 50, &[2; 48]);
    bag.send(joystick, (30_000, 40_000), 100, &[3; 48]);
    bag.send(late, (45_000, 50_000), 1_000, b"\x05\0\0\0found");
    bag
}

/// A sink that keeps everything.
#[derive(Default)]
pub struct Kept {
    pub want: Want,
    pub connections: Vec<Connection>,
    pub stamps: Vec<(ConnectionId, Stamp, Option<u32>)>,
    pub messages: Vec<(ConnectionId, Stamp, Vec<u8>)>,
    pub notices: Vec<Notice>,
}

impl Kept {
    /// Messages per topic.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        self.count(|c| c.topic.to_string())
    }

    /// Messages per `key` of a connection.
    pub fn count<K: Ord>(&self, key: impl Fn(&Connection) -> K) -> BTreeMap<K, u64> {
        let mut counts = BTreeMap::new();
        for (id, ..) in &self.stamps {
            *counts
                .entry(key(&self.connections[id.0 as usize]))
                .or_default() += 1;
        }
        counts
    }

    /// Every message as topic, time and payload, in order.
    pub fn payloads(&self) -> Vec<(String, Stamp, Vec<u8>)> {
        let topic = |id: &ConnectionId| self.connections[id.0 as usize].topic.to_string();
        let all = self.messages.iter();
        let mut all: Vec<_> = all
            .map(|(id, t, data)| (topic(id), *t, data.clone()))
            .collect();
        all.sort();
        all
    }
}

impl Sink for Kept {
    fn connection(&mut self, connection: &Connection) -> Want {
        assert_eq!(
            connection.id.0 as usize,
            self.connections.len(),
            "ids have no holes"
        );
        self.connections.push(connection.clone());
        self.want
    }

    fn stamps(&mut self, id: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        assert!((id.0 as usize) < self.connections.len(), "announced before");
        assert!(
            sizes.is_none_or(|s| s.len() == stamps.len()),
            "a size for each stamp"
        );
        let size = |at: usize| sizes.map(|s| s[at]);
        self.stamps
            .extend(stamps.iter().enumerate().map(|(at, t)| (id, *t, size(at))));
    }

    fn message(&mut self, message: Message<'_>) {
        self.messages
            .push((message.connection, message.time, message.data.to_vec()));
    }

    fn notice(&mut self, notice: Notice) {
        self.notices.push(notice);
    }
}

/// Reads a bag whole.
pub fn read(path: &Path, want: Want) -> Result<(Report, Kept)> {
    read_as(path, want, None, &OpenOptions::default())
}

/// Reads a bag, or a part of it.
pub fn read_as(
    path: &Path,
    want: Want,
    range: Option<Span>,
    options: &OpenOptions,
) -> Result<(Report, Kept)> {
    let mut kept = Kept {
        want,
        ..Kept::default()
    };
    let mut reader = bag::open(&Input::Path(path.to_owned()), options)?;
    reader.span()?;
    let report = reader.read(range, &mut kept)?;
    Ok((report, kept))
}

/// A folder outside the project with recordings that may not be copied; `None`, with a printed line, if absent.
pub fn shared(below: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared")
        .join(below);
    if !path.exists() {
        #[expect(clippy::print_stdout, reason = "a skipped test prints its reason")]
        {
            println!("skipped: {} is not there", path.display());
        }
        return None;
    }
    Some(path)
}

/// The rows of a Parquet file.
#[cfg(feature = "parquet")]
pub fn parquet_rows(path: &Path) -> Vec<parquet::record::Row> {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    let file = std::fs::File::open(path).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let rows = reader.get_row_iter(None).unwrap();
    rows.map(|row| row.unwrap()).collect()
}
