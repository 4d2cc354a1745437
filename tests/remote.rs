//! Tests of bags on a server: the same counts as from a file, few requests, few bytes, and errors for refusals.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::Duration;

use bagreel::bag::{Input, Tier};
use bagreel::fleet::{CountDetail, CountedBag, PlannedBag, Planning, Tally, count, plan};
use bagreel::internals::mission::write_json;
use bagreel::values::{Align, Length, Period, Stamp};
use bagreel::{Error, Reading, read};

use crate::support::rosbag1::{self, SparseBag};
use crate::support::{self, ORIGIN, Recording};

/// A server's objects, requests and behaviour.
#[derive(Default)]
struct State {
    objects: BTreeMap<String, (SparseBag, u32)>,
    requests: usize,
    bytes: usize,
    /// The first lines of all requests.
    asked: Vec<String>,
    /// The status of every answer.
    refuses: Option<u16>,
    /// Answers every request of these numbers, modulo 5, with 503.
    stumbles: Option<usize>,
    /// Replaces the object after this many requests.
    replaces_at: Option<usize>,
    /// Redirects every request there.
    redirects: Option<String>,
    versions: Versions,
    /// The delay of every answer.
    late: Duration,
    /// The current and the highest number of pending requests.
    under_way: usize,
    most_under_way: usize,
}

/// How a server reports versions.
#[derive(Clone, Copy, Default, PartialEq)]
enum Versions {
    #[default]
    Told,
    /// With an `ETag`, but ignoring `If-Match`.
    Careless,
    /// With a weak `ETag`, which `If-Match` must not compare.
    Weak,
    /// By modification time.
    Dated,
    Untold,
}

/// A minimal local server that supports range requests.
struct Server {
    address: String,
    state: Arc<Mutex<State>>,
}

impl Server {
    fn with(objects: &[(&str, Vec<u8>)]) -> Self {
        let whole = |bytes: &[u8]| SparseBag {
            len: bytes.len() as u64,
            parts: vec![(0, bytes.to_vec())],
        };
        let objects = objects.iter().map(|(name, bytes)| (*name, whole(bytes)));
        Self::with_sparse(objects)
    }

    fn with_sparse<'a>(objects: impl IntoIterator<Item = (&'a str, SparseBag)>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let objects = objects
            .into_iter()
            .map(|(name, object)| (format!("/{name}"), (object, 1)));
        let state = Arc::new(Mutex::new(State {
            objects: objects.collect(),
            ..State::default()
        }));
        let shared = Arc::clone(&state);
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let state = Arc::clone(&shared);
                thread::spawn(move || serve(stream, &state));
            }
        });
        Self { address, state }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    fn url(&self, name: &str) -> String {
        format!("http://{}/{name}", self.address)
    }

    fn count(&self, name: &str, detail: CountDetail) -> bagreel::Result<CountedBag> {
        counted(&self.url(name), detail)
    }

    /// The error message for a refused object.
    #[track_caller]
    fn refusal(&self, name: &str) -> String {
        match self.count(name, CountDetail::Auto) {
            Err(error @ Error::Remote { .. }) => format!("{error} ({})", error.hint()),
            other => panic!("{other:?}"),
        }
    }
}

fn counted(uri: &str, detail: CountDetail) -> bagreel::Result<CountedBag> {
    let planned = PlannedBag {
        uri: uri.to_owned(),
        mission: "m".to_owned(),
        origin: Stamp(0),
    };
    let tally = Tally {
        detail,
        ..Tally::of(Period::parse("10").unwrap())
    };
    count(&planned, &tally)
}

fn serve(stream: TcpStream, state: &Mutex<State>) {
    let mut reader = BufReader::new(stream.try_clone().unwrap());
    let mut stream = stream;
    loop {
        let mut head = Vec::new();
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line).unwrap_or(0) == 0 {
                return;
            }
            if line.trim().is_empty() {
                break;
            }
            head.push(line.trim().to_owned());
        }
        let late = {
            let mut state = state.lock().unwrap();
            state.under_way += 1;
            state.most_under_way = state.most_under_way.max(state.under_way);
            state.late
        };
        thread::sleep(late);
        let (status, fields, body) = {
            let mut state = state.lock().unwrap();
            state.under_way -= 1;
            answer(&head, &mut state)
        };
        let fields: Vec<String> = fields
            .iter()
            .map(|(k, v)| format!("{k}: {v}\r\n"))
            .collect();
        let fields = fields.concat();
        let text = format!("HTTP/1.1 {status} X\r\n{fields}\r\n");
        if stream.write_all(text.as_bytes()).is_err() || stream.write_all(&body).is_err() {
            return;
        }
    }
}

