//! Tests with recordings whose time is not monotonic, derived from a healthy one: the robot's events are reported as
//! for that one, and the recorder's as interruptions.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use bagreel::bag::{self, Connection, Input, Message, OpenOptions, Sink, Want};
use bagreel::internals::base::notice::{Notice, NoticeKind};
use bagreel::internals::base::time::Stamp;
use bagreel::internals::mission::Mission;
use bagreel::internals::mission::event_log::Kind;
use bagreel::{Reading, read};

use crate::support::rosbag1::{Pack, write};
use crate::support::snapshot::assert_snapshot;
use crate::support::{ORIGIN, Publisher, Recording};

const SECOND: i64 = 1_000_000_000;

/// A sink that copies everything into a recording.
#[derive(Default)]
struct Copied(Recording);

impl Sink for Copied {
    fn connection(&mut self, connection: &Connection) -> Want {
        let text =
            |text: &Option<std::sync::Arc<str>>| text.as_deref().unwrap_or_default().to_owned();
        self.0.publishers.push(Publisher {
            node: connection
                .publisher
                .as_ref()
                .map(ToString::to_string)
                .unwrap_or_default(),
            topic: connection.topic.to_string(),
            type_name: connection.type_name.to_string(),
            latching: connection.latching,
            qos: String::new(),
            definition: text(&connection.definition),
        });
        Want::Payload
    }

    fn stamps(&mut self, _: bag::ConnectionId, _: &[Stamp], _: Option<&[u32]>) {}

    fn message(&mut self, message: Message<'_>) {
        let publisher = message.connection.0 as usize;
        self.0
            .messages
            .push((publisher, message.time.0, message.data.to_vec()));
    }

    fn notice(&mut self, _: Notice) {}
}

/// The topics whose contents show nodes.
const LOGS: [&str; 3] = ["/rosout", "/rosout_agg", "/statistics"];

/// The healthy recording, with its first moment and its length.
struct Healthy {
    all: Recording,
    begin: i64,
    length: i64,
    /// The topics in the order of their names.
    topics: Vec<String>,
}

impl Healthy {
    fn new() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
        let mut copied = Copied::default();
        let mut reader = bag::open(&Input::Path(path), &OpenOptions::default()).unwrap();
        reader.read(None, &mut copied).unwrap();
        let all = copied.0;
        let times = || all.messages.iter().map(|m| m.1);
        let (begin, end) = (times().min().unwrap(), times().max().unwrap());
        let mut topics: Vec<String> = all.publishers.iter().map(|p| p.topic.clone()).collect();
        topics.sort();
        topics.dedup();
        Self {
            begin,
            length: end - begin,
            topics,
            all,
        }
    }

    /// A copy with other times, seconds after the first moment of the healthy one, and without some messages.
    fn copy(&self, mut time: impl FnMut(&str, i64) -> Option<i64>) -> Recording {
        let mut copy = self.all.clone();
        copy.messages.retain_mut(|(publisher, at, _)| {
            let moved = time(&self.all.publishers[*publisher].topic, *at - self.begin);
            *at = self.begin + moved.unwrap_or(0);
            moved.is_some()
        });
        copy
    }

    /// A copy without this percentage of the messages; `dice` decides which.
    fn lossy(&self, percent: u64, mut dice: u64) -> Recording {
        self.copy(|_, at| {
            dice = dice
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((dice >> 33) % 100 >= percent).then_some(at)
        })
    }

    /// The recording of another robot, with other contents but on the topics that both read, this much later.
    fn another(&self, later: i64, read: &[&str]) -> Recording {
        let mut copy = self.copy(|_, at| Some(at + later));
        for (publisher, _, payload) in &mut copy.messages {
            let topic = &self.all.publishers[*publisher].topic;
            let is_read = read.contains(&topic.as_str());
            if let Some(last) = payload.last_mut().filter(|_| !is_read) {
                *last ^= 1;
            }
        }
        copy
    }

    /// The recording with a copy of it behind, as a script writes them into one file.
    fn appended(&self, time: impl FnMut(&str, i64) -> Option<i64>) -> Recording {
        let mut all = self.all.clone();
        all.messages.extend(self.copy(time).messages);
        all
    }

    /// Whether a topic belongs to the first half of all of them.
    fn is_first(&self, topic: &str) -> bool {
        let place = self.topics.iter().position(|t| t == topic).unwrap();
        place < self.topics.len() / 2
    }
}

