#!/usr/bin/env python3
"""Creates seeds for the targets: the small bags and files of the project, each also cut to its beginning."""
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MOST = 60_000

BY_ENDING = {
    ".bag": ["rosbag1", "verify", "graph", "zstd_body"],
    ".active": ["rosbag1", "graph"],
    ".mcap": ["mcap", "verify", "graph", "zstd_body"],
    ".db3": ["sqlite3", "verify", "graph", "zstd_body"],
    ".zstd": ["zstd"],
    ".launch": ["topology_launch"],
    ".dot": ["topology_dot"],
    ".toml": ["style"],
    ".csv": ["topology_csv"],
    ".json": ["mission"],
}

SMALL = {
    "topology_yaml": b"nodes:\n  /a: {publishes: [/x], subscribes: [/y]}\n  /b: {subscribes: [/x]}\n",
    "topology_launch": b'<launch><arg name="n" default="a"/><group ns="g"><node name="$(arg n)" pkg="p" type="t">'
    b'<remap from="x" to="/y"/></node></group><include file="other.launch"/></launch>',
    "topology_dot": b'digraph g { "/a" -> "/x" [label="t"]; subgraph cluster_1 { "/b"; } "/x" -> "/b"; }',
    "topology_csv": b"node,topic,role\n/a,/x,publisher\n/b,/x,subscriber\n",
    "metadata": b"rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n"
    b"    - bag_0.mcap\n  topics_with_message_count:\n    - topic_metadata:\n        name: /a\n        type: std_msgs/msg/String\n"
    b"        serialization_format: cdr\n        offered_qos_profiles: ''\n      message_count: 1\n",
    "definition": b"\x0estd_msgs/Header header\nstring[] names\nfloat64[3] xs\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\n"
    b"string frame_id\n\xff\x12\0\1\0\0" + bytes(64),
    "mission": b'{"schema": "bagreel.mission/3", "windows": []}',
}


def put(target, name, data):
    folder = HERE / "seeds" / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data[:MOST])


def main():
    for target, data in SMALL.items():
        put(target, "small", data)
    for kind in range(19):
        # A header, a few strings and arrays: most layouts begin so.
        words = b"".join(len(w).to_bytes(4, "little") + w for w in (b"/talker", b"/chatter", b"/listener"))
        put("cursor_ros1", f"type{kind}", bytes([kind]) + bytes(16) + words + bytes(64))
        put("cursor_cdr", f"type{kind}", bytes([kind]) + b"\0\1\0\0" + bytes(16) + words + bytes(64))
    for folder in ("tests/data", "examples", "styles"):
        for path in sorted((ROOT / folder).rglob("*")):
            if not path.is_file() or path.stat().st_size > 8 << 20:
                continue
            for target in BY_ENDING.get(path.suffix, []):
                put(target, path.name, path.read_bytes())


main()
