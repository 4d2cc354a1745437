//! rosbag2 folders, finished or growing: the storage files in them, read as one recording, with `metadata.yaml` as a hint.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs::File;
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::bag::adapters::known_span;
use crate::bag::folder::{Recording, is_spare, is_storage, only_recording, recordings};
use crate::bag::input::{BagPlace, FormatRow, Input, explain, file_name, size_on_disk};
use crate::bag::model::{
    Connection, ConnectionId, Encoding, Growing, Growth, Message, OpenOptions, Reader, Report,
    Sink, Want, damaged,
};
use crate::bag::{self, open_each};
use crate::base::budget::{FILES, YAML};
use crate::base::error::{Error, Result};
use crate::base::file::with_suffix;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::OUT_OF_ORDER_NS;
use crate::base::time::{Span, Stamp};
use crate::base::yaml::{self, Value};

/// The format of rosbag2 folders.
pub(crate) const FORMAT: FormatRow = FormatRow {
    name: "rosbag2",
    what: "ROS 2 recording: a folder with metadata.yaml, or with the parts of one recording",
    extensions: &[],
    needs_file: false,
    is_inside: |_| false,
    sniff: |place, _| matches!(place, BagPlace::Folder(_)),
    open,
    follow: Some(|path| Ok(Box::new(GrowingFolder::new(path)))),
};

/// A folder's storage files.
#[derive(Default)]
struct BagFolder {
    name: String,
    parts: Vec<Box<dyn Reader>>,
    /// Whether time goes back from one part to the next, as far as is known.
    overlaps: bool,
    /// The bytes of all files.
    size: u64,
    metadata: Metadata,
    notices: Vec<Notice>,
}

fn open(place: BagPlace, options: &OpenOptions) -> Result<Box<dyn Reader>> {
    let BagPlace::Folder(path) = place else {
        return Err(Error::unsupported("", "it is not a folder", ""));
    };
    let (files, links) = storage_and_links(&path);
    // A folder with nothing but links out of it is opened too, for this format's error message.
    let mut parts = Vec::new();
    let is_here = links.is_empty() || !files.is_empty();
    if is_here && !path.join("metadata.yaml").is_file() {
        let only = only_recording(&path)?;
        match only.paths() {
            [only] => {
                let is_part = only.parent() == Some(&path) && is_storage(only);
                if *only != path && !is_part {
                    let mut one = open_each([Input::Path(only.clone())], options);
                    return one.next().unwrap_or_else(|| Err(explain(&path, &[], true)));
                }
            }
            several => parts = several.to_vec(),
        }
    }
    let mut folder = BagFolder {
        name: file_name(&path),
        ..BagFolder::default()
    };
    match read_metadata(&path) {
        Ok(found) => folder.metadata = found.unwrap_or_default(),
        Err(why) => {
            let text = format!("`metadata.yaml` was left out: {why}");
            folder.note(NoticeKind::Note, text);
        }
    }
    let mut failed = None;
    if parts.is_empty() {
        parts = folder.files(&path);
    }
    // Decompressing whole parts to learn their times would take too long.
    let mut extensions = parts.iter().filter_map(|part| part.extension());
    let is_packed = extensions.any(|extension| extension == "zstd");
    let files: Vec<Input> = parts.into_iter().map(Input::Path).collect();
    folder.size = files.iter().filter_map(size_on_disk).sum();
    for part in open_each(files, options) {
        match part {
            Ok(reader) => folder.parts.push(reader),
            Err(e) => {
                folder.note(NoticeKind::Damaged, format!("a part was left out: {e}"));
                failed.get_or_insert(e);
            }
        }
    }
    if folder.parts.len() > 1 && !is_packed {
        folder.sort();
    }
    match failed {
        Some(e) if folder.parts.is_empty() => Err(e),
        None if folder.parts.is_empty() => Err(folder.nothing(&path)),
        _ => Ok(Box::new(folder)),
    }
}