/// The mission of some recordings, read with these changes to the reading of their paths.
fn mission(recordings: &[Recording], change: impl FnOnce(&mut Reading, &[PathBuf])) -> Mission {
    let folder = tempfile::tempdir().unwrap();
    let place = |(at, recording): (usize, &Recording)| -> PathBuf {
        let path = folder.path().join(format!("{at}.bag"));
        std::fs::write(&path, write(recording, Pack::None, 768 * 1024)).unwrap();
        path
    };
    let paths: Vec<PathBuf> = recordings.iter().enumerate().map(place).collect();
    let mut reading = Reading::of(paths.clone());
    change(&mut reading, &paths);
    read(&reading).unwrap()
}

/// One line per mission: the number of headlines, the restarts, the interruptions, the notes.
fn shown(name: &str, recordings: &[Recording]) -> String {
    let mission = mission(recordings, |_, _| {});
    let mut line = format!("{name}:");
    for kind in Kind::ALL {
        let entries = mission.log.events.iter();
        let many = entries
            .filter(|e| e.kind == kind && e.is_headline())
            .count();
        if many > 0 {
            write!(line, " {many} {}", kind.word()).unwrap();
        }
    }
    line.push_str(&details(&mission));
    line
}

fn details(mission: &Mission) -> String {
    let mut text = String::new();
    let seconds = |time: Stamp| mission.offset(time) / SECOND;
    for entry in mission
        .log
        .events
        .iter()
        .filter(|e| e.kind == Kind::Restarted && e.is_headline())
    {
        let (node, _) = mission.elements.ends(entry.what);
        let role = &mission.elements.nodes[node.unwrap()].role;
        write!(text, "\n  {} restarted at {} s", role, seconds(entry.time)).unwrap();
    }
    for one in &mission.log.interruptions {
        let (word, length) = (one.kind.word(), one.length as f64 / 1e9);
        write!(text, "\n  {word} at {} s: {length:.1} s", seconds(one.time)).unwrap();
    }
    for notice in mission.notices.iter() {
        if matches!(notice.kind, NoticeKind::Note | NoticeKind::ImpossibleTime) {
            write!(text, "\n  note: {} (×{})", notice.text, notice.count).unwrap();
        }
    }
    text.push('\n');
    text
}

