//! Shared code of the fuzz targets: bytes as a file, reading a bag without output, reading a message into a graph.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use bagreel::bag::{self, Connection, ConnectionId, Input, Message, OpenOptions, Sink, Want};
use bagreel::internals::base::notice::{Notice, NoticeKind};
use bagreel::internals::base::time::Stamp;
use bagreel::internals::pipeline::{Reading, Unwatched, read};
use bagreel::{Output, Render};
use tests::support::tiny;

#[allow(dead_code, unexpected_cfgs, reason = "shared with the tests")]
#[path = ".."]
mod tests {
    pub mod support;
}

/// Calls `with` with a file of this name and content, in memory if the system has such a folder: it may take a second
/// of processor time and one more per megabyte, though the code is instrumented.
pub fn as_file(name: &str, bytes: &[u8], with: impl FnOnce(&Path)) {
    let memory = Path::new("/dev/shm");
    let dir = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    let dir = dir.expect("a folder");
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    let before = processor_time();
    with(&path);
    let took = processor_time() - before;
    let most = Duration::from_secs(1) + Duration::from_micros(bytes.len() as u64);
    assert!(took < most, "{took:?} of processor time for {} bytes", bytes.len());
}

/// The processor time of this process so far, if `/proc` reports it, in hundredths of a second.
fn processor_time() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the process, in parentheses, may contain spaces.
    let behind = stat.rsplit(')').next().unwrap_or_default();
    let ticks = behind.split_whitespace().skip(11).take(2);
    Duration::from_millis(ticks.filter_map(|n| n.parse::<u64>().ok()).sum::<u64>() * 10)
}

/// A sink that wants everything, keeps nothing, and checks the reader's contract.
#[derive(Default)]
struct Nothing {
    connections: u32,
    stamps: u64,
    /// Whether a notice reports lost or skipped data.
    is_said: bool,
}

impl Sink for Nothing {
    fn connection(&mut self, connection: &Connection) -> Want {
        assert_eq!(connection.id.0, self.connections, "ids have no holes");
        self.connections += 1;
        Want::Payload
    }

    fn stamps(&mut self, id: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        assert!(id.0 < self.connections, "announced before");
        assert!(sizes.is_none_or(|s| s.len() == stamps.len()), "a size for each");
        self.stamps += stamps.len() as u64;
    }

    fn message(&mut self, message: Message<'_>) {
        assert!(message.connection.0 < self.connections, "announced before");
        assert!(message.data.len() <= message.size as usize, "a head is no longer than the whole");
    }

    fn notice(&mut self, notice: Notice) {
        assert!(notice.count > 0 && !notice.text.is_empty());
        self.is_said |= notice.kind.is_loss() || notice.kind == NoticeKind::Note;
    }
}

/// Reads an input with all payloads.
pub fn read_bag(path: &Path, verify: bool) {
    let input = Input::Path(path.to_owned());
    if let Ok(mut reader) = bag::open(&input, &OpenOptions { verify }) {
        let _ = reader.span();
        let mut nothing = Nothing::default();
        if reader.read(None, &mut nothing).is_ok() {
            // Every message takes bytes, except in a compressed chunk or row.
            assert!(nothing.stamps < 100_000_000, "{} messages", nothing.stamps);
        }
    }
}

/// The number of messages in a bag, and whether a notice reports a loss; `None` if it cannot be opened.
fn count(bytes: &[u8], verify: bool) -> Option<(u64, bool)> {
    let mut counted = None;
    as_file("x", bytes, |path| {
        let input = Input::Path(path.to_owned());
        let Ok(mut reader) = bag::open(&input, &OpenOptions { verify }) else {
            return;
        };
        let mut nothing = Nothing::default();
        if let Ok(report) = reader.read(None, &mut nothing) {
            counted = Some((nothing.stamps, nothing.is_said || !report.complete));
        }
    });
    counted
}

/// The healthy bags that targets damage.
static BAGS: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(tiny::bags);

/// A healthy file of any format, damaged as encoded in the bytes: up to four edits of five bytes, each a kind, a place and
/// another place or number. Bits change, zeros are written, records and chunks are exchanged or doubled, the end is cut.
/// Returns its name and whether it was cut.
fn damaged(bytes: &[u8]) -> Option<(&'static str, Vec<u8>, bool)> {
    let (way, edits) = bytes.split_first()?;
    let (name, healthy) = &BAGS[usize::from(*way) % BAGS.len()];
    let (mut file, mut is_cut) = (healthy.clone(), false);
    for edit in edits.chunks_exact(5).take(4) {
        let number = |at: usize| usize::from(u16::from_le_bytes([edit[at], edit[at + 1]]));
        let len = file.len();
        let (at, other) = (number(1) % len, number(3) % len);
        let (low, high) = (at.min(other), at.max(other));
        match edit[0] % 6 {
            0 | 1 => file[at] ^= edit[3],
            2 => file[at..len.min(at + (8 << (edit[3] % 7)))].fill(0),
            3 => {
                let part = (high - low).min(len - high).min(600);
                for byte in 0..part {
                    file.swap(low + byte, high + byte);
                }
            }
            4 => {
                let part = file[low..high.min(low + 600)].to_vec();
                file.splice(high..high, part);
            }
            _ => {
                file.truncate(at.max(1));
                is_cut = true;
            }
        }
    }
    Some((name, file, is_cut))
}