/// The storage files in a folder, ordered by number, without links out of it.
fn storage(folder: &Path) -> Vec<PathBuf> {
    let (mut files, _) = storage_and_links(folder);
    files.sort_by_cached_key(|part| (number(part), file_name(part)));
    files.truncate(FILES);
    files
}

/// The number of a part: 2 of `run_2.mcap`.
fn number(part: &Path) -> Option<u64> {
    let name = file_name(part);
    let stem = name.split('.').next().unwrap_or_default();
    stem.rsplit('_').next()?.parse().ok()
}

/// The storage files in a folder, and links out of it that look like storage files.
fn storage_and_links(folder: &Path) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let Ok(entries) = folder.read_dir() else {
        return (Vec::new(), Vec::new());
    };
    let files = entries.filter_map(|e| Some(e.ok()?.path()));
    let files = files.filter(|p| is_storage(p) && p.is_file() && !is_spare(p));
    files.partition(|file| is_inside(folder, file))
}

impl BagFolder {
    fn note(&mut self, kind: NoticeKind, text: String) {
        self.notices.push(Notice::new(kind, text));
    }

    /// The files to read: those that the metadata lists; if none of them exists, all that look like storage files.
    fn files(&mut self, path: &Path) -> Vec<PathBuf> {
        let named = std::mem::take(&mut self.metadata.files);
        let (mut found, mut known) = (Vec::new(), HashSet::new());
        let mut missing = Vec::new();
        for name in named.iter().take(FILES) {
            match locate(path, name) {
                Ok(file) if known.insert(file.clone()) => found.push(file),
                Ok(_) => {}
                Err(why) => missing.push(why),
            }
        }
        let there = storage(path);
        let instead = found.is_empty() && !there.is_empty();
        for why in missing {
            let (kind, text) = if instead {
                let text = format!("{why}; read the existing files instead");
                (NoticeKind::Note, text)
            } else {
                (
                    NoticeKind::Damaged,
                    format!("a part of the recording: {why}"),
                )
            };
            self.note(kind, text);
        }
        if instead {
            self.note_gaps(&there);
            return there;
        }
        // The error explains why there is no file.
        if found.is_empty() {
            return found;
        }
        let beside = recordings(path).unwrap_or_default();
        let beside = beside.iter().flat_map(Recording::paths);
        let beside = beside.filter(|other| *other != path && !known.contains(*other));
        for other in beside.take(FILES) {
            let name = other.strip_prefix(path).unwrap_or(other).display();
            let text = format!("`{name}` is not named in `metadata.yaml` and was left out");
            self.note(NoticeKind::Note, text);
        }
        found
    }

    /// Puts the parts in order of time, whatever their numbers and the metadata state; if they overlap by more than
    /// messages that are merely out of order, the recorder's clock was set back, and they stay in their order.
    fn sort(&mut self) {
        let spans = self.parts.iter().map(|part| part.stated());
        let Some(spans) = spans.collect::<Option<Vec<Span>>>() else {
            return;
        };
        let is_back = |pair: &[Span]| pair[0].end.since(pair[1].start) > OUT_OF_ORDER_NS;
        let mut sorted = spans.clone();
        sorted.sort_by_key(|span| span.start);
        self.overlaps = sorted.windows(2).any(is_back);
        if !self.overlaps {
            let mut parts: Vec<_> = spans.into_iter().zip(self.parts.drain(..)).collect();
            parts.sort_by_key(|(span, _)| span.start);
            self.parts.extend(parts.into_iter().map(|(_, part)| part));
        }
    }

    /// Notes the numbers that are missing between these parts.
    fn note_gaps(&mut self, parts: &[PathBuf]) {
        let numbers = parts.iter().map(|part| number(part));
        let numbers: Vec<Option<u64>> = numbers.collect();
        for (names, numbers) in parts.windows(2).zip(numbers.windows(2)) {
            let [Some(before), Some(after)] = numbers else {
                continue;
            };
            let missing = (after - before).saturating_sub(1);
            if missing > 0 {
                let names = [&names[0], &names[1]].map(|name| file_name(name));
                let which = match missing {
                    1 => format!("part {} is", before + 1),
                    _ => format!("parts {} to {} are", before + 1, after - 1),
                };
                let text = format!("{which} missing between `{}` and `{}`", names[0], names[1]);
                self.note(NoticeKind::Damaged, text);
            }
        }
    }

