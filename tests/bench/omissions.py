#!/usr/bin/env python3
"""Counts what happens in missions and is not in their pictures, and words and arrows that cover each other. Run by hand:

    tests/bench/omissions.py BAGREEL [DATA] [--only NAME]

Draws the examples, and the recordings and graphs in DATA (default: `../shared/data` beside the repository), in both modes, and
recordings in windows of 10 s, of 60 s and of the default length, on pages of the default size and of a README. Missions that are
absent are skipped with a note. Prints a row per series of frames, and exits with 1 if a sum is beyond its limit in `LIMITS`:

    uncoloured  starts, stops and restarts of nodes in headlines without a colour at the node or its words
    nowhere     topics with messages in the window that are no box, row, label, word, or counted with their sender
    dead        boxes drawn as active although no node in them is there
    numbers     changes of rates in headlines whose numbers are on no element
    crossed     words of lists and titles, and labels, with another line under them
    heads       arrowheads less than 6 pixels from that of another line; lines that join before their end share one
"""

import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "support")]
import windows
from pictures import SVG, points

ROOT = HERE.parent.parent
MISSIONS = ["inspect/inspect.bag", "mini/mini_lz4.bag", "bags/mission/mission.bag"]
GRAPHS = [f"graphs/{name}.json" for name in ("medium", "large", "huge", "cyclic", "disconnected", "churn")]
FORMS = {"10 s": ["--period", "10"], "60 s": ["--period", "60"], "README": ["--for", "readme"], "default": []}
# The share of each defect above which the script fails. Graphs have up to 80 nodes: what changes in them is partly folded.
DEFECTS = ("uncoloured", "nowhere", "dead", "numbers", "crossed", "heads")
LIMITS = {
    "recordings": dict(zip(DEFECTS, (0.01, 0.005, 0.0, 0.02, 0.005, 0.04))),
    "graphs": dict(zip(DEFECTS, (0.35, 0.05, 0.0, 0.6, 0.005, 0.05))),
}
# Topics that every system has; pictures leave them out, or list some as words.
COMMON = ("tf tf_static diagnostics diagnostics_agg diagnostics_toplevel_state bond rosout rosout_agg clock statistics "
          "parameter_events parameter_updates parameter_descriptions").split()
# The last parts of the names of topics that are drawn as one.
PARTS = "status result goal cancel feedback compressed compressedDepth theora zstd ffmpeg".split()
FAMILIES = ("/action_topics", "/image_topics", "/service_events")
LIVES = ("started", "stopped", "restarted")


def group_of(topic):
    """The names under which a topic may be drawn together with others."""
    parent, _, last = topic.rpartition("/")
    yield topic
    for base in (parent, topic) if last in PARTS or last == "camera_info" else (topic,):
        yield from (base + family for family in FAMILIES)
    if "/_action/" in topic:
        yield topic.split("/_action/")[0] + FAMILIES[0]
    if topic.endswith("/_service_event"):
        yield parent.rpartition("/")[0] + FAMILIES[2]


def box(text):
    """The rectangle of a text: left, top, right, bottom."""
    size, x, y = (float(text.get(key, 0)) for key in ("font-size", "x", "y"))
    wide = float(text.get("textLength", size / 2))
    left = x - {"middle": wide / 2, "end": wide}.get(text.get("text-anchor"), 0)
    return left, y - size * 0.72, left + wide, y