#[test]
#[expect(clippy::too_many_lines, reason = "a recording after the other")]
fn clock_faults_are_attributed_to_the_recorder() {
    let healthy = Healthy::new();
    let (length, half) = (healthy.length, healthy.length / 2);
    let from_half = |at: i64, step: i64| if at < half { at } else { at + step };
    let begin = healthy.begin;
    let holes = [1, 2, 4].map(|fifth| length * fifth / 5);
    let in_hole = |at: i64| {
        holes
            .iter()
            .any(|hole| (*hole..*hole + 3 * SECOND).contains(&at))
    };
    let first = |at: i64, topic: &str| healthy.is_first(topic).then_some(at);
    let second = |at: i64, topic: &str| (!healthy.is_first(topic)).then_some(at);
    let all = [
        ("healthy", vec![healthy.copy(|_, at| Some(at))]),
        (
            "without /rosout_agg",
            vec![healthy.copy(|topic, at| (topic != "/rosout_agg").then_some(at))],
        ),
        ("3 % lost", vec![healthy.lossy(3, 2_463_534_245)]),
        ("10 % lost", vec![healthy.lossy(10, 2_463_534_252)]),
        ("30 % lost", vec![healthy.lossy(30, 2_463_534_272)]),
        (
            "three times 3 s not recorded",
            vec![healthy.copy(|_, at| (!in_hole(at)).then_some(at))],
        ),
        (
            "a fifth not recorded",
            vec![healthy.copy(|_, at| (!(half..half + length / 5).contains(&at)).then_some(at))],
        ),
        (
            "5 s ahead",
            vec![healthy.copy(|_, at| Some(from_half(at, 5 * SECOND)))],
        ),
        (
            "an hour ahead",
            vec![healthy.copy(|_, at| Some(from_half(at, 3600 * SECOND)))],
        ),
        (
            "20 s back",
            vec![healthy.copy(|_, at| Some(from_half(at, -20 * SECOND)))],
        ),
        (
            "simulated",
            vec![healthy.copy(|_, at| Some(at - begin + SECOND / 100))],
        ),
        (
            "simulated, and begun again half way",
            vec![healthy.copy(|_, at| Some(from_half(at, -half) - begin + SECOND / 100))],
        ),
        (
            "simulated after 2 s",
            vec![healthy.copy(|_, at| {
                Some(if at < 2 * SECOND {
                    at
                } else {
                    at - begin + SECOND / 100
                })
            })],
        ),
        (
            "five times as slow",
            vec![healthy.copy(|_, at| Some(at * 5))],
        ),
        (
            "two robots with the same names",
            vec![
                healthy.copy(|_, at| Some(at)),
                healthy.another(5_012_345_678, &LOGS),
            ],
        ),
        (
            "two recorders of one robot, one 5 s ahead",
            vec![
                healthy.copy(|_, at| Some(at)),
                healthy.copy(|_, at| Some(at + 5_012_345_678)),
            ],
        ),
        (
            "one recording appended to another",
            vec![healthy.appended(|topic, at| second(at + 3_000_000, topic))],
        ),
        (
            "half of the topics each",
            vec![
                healthy.copy(|topic, at| first(at, topic)),
                healthy.copy(|topic, at| second(at, topic)),
            ],
        ),
        (
            "half of the topics each, one 30 s ahead",
            vec![
                healthy.copy(|topic, at| first(at, topic)),
                healthy.copy(|topic, at| second(at + 30 * SECOND, topic)),
            ],
        ),
        (
            "half of the topics each, one for a third of the time",
            vec![
                healthy.copy(|topic, at| first(at, topic)),
                healthy.copy(|topic, at| {
                    second(at, topic).filter(|at| (half..length * 5 / 6).contains(at))
                }),
            ],
        ),
    ];
    let lines = all.iter().map(|(name, recordings)| shown(name, recordings));
    assert_snapshot("clocks.txt", &lines.collect::<String>());
}

#[test]
fn a_jump_of_years_is_no_silence() {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "std_msgs/Empty");
    for start in [0, 700 * 86_400_000] {
        bag.send(scan, (start, start + 20_000), 1_000, &[]);
    }
    let text = shown("jump", &[bag]);
    assert!(
        text.contains("nothing_recorded at 19 s: 60479981.0 s"),
        "{text}"
    );
    assert!(!text.contains("silent"), "{text}");
}

#[test]
fn two_robots_with_the_same_names_are_distinguished_by_a_namespace() {
    let healthy = Healthy::new();
    let alone = mission(&[healthy.copy(|_, at| Some(at))], |_, _| {});
    let both = [
        healthy.copy(|_, at| Some(at)),
        healthy.another(5_012_345_678, &LOGS),
    ];
    let both = mission(&both, |reading, paths| {
        reading
            .namespaces
            .push((paths[1].clone(), "/second".to_owned()));
    });
    let nodes = |mission: &Mission| mission.elements.nodes.len();
    assert_eq!(nodes(&both), 2 * nodes(&alone));
    let count = |mission: &Mission, kind: Kind| {
        let entries = mission.log.events.iter();
        entries
            .filter(|e| e.kind == kind && e.is_headline())
            .count()
    };
    // A restart with the same headers as another is attributed to a relay.
    for kind in [Kind::Stopped, Kind::HandedOver, Kind::Rate] {
        assert_eq!(
            count(&both, kind),
            2 * count(&alone, kind),
            "{}",
            kind.word()
        );
    }
    assert!(!says(&both, "restarts are unknown"));
}