/// Damages a healthy file: losses must be reported, by both readings. The killed recorder of a ROS 1 bag
/// may have stopped between two records.
pub fn damage(bytes: &[u8]) {
    let Some((name, file, is_cut)) = damaged(bytes) else {
        return;
    };
    let is_open = is_cut && name.starts_with("front") && name.ends_with(".bag");
    for verify in [false, true] {
        if let Some((found, is_said)) = count(&file, verify) {
            let is_whole = found >= tiny::MESSAGES as u64;
            assert!(is_whole || is_said || is_open, "{name}: {found} messages without a notice");
        }
    }
}

/// Damages a healthy file and compresses it as a whole: losses must be reported.
pub fn damage_packed(bytes: &[u8]) {
    let Some((name, file, is_cut)) = damaged(bytes) else {
        return;
    };
    let is_open = is_cut && name.starts_with("front") && name.ends_with(".bag");
    if let Some((found, is_said)) = count(&packed(&file), false) {
        let is_whole = found >= tiny::MESSAGES as u64;
        assert!(is_whole || is_said || is_open, "{name}: {found} messages without a notice");
    }
}

/// The bytes as a Zstandard frame.
pub fn packed(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 1).expect("a frame")
}

/// Damages two or three healthy files and reads them into one mission.
pub fn several(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    let parts = bytes.chunks(bytes.len().div_ceil(3).max(6)).filter_map(damaged);
    let paths = parts.enumerate().map(|(at, (name, file, _))| {
        let path = folder.path().join(format!("{at}_{name}"));
        std::fs::write(&path, file).expect("a file");
        path
    });
    let paths: Vec<_> = paths.collect();
    if let Ok(mission) = read(&Reading::of(paths), &mut Unwatched) {
        assert!(!mission.windows.is_empty());
    }
}

/// Renders a bag to a path made of parts chosen by the bytes: the bag must stay unchanged.
pub fn outputs(bytes: &[u8]) {
    const PARTS: [&str; 8] = ["..", ".", "a", "new", "x.mcap", "link.json", "0.mcap", "{n}.mcap"];
    let folder = tempfile::tempdir().expect("a folder");
    let inside = folder.path().join("a");
    std::fs::create_dir(&inside).expect("a folder");
    let (_, bag) = tiny::bags().swap_remove(5);
    let path = inside.join("x.mcap");
    std::fs::write(&path, &bag).expect("a file");
    std::fs::hard_link(&path, inside.join("0.mcap")).expect("a link");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&path, inside.join("link.json")).expect("a link");
    let mut to = inside.clone();
    // Two steps up at most, so that nothing is written elsewhere.
    let steps = bytes.iter().take(6).map(|byte| PARTS[usize::from(byte % 8)]);
    let mut up = 0;
    for step in steps {
        up += u32::from(step == "..");
        if up < 2 {
            to.push(step);
        }
    }
    let Ok(output) = Output::parse(&to.display().to_string(), Some("json")) else {
        return;
    };
    if let Ok(job) = Render::new(bagreel::Reading::of([&path]), vec![output]) {
        let _ = bagreel::render(&job);
    }
    assert!(std::fs::read(&path).expect("the bag") == bag, "overwritten by {}", to.display());
}

/// Reads an input into graphs.
pub fn read_graphs(path: &Path) {
    let reading = Reading::of([path]);
    if let Ok(mission) = read(&reading, &mut Unwatched) {
        assert!(!mission.windows.is_empty());
    }
}

/// Topics and types whose messages are read by an evidence source.
const KNOWN: &[(&str, &str)] = &[
    ("/rosout", "rosgraph_msgs/Log"),
    ("/statistics", "rosgraph_msgs/TopicStatistics"),
    ("/move_base/status", "actionlib_msgs/GoalStatusArray"),
    ("/diagnostics", "diagnostic_msgs/DiagnosticArray"),
    ("/bond", "bond/Status"),
    ("/planner/parameter_updates", "dynamic_reconfigure/Config"),
    ("/rosout", "rcl_interfaces/msg/Log"),
    ("/parameter_events", "rcl_interfaces/msg/ParameterEvent"),
    ("/walk/_action/status", "action_msgs/msg/GoalStatusArray"),
    ("/walk/_action/feedback", "walker/action/Walk_FeedbackMessage"),
    ("/node/transition_event", "lifecycle_msgs/msg/TransitionEvent"),
    ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),
    ("/bond", "bond/msg/Status"),
    ("/rosgraph", "rosgraph_monitor_msgs/msg/Graph"),
    ("/topic_statistics", "rosgraph_monitor_msgs/msg/TopicStatistics"),
    ("/statistics", "statistics_msgs/msg/MetricsMessage"),
    ("/ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo"),
    ("/add/_service_event", "example_interfaces/srv/AddTwoInts_Event"),
    ("/odd", "odd/msg/Odd"),
];

/// Reads a bag with one connection, whose type is chosen by the first byte, and one message of these bytes.
pub fn read_message(encoding: &str, definition: &[u8], bytes: &[u8]) {
    let Some((choice, payload)) = bytes.split_first() else {
        return;
    };
    let (topic, kind) = KNOWN[*choice as usize % KNOWN.len()];
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut file).expect("a writer");
    let how = if encoding == "ros1" { "ros1msg" } else { "ros2msg" };
    let schema = writer.add_schema(kind, how, definition).expect("a schema");
    let channel = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).expect("a channel");
    for second in 1..4u64 {
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: second * 1_000_000_000,
            publish_time: 0,
        };
        writer.write_to_known_channel(&header, payload).expect("a message");
    }
    writer.finish().expect("an end");
    drop(writer);
    as_file("one.mcap", &file.into_inner(), read_graphs);
}