type Answer = (u16, Vec<(&'static str, String)>, Vec<u8>);

fn answer(head: &[String], state: &mut State) -> Answer {
    let field = |name: &str| {
        let lines = head.iter().filter_map(|line| line.split_once(": "));
        let mut found = lines.filter(|(key, _)| key.eq_ignore_ascii_case(name));
        found.next().map(|(_, value)| value.to_owned())
    };
    state.requests += 1;
    state.asked.push(head[0].clone());
    let empty = |status: u16| (status, vec![("Content-Length", "0".to_owned())], Vec::new());
    if let Some(status) = state.refuses {
        return empty(status);
    }
    if let Some(to) = &state.redirects {
        let (status, mut fields, body) = empty(302);
        fields.push(("Location", to.clone()));
        return (status, fields, body);
    }
    if state.stumbles.is_some_and(|k| state.requests % 5 == k) {
        return empty(503);
    }
    if state.replaces_at == Some(state.requests) {
        state.objects.values_mut().for_each(|object| object.1 += 1);
    }
    let path = head[0].split([' ', '?']).nth(1).unwrap();
    let Some((object, version)) = state.objects.get(path) else {
        return empty(404);
    };
    let weak = if state.versions == Versions::Weak {
        "W/"
    } else {
        ""
    };
    let etag = format!("{weak}\"{version}\"");
    let date = format!("Mon, 01 Jan 2024 00:00:{version:02} GMT");
    let has_etag = !matches!(state.versions, Versions::Dated | Versions::Untold);
    let is_changed = field("if-match").is_some_and(|wanted| wanted != etag || weak == "W/")
        || field("if-unmodified-since").is_some_and(|wanted| wanted != date);
    if is_changed && state.versions != Versions::Careless {
        return empty(412);
    }
    let mut fields = Vec::new();
    fields.extend(has_etag.then_some(("ETag", etag)));
    fields.extend((state.versions != Versions::Untold).then_some(("Last-Modified", date)));
    if head[0].starts_with("HEAD") {
        fields.push(("Content-Length", object.len.to_string()));
        return (200, fields, Vec::new());
    }
    let range = field("range").unwrap();
    let range = range.strip_prefix("bytes=").unwrap();
    let (from, to) = range.split_once('-').unwrap();
    let (from, to): (u64, u64) = (from.parse().unwrap(), to.parse().unwrap());
    if from >= object.len {
        return empty(416);
    }
    let to = to.min(object.len - 1);
    let part = cut(object, from, to + 1);
    fields.push(("Content-Length", part.len().to_string()));
    fields.push(("Content-Range", format!("bytes {from}-{to}/{}", object.len)));
    state.bytes += part.len();
    (206, fields, part)
}

/// The bytes from `from` up to `to`.
fn cut(object: &SparseBag, from: u64, to: u64) -> Vec<u8> {
    let mut bytes = vec![0; usize::try_from(to - from).unwrap()];
    for (at, part) in &object.parts {
        let (start, end) = ((*at).max(from), (at + part.len() as u64).min(to));
        if start < end {
            let place = |at: u64, from: u64| usize::try_from(at - from).unwrap();
            bytes[place(start, from)..place(end, from)]
                .copy_from_slice(&part[place(start, *at)..place(end, *at)]);
        }
    }
    bytes
}

/// Twelve gigabytes of a camera and an inertial sensor, 200 s in 2,000 chunks; nearly all of it a hole.
fn large() -> SparseBag {
    let mut names = Recording::default();
    names.publisher("/imu", "/imu", "sensor_msgs/Imu");
    names.publisher("/camera", "/image", "sensor_msgs/Image");
    let publishers = <[_; 2]>::try_from(names.publishers).ok().unwrap();
    rosbag1::sparse(&publishers, ORIGIN, 2000, 6 << 20)
}

fn server_of_large() -> Server {
    Server::with_sparse([("large.bag", large())])
}

#[test]
fn an_object_has_the_counts_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let own = |name: &str| fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::Lz4, 4000);
    let objects = [
        ("a/warehouse.bag", own("examples/warehouse.bag")),
        ("a/courier.mcap", own("examples/courier.mcap")),
        ("a/courier_0.db3", own("examples/courier/courier_0.db3")),
        ("a/small.bag", bag.clone()),
        ("a/cut.bag", bag[..bag.len() / 2].to_vec()),
        ("a/empty.bag", Vec::new()),
        ("a/foreign.bag", b"no bag".to_vec()),
    ];
    let server = Server::with(&objects);
    for (name, bytes) in &objects {
        let path = dir.path().join(Path::new(name).file_name().unwrap());
        fs::write(&path, bytes).unwrap();
        let far = server.count(name, CountDetail::Index).unwrap();
        let near = counted(&path.to_string_lossy(), CountDetail::Index).unwrap();
        let plain = |counted: &CountedBag| {
            let mut counts = counted.counts.clone();
            for count in &mut counts {
                count.bag = "".into();
            }
            counts
        };
        assert_eq!(plain(&far), plain(&near), "{name}");
        assert_eq!(far.bag.messages, near.bag.messages, "{name}");
        assert_eq!(
            (far.bag.tier, far.bag.is_complete),
            (near.bag.tier, near.bag.is_complete)
        );
        assert_eq!(far.bag.error.is_some(), near.bag.error.is_some(), "{name}");
        assert_eq!(far.bag.file_bytes, Some(bytes.len() as u64), "{name}");
        assert_eq!(far.bag.etag.as_deref(), Some("\"1\""), "{name}");
    }
}

