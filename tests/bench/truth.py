#!/usr/bin/env python3
"""Compares what bagreel finds with the true state of a mission, for the recording itself and for situations that are made from it.

    pip install rosbags
    python3 tests/bench/truth.py target/release/bagreel examples/warehouse.bag tests/data/warehouse.truth.json
    python3 tests/bench/truth.py target/release/bagreel BAG TRUTH [BAG TRUTH ...] [--also OTHER.bag ...]

TRUTH contains, for windows of 10 s under "periods" and "10", "start_ns" and the true "nodes", "publishes" (node, topic) and
"subscribes" (topic, node). With `--also`, the recordings of further recorders of the last mission are read with it.

If `truth.jsonl` is beside it, with the state of the ROS master every half second, starts and stops are those of these samples, otherwise
those that the windows show.

Prints F1 (precision) of nodes, publications and subscriptions in these windows, and how many of the true starts and stops of nodes are
listed, and how many are listed and false. Those of restarts are not counted as false, since windows may hide them.
"""

import json
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from rosbags.rosbag1 import Reader, Writer

SECOND = 10**9
WINDOW = 10 * SECOND
EDGE = 2 * SECOND
RECORDER = re.compile(r"^/record(_|$)")
KINDS = ["nodes", "publishes", "subscribes"]


def read(bag):
    with Reader(bag) as reader:
        return [(time, connection, bytes(data)) for connection, time, data in reader.messages()]


def write(bag, messages):
    with Writer(bag) as writer:
        known = {}
        for time, of, data in messages:
            if of.id not in known:
                known[of.id] = writer.add_connection(
                    of.topic, of.msgtype, msgdef=of.msgdef.data, md5sum=of.digest,
                    callerid=of.ext.callerid, latching=of.ext.latching)
            writer.write(known[of.id], time, data)
    return bag


