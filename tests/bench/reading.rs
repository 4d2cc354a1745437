//! Measures how fast bags are read, compared with other readers, on bags that it creates below
//! `target/bench/`.
//!
//! `cargo bench --bench reading [-- --gigabytes 10] [--keep]`. Other readers need Python with `rosbags`, `mcap` and
//! `zstandard`:
//! `BENCH_PYTHON=venv/bin/python`. Missing readers are reported and skipped. The table of a run is in `reading.md`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "a panic in a benchmark names its line, and the numbers are small"
)]

mod measure;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use bagreel::bag::{self, Connection, ConnectionId, Input, Message, OpenOptions, Sink, Want};
use bagreel::internals::base::notice::Notice;
use bagreel::internals::base::time::{Span, Stamp};
use measure::{Took, cpu, io_bytes, median, parse, peak_mb};

/// A robot's stream: topic, type, messages per second, bytes per message.
type Stream = (&'static str, &'static str, u32, usize);

/// A robot whose cameras produce most of the bag: about 17 MB/s with 15 images per second.
fn streams(pictures: u32) -> Vec<Stream> {
    vec![
        ("/camera/image", "sensor_msgs/Image", pictures, 1 << 20),
        ("/lidar/points", "sensor_msgs/PointCloud2", 10, 130_000),
        ("/imu/a", "sensor_msgs/Imu", 100, 320),
        ("/imu/b", "sensor_msgs/Imu", 100, 320),
        ("/odom", "nav_msgs/Odometry", 50, 720),
        ("/tf", "tf2_msgs/TFMessage", 100, 160),
        ("/joint_states", "sensor_msgs/JointState", 50, 400),
        ("/cmd_vel", "geometry_msgs/Twist", 20, 48),
        ("/rosout", "rosgraph_msgs/Log", 5, 180),
    ]
}

/// Every message of `seconds` seconds: stream, nanoseconds since 1970, in order of time.
fn messages(streams: &[Stream], seconds: u32) -> impl Iterator<Item = (usize, i64)> + '_ {
    (0..seconds).flat_map(move |second| {
        let mut all: Vec<(i64, usize)> = Vec::new();
        for (at, (_, _, hz, _)) in streams.iter().enumerate() {
            let step = 1_000_000_000 / i64::from(*hz);
            let nanos = |i| i64::from(second) * 1_000_000_000 + i * step + at as i64 * 1_000;
            all.extend((0..i64::from(*hz)).map(|i| (1_700_000_000_000_000_000 + nanos(i), at)));
        }
        all.sort_unstable();
        all.into_iter().map(|(time, at)| (at, time))
    })
}

/// Bytes that compress to about half.
fn noise() -> Vec<u8> {
    let mut state = 1u64;
    let mut bytes = Vec::with_capacity(2 << 20);
    while bytes.len() < 2 << 20 {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        bytes.extend((state >> 8).to_le_bytes());
        if state >> 60 & 1 == 0 {
            bytes.extend([0; 12]);
        }
    }
    bytes
}

// ---------------------------------------------------------------- ROS 1

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, value) in fields {
        bytes.extend(((name.len() + 1 + value.len()) as u32).to_le_bytes());
        bytes.extend(name.bytes().chain([b'=']).chain(value.iter().copied()));
    }
    bytes
}

/// A record up to its data, of which only the length is known.
fn head(named: &[(&str, &[u8])], data: usize) -> Vec<u8> {
    let header = fields(named);
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(header);
    bytes.extend((data as u32).to_le_bytes());
    bytes
}

fn time(nanos: i64) -> [u8; 8] {
    let mut bytes = [0; 8];
    bytes[..4].copy_from_slice(&((nanos / 1_000_000_000) as u32).to_le_bytes());
    bytes[4..].copy_from_slice(&((nanos % 1_000_000_000) as u32).to_le_bytes());
    bytes
}

/// How a ROS 1 bag is written.
#[derive(Clone, Copy, PartialEq)]
enum Body {
    Plain,
    /// The payloads are sparse: real headers and index, no disk space.
    Holes,
    Lz4,
}

