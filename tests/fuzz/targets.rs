//! All fuzz targets in one program, which is built once; the variable `TARGET` names the one to run.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use bagreel::internals::draw::style::Style;
use bagreel::internals::evidence::topology;
use bagreel::internals::mission::read_json;
use bagreel_fuzz::{
    as_file, damage, damage_packed, outputs, packed, read_bag, read_graphs, read_message, several,
};
use libfuzzer_sys::fuzz_target;

type Target = fn(&[u8]);

/// The targets by name; `README.md` describes their inputs.
const TARGETS: &[(&str, Target)] = &[
    ("rosbag1", |bytes| as_file("x.bag", bytes, |path| read_bag(path, false))),
    ("mcap", |bytes| as_file("x.mcap", bytes, |path| read_bag(path, false))),
    ("sqlite3", |bytes| as_file("x.db3", bytes, |path| read_bag(path, false))),
    ("zstd", |bytes| as_file("x.mcap.zstd", bytes, |path| read_bag(path, false))),
    ("zstd_body", |bytes| as_file("x.zstd", &packed(bytes), |path| read_bag(path, false))),
    ("verify", |bytes| as_file("x", bytes, |path| read_bag(path, true))),
    ("metadata", metadata),
    ("cursor_ros1", |bytes| read_message("ros1", b"", bytes)),
    ("cursor_cdr", |bytes| read_message("cdr", b"", bytes)),
    ("definition", definition),
    ("topology_yaml", |bytes| as_file("x.yaml", bytes, read_topology)),
    ("topology_launch", |bytes| as_file("x.launch", bytes, read_topology)),
    ("topology_dot", |bytes| as_file("x.dot", bytes, read_topology)),
    ("topology_csv", |bytes| as_file("x.csv", bytes, read_topology)),
    ("style", |bytes| as_text(bytes, |text| drop(Style::from_toml(text, "x.toml".as_ref())))),
    ("mission", |bytes| as_text(bytes, |text| drop(read_json(text, "x.json".as_ref())))),
    ("graph", |bytes| as_file("x", bytes, read_graphs)),
    ("damage", damage),
    ("damage_packed", damage_packed),
    ("several", several),
    ("outputs", outputs),
];

static CHOSEN: LazyLock<Target> = LazyLock::new(|| {
    let name = std::env::var("TARGET").expect("`TARGET` names a target");
    let target = TARGETS.iter().find(|(of, _)| *of == name);
    target.expect("`TARGET` is one of the targets").1
});

fuzz_target!(|bytes: &[u8]| CHOSEN(bytes));

/// `metadata.yaml` of a folder, which may list two existing files.
fn metadata(bytes: &[u8]) {
    as_file("metadata.yaml", bytes, |path| {
        let folder = path.parent().expect("a folder");
        for name in ["bag_0.mcap", "bag_1.mcap"] {
            std::fs::write(folder.join(name), b"\x89MCAP0\r\n").expect("a file");
        }
        read_bag(folder, false);
    });
}

/// A message definition, up to the first byte 0xff, followed by a payload.
fn definition(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |b| *b == 0xff);
    let (definition, payload) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    read_message("cdr", definition, payload);
}

fn read_topology(path: &Path) {
    drop(topology::read(path));
}

fn as_text(bytes: &[u8], read: impl FnOnce(&str)) {
    if let Ok(text) = std::str::from_utf8(bytes) {
        read(text);
    }
}