#[test]
fn a_large_bag_takes_few_requests_and_few_bytes() {
    let server = server_of_large();
    let chunks = server.count("large.bag", CountDetail::Auto).unwrap();
    let (requests, read) = {
        let state = server.state();
        (state.requests, state.bytes)
    };
    assert!(requests <= 100, "{requests} requests");
    let size = large().len;
    assert!(
        size > 12_000_000_000 && read as u64 * 1000 < size,
        "{read} of {size} bytes"
    );
    assert_eq!(chunks.bag.tier.map(Tier::word), Some("chunks"));
    assert_eq!(chunks.bag.messages, 2000 * 21);
    let index = server.count("large.bag", CountDetail::Index).unwrap();
    let n = |counted: &CountedBag| -> Vec<_> {
        let counts = counted.counts.iter();
        counts.map(|c| (c.win, c.topic.clone(), c.n)).collect()
    };
    assert_eq!(n(&chunks), n(&index));
    println!("12 GB: {requests} requests, {read} bytes");
}

/// The mission of a bag as JSON. Payloads of remote bags are not compared, so neither are they here.
fn mission(bag: &str) -> String {
    let mut reading = Reading::of([bag]);
    reading.collect.payload_bytes = 0;
    reading.division.length = Length::Fixed(Period::parse("10").unwrap());
    let mut text = Vec::new();
    write_json(&read(&reading).unwrap(), &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

#[test]
fn an_object_yields_the_mission_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let own = |name: &str| fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let small = support::small();
    let mut objects = vec![
        ("warehouse.bag", own("examples/warehouse.bag")),
        ("courier.mcap", own("examples/courier.mcap")),
        ("courier_0.db3", own("examples/courier/courier_0.db3")),
    ];
    let packs = [
        ("plain.bag", rosbag1::Pack::None),
        ("lz4.bag", rosbag1::Pack::Lz4),
        ("bz2.bag", rosbag1::Pack::Bz2),
    ];
    // Many chunks, so that several threads read them.
    objects.extend(packs.map(|(name, pack)| (name, rosbag1::write(&small, pack, 200))));
    let plain = &objects[3].1;
    let cut = plain[..plain.len() / 2].to_vec();
    objects.push(("cut.bag", cut));
    let server = Server::with(&objects);
    for (name, bytes) in &objects {
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        let (far, near) = (mission(&server.url(name)), mission(&path.to_string_lossy()));
        assert!(far == near, "{name}");
    }
}

#[test]
fn a_large_mission_takes_one_request_per_chunk_in_parallel() {
    let server = server_of_large();
    server.state().late = Duration::from_millis(5);
    let mut reading = Reading::of([server.url("large.bag")]);
    reading.division.length = Length::Fixed(Period::parse("10").unwrap());
    let mission = read(&reading).unwrap();
    assert_eq!(mission.messages, 2000 * 21);
    let state = server.state();
    let (requests, read, most) = (state.requests, state.bytes, state.most_under_way);
    assert!(requests <= 2000 + 20, "{requests} requests");
    assert!((read as u64) * 100 < large().len, "{read} bytes");
    assert!((16..=128).contains(&most), "{most} at a time");
    println!("12 GB: {requests} requests, {read} bytes, {most} at a time");
}

#[test]
fn the_beginning_of_a_large_bag_takes_few_requests() {
    let server = server_of_large();
    let planning = Planning {
        align: Align::Bag,
        ..Planning::default()
    };
    let planned = plan(&[server.url("large.bag")], &planning).unwrap();
    assert_eq!(planned.bags[0].origin, Stamp(ORIGIN));
    let requests = server.state().requests;
    assert!(requests <= 8, "{requests} requests");
}

#[test]
fn transient_server_errors_are_retried() {
    let server = server_of_large();
    let whole = server.count("large.bag", CountDetail::Auto).unwrap();
    server.state().stumbles = Some(3);
    assert_eq!(server.count("large.bag", CountDetail::Auto).unwrap(), whole);
}

#[test]
fn a_refused_object_is_an_error_without_a_row() {
    let server = server_of_large();
    server.state().refuses = Some(403);
    let said = server.refusal("large.bag");
    assert!(
        said.contains("denies access (403)") && said.contains("AWS_ACCESS_KEY_ID"),
        "{said}"
    );
    assert_eq!(server.state().requests, 1, "403 does not pass");
    server.state().refuses = Some(401);
    assert!(server.refusal("large.bag").contains("(401)"));
    server.state().refuses = None;
    // A missing object is a fact about the bag.
    let gone = server.count("gone.bag", CountDetail::Auto).unwrap();
    assert!(gone.bag.error.unwrap().contains("no such object"));
}

#[test]
fn a_prefix_is_not_a_bag() {
    let server = server_of_large();
    let error = read(&Reading::of([server.url("day/")])).unwrap_err();
    assert!(
        error.is_usage() && error.hint().contains("bagreel tables"),
        "{error}"
    );
    assert_eq!(server.state().requests, 0);
}

/// A bag of four chunks with one message each: the tail, and one request for each chunk's index and the next one's
/// head.
#[test]
fn sizes_need_no_request_if_a_chunk_has_one_message() {
    let server = Server::with(&[("a.bag", one_message_in_each_chunk())]);
    let output = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args([
            "extract",
            &server.url("a.bag"),
            "-o",
            "-",
            "--format",
            "csv",
        ])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let sizes: Vec<&str> = text
        .lines()
        .skip(1)
        .filter_map(|l| l.rsplit(',').next())
        .collect();
    assert_eq!(sizes, ["300004"; 4], "{text}");
    let state = server.state();
    assert!(state.requests <= 2 + 5, "{:?}", state.asked);
    assert!(state.bytes < 160_000, "{} bytes", state.bytes);
}

fn one_message_in_each_chunk() -> Vec<u8> {
    let mut recording = Recording::default();
    let talks = recording.publisher("/talker", "/chatter", "std_msgs/String");
    let text = [300_000u32.to_le_bytes().to_vec(), vec![b'a'; 300_000]].concat();
    recording.send(talks, (0, 4000), 1000, &text);
    rosbag1::write(&recording, rosbag1::Pack::None, 1000)
}

#[test]
fn an_object_that_is_replaced_while_it_is_read_is_an_error() {
    use Versions::{Careless, Dated, Told, Untold, Weak};
    for versions in [Told, Careless, Weak, Dated] {
        let server = server_of_large();
        server.state().versions = versions;
        let whole = server.count("large.bag", CountDetail::Auto).unwrap();
        assert_eq!(whole.bag.etag.is_some(), versions != Dated);
        let middle = server.state().requests / 2;
        server.state().requests = 0;
        server.state().replaces_at = Some(middle);
        assert!(
            server
                .refusal("large.bag")
                .contains("replaced while it was read")
        );
    }
    // Without reported versions, none can be required.
    let server = server_of_large();
    server.state().versions = Untold;
    server.count("large.bag", CountDetail::Auto).unwrap();
}

#[test]
fn redirects_to_files_are_not_followed() {
    let server = server_of_large();
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("a.bag");
    fs::write(
        &file,
        rosbag1::write(&support::small(), rosbag1::Pack::None, 4000),
    )
    .unwrap();
    for to in [
        format!("file://{}", file.display()),
        file.display().to_string(),
    ] {
        server.state().redirects = Some(to);
        server.refusal("large.bag");
    }
    // A different address is fine.
    let other = server_of_large();
    server.state().redirects = Some(other.url("large.bag"));
    assert_eq!(
        server
            .count("large.bag", CountDetail::Auto)
            .unwrap()
            .bag
            .messages,
        42_000
    );
}

#[test]
fn a_signature_is_sent_but_not_printed() {
    let server = server_of_large();
    let signed = "large.bag?X-Amz-Signature=secret#part";
    server.count(signed, CountDetail::Auto).unwrap();
    let asked = std::mem::take(&mut server.state().asked);
    assert!(
        asked
            .iter()
            .all(|line| line.contains("/large.bag?X-Amz-Signature=secret ")),
        "{asked:?}"
    );
    server.state().refuses = Some(403);
    let said = server.refusal(signed);
    assert!(
        said.contains("/large.bag`") && !said.contains("secret"),
        "{said}"
    );
    let named = Input::parse("https://me:secret@host/a/b.bag?sig=secret");
    assert_eq!(named.name(), "b.bag");
}

#[test]
fn the_command_prints_the_same_for_an_object_and_a_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let server = Server::with(&[("warehouse.bag", fs::read(&path).unwrap())]);
    let output_of = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
        let output = command.args(args).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        String::from_utf8(output.stdout).unwrap()
    };
    let (far, near) = (server.url("warehouse.bag"), path.to_string_lossy());
    let rows = |bag: &str| output_of(&["extract", bag, "-o", "-", "--format", "csv"]);
    assert_eq!(rows(&far), rows(&near));
    // Payloads of remote bags are only compared on request, which reveals one more subscription.
    let info = |bag: &str| -> Vec<String> {
        let row = output_of(&["info", bag, "--format", "csv"]);
        let cells = row.lines().nth(1).unwrap().split(',');
        cells.take(12).map(str::to_owned).collect()
    };
    assert_eq!(info(&far), info(&near));
    let all = |bag: &str| -> serde_json::Value {
        let text = output_of(&["info", bag, "--format", "json", "--infer", "payloads"]);
        let mut info: serde_json::Value = serde_json::from_str(&text).unwrap();
        // The version of the object, which a file does not have.
        info["bags"][0]["facts"].take();
        info
    };
    assert!(all(&far) == all(&near));
}

#[test]
fn refused_objects_are_reported_and_counted_later() {
    let dir = tempfile::tempdir().unwrap();
    let bag = rosbag1::write(&support::small(), rosbag1::Pack::None, 4000);
    let server = Server::with(&[("a.bag", bag.clone()), ("b.bag", bag)]);
    let run = || {
        let output = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .current_dir(dir.path())
            .args([
                "tables",
                &server.url("a.bag"),
                &server.url("b.bag"),
                "-o",
                "t",
                "--skip-existing",
            ])
            .output()
            .unwrap();
        (
            output.status.code(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    server.state().refuses = Some(403);
    let (code, said) = run();
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("0 bags (2 not available)") && said.matches("error: ").count() == 2,
        "{said}"
    );
    server.state().refuses = None;
    let (code, said) = run();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("2 bags, "), "{said}");
    let (code, said) = run();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("0 bags (2 already there)"), "{said}");
}