fn connection(id: u32, (topic, kind, ..): &Stream) -> Vec<u8> {
    let data = fields(&[
        ("topic", topic.as_bytes()),
        ("type", kind.as_bytes()),
        ("md5sum", b"00000000000000000000000000000000"),
        ("message_definition", b"# none\n"),
        ("callerid", b"/robot"),
    ]);
    let mut bytes = head(
        &[
            ("conn", &id.to_le_bytes()),
            ("op", &[7]),
            ("topic", topic.as_bytes()),
        ],
        data.len(),
    );
    bytes.extend(data);
    bytes
}

fn bag_head(index_pos: u64, connections: u32, chunks: u32) -> Vec<u8> {
    let named: [(&str, &[u8]); 4] = [
        ("chunk_count", &chunks.to_le_bytes()),
        ("conn_count", &connections.to_le_bytes()),
        ("index_pos", &index_pos.to_le_bytes()),
        ("op", &[3]),
    ];
    let padding = 4096 - fields(&named).len();
    let mut bytes = head(&named, padding);
    bytes.extend(vec![b' '; padding]);
    bytes
}

struct Ros1<'a> {
    to: BufWriter<File>,
    at: u64,
    streams: &'a [Stream],
    body: Body,
    noise: Vec<u8>,
    infos: Vec<u8>,
    chunks: u32,
}

impl Ros1<'_> {
    fn put(&mut self, bytes: &[u8]) {
        self.to.write_all(bytes).unwrap();
        self.at += bytes.len() as u64;
    }

    fn payload(&mut self, len: usize) {
        if self.body == Body::Holes {
            self.to.seek_relative(len as i64).unwrap();
            self.at += len as u64;
        } else {
            let start = self.at as usize % (self.noise.len() - len);
            self.to.write_all(&self.noise[start..start + len]).unwrap();
            self.at += len as u64;
        }
    }

    /// A chunk of these messages, its index, and its entry for the tail.
    fn chunk(&mut self, messages: &[(usize, i64)], first: bool) {
        let mut index: BTreeMap<usize, Vec<(i64, u32)>> = BTreeMap::new();
        let mut parts = Vec::new();
        let mut len = 0;
        if first {
            for (id, stream) in self.streams.iter().enumerate() {
                let record = connection(id as u32, stream);
                len += record.len();
                parts.push((record, 0));
            }
        }
        for (stream, at) in messages {
            let size = self.streams[*stream].3;
            let id = (*stream as u32).to_le_bytes();
            let record = head(&[("conn", &id), ("op", &[2]), ("time", &time(*at))], size);
            index.entry(*stream).or_default().push((*at, len as u32));
            len += record.len() + size;
            parts.push((record, size));
        }
        let pos = self.at;
        let size = (len as u32).to_le_bytes();
        if self.body == Body::Lz4 {
            let mut plain = Vec::with_capacity(len);
            for (record, size) in &parts {
                plain.extend(record);
                let start = plain.len() % (self.noise.len() - size);
                plain.extend(&self.noise[start..start + size]);
            }
            let packed = lz4(&plain);
            self.put(&head(
                &[("compression", b"lz4"), ("op", &[5]), ("size", &size)],
                packed.len(),
            ));
            self.put(&packed);
        } else {
            self.put(&head(
                &[("compression", b"none"), ("op", &[5]), ("size", &size)],
                len,
            ));
            for (record, size) in &parts {
                self.put(record);
                self.payload(*size);
            }
        }
        self.index(&index, pos, messages);
    }

    fn index(
        &mut self,
        index: &BTreeMap<usize, Vec<(i64, u32)>>,
        pos: u64,
        messages: &[(usize, i64)],
    ) {
        let mut counts: Vec<u8> = Vec::new();
        for (id, entries) in index {
            let (id, count) = (
                (*id as u32).to_le_bytes(),
                (entries.len() as u32).to_le_bytes(),
            );
            counts.extend(id.iter().chain(&count));
            let named: [(&str, &[u8]); 4] = [
                ("conn", &id),
                ("count", &count),
                ("op", &[4]),
                ("ver", &[1, 0, 0, 0]),
            ];
            let mut record = head(&named, entries.len() * 12);
            for (at, offset) in entries {
                record.extend(time(*at));
                record.extend(offset.to_le_bytes());
            }
            self.put(&record);
        }
        let (first, last) = (messages[0].1, messages[messages.len() - 1].1);
        let connections = (index.len() as u32).to_le_bytes();
        let named: [(&str, &[u8]); 6] = [
            ("chunk_pos", &pos.to_le_bytes()),
            ("count", &connections),
            ("end_time", &time(last)),
            ("op", &[6]),
            ("start_time", &time(first)),
            ("ver", &[1, 0, 0, 0]),
        ];
        self.infos.extend(head(&named, counts.len()));
        self.infos.extend(counts);
        self.chunks += 1;
    }
}