class Frame:
    """The groups of a picture by what they show."""

    def __init__(self, file):
        self.coloured, self.written, self.places = set(), collections.defaultdict(str), set()
        self.words, self.boxes, self.folds = [], [], []
        self.lines, self.heads = collections.defaultdict(list), []
        self.headline, self.ended = set(), set()
        for group in ET.parse(file).getroot().iter(SVG + "g"):
            self.add(group, group.get("class", "").split())

    def add(self, group, words):
        kind, data = words[0] if words else "", lambda key: (group.get("data-" + key) or "").split()
        entries = {int(n) for key in ("entry", "entries") for n in data(key)}
        texts = [text for text in group if text.tag == SVG + "text"]
        if kind == "headline":
            self.headline = entries
        if kind not in ("node", "topic", "edge", "also", "namespace-title"):
            return
        is_marked = {"added", "removed", "changed", "away"} & set(words) and group.get("data-mark") != "inside"
        if kind == "also" or kind == "node" and is_marked:
            self.coloured |= entries
        if "removed" in words:
            self.ended |= entries
        for entry in entries:
            self.written[entry] += " ".join("".join(text.itertext()) for text in texts) + " "
        self.places.update(data("name") + data("names") + data("topics"))
        name = group.get("id", "").split("..over")[0]
        if kind in ("also", "namespace-title", "edge"):
            self.words += [(name, box(text)) for text in texts]
        if kind == "edge":
            self.places.update(data("from") + data("to"))
            for form in group:
                if form.tag == SVG + "path":
                    self.lines[name] += points(form.get("d"))
                elif form.tag == SVG + "polygon":
                    self.heads.append((name, tuple(map(float, form.get("points").split()[0].split(",")))))
        elif kind == "node" and "active" in words and "removed" not in words:
            (self.folds if group.get("data-members") else self.boxes).append(group.get("data-name"))
        if kind == "node" and group.get("data-members"):
            self.places.update(data("members"))

    def crossed(self):
        """The words that a line of another element runs through."""
        def is_hit(own, place):
            left, top, right, bottom = place
            return any(
                left < x < right and top < y < bottom for name, line in self.lines.items() if name != own for x, y in line
            )
        return sum(is_hit(own, place) for own, place in self.words)

    def close(self):
        """The heads that are close to one of another line."""
        def is_close(name, at):
            return any(
                other != name and 1 < (at[0] - x) ** 2 + (at[1] - y) ** 2 < 36 for other, (x, y) in self.heads
            )
        return sum(is_close(*head) for head in self.heads)


def number(text):
    """A rate in Hz."""
    value, unit = re.fullmatch(r"([\d.]+) ?(k?)", text).groups()
    return float(value) * (1000 if unit else 1)


def has_rates(event, text):
    """Whether the words of an element contain the rates of an event before and after."""
    near = lambda shown, hz: abs(number(shown) - hz) <= 0.06 * hz + 0.06
    for chain in re.findall(r"[\d.]+(?: ?k?(?:Hz)? → [\d.]+)+ ?k?", text):
        steps = re.findall(r"[\d.]+ ?k?", chain)
        unit = "k" if steps[-1].endswith("k") else ""
        steps = [step if step.endswith("k") else step.strip() + unit for step in steps]
        if any(near(a, event["from_hz"]) and near(b, event["to_hz"]) for a, b in zip(steps, steps[1:])):
            return True
    return False


def run_of(name, role):
    """Whether a node is this one, a run of this anonymous one, or one of these equal ones."""
    is_run = name.startswith(role) and re.fullmatch(r"[_\d]*", name[len(role) :])
    return is_run or re.sub(r"\d+", "N", name) == role