#[test]
fn two_robots_that_receive_the_same_of_their_fleet_are_two() {
    let healthy = Healthy::new();
    let common = [&LOGS[..], &["/robot1/odom", "/robot2/odom"]].concat();
    let both = [
        healthy.copy(|_, at| Some(at)),
        healthy.another(2_000_000, &common),
    ];
    let both = mission(&both, |_, _| {});
    assert!(!says(&both, "recorded twice"), "{:?}", both.notices);
    assert!(says(&both, "restarts of these nodes are unknown"));
}

#[test]
fn what_one_recorder_loses_is_taken_from_the_other() {
    let healthy = Healthy::new();
    let end = healthy.length / 10 * 7;
    let complete = healthy.copy(|_, at| (at < end).then_some(at + 800_000_000 + at % 5_000_000));
    let both = mission(&[healthy.lossy(25, 7), complete], |_, _| {});
    let alone = mission(&[healthy.copy(|_, at| Some(at))], |_, _| {});
    // A silence, and since when a topic is received, may be known by a lost message only.
    let certain = |mission: &Mission| {
        let all = headlines(mission).into_iter();
        let all = all.filter(|of| ![Kind::Silent, Kind::Appeared].contains(&of.0));
        all.collect::<Vec<_>>()
    };
    assert_eq!(certain(&both), certain(&alone));
}

#[test]
fn the_offset_of_a_clock_is_estimated_from_common_messages() {
    let healthy = Healthy::new();
    let late = |topic: &str, at: i64| (topic != "/robot1/scan").then_some(at + 350_000_000);
    let recordings = [
        healthy.copy(|topic, at| (topic != "/robot2/scan").then_some(at)),
        healthy.copy(late),
    ];
    let notes = |offset: Option<i64>| -> Vec<String> {
        let mission = mission(&recordings, |reading, paths| {
            let offset = offset.map(|offset| (paths[1].clone(), offset));
            reading.offsets.extend(offset);
        });
        let notes = mission.notices.iter().map(|n| n.text.clone());
        notes.filter(|text| text.contains("the clock of")).collect()
    };
    // A wrong offset is not corrected, but the note contains the whole one.
    for offset in [0, -100_000_000] {
        let found = notes(Some(offset));
        assert!(
            found.len() == 1 && found[0].contains("1.bag=-0.350s` corrects it"),
            "{found:?}"
        );
    }
    assert_eq!(notes(Some(-350_000_000)), [] as [&str; 0]);
    let found = notes(None);
    assert!(
        found.len() == 1 && found[0].contains("corrected; `--offset 1.bag=0s`"),
        "{found:?}"
    );
}

/// Whether a notice of a mission contains this text.
fn says(mission: &Mission, text: &str) -> bool {
    mission.notices.iter().any(|n| n.text.contains(text))
}

/// The headlines of a mission, each with its time in seconds, sorted.
fn headlines(mission: &Mission) -> Vec<(Kind, String, i64)> {
    let all = mission.log.headlines(mission.span).map(|(_, event)| {
        let (node, topic) = mission.elements.ends(event.what);
        let node = node.map(|id| mission.elements.nodes[id].name.as_str());
        let topic = topic.map(|id| mission.elements.topics[id].name.as_str());
        let name = format!("{} {}", node.unwrap_or_default(), topic.unwrap_or_default());
        (event.kind, name, mission.offset(event.time) / SECOND)
    });
    let mut all: Vec<_> = all.collect();
    all.sort();
    all
}