fn lz4(plain: &[u8]) -> Vec<u8> {
    use lz4_flex::frame::{BlockSize, FrameEncoder, FrameInfo};
    let info = FrameInfo::new()
        .block_size(BlockSize::Max1MB)
        .content_checksum(true);
    let mut to = FrameEncoder::with_frame_info(info, Vec::new());
    to.write_all(plain).unwrap();
    to.finish().unwrap()
}

fn ros1(path: &Path, body: Body, streams: &[Stream], seconds: u32) {
    let mut bag = Ros1 {
        to: BufWriter::with_capacity(1 << 16, File::create(path).unwrap()),
        at: 0,
        streams,
        body,
        noise: noise(),
        infos: Vec::new(),
        chunks: 0,
    };
    bag.put(b"#ROSBAG V2.0\n");
    bag.put(&bag_head(0, 0, 0));
    let (mut open, mut len) = (Vec::new(), 0);
    for (stream, at) in messages(streams, seconds) {
        open.push((stream, at));
        len += streams[stream].3 + 60;
        if len >= 768 * 1024 {
            let first = bag.chunks == 0;
            bag.chunk(&open, first);
            open.clear();
            len = 0;
        }
    }
    bag.chunk(&open, bag.chunks == 0);
    let index_pos = bag.at;
    for (id, stream) in streams.iter().enumerate() {
        bag.put(&connection(id as u32, stream));
    }
    let infos = std::mem::take(&mut bag.infos);
    bag.put(&infos);
    let head = bag_head(index_pos, streams.len() as u32, bag.chunks);
    bag.to.seek(SeekFrom::Start(13)).unwrap();
    bag.to.write_all(&head).unwrap();
    bag.to.flush().unwrap();
}

// ---------------------------------------------------------------- ROS 2

fn mcap(path: &Path, streams: &[Stream], seconds: u32) {
    let to = BufWriter::new(File::create(path).unwrap());
    let options = ::mcap::WriteOptions::new()
        .profile("ros2")
        .compression(Some(::mcap::Compression::Lz4));
    let mut to = options.chunk_size(Some(786_432)).create(to).unwrap();
    let noise = noise();
    let channels: Vec<u16> = streams
        .iter()
        .map(|(topic, kind, ..)| {
            let schema = to.add_schema(kind, "ros2msg", b"").unwrap();
            to.add_channel(schema, topic, "cdr", &BTreeMap::new())
                .unwrap()
        })
        .collect();
    for (n, (stream, at)) in messages(streams, seconds).enumerate() {
        let header = ::mcap::records::MessageHeader {
            channel_id: channels[stream],
            sequence: n as u32,
            log_time: at as u64,
            publish_time: at as u64,
        };
        let start = n * 8 % (noise.len() - streams[stream].3);
        to.write_to_known_channel(&header, &noise[start..start + streams[stream].3])
            .unwrap();
    }
    to.finish().unwrap();
}

fn sqlite3(path: &Path, streams: &[Stream], seconds: u32) {
    let mut db = rusqlite::Connection::open(path).unwrap();
    db.execute_batch(
        "PRAGMA journal_mode = off; PRAGMA synchronous = off;
         CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
    )
    .unwrap();
    let noise = noise();
    let all = db.transaction().unwrap();
    for (id, (topic, kind, ..)) in streams.iter().enumerate() {
        let row = rusqlite::params![id as i64, topic, kind];
        all.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')", row)
            .unwrap();
    }
    {
        let mut insert = all
            .prepare("INSERT INTO messages VALUES (NULL, ?1, ?2, ?3)")
            .unwrap();
        for (n, (stream, at)) in messages(streams, seconds).enumerate() {
            let start = n * 8 % (noise.len() - streams[stream].3);
            let row =
                rusqlite::params![stream as i64, at, &noise[start..start + streams[stream].3]];
            insert.execute(row).unwrap();
        }
    }
    all.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)", [])
        .unwrap();
    all.commit().unwrap();
}

