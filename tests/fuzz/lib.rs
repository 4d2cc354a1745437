//! What the targets share: bytes as a file, a bag read into nothing, a message of any type read into a graph.

use std::collections::BTreeMap;
use std::path::Path;

use bagreel::bag::{self, Connection, ConnectionId, Input, Message, OpenOptions, Sink, Want};
use bagreel::internals::base::notice::Notice;
use bagreel::internals::base::time::Stamp;
use bagreel::internals::pipeline::{Reading, Unwatched, read};

/// Calls `with` with a file of this name that holds `bytes`, in memory where the system has such a folder.
pub fn as_file(name: &str, bytes: &[u8], with: impl FnOnce(&Path)) {
    let memory = Path::new("/dev/shm");
    let dir = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    let dir = dir.expect("a folder");
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    with(&path);
}

/// Wants everything, keeps nothing, and holds the reader to its promises.
#[derive(Default)]
struct Nothing {
    connections: u32,
    stamps: u64,
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
    }
}

/// Reads whatever lies there, every payload of it.
pub fn read_bag(path: &Path, verify: bool) {
    let input = Input::Path(path.to_owned());
    if let Ok(mut reader) = bag::open(&input, &OpenOptions { verify, ..OpenOptions::default() }) {
        let _ = reader.span();
        let mut nothing = Nothing::default();
        if reader.read(None, &mut nothing).is_ok() {
            // Every message takes bytes, but for those that a compressed chunk or row holds.
            assert!(nothing.stamps < 100_000_000, "{} messages", nothing.stamps);
        }
    }
}

/// Reads whatever lies there into graphs.
pub fn read_graphs(path: &Path) {
    let reading = Reading::of([path]);
    if let Ok(mission) = read(&reading, &mut Unwatched) {
        assert!(!mission.windows.is_empty());
    }
}

/// Topics and types of which some source reads the messages.
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

/// A bag of one connection, whose type the first byte chooses, and of one message of these bytes.
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
