//! `metadata.yaml` of a rosbag2 folder, versions 1 to 9, as a hint: storage files and quality of service.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::bag::folder::{is_spare, is_storage};
use crate::base::budget::YAML;
use crate::base::file::with_suffix;
use crate::base::yaml::{self, Value};

/// The contents of `metadata.yaml`.
#[derive(Default)]
pub(super) struct Metadata {
    /// Names of storage files, as written.
    pub(super) files: Vec<String>,
    pub(super) topics: BTreeMap<String, TopicMetadata>,
    pub(super) facts: Vec<(String, String)>,
}

/// A topic in `metadata.yaml`.
pub(super) struct TopicMetadata {
    pub(super) type_name: Arc<str>,
    pub(super) encoding: String,
    pub(super) qos: Option<Arc<str>>,
    pub(super) hash: Option<Arc<str>>,
}

/// Reads `metadata.yaml` in `folder`: `Ok(None)` if there is none, the reason if it cannot be parsed.
pub(super) fn read(folder: &Path) -> Result<Option<Metadata>, String> {
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
    let topics = root
        .get("topics_with_message_count")
        .and_then(Value::as_array);
    for topic in topics.into_iter().flatten() {
        let Some(topic) = topic.get("topic_metadata") else {
            continue;
        };
        let text = |key| topic.get(key).and_then(Value::as_str).unwrap_or_default();
        if !text("name").is_empty() {
            metadata
                .topics
                .insert(text("name").to_owned(), of_topic(topic, text));
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
pub(super) fn locate(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let path = Path::new(name);
    if path
        .components()
        .any(|c| !matches!(c, Component::Normal(_) | Component::CurDir))
    {
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
pub(super) fn is_inside(folder: &Path, file: &Path) -> bool {
    let real = file.canonicalize().ok().zip(folder.canonicalize().ok());
    real.is_some_and(|(file, folder)| file.starts_with(folder))
}

/// The notice about a link that leads out of the folder.
pub(super) fn leads_out(name: &str) -> String {
    format!("`{name}` is a link out of the folder and was not followed")
}