// ---------------------------------------------------------------- our side

/// Counts per connection and window of ten seconds, and the log records if wanted.
struct Counter {
    logs: bool,
    windows: Vec<BTreeMap<i64, u64>>,
    messages: u64,
    log_records: u64,
}

impl Sink for Counter {
    fn connection(&mut self, connection: &Connection) -> Want {
        self.windows.push(BTreeMap::new());
        if self.logs && connection.topic.as_str() == "/rosout" {
            Want::Payload
        } else {
            Want::Stamps
        }
    }

    fn stamps(&mut self, id: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
        self.messages += stamps.len() as u64;
        for at in stamps {
            *self.windows[id.0 as usize]
                .entry(at.0 / 10_000_000_000)
                .or_default() += 1;
        }
    }

    fn message(&mut self, _: Message<'_>) {
        self.log_records += 1;
    }

    fn notice(&mut self, notice: Notice) {
        println!("notice: {}", notice.text);
    }
}

/// Reads a bag in this process and prints the cost: `--one bag logs|counts start_s end_s rounds`.
fn one(args: &[String]) {
    let path = PathBuf::from(&args[0]);
    let part: Vec<i64> = args[2..4].iter().map(|s| s.parse().unwrap()).collect();
    let rounds: u32 = args[4].parse().unwrap();
    let mut counter = Counter {
        logs: args[1] == "logs",
        windows: Vec::new(),
        messages: 0,
        log_records: 0,
    };
    let (start, read_before) = (Instant::now(), io_bytes());
    for _ in 0..rounds {
        counter.windows.clear();
        let mut reader = bag::open(&Input::Path(path.clone()), &OpenOptions::default()).unwrap();
        let span = reader.span().unwrap().unwrap();
        let at = |s: i64| match s {
            0.. => span.start.plus(s * 1_000_000_000),
            _ => span.end.plus(s * 1_000_000_000),
        };
        let range = (part != [0, 0]).then(|| Span {
            start: at(part[0]),
            end: if part[1] == 0 { span.end } else { at(part[1]) },
        });
        reader.read(range, &mut counter).unwrap();
    }
    let n = f64::from(rounds);
    println!(
        "took {} {} {} {} {}",
        start.elapsed().as_secs_f64() / n,
        cpu() / n,
        (io_bytes() - read_before) as f64 / n,
        peak_mb(),
        counter.messages as f64 / n
    );
}

// ---------------------------------------------------------------- runs

fn ours(path: &Path, what: &str, (from, to): (i64, i64), rounds: u32) -> Option<Took> {
    let args = [
        "--one",
        path.to_str().unwrap(),
        what,
        &from.to_string(),
        &to.to_string(),
        &rounds.to_string(),
    ];
    let out = Command::new(std::env::current_exe().unwrap())
        .args(args)
        .output()
        .unwrap();
    parse(&out.stdout)
}

/// Runs a Python reader: `body` counts into `n`.
fn python(path: &Path, body: &str) -> Option<Took> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = format!(
        "import sys,time,resource\nP=sys.argv[1]\nn=0\n{body}\nr=resource.getrusage(resource.RUSAGE_SELF)\n\
         print('took',time.perf_counter()-t,time.process_time()-c,0,r.ru_maxrss/1024,n)"
    );
    let out = Command::new(python)
        .args(["-c", &script])
        .arg(path)
        .output()
        .ok()?;
    parse(&out.stdout)
}

const CLOCK: &str = "t=time.perf_counter();c=time.process_time()";

fn python_rosbags(path: &Path) -> Option<Took> {
    python(
        path,
        &format!(
            "from rosbags.rosbag1 import Reader\n{CLOCK}\nwith Reader(P) as b:\n for m in b.messages(): n+=1"
        ),
    )
}

fn python_mcap(path: &Path) -> Option<Took> {
    python(
        path,
        &format!(
            "from mcap.reader import make_reader\n{CLOCK}\nfor m in make_reader(open(P,'rb')).iter_messages(): n+=1"
        ),
    )
}

fn python_sqlite3(path: &Path) -> Option<Took> {
    python(
        path,
        &format!(
            "import sqlite3\n{CLOCK}\nfor m in sqlite3.connect(P).execute('select topic_id,timestamp,data from messages'): n+=1"
        ),
    )
}