    /// The error for a folder without any of its files.
    fn nothing(&self, path: &Path) -> Error {
        let mut reasons: Vec<String> = self.notices.iter().map(|n| n.text.clone()).collect();
        if reasons.is_empty() {
            let (_, links) = storage_and_links(path);
            let names = links.iter().filter_map(|link| link.file_name());
            reasons.extend(names.map(|name| leads_out(&name.to_string_lossy())));
        }
        if reasons.is_empty() {
            return explain(path, &[], true);
        }
        Error::unknown_bag(
            path,
            &format!("a folder without its recording ({})", reasons.join("; ")),
            "copy the `.db3` or `.mcap` files that `metadata.yaml` names into it",
        )
    }
}

impl Reader for BagFolder {
    fn is_straight(&self) -> bool {
        !self.overlaps && self.parts.iter().all(|part| part.is_straight())
    }

    fn span(&mut self) -> Result<Option<Span>> {
        known_span(&mut self.parts)
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        for notice in &self.notices {
            sink.notice(notice.clone());
        }
        let mut complete = !self.notices.iter().any(|n| n.kind.is_loss());
        let mut joined = PartsAdapter::new(&self.metadata, sink, self.size);
        let mut reports = Vec::new();
        for part in &mut self.parts {
            joined.next();
            match part.read(range, &mut joined) {
                Ok(report) => reports.push(report),
                Err(e) => {
                    complete = false;
                    damaged(&mut joined, 1, &format!("a part was left out: {e}"));
                }
            }
        }
        joined.silent();
        Ok(self.report(&reports, complete))
    }
}

impl BagFolder {
    fn report(&self, parts: &[Report], complete: bool) -> Report {
        let compression: BTreeSet<&String> = parts.iter().flat_map(|r| &r.compression).collect();
        let rank = |report: &&Report| (report.tier, report.tier_reason.is_some());
        let worst = parts.iter().max_by_key(rank);
        let mut facts = self.metadata.facts.clone();
        for fact in parts.iter().flat_map(|r| &r.facts) {
            if !facts.iter().any(|(name, _)| *name == fact.0) {
                facts.push(fact.clone());
            }
        }
        if parts.len() > 1 {
            facts.push(("files".to_owned(), parts.len().to_string()));
        }
        let format = parts.first().map(|report| report.format.as_str());
        Report {
            name: self.name.clone(),
            format: format.unwrap_or(FORMAT.name).to_owned(),
            compression: compression.into_iter().cloned().collect(),
            tier: worst.map_or(super::Tier::Index, |r| r.tier),
            tier_reason: worst.and_then(|r| r.tier_reason.clone()),
            complete: complete && parts.iter().all(|r| r.complete),
            bytes_read: parts.iter().map(|r| r.bytes_read).sum(),
            file_bytes: parts.iter().map(|r| r.file_bytes).sum(),
            facts,
        }
    }
}

/// The connections of a whole recording.
#[derive(Default)]
struct Joined {
    /// The connections by their descriptions, without ids. Parts describe a connection alike.
    known: BTreeMap<Connection, Vec<ConnectionId>>,
    /// The wanted part of their payloads, by id.
    wants: Vec<Want>,
}

/// The connections of one part.
#[derive(Default)]
struct PartConnections {
    /// Their ids in the whole recording.
    ids: Vec<ConnectionId>,
    /// The numbers of those that are described alike: they stay apart, as when the part is read alone.
    alike: BTreeMap<Connection, usize>,
}

/// A sink that maps the parts' connection ids to ids of the whole recording.
struct PartsAdapter<'a> {
    metadata: &'a Metadata,
    sink: &'a mut dyn Sink,
    joined: Joined,
    part: PartConnections,
    /// The sizes in bytes of the parts before this one, of this part, and of all parts.
    sizes: (u64, u64, u64),
}

