#!/usr/bin/env python3
"""Measures how time and memory grow with the names, nodes, topics and files of a recording. Run by hand:

    tests/bench/growth.py BAGREEL [--sizes 5000,10000] [--rounds 3] [--only COMMAND] [KIND...]

Makes recordings of several sizes, each twice the one before, and prints as Markdown the processor time and the most memory
of each command, and how many times as much it took as at half the size. Ends with 1 where twice the size takes more than
2.4 times as much time (of runs of at least a third of a second) or twice the memory (of at least 64 MB), an evidence command
more than 256 MB, a drawing more than 512 MB, or a command fails without refusing a drawing as too large.
"""

import argparse
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

SIZES = "5000,10000,20000,40000"
MOST_TIME, MOST_MEMORY = 2.4, 2.0
EVIDENCE_MB, DRAWING_MB = 256, 512
# Seconds from which a run is measured once.
LONG = 8
BEGIN = 1_600_000_000

STATISTICS = b"""string topic
string node_pub
string node_sub
time window_start
time window_stop
int32 delivered_msgs
int32 dropped_msgs
int32 traffic
duration period_mean
duration period_stddev
duration period_max
duration stamp_age_mean
duration stamp_age_stddev
duration stamp_age_max
"""
HEADER = b"=" * 80 + b"\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
LOG = b"""byte DEBUG=1
byte INFO=2
byte WARN=4
byte ERROR=8
byte FATAL=16
Header header
byte level
string name
string msg
string file
string function
uint32 line
string[] topics
""" + HEADER
GOAL_ID = b"=" * 80 + b"\nMSG: actionlib_msgs/GoalID\ntime stamp\nstring id\n"
GOALS = b"Header header\nGoalStatus[] status_list\n" + HEADER + b"=" * 80 + b"""
MSG: actionlib_msgs/GoalStatus
GoalID goal_id
uint8 status
uint8 PENDING=0
uint8 ACTIVE=1
uint8 PREEMPTED=2
uint8 SUCCEEDED=3
uint8 ABORTED=4
uint8 REJECTED=5
uint8 PREEMPTING=6
uint8 RECALLING=7
uint8 RECALLED=8
uint8 LOST=9
string text
""" + GOAL_ID


def text(value):
    return struct.pack("<I", len(value)) + value


class Bag:
    """A ROS 1 bag of one chunk, without an index."""

    def __init__(self):
        self.inner = bytearray()
        self.connections = 0

    @staticmethod
    def record(fields, data):
        head = b"".join(text(key + b"=" + value) for key, value in fields)
        return text(head) + text(data)

    def connection(self, topic, kind, definition, node):
        here = struct.pack("<I", self.connections)
        self.connections += 1
        about = [(b"topic", topic), (b"type", kind), (b"md5sum", b"*" * 32), (b"message_definition", definition),
                 (b"callerid", node)]
        about = b"".join(text(key + b"=" + value) for key, value in about)
        self.inner += self.record([(b"op", b"\x07"), (b"conn", here), (b"topic", topic)], about)
        return here

    def message(self, connection, seconds, data):
        whole = int(seconds)
        at = struct.pack("<II", BEGIN + whole, int((seconds - whole) * 1e9))
        self.inner += self.record([(b"op", b"\x02"), (b"conn", connection), (b"time", at)], data)

    def write(self, path):
        head = [(b"op", b"\x03"), (b"index_pos", bytes(8)), (b"conn_count", bytes(4)), (b"chunk_count", bytes(4))]
        chunk = [(b"op", b"\x05"), (b"compression", b"none"), (b"size", struct.pack("<I", len(self.inner)))]
        path.write_bytes(b"#ROSBAG V2.0\n" + self.record(head, b" " * 4000) + self.record(chunk, bytes(self.inner)))
        return path