/// The crate `rosbag`, all of it, in a process of its own.
fn crate_rosbag(path: &Path) {
    let (start, mut n) = (Instant::now(), 0u64);
    let bag = rosbag::RosBag::new(path).unwrap();
    for record in bag.chunk_records() {
        if let rosbag::ChunkRecord::Chunk(chunk) = record.unwrap() {
            n += chunk
                .messages()
                .filter(|m| matches!(m, Ok(rosbag::MessageRecord::MessageData(_))))
                .count() as u64;
        }
    }
    println!(
        "took {} {} 0 {} {n}",
        start.elapsed().as_secs_f64(),
        cpu(),
        peak_mb()
    );
}

/// The crate `mcap`'s `LinearReader`, all of it, in a process of its own.
fn crate_mcap(path: &Path) {
    use std::io::Read as _;

    use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};
    let (start, mut n) = (Instant::now(), 0u64);
    let mut file = File::open(path).unwrap();
    let mut reader = LinearReader::new();
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            LinearReadEvent::ReadRequest(need) => {
                let got = file.read(reader.insert(need)).unwrap();
                reader.notify_read(got);
            }
            LinearReadEvent::Record { opcode, .. } => n += u64::from(opcode == 5),
        }
    }
    println!(
        "took {} {} 0 {} {n}",
        start.elapsed().as_secs_f64(),
        cpu(),
        peak_mb()
    );
}

fn this(flag: &str, path: &Path) -> Option<Took> {
    let out = Command::new(std::env::current_exe().unwrap())
        .arg(flag)
        .arg(path)
        .output()
        .ok()?;
    parse(&out.stdout)
}

/// Drops the file's pages from memory.
fn cool(path: &Path) {
    let _ = Command::new("sync").status();
    let from = format!("if={}", path.display());
    let _ = Command::new("dd")
        .args([&from, "iflag=nocache", "count=0"])
        .stderr(std::process::Stdio::null())
        .status();
}

fn ratio(what: &str, ours: Option<Took>, theirs: Option<Took>, cpu: bool, goal: f64) {
    let (Some(ours), Some(theirs)) = (ours, theirs) else {
        return println!(
            "| {what} | left out: the other reader is not here | | | at least {goal}x |"
        );
    };
    assert!(
        (ours.messages - theirs.messages).abs() < 0.5,
        "{what}: {} and {}",
        ours.messages,
        theirs.messages
    );
    let pick = |t: Took| if cpu { t.cpu } else { t.wall };
    let (a, b) = (pick(ours), pick(theirs));
    println!(
        "| {what} | {a:.4} s | {b:.2} s | **{:.0}x** | at least {goal}x |",
        b / a.max(1e-6)
    );
}

fn share(what: &str, path: &Path, took: Option<Took>, goal: f64) {
    let Some(took) = took else { return };
    let size = path.metadata().unwrap().len() as f64;
    let percent = 100.0 * took.bytes / size;
    println!(
        "| {what} | {:.1} MB of {:.0} MB | | {percent:.2} % | at most {goal} % |",
        took.bytes / 1e6,
        size / 1e6
    );
}

const WHOLE: (i64, i64) = (0, 0);

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.first().map(String::as_str) {
        Some("--one") => return one(&args[1..]),
        Some("--crate-rosbag") => return crate_rosbag(Path::new(&args[1])),
        Some("--crate-mcap") => return crate_mcap(Path::new(&args[1])),
        _ => {}
    }
    let flag = |name: &str| args.iter().position(|a| a == name);
    let gigabytes: u32 = flag("--gigabytes").map_or(10, |at| args[at + 1].parse().unwrap());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/bench");
    fs::create_dir_all(&folder).unwrap();
    println!("| what | ours | other | | goal |\n|---|---|---|---|---|");
    uncompressed(&folder, gigabytes);
    compressed(&folder);
    ros2(&folder);
    fifty(&folder);
    growth(&folder);
    if flag("--keep").is_none() {
        fs::remove_dir_all(&folder).unwrap();
    }
}