#[test]
fn recordings_that_were_merged_and_sorted_count_once() {
    let healthy = Healthy::new();
    let alone = mission(&[healthy.copy(|_, at| Some(at))], |_, _| {});
    for late in [4_000_000, 300_000_000] {
        // A second recorder of every second topic, over most of the time.
        let covered = healthy.length / 50..healthy.length / 10 * 9;
        let is_second =
            |topic: &str| healthy.topics.iter().position(|t| t == topic).unwrap() % 2 == 0;
        let again = |topic: &str, at: i64| {
            let jitter = at % 5_000_000;
            (is_second(topic) && covered.contains(&at)).then_some(at + late + jitter)
        };
        let mut both = healthy.appended(again);
        both.messages.sort_by_key(|message| message.1);
        let merged = mission(&[both], |_, _| {});
        assert!(
            says(&merged, "messages of `0.bag`, recorded twice"),
            "{:?}",
            merged.notices
        );
        assert_eq!(headlines(&merged), headlines(&alone));
    }
    // A camera that sends every image twice is one recorder.
    let mut bag = Recording::default();
    for topic in ["/image", "/info"] {
        let place = bag.publisher("/camera", topic, "std_msgs/UInt16");
        for at in 0..600_i64 {
            let number = u16::try_from(at / 2).unwrap().to_le_bytes();
            bag.messages
                .push((place, ORIGIN + at * SECOND / 10, number.to_vec()));
        }
    }
    let camera = mission(&[bag], |_, _| {});
    assert!(!says(&camera, "recorded twice"));
}

#[test]
fn of_two_recorders_that_split_their_recordings_each_ends_with_its_last_part() {
    let healthy = Healthy::new();
    let (length, ahead) = (healthy.length, 3_300_000_000);
    // The first takes all topics and ends sooner, the second half of them, by a clock that is ahead.
    let end = length / 20 * 17;
    let part = |from: i64, to: i64| healthy.copy(|_, at| (from..to).contains(&at).then_some(at));
    let second = |from: i64, to: i64| {
        healthy.copy(|topic, at| {
            let is_in = healthy.is_first(topic) && (from..to).contains(&at);
            is_in.then_some(at + ahead + at % 5_000_000)
        })
    };
    let begin = length / 10;
    let parts: Vec<Recording> = (0..3)
        .map(|k| part(end * k / 3, end * (k + 1) / 3))
        .chain((0..4).map(|k| {
            let at = |k: i64| begin + (length - begin) * k / 4;
            second(at(k), at(k + 1))
        }))
        .collect();
    let split = mission(&parts, |_, _| {});
    let whole = mission(&[part(0, end), second(begin, length)], |_, _| {});
    assert_eq!(headlines(&split), headlines(&whole));
    let apart = split
        .notices
        .iter()
        .filter(|n| n.text.contains("3.3 s ahead"));
    assert_eq!(apart.count(), 4);
}

#[test]
fn two_recorders_in_simulated_time_are_of_one_run_if_a_node_started_once() {
    let healthy = Healthy::new();
    let simulated = |from: i64| {
        let mut all = healthy.copy(|_, at| (at >= from).then_some(at));
        all.messages
            .iter_mut()
            .for_each(|message| message.1 -= healthy.begin - 100 * SECOND);
        all
    };
    for first in [simulated(0), healthy.all.clone()] {
        let alone = mission(std::slice::from_ref(&first), |_, _| {});
        let both = mission(&[first, simulated(healthy.length / 3)], |_, _| {});
        assert!(
            says(&both, "messages of `1.bag`, recorded twice"),
            "{:?}",
            both.notices
        );
        assert_eq!(headlines(&both), headlines(&alone));
    }
}