def situations(messages, folder):
    """The recordings that other recorders of this mission would have made, by the name of the situation."""
    start, end = messages[0][0], max(time for time, *_ in messages)
    topics = sorted({of.topic for _, of, _ in messages} - {"/rosout", "/rosout_agg"})
    chance = random.Random(1)

    def part(since=0.0, until=1.0, ahead=0.0, of=None):
        """Messages between two fractions of the mission, by a clock that is some seconds ahead."""
        first, last = start + since * (end - start), start + until * (end - start)
        latched, kept = {}, []
        for time, connection, data in messages:
            if of is not None and connection.topic not in of or time > last:
                continue
            if time >= first:
                late = chance.uniform(0.0005, 0.006) + ahead
                kept.append((time + round(late * SECOND), connection, data))
            elif connection.ext.latching and connection.topic != "/rosout":
                late = chance.random() + ahead
                latched[connection.id] = (round(first + late * SECOND), connection, data)
        return sorted([*latched.values(), *kept], key=lambda message: message[0])

    def parts(recording, many):
        """The files into which a recorder splits its recording."""
        first, last = recording[0][0], recording[-1][0]
        cuts = [*(first + (last - first) * at // many for at in range(many)), last + 1]
        return [[one for one in recording if a <= one[0] < b] for a, b in zip(cuts, cuts[1:])]

    half, most = set(topics[::2]), dict(since=0.02, until=0.9)
    zero = start - 100 * SECOND
    simulated = [(time - zero, of, data) for time, of, data in part(**most, of=half)]
    made = {
        "the recording": [messages],
        "half of the topics, without the log": [part(of=half)],
        "recorded from the middle on": [part(since=0.4)],
        "two recorders, the second of half the topics": [messages, part(**most, of=half)],
        "the same, its clock 2.5 s ahead": [messages, part(**most, ahead=2.5, of=half)],
        "the same, its clock an hour ahead": [messages, part(**most, ahead=3600, of=half)],
        "the same, in simulated time": [messages, simulated],
        "the same, appended to one file": [messages + part(**most, of=half)],
        "the same, merged and sorted in one file": [
            sorted(messages + part(**most, of=half), key=lambda message: message[0])
        ],
        "two recorders in parts, one ends sooner, the other 3.3 s ahead": [
            *parts(part(until=0.85), 3),
            *parts(part(since=0.1, ahead=3.3, of=half), 4),
        ],
        "two recorders, one after the other": [part(until=0.6), part(since=0.4, ahead=1.5)],
        "three recorders, of a third of the topics and half of another": [
            part(of=set(topics[at::3]) | set(topics[(at + 1) % 3 :: 6]) | {"/rosout", "/rosout_agg"})
            for at in range(3)
        ],
    }
    for number, (name, recordings) in enumerate(made.items()):
        names = [folder / f"{number}_{at}.bag" for at in range(len(recordings))]
        yield name, [write(*pair) for pair in zip(names, recordings)]


def found(binary, bags, folder):
    """The mission as JSON."""
    out = folder / "found.json"
    done = subprocess.run([binary, "render", "-q", *bags, "-o", out, "--period", "10"], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    return json.loads(out.read_text())


def stated(mission, span):
    """What exists in an interval according to bagreel, by kind."""
    there = {kind: set() for kind in KINDS}
    for element in mission["elements"]:
        lives = element.get("lives") or []
        if any(begin < span[1] and span[0] < end for begin, end in lives):
            what = element["what"]
            if what == "node":
                there["nodes"].add(element["name"])
            elif what == "publish":
                there["publishes"].add((element["node"], element["topic"]))
            elif what == "subscribe":
                there["subscribes"].add((element["topic"], element["node"]))
    return there


def real(window, kind):
    every = window[kind]
    return set(every) if kind == "nodes" else {tuple(edge) for edge in every}


def is_ours(one):
    """Whether an element names no recorder."""
    return not any(RECORDER.match(name) for name in ([one] if isinstance(one, str) else one))


def states(path, windows):
    """The nodes that exist at the times of samples, or in windows."""
    samples = path.with_name("truth.jsonl")
    if not samples.exists():
        return [(window["start_ns"], real(window, "nodes")) for window in windows]
    all, now = [], set()
    for line in samples.read_text().splitlines():
        sample = json.loads(line)
        if not sample.get("same"):
            ends = [sample[kind] for kind in ("pubs", "subs", "services")]
            now = {node for end in ends for nodes in end.values() for node in nodes} - set(sample["dead"])
            now -= set(sample["tools"])
        all.append((sample["t_ns"], now))
    return all


def changes(mission, states):
    """How many true starts and stops of nodes there are, and are listed, and how many are listed and false."""
    listed = []
    for event in mission["events"]:
        if event["what"] == "node" and not event.get("quiet") and is_ours(event["name"]):
            kind, until = event["kind"], event.get("until_ns")
            if kind in ("started", "stopped"):
                listed.append((kind, event["name"], event["time_ns"], True))
            elif kind == "restarted":
                listed.append(("stopped", event["name"], event["time_ns"], False))
                listed.append(("started", event["name"], until or event["time_ns"], False))
    # At its ends, nobody can distinguish a node that begins from one that was there.
    first, last = mission["start_ns"] + EDGE, mission["end_ns"] - EDGE
    true, near = [], 5 * SECOND
    for (before, old), (time, new) in zip(states, states[1:]):
        near = max(near, time - before)
        if first < time < last:
            true += [("started", name, time) for name in new - old if is_ours(name)]
            true += [("stopped", name, time) for name in old - new if is_ours(name)]

    def agree(one, other):
        return one[:2] == other[:2] and abs(one[2] - other[2]) <= near

    told = sum(any(agree(one, other) for other in listed) for one in true)
    wrong = [one for one in listed if one[3] and first + near < one[2] < last - near]
    return told, len(true), sum(not any(agree(one, other) for other in true) for one in wrong)


def row(binary, bags, path, folder):
    mission = found(binary, bags, folder)
    truth = json.loads(path.read_text())["periods"]["10"]
    covered = mission["start_ns"] - WINDOW // 2, mission["end_ns"] + WINDOW // 2
    windows = [w for w in truth if covered[0] <= w["start_ns"] and w["start_ns"] + WINDOW <= covered[1]]
    cells = []
    there = [stated(mission, (w["start_ns"], w["start_ns"] + WINDOW)) for w in windows]
    for kind in KINDS:
        right = wrong = missed = 0
        for window, every in zip(windows, there):
            is_there = {one for one in every[kind] if is_ours(one)}
            is_true = {one for one in real(window, kind) if is_ours(one)}
            right += len(is_there & is_true)
            wrong += len(is_there - is_true)
            missed += len(is_true - is_there)
        f1 = 2 * right / max(2 * right + wrong + missed, 1)
        cells.append(f"{f1:.3f} ({right / max(right + wrong, 1):.3f})")
    told, all_true, false = changes(mission, states(path, windows))
    return [*cells, f"{told} of {all_true}, {false}"]


def main():
    arguments = sys.argv[1:]
    also = arguments.index("--also") if "--also" in arguments else len(arguments)
    binary, *pairs = arguments[:also]
    if not pairs or len(pairs) % 2:
        sys.exit(__doc__)
    print("| recording | nodes | publications | subscriptions | starts and stops, false |")
    print("|---|---|---|---|---|")
    for bag, truth in zip(pairs[::2], pairs[1::2]):
        truth = Path(truth)
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            for name, bags in situations(read(bag), folder):
                print("|", " | ".join([f"{Path(bag).name}: {name}", *row(binary, bags, truth, folder)]), "|", flush=True)
            others = arguments[also + 1 :] if bag == pairs[-2] else []
            if others:
                name = f"{Path(bag).name} with {', '.join(Path(other).name for other in others)}"
                print("|", " | ".join([name, *row(binary, [bag, *others], truth, folder)]), "|")


if __name__ == "__main__":
    main()