fn uncompressed(folder: &Path, gigabytes: u32) {
    let bag = folder.join("plain.bag");
    ros1(&bag, Body::Plain, &streams(15), gigabytes * 58);
    let run = |what: &str| median(5, || ours(&bag, what, WHOLE, 1));
    let rosbags = median(1, || python_rosbags(&bag));
    let rosbags = rosbags.and(median(3, || python_rosbags(&bag)));
    let counts = run("counts");
    ratio(
        &format!("ROS 1 {gigabytes} GB, counts, warm, against pip `rosbags`"),
        counts,
        rosbags,
        false,
        100.0,
    );
    ratio(
        "the same and all log records",
        run("logs"),
        rosbags,
        false,
        50.0,
    );
    share("bytes read, .bag", &bag, counts, 1.0);
    let cold = median(3, || {
        cool(&bag);
        ours(&bag, "counts", WHOLE, 1)
    });
    cool(&bag);
    ratio(
        "counts, cold, against pip `rosbags`",
        cold,
        python_rosbags(&bag),
        false,
        30.0,
    );
    fs::remove_file(bag).unwrap();
}

fn compressed(folder: &Path) {
    let bag = folder.join("lz4.bag");
    ros1(&bag, Body::Lz4, &streams(15), 116);
    let full = median(3, || this("--crate-rosbag", &bag));
    let counts = median(5, || ours(&bag, "counts", WHOLE, 20));
    ratio(
        "ROS 1 lz4 (2 GB plain), counts, processor time, against crate `rosbag`",
        counts,
        full,
        true,
        200.0,
    );
    let logs = median(3, || ours(&bag, "logs", WHOLE, 1));
    ratio(
        "the same and all log records (in about 30 % of the chunks)",
        logs,
        full,
        true,
        3.0,
    );
    fs::remove_file(bag).unwrap();
}

fn ros2(folder: &Path) {
    let bag = folder.join("lz4.mcap");
    mcap(&bag, &streams(15), 116);
    let counts = median(5, || ours(&bag, "counts", WHOLE, 5));
    ratio(
        "MCAP LZ4 (2 GB plain), counts, warm, against python `mcap`",
        counts,
        median(1, || python_mcap(&bag)),
        false,
        200.0,
    );
    ratio(
        "… against Rust `LinearReader`",
        counts,
        median(3, || this("--crate-mcap", &bag)),
        false,
        50.0,
    );
    share("bytes read, .mcap", &bag, counts, 1.0);
    fs::remove_file(&bag).unwrap();
    let bag = folder.join("big.db3");
    sqlite3(&bag, &streams(15), 116);
    let counts = median(5, || ours(&bag, "counts", WHOLE, 1));
    ratio(
        "SQLite 2 GB, counts, warm, against python with data",
        counts,
        median(3, || python_sqlite3(&bag)),
        false,
        10.0,
    );
    share("bytes read, .db3", &bag, counts, 3.0);
    fs::remove_file(&bag).unwrap();
}

fn fifty(folder: &Path) {
    let bag = folder.join("fifty.bag");
    ros1(&bag, Body::Holes, &streams(66), 708);
    let whole = median(5, || ours(&bag, "counts", WHOLE, 1)).unwrap();
    let size = bag.metadata().unwrap().len() as f64 / 1e9;
    println!(
        "| {size:.0} GB of 11.8 min, every window, warm | {:.3} s, peak {:.0} MB | | | at most 0.2 s |",
        whole.wall, whole.peak_mb
    );
    let part = |part| median(9, || ours(&bag, "counts", part, 1)).unwrap().wall;
    let (start, end) = (part((0, 60)), part((-60, 0)));
    println!(
        "| 60 s at its start and at its end | {start:.4} s, {end:.4} s | | {:.0} %, {:.2} and {:.2} of the whole | equal within 20 %, at most 0.2 |",
        100.0 * (start / end - 1.0),
        start / whole.wall,
        end / whole.wall
    );
    fs::remove_file(bag).unwrap();
}

fn growth(folder: &Path) {
    for gigabytes in [1, 10] {
        let bag = folder.join("growth.bag");
        ros1(&bag, Body::Holes, &streams(15), gigabytes * 58);
        let took = median(5, || ours(&bag, "counts", WHOLE, 5)).unwrap();
        println!(
            "| {gigabytes} GB (holes), counts, warm | {:.4} s, {:.1} MB read, peak {:.1} MB | | | linear, memory flat |",
            took.wall,
            took.bytes / 1e6,
            took.peak_mb
        );
        fs::remove_file(bag).unwrap();
    }
}