#[test]
fn what_two_recorders_recorded_counts_once() {
    let recorder = |late: i64, ends: i64| {
        let mut bag = Recording::default();
        let pose = bag.publisher("/localizer", "/pose", "geometry_msgs/PoseStamped");
        bag.publishers[pose].definition =
            "Header header\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
                .to_owned();
        let own = bag.publisher(
            "/driver",
            ["/scan", "/odom"][usize::from(late > 0)],
            "std_msgs/Empty",
        );
        for at in 0..ends * 10 {
            let sent = ORIGIN + at * SECOND / 10;
            let stamp = [sent / SECOND, sent % SECOND].map(|part| u32::try_from(part).unwrap());
            let payload = [
                &0_u32.to_le_bytes()[..],
                &stamp.map(u32::to_le_bytes).concat(),
                &[0; 60],
            ];
            bag.messages.push((pose, sent + late, payload.concat()));
            bag.messages.push((own, sent + late, Vec::new()));
        }
        bag
    };
    // No payload is read but a few to compare them: there are no log records.
    let mission = mission(&[recorder(0, 60), recorder(4_000_000, 30)], |_, _| {});
    let pose = mission
        .elements
        .topics
        .iter()
        .position(|t| t.name.as_str() == "/pose")
        .unwrap();
    let sender = mission
        .sending
        .senders
        .iter()
        .find(|s| s.topic.0 as usize == pose);
    let counts: Vec<u64> = sender.unwrap().stretches.iter().map(|s| s.count).collect();
    assert_eq!(counts, [600]);
    assert!(
        says(&mission, "left out 300 messages of `1.bag`, recorded twice")
            && !says(&mission, "restarts are unknown")
    );
    // `/driver` sends `/odom` in the recording that ends sooner.
    let stopped = mission
        .log
        .events
        .iter()
        .filter(|e| e.kind == Kind::Stopped);
    assert_eq!(stopped.count(), 0);
}

#[test]
fn a_recording_of_which_nothing_is_read_is_compared_with_one_that_is_read() {
    // Short messages without stamps; the numbers of either camera begin anew.
    let recorder = |is_whole: bool, ahead: i64| {
        let mut bag = Recording::default();
        if is_whole {
            let clock = bag.publisher("/gazebo", "/clock", "rosgraph_msgs/Clock");
            "time clock\n".clone_into(&mut bag.publishers[clock].definition);
            bag.messages.push((clock, ORIGIN, vec![0; 8]));
        }
        for (node, topic, span) in [
            ("/camera_1", "/image", 0..300),
            ("/camera_2", "/image", 300..600),
            ("/lidar", "/scan", 0..600),
            ("/base", "/odom", 0..600),
        ] {
            let place = bag.publisher(node, topic, "std_msgs/UInt16");
            for at in span.clone() {
                let number = u16::try_from(at - span.start).unwrap().to_le_bytes();
                let at = ORIGIN + ahead + at * SECOND / 10;
                bag.messages.push((place, at, number.to_vec()));
            }
        }
        bag.messages.sort_by_key(|message| message.1);
        bag
    };
    for ahead in [4_000_000, 3600 * SECOND] {
        let both = mission(&[recorder(true, 0), recorder(false, ahead)], |_, _| {});
        assert!(says(&both, "left out 1800 messages"), "{:?}", both.notices);
        assert_eq!(both.span.nanos() / SECOND, 59);
    }
    // In simulated time it may be another run, so it is set aside.
    let both = mission(
        &[recorder(false, -ORIGIN + SECOND), recorder(true, 0)],
        |_, _| {},
    );
    assert!(!says(&both, "left out"));
    assert!(both.span.start.0 >= ORIGIN);
}