def statistics(many, folder):
    """A third as many topics, publishers and subscribers, all named in `/statistics`."""
    bag = Bag()
    here = bag.connection(b"/statistics", b"rosgraph_msgs/TopicStatistics", STATISTICS, b"/monitor")
    for k in range(many // 3):
        span = struct.pack("<4I3i", BEGIN, 0, BEGIN + 1, 0, 5, 0, 100)
        data = text(b"/t%06d" % k) + text(b"/p%06d" % k) + text(b"/s%06d" % k) + span + bytes(48)
        bag.message(here, 60 * k / many, data)
    return [bag.write(folder / "statistics.bag")]


def logs(many, folder):
    """As many topics, named in the log records of a hundred nodes."""
    bag = Bag()
    for node in range(100):
        name = b"/n%03d" % node
        here = bag.connection(b"/rosout", b"rosgraph_msgs/Log", LOG, name)
        topics = [b"/t%06d" % k for k in range(node, many, 100)]
        topics = struct.pack("<I", len(topics)) + b"".join(map(text, topics))
        for k in range(3):
            stamp = struct.pack("<III", k, BEGIN + node // 2 + 3 * k, 0) + text(b"")
            words = text(name) + text(b"all well") + text(b"a.cpp") + text(b"main") + struct.pack("<I", 7)
            bag.message(here, node // 2 + 3 * k, stamp + b"\x02" + words + topics)
    return [bag.write(folder / "logs.bag")]


def strings(pairs, folder, name, begin):
    """A bag with three messages a second apart on each connection, (node, topic), from `begin(k)` on."""
    bag = Bag()
    connections = [bag.connection(topic, b"std_msgs/String", b"string data\n", node) for node, topic in pairs]
    times = sorted((begin(k) + second, k) for k in range(len(connections)) for second in range(3))
    for at, k in times:
        bag.message(connections[k], at, text(b"ping"))
    return [bag.write(folder / name)]


def nodes(many, folder):
    """As many nodes that publish a hundred topics, each for two seconds of a minute."""
    pairs = [(b"/n%06d" % k, b"/t%02d" % (k % 100)) for k in range(many)]
    return strings(pairs, folder, "nodes.bag", lambda k: 60 * k / many)


def together(many, folder):
    """As many topics of a hundred nodes, which appear together."""
    pairs = [(b"/n%02d" % (k % 100), b"/t%06d" % k) for k in range(many)]
    return strings(pairs, folder, "together.bag", lambda k: k / many)


def spread(many, folder):
    """As many topics of a hundred nodes, which appear in the course of ten minutes."""
    pairs = [(b"/n%02d" % (k % 100), b"/t%06d" % k) for k in range(many)]
    return strings(pairs, folder, "spread.bag", lambda k: 600 * k / many)


def goals(many, folder):
    """As many clients of one action, in four messages of its server."""
    bag = Bag()
    here = bag.connection(b"/walk/status", b"actionlib_msgs/GoalStatusArray", GOALS, b"/walker")
    for second in range(4):
        stamp = struct.pack("<III", second, BEGIN + second, 0) + text(b"")
        clients = range(second * many // 4, (second + 1) * many // 4)
        each = b"".join(
            struct.pack("<II", BEGIN, 0) + text(b"/c%06d-1-%d.0" % (k, BEGIN)) + b"\x01" + text(b"") for k in clients
        )
        bag.message(here, second, stamp + struct.pack("<I", len(clients)) + each)
    return [bag.write(folder / "goals.bag")]


def launched(many, folder):
    """As many nodes of a launch file, beside a recording of three nodes."""
    lines = (f'<node pkg="p" type="t" name="n{k}"><remap from="x" to="/t{k % 1000}"/></node>' for k in range(many))
    (folder / "all.launch").write_text("<launch>\n" + "\n".join(lines) + "\n</launch>\n")
    bag = nodes(3, folder)
    return [*bag, "--topology", folder / "all.launch"]


def drawn(many, folder):
    """A chain of as many nodes and topics of a DOT file without blanks, beside a recording of three nodes."""
    chain = "->".join(f'"/{"nt"[k % 2]}{k // 2}"' for k in range(2 * many))
    shapes = "".join(f'"/n{k}"[shape=ellipse];"/t{k}"[shape=box];' for k in range(many))
    (folder / "all.dot").write_text("digraph{" + shapes + chain + "}")
    return [*nodes(3, folder), "--topology", folder / "all.dot"]


def hub(many, folder):
    """A third as many nodes with three topics each, to all of which one node subscribes."""
    bag = Bag()
    here = bag.connection(b"/statistics", b"rosgraph_msgs/TopicStatistics", STATISTICS, b"/monitor")
    for k in range(many):
        span = struct.pack("<4I3i", BEGIN, 0, BEGIN + 1, 0, 5, 0, 100)
        node = b"/n%06d" % (k // 3)
        data = text(node + b"/t%d" % (k % 3)) + text(node) + text(b"/hub") + span + bytes(48)
        bag.message(here, 60 * k / many, data)
    return [bag.write(folder / "hub.bag")]


def files(many, folder):
    """A recording split into a quarter as many files, each a second of ten topics."""
    pairs = [(b"/n%d" % (j % 3), b"/t%d" % j) for j in range(10)]
    parts = [strings(pairs, folder, f"{k:06}.bag", lambda j, k=k: k + j / 20) for k in range(many // 4)]
    return [path for part in parts for path in part]


KINDS = {f.__name__: f for f in (statistics, logs, nodes, hub, together, spread, goals, launched, drawn, files)}
COMMANDS = {
    "info": ["info"],
    "events": ["events"],
    "json": ["render", "-q", "-o", "x.json"],
    "page": ["render", "-q", "-o", "x.html"],
    "gif": ["render", "-q", "-o", "x.gif"],
    "png": ["render", "-q", "-o", "x.png"],
    "svg": ["render", "-q", "-o", "x.svg"],
    "dot": ["render", "-q", "-o", "x.dot"],
    "mermaid": ["render", "-q", "-o", "x.mmd"],
    "markdown": ["render", "-q", "-o", "x.md"],
    "pdf": ["render", "-q", "-o", "x.pdf"],
    "csv": ["render", "-q", "-o", "x.csv"],
    "graph": ["figure", "--kind", "graph", "-o", "graph.svg"],
    "lives": ["figure", "--kind", "lives", "-o", "lives.svg"],
    "holders": ["figure", "--kind", "holders", "-o", "holders.svg"],
    "steps": ["figure", "--kind", "steps", "-o", "steps.svg"],
    "extract": ["extract", "-o", "x.csv"],
    "fields": ["extract", "--fields", "-o", "fields/"],
    "tables": ["tables", "-o", "tables/"],
    "diff": ["diff", "x.json"],
    "baseline": ["baseline", "-o", "expect.yaml"],
    "check": ["check", "--expect", "expect.yaml"],
}
DRAWINGS = ("page", "gif", "png", "svg", "pdf", "graph", "lives", "holders", "steps")


def measured(program, command, recordings, rounds):
    """Per recording the seconds of processor time, megabytes, and the words of a failure: of some rounds over all
    recordings the least time in the program and the least in the kernel, as the speed of a machine varies, and the host
    of a virtual one may take back free memory, which the kernel then clears slowly; long runs are measured once.
    """
    runs = [[measured_once(program, command, *recording)] for recording in recordings]
    for _ in range(rounds - 1):
        for of, recording in zip(runs, recordings):
            if of[0][0] < LONG:
                of.append(measured_once(program, command, *recording))
    return [(min(r[0] for r in of) + min(r[1] for r in of), min(r[2] for r in of), max(r[3] for r in of)) for of in runs]


def measured_once(program, command, inputs, folder):
    for old in ("fields", "tables"):
        shutil.rmtree(folder / old, ignore_errors=True)
    with open(folder / "printed", "w+b") as printed, open(folder / "said", "w+b") as said:
        child = subprocess.Popen([program, *command, *inputs], cwd=folder, stdout=printed, stderr=said)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        words = said.read().decode(errors="replace").strip()
    used = usage.ru_utime, usage.ru_stime, usage.ru_maxrss / 1024
    if child.returncode not in (0, 3):
        wrong = "refused" if child.returncode == 2 else f"exit {child.returncode}: {words[:160]}"
        return *used, wrong
    return *used, ""


def fault(command, before, now):
    """Whether a limit is exceeded, in a word."""
    found = []
    if now[0] >= 1 / 3 and now[0] > MOST_TIME * max(before[0], 0.05):
        found.append("time")
    if now[1] >= 64 and now[1] > MOST_MEMORY * before[1]:
        found.append("memory")
    if now[1] > (DRAWING_MB if command in DRAWINGS else EVIDENCE_MB):
        found.append("too large")
    return " and ".join(found)


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("program", type=os.path.abspath)
    args.add_argument("--sizes", default=SIZES)
    args.add_argument("--rounds", type=int, default=3)
    args.add_argument("--only", action="append", choices=COMMANDS)
    args.add_argument("kinds", nargs="*", metavar="KIND")
    args = args.parse_intermixed_args()
    sizes = [int(size) for size in args.sizes.split(",")]
    # `check` needs the file of `baseline`, and `diff` that of `json`.
    commands = {name: words for name, words in COMMANDS.items() if name in (args.only or COMMANDS)}
    faults = 0
    print("| recording | command | " + " | ".join(f"{size:,}" for size in sizes) + " | growth of time | of memory | |")
    print("|---" * (len(sizes) + 5) + "|")
    for kind in args.kinds or KINDS:
        with tempfile.TemporaryDirectory() as scratch:
            recordings = []
            for many in sizes:
                folder = Path(scratch) / str(many)
                folder.mkdir()
                recordings.append((KINDS[kind](many, folder), folder))
            for command, words in commands.items():
                of = measured(args.program, words, recordings, args.rounds)
                cells = [f"{seconds:.2f} s, {mb:.0f} MB" for seconds, mb, _ in of]
                growth = [", ".join(f"×{b[at] / max(a[at], 0.01):.2f}" for a, b in zip(of, of[1:])) for at in (0, 1)]
                wrong = [fault(command, *pair) for pair in zip(of, of[1:])] + [failure for *_, failure in of]
                wrong = list(dict.fromkeys(word for word in wrong if word))
                faults += wrong not in ([], ["refused"])
                print("| " + " | ".join([kind, command, *cells, *growth, "; ".join(wrong)]) + " |", flush=True)
    sys.exit(faults > 0)


main()