impl<'a> PartsAdapter<'a> {
    fn new(metadata: &'a Metadata, sink: &'a mut dyn Sink, size: u64) -> Self {
        Self {
            metadata,
            sink,
            joined: Joined::default(),
            part: PartConnections::default(),
            sizes: (0, 0, size),
        }
    }

    /// The next part begins.
    fn next(&mut self) {
        self.part = PartConnections::default();
        self.sizes.0 += std::mem::take(&mut self.sizes.1);
    }

    /// Announces a connection that no part had before; returns its id.
    fn announce(&mut self, key: Connection) -> ConnectionId {
        let id = ConnectionId(u32::try_from(self.joined.wants.len()).unwrap_or(u32::MAX));
        let mut connection = Connection { id, ..key.clone() };
        if let Some(topic) = self.metadata.topics.get(connection.topic.as_str()) {
            connection.qos = connection.qos.or_else(|| topic.qos.clone());
            connection.type_hash = connection.type_hash.or_else(|| topic.hash.clone());
        }
        self.joined.wants.push(self.sink.connection(&connection));
        self.joined.known.entry(key).or_default().push(id);
        id
    }

    /// Announces the topics that only the metadata lists: they have no messages.
    fn silent(&mut self) {
        let known: BTreeSet<Arc<str>> =
            self.joined.known.keys().map(|c| c.topic.shared()).collect();
        let topics = self.metadata.topics.iter();
        for (name, topic) in topics.filter(|(name, _)| !known.contains(name.as_str())) {
            self.announce(Connection {
                topic: name.as_str().into(),
                type_name: Arc::clone(&topic.type_name),
                encoding: match topic.encoding.as_str() {
                    "" | "cdr" => Encoding::Cdr,
                    other => Encoding::Other(other.to_owned()),
                },
                ..Connection::default()
            });
        }
    }
}

impl Sink for PartsAdapter<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn connection(&mut self, connection: &Connection) -> Want {
        let key = Connection {
            id: ConnectionId::default(),
            ..connection.clone()
        };
        let alike = self.part.alike.entry(key.clone()).or_default();
        let known = self.joined.known.get(&key);
        let known = known.and_then(|ids| ids.get(*alike)).copied();
        *alike += 1;
        let id = known.unwrap_or_else(|| self.announce(key));
        self.part.ids.push(id);
        self.joined.wants[id.0 as usize]
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let id = self.part.ids[connection.0 as usize];
        self.sink.stamps(id, stamps, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        let connection = self.part.ids[message.connection.0 as usize];
        self.sink.message(Message {
            connection,
            ..message
        });
    }

    fn progress(&mut self, done: u64, total: u64) {
        let (before, size, whole) = &mut self.sizes;
        *size = total;
        self.sink
            .progress(*before + done, (*whole).max(*before + total));
    }
}

// A rosbag2 folder that is still being written: its storage files, including those added by splits.

/// The number of polls without growth after which a recording with metadata is over: two seconds, in which a recorder
/// closes its last file.
const QUIET: u32 = 8;

/// A folder's storage files, each with its read position.
#[derive(Default)]
struct GrowingFolder {
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
    fn new(path: &Path) -> Self {
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
        let named = read_metadata(&self.path).ok().flatten();
        named.is_some_and(|named| named.files.len() >= storage(&self.path).len())
    }
}

// `metadata.yaml` of a rosbag2 folder, versions 1 to 9, as a hint: storage files and quality of service.

/// The contents of `metadata.yaml`.
#[derive(Default)]
struct Metadata {
    /// Names of storage files, as written.
    files: Vec<String>,
    topics: BTreeMap<String, TopicMetadata>,
    facts: Vec<(String, String)>,
}

/// A topic in `metadata.yaml`.
struct TopicMetadata {
    type_name: Arc<str>,
    encoding: String,
    qos: Option<Arc<str>>,
    hash: Option<Arc<str>>,
}

