"""A mission's JSON window by window: each with its `nodes`, `topics`, `publishes` and `subscribes`, as graph tools want them.

usage: windows.py split MISSION.json    prints the mission with these lists in each window
       windows.py join WINDOWS.json     prints the mission of such windows, with `elements`
"""

import itertools
import json
import sys

LISTS = {"node": "nodes", "topic": "topics", "publish": "publishes", "subscribe": "subscribes"}
COLUMNS = "state degree count bytes median_period_s max_gap_s drops jitter_s age_s hz lifecycle".split()
DEFAULTS = {"state": "active", "degree": "stated"}


def values(column):
    """The values of a column, of which `[value, times]` are several."""
    for cell in column:
        value, times = cell if isinstance(cell, list) else (cell, 1)
        yield from [value] * times


def split(mission):
    windows = mission["windows"]
    for window in windows:
        window.update({list_: [] for list_ in LISTS.values()})
    for element in mission["elements"]:
        plain = {key: value for key, value in element.items() if key not in ("what", "in", "lives", "stretches", "pauses")}
        columns = dict(element["in"])
        there = [windows[at] for first, last in columns.pop("windows") for at in range(first, last + 1)]
        rows = [dict(plain) for _ in there]
        for key, column in columns.items():
            for row, value in zip(rows, values(column)):
                row[key] = value
        for window, row in zip(there, rows):
            count = row.pop("sent", row.get("count"))
            if row.get("hz", "=") == "=":
                row["hz"] = None if count is None else count / ((window["end_ns"] - window["start_ns"]) / 1e9)
            window[LISTS[element["what"]]].append(row)
    return mission


def join(mission):
    elements, windows = {}, mission["windows"]
    for at, window in enumerate(windows):
        counts = [topic.get("count") or 0 for topic in window.get("topics", [])]
        window.setdefault("messages", sum(counts))
        ends = [edge for kind in ("publishes", "subscribes") for edge in window.get(kind, [])]
        for what, list_ in LISTS.items():
            rows = [(row.get("name") or (row["node"], row["topic"]), row) for row in window.pop(list_, [])]
            # An edge brings its ends.
            known = [{key: edge[key] for key in ("state", "degree") if key in edge} for edge in ends]
            rows += [(edge[what], end) for edge, end in zip(ends, known) if what in ("node", "topic")]
            for name, row in reversed(rows):
                names = {"name": name} if isinstance(name, str) else {"node": name[0], "topic": name[1]}
                element, there = elements.setdefault((list(LISTS).index(what), name), ({"what": what, **names}, {}))
                element.update({key: value for key, value in row.items() if key not in COLUMNS})
                there[at] = {"count": 0, **row} if what == "topic" else row
    listed = []
    for _, (element, there) in sorted(elements.items(), key=lambda item: (item[0][0], str(item[0][1]))):
        runs = []
        for at in sorted(there):
            if runs and runs[-1][1] == at - 1:
                runs[-1][1] = at
            else:
                runs.append([at, at])
        columns = {"windows": runs}
        for key in COLUMNS:
            column = [there[at].get(key, DEFAULTS.get(key)) for at in sorted(there)]
            # Without rates, they would be computed from counts.
            if key == "hz" or any(value != DEFAULTS.get(key) for value in column):
                columns[key] = [[value, len(list(same))] for value, same in itertools.groupby(column)]
        # Windows do not say when in them the first message came.
        sent = [windows[at] for at in sorted(there) if there[at].get("count")]
        if sent:
            element = {"first_ns": sent[0]["start_ns"], "last_ns": sent[-1]["end_ns"] - 1, **element}
        listed.append({**element, "in": columns})
    return {**mission, "schema": "bagreel.mission/3", "elements": listed}


if __name__ == "__main__":
    with open(sys.argv[2]) as file:
        json.dump({"split": split, "join": join}[sys.argv[1]](json.load(file)), sys.stdout)