def measure(file, window, events, sums):
    """Adds the defects of one frame, and what was looked at."""
    frame = Frame(file)
    shown = [events[n] for n in frame.headline]
    lives = [event for event in shown if event["what"] == "node" and event["kind"] in LIVES]
    # What ends in the window has no rate any more.
    rates = [event for event in shown if "to_hz" in event and event["id"] not in frame.ended]
    lost = [event for event in lives if event["id"] not in frame.coloured]
    sums["uncoloured"] += len(lost)
    sums["of uncoloured"] += len(lives)
    unread = [event for event in rates if not has_rates(event, frame.written[event["id"]])]
    sums["numbers"] += len(unread)
    sums["of numbers"] += len(rates)
    sent = [topic["name"] for topic in window["topics"] if topic.get("count")]
    sent = [name for name in sent if name.rpartition("/")[2] not in COMMON]
    folds = [fold.rstrip("/") + "/" for fold in frame.folds]
    senders = collections.defaultdict(list)
    for edge in window["publishes"]:
        senders[edge["topic"]].append(edge["node"])

    def is_placed(topic):
        inside = lambda name: any(name.startswith(fold) for fold in folds)
        # Equal robots are drawn as one.
        names = [name for one in (topic, re.sub(r"\d+", "N", topic)) for name in group_of(one)]
        return not frame.places.isdisjoint(names) or inside(topic) or any(map(inside, senders[topic]))

    nowhere = [topic for topic in sent if not is_placed(topic)]
    sums["nowhere"] += len(nowhere)
    sums["of nowhere"] += len(sent)
    there = [node["name"] for node in window["nodes"]]
    dead = [name for name in frame.boxes if " ?" not in name and not any(run_of(node, name) for node in there)]
    dead += [fold for fold in folds if not any(name.startswith(fold) for name in there + sent)]
    sums["dead"] += len(dead)
    sums["of dead"] += len(frame.boxes) + len(folds)
    sums["crossed"] += frame.crossed()
    sums["of crossed"] += len(frame.words)
    sums["heads"] += frame.close()
    sums["of heads"] += len(frame.heads)
    lost = [event["name"] for event in lost]
    unread = [f"{event.get('topic', event.get('name'))} {event['from_hz']:.3g} → {event['to_hz']:.3g} Hz, but: "
              f"{frame.written[event['id']]}" for event in unread]
    for what, found in (("uncoloured", lost), ("nowhere", nowhere), ("dead", dead), ("numbers", unread)):
        for name in found:
            print(f"    {what} in {file.stem}: {name}", file=sys.stderr)


def series(bagreel, mission, mode, form):
    """The sums over the frames of a mission."""
    period = [option for option in form if option not in FORMS["README"]]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if mission.suffix == ".json":
            # Its schema may be an older one, whose windows list their elements.
            whole = windows.join(json.loads(mission.read_text()))
            mission = folder / mission.name
            mission.write_text(json.dumps(whole))
        render = [bagreel, "render", "-q", mission]
        subprocess.run([*render, "--mode", mode, *form, "-o", folder / "x{n}.svg"], check=True)
        # Data of a mode contains only what it shows.
        subprocess.run([*render, *period, "-o", folder / "x.json"], check=True)
        data = json.loads((folder / "x.json").read_text())
        events = {event["id"]: event for event in data["events"]}
        files, sums = sorted(folder.glob("x*.svg")), collections.Counter()
        for file, window in zip(files, windows.split(data)["windows"]):
            measure(file, window, events, sums)
    return len(files), sums


def main():
    args = sys.argv[1:]
    only = args.pop(args.index("--only") + 1) if "--only" in args else ""
    args = [arg for arg in args if arg != "--only"]
    bagreel, data = args[0], pathlib.Path(args[1] if len(args) > 1 else ROOT.parent / "shared/data")
    found = [ROOT / "examples/warehouse.bag", ROOT / "examples/courier.mcap"] + [data / name for name in MISSIONS + GRAPHS]
    total = {kind: collections.Counter() for kind in LIMITS}
    print("| mission | frames | " + " | ".join(DEFECTS) + " |")
    print("|---" * (2 + len(DEFECTS)) + "|")

    def row(what, frames, sums):
        cells = [f"{sums[key]} of {sums['of ' + key]}" for key in DEFECTS]
        print(f"| {what} | {frames} | " + " | ".join(cells) + " |", flush=True)

    for mission in found:
        if only not in str(mission):
            continue
        if not mission.exists():
            print(f"skipped {mission.name}: it is not in {mission.parent}", file=sys.stderr)
            continue
        kind = "graphs" if mission.suffix == ".json" else "recordings"
        for mode in ("nodes", "all"):
            for form in ("10 s", "60 s", "README", "default") if kind == "recordings" else ("README", "default"):
                frames, sums = series(bagreel, mission, mode, FORMS[form])
                row(f"{mission.stem}, {mode}, {form}", frames, sums)
                total[kind] += sums
    beyond = []
    for kind, sums in total.items():
        row(f"all {kind}", "", sums)
        beyond += [f"{key} of {kind}" for key, most in LIMITS[kind].items() if sums[key] > most * sums["of " + key]]
    if beyond:
        sys.exit("beyond the limits: " + ", ".join(beyond))


if __name__ == "__main__":
    main()