/// A minute of three nodes in a simulation and of `/joystick`, which runs in wall time; `simulated` is the simulated time for
/// the milliseconds since the start, and without it nothing of the simulation is recorded.
fn simulation(simulated: impl Fn(i64) -> Option<i64>) -> Recording {
    let mut bag = Recording::default();
    let clock = bag.publisher("/gazebo", "/clock", "rosgraph_msgs/Clock");
    "time clock\n".clone_into(&mut bag.publishers[clock].definition);
    let joystick = bag.publisher("/joystick", "/joy", "test/Stamped");
    let robot = ["/base", "/lidar", "/nav"];
    let robot = robot.map(|node| bag.publisher(node, &format!("{node}/data"), "test/Stamped"));
    for place in [&robot[..], &[joystick]].concat() {
        "Header header\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
            .clone_into(&mut bag.publishers[place].definition);
    }
    let time = |millis: i64| [millis / 1000, millis % 1000 * 1_000_000];
    let bytes = |numbers: &[i64]| -> Vec<u8> {
        let numbers = numbers.iter().map(|n| u32::try_from(*n).unwrap());
        numbers.flat_map(u32::to_le_bytes).collect()
    };
    let stamped = |at: i64, millis| bytes(&[&[at / 100][..], &time(millis), &[0]].concat());
    for at in (0..60_000).step_by(100) {
        let now = ORIGIN + at * 1_000_000;
        bag.messages
            .push((joystick, now, stamped(at, now / 1_000_000)));
        let Some(millis) = simulated(at) else {
            continue;
        };
        bag.messages.push((clock, now, bytes(&time(millis))));
        for place in robot {
            bag.messages.push((place, now, stamped(at, millis)));
        }
    }
    bag
}

#[test]
fn what_simulated_time_does_is_in_the_log_and_explains_silences() {
    let found = |simulated: &dyn Fn(i64) -> Option<i64>| shown("", &[simulation(simulated)]);
    assert_eq!(found(&|at| Some(5_000 + at)), ":\n");
    let paused = found(&|at| match at {
        ..30_000 => Some(5_000 + at),
        30_000..36_000 => None,
        _ => Some(at - 1_000),
    });
    assert_eq!(paused, ":\n  simulation_paused at 29 s: 6.1 s\n");
    let back = found(&|at| Some(if at < 30_000 { 50_000 } else { 5_000 } + at));
    assert_eq!(back, ":\n  simulation_back at 30 s: 44.9 s\n");
    // The recorder paused.
    let hole = found(&|at| (!(30_000..36_000).contains(&at)).then_some(5_000 + at));
    assert!(!hole.contains("simulation"), "{hole}");
}

#[test]
fn the_rates_of_a_slower_simulation_are_no_changes() {
    let mut bag = simulation(|at| Some(5_000 + at));
    for (publisher, at, _) in &mut bag.messages {
        let since = *at - ORIGIN - 20 * SECOND;
        // `/clock`, and the three nodes in the simulation.
        if *publisher != 1 && since > 0 {
            *at += since;
        }
    }
    bag.messages.sort_by_key(|message| message.1);
    let slow = mission(&[bag], |_, _| {});
    let [one] = slow.log.interruptions[..] else {
        panic!("{}", details(&slow));
    };
    let starts = slow.offset(one.time) / SECOND;
    assert_eq!((one.kind.word(), one.percent), ("simulation_speed", 50));
    assert!((18..=22).contains(&starts), "{starts}");
    let rates = slow.log.events.iter().filter(|e| e.kind == Kind::Rate);
    assert_eq!(rates.count(), 0);
}

#[test]
fn nodes_with_stamps_in_simulated_time_subscribe_to_the_clock() {
    let mission = mission(&[simulation(|at| Some(5_000 + at))], |_, _| {});
    let elements = &mission.elements;
    let edges = elements.subscribes.iter();
    let nodes = edges.map(|edge| elements.nodes[edge.node].name.to_string());
    let nodes: Vec<String> = nodes.filter(|node| node != "/rosout").collect();
    assert_eq!(nodes, ["/base", "/lidar", "/nav"]);
}