/// Reads `metadata.yaml` in `folder`: `Ok(None)` if there is none, the reason if it cannot be parsed.
fn read_metadata(folder: &Path) -> Result<Option<Metadata>, String> {
    let path = folder.join("metadata.yaml");
    if !path.is_file() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let file = File::open(&path).map_err(|e| e.to_string())?;
    let read = file.take(YAML as u64).read_to_end(&mut bytes);
    read.map_err(|e| e.to_string())?;
    let data = yaml::parse(&String::from_utf8_lossy(&bytes))
        .map_err(|e| format!("line {}: {}", e.at.line, e.reason))?;
    let root = data.get("rosbag2_bagfile_information");
    let root = root.ok_or("it has no `rosbag2_bagfile_information`")?;
    Ok(Some(understand(root)))
}

fn understand(root: &Value) -> Metadata {
    let mut metadata = Metadata::default();
    let files = root.get("relative_file_paths").and_then(Value::as_array);
    let names = files.into_iter().flatten().filter_map(Value::as_str);
    metadata.files = names.map(str::to_owned).collect();
    let own = ["storage_identifier", "ros_distro", "compression_mode"].map(|key| (key, key));
    for (key, name) in [("version", "metadata_version")].into_iter().chain(own) {
        let text = match root.get(key) {
            Some(Value::String(text)) if !text.is_empty() => text.clone(),
            Some(Value::Number(number)) => number.to_string(),
            _ => continue,
        };
        metadata.facts.push((name.to_owned(), text));
    }
    let topics = root.get("topics_with_message_count");
    let topics = topics.and_then(Value::as_array);
    for topic in topics.into_iter().flatten() {
        let Some(topic) = topic.get("topic_metadata") else {
            continue;
        };
        let text = |key| topic.get(key).and_then(Value::as_str).unwrap_or_default();
        let name = text("name").to_owned();
        if !name.is_empty() {
            metadata.topics.insert(name, of_topic(topic, text));
        }
    }
    metadata
}

fn of_topic<'v>(topic: &'v Value, text: impl Fn(&'static str) -> &'v str) -> TopicMetadata {
    let some = |text: &str| (!text.is_empty()).then(|| Arc::from(text));
    TopicMetadata {
        type_name: text("type").into(),
        encoding: text("serialization_format").to_owned(),
        qos: match topic.get("offered_qos_profiles") {
            // Up to version 8 the profiles are text, from version 9 on data.
            Some(Value::Array(all)) if !all.is_empty() => {
                some(&Value::from(all.clone()).to_string())
            }
            Some(Value::String(profiles)) => some(profiles),
            _ => None,
        },
        hash: some(text("type_description_hash")),
    }
}

/// The file in `folder` with this `name`, which must be a plain name of a regular file. Up to version 3 it is prefixed
/// by the folder's own name.
///
/// # Errors
/// A sentence with the reason why not.
fn locate(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let path = Path::new(name);
    let is_downward = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    if !path.components().all(is_downward) {
        return Err(format!("`{name}` leaves the folder and was not followed"));
    }
    let Some(last) = path.file_name() else {
        return Err(format!("`{name}` is not a file name"));
    };
    let plain = folder.join(last);
    let found = [
        plain.clone(),
        with_suffix(&plain, ".zstd"),
        plain.with_extension(""),
    ];
    let is_storage = |p: &&PathBuf| p.is_file() && is_storage(p) && !is_spare(p);
    let Some(found) = found.iter().find(is_storage) else {
        return Err(format!("`{}` is missing", last.to_string_lossy()));
    };
    if is_inside(folder, found) {
        Ok(found.clone())
    } else {
        Err(leads_out(name))
    }
}

/// Whether a file lies in a folder after links are resolved.
fn is_inside(folder: &Path, file: &Path) -> bool {
    let real = file.canonicalize().ok().zip(folder.canonicalize().ok());
    real.is_some_and(|(file, folder)| file.starts_with(folder))
}

/// The notice about a link that leads out of the folder.
fn leads_out(name: &str) -> String {
    format!("`{name}` is a link out of the folder and was not followed")
}
