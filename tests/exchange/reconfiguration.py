"""Computes anew how much a recording reconfigures, and compares every number with the tables of a bundle.

usage: reconfiguration.py MISSION.json EVENTS.csv BUNDLE
The mission has the same windows as the bundle, whose only recording it is; the events are those of `bagreel events`.
"""

import csv
import json
import pathlib
import re
import statistics
import sys

QUIET = re.compile(r"/parameter_events|/clock|/statistics|(.*/)?rosout(_agg)?|.*/parameter_(updates|descriptions)|/events/.*")
TOOL = re.compile(r"(.*/)?(record_\d+|play_\d+|rosbag2_(recorder.*|player)|_ros2cli_.*)")
GUESSES = {"source_only", "unknown", "owned_type"}


def is_robot(element):
    """Whether a node or an edge is of the robot, and more than a guess."""
    names = [element.get("name") or element["node"], element.get("topic", "")]
    evidence = element["evidence"]
    is_guess = evidence and GUESSES.issuperset(evidence)
    is_tool = "recorder" in evidence or TOOL.fullmatch(names[0])
    return not is_guess and not is_tool and not any(QUIET.fullmatch(name) for name in names)


def table(path):
    """The rows of a table, without the name of the recording; numbers as numbers, empty cells as `None`."""
    word = {"": None, "true": True, "false": False}
    number = re.compile(r"-?\d+(\.\d+)?(e-?\d+)?")
    cell = lambda text: word[text] if text in word else json.loads(text) if number.fullmatch(text) else text
    with open(path, newline="") as file:
        return [{key: cell(text) for key, text in row.items() if key != "run"} for row in csv.DictReader(file)]


def windows(mission):
    """A row per window: its graph, and what differs from the one before."""
    guessed = {e["name"] for e in mission["elements"] if e["what"] == "node" and not is_robot(e)}
    before = None
    for place, window in enumerate(mission["windows"]):
        nodes = {n["name"] for n in window["nodes"] if n["name"] not in guessed}
        edges = {
            (way, edge["node"], edge["topic"])
            for way in ("publishes", "subscribes")
            for edge in window[way]
            if is_robot(edge) and edge["node"] not in guessed
        }
        row = {"win": place, "start_ns": window["start_ns"], "end_ns": window["end_ns"], "nodes": len(nodes), "edges": len(edges)}
        counts, turnover = [None] * 5, None
        if before:
            counts = [len(nodes - before[0]), len(before[0] - nodes), len(edges - before[1]), len(before[1] - edges)]
            counts.append(sum(counts))
            turnover = counts[4] / (len(nodes | before[0]) + len(edges | before[1]))
        names = ["nodes_added", "nodes_removed", "edges_added", "edges_removed", "distance"]
        yield row | dict(zip(names, counts)) | {"turnover": turnover}
        before = nodes, edges


def lifetimes(mission):
    """A row per life of a node."""
    start, end = mission["start_ns"], mission["end_ns"]
    for node in mission["elements"]:
        if node["what"] == "node" and is_robot(node):
            for life in node["lives"]:
                ends = {"start_ns": life[0], "end_ns": life[1], "lifetime_s": (life[1] - life[0]) / 1e9}
                yield {"node": node["name"]} | ends | {"is_from_start": life[0] <= start, "is_to_end": life[1] >= end}


def summary(mission, changes, windows, lifetimes):
    """The row of the recording."""
    seconds = (mission["end_ns"] - mission["start_ns"]) / 1e9
    mean = lambda key: statistics.mean(row[key] for row in windows if row[key] is not None)
    return {
        "duration_s": seconds,
        "period_s": mission["period_ns"] / 1e9,
        "windows": len(windows),
        "changes": changes,
        "changes_per_min": changes / seconds * 60,
        "distance_mean": mean("distance"),
        "distance_max": max(row["distance"] or 0 for row in windows),
        "turnover_mean": mean("turnover"),
        "lives": len(lifetimes),
        "lifetime_median_s": statistics.median_high(row["lifetime_s"] for row in lifetimes),
    }


def main(mission, events, bundle):
    mission, bundle = json.loads(pathlib.Path(mission).read_text()), pathlib.Path(bundle)
    rows = {"windows": list(windows(mission)), "lifetimes": list(lifetimes(mission))}
    rows["reconfiguration"] = [summary(mission, len(table(events)), *rows.values())]
    for name, own in rows.items():
        written = table(bundle / f"{name}.csv")
        assert len(own) == len(written) > 0, (name, len(own), len(written))
        for mine, theirs in zip(own, written):
            assert mine.keys() == theirs.keys(), (name, mine.keys() ^ theirs.keys())
            for key, value in mine.items():
                same = value == theirs[key] or isinstance(value, float) and abs(value - theirs[key]) <= 1e-12 * abs(value)
                assert same, (name, key, value, theirs[key], mine)
        print(f"{name}: {len(own)} rows of {len(own[0])} numbers are equal")
    print("all well")


main(*sys.argv[1:])
