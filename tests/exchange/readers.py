"""Opens `graph.mcap` of the examples with other readers and compares each graph with the lives in the mission's JSON.

usage: readers.py, in an environment with the wheel, mcap-ros2-support, and rerun-sdk if Rerun is to be tried, too.
Ends with an error if anything differs.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
GUESSES = {"source_only", "unknown", "owned_type"}


def bagreel(*args):
    subprocess.run([sys.executable, "-m", "bagreel", "--quiet", *map(str, args)], check=True)


def ends(nodes, get):
    """The nodes and edges of a graph, as names."""
    for node in nodes:
        name = get(node, "name")
        if name != "/_unknown":
            yield name
            for way, lists in [("publish", ["publishers", "service_clients"]), ("subscribe", ["subscriptions", "service_servers"])]:
                yield from ((way, name, get(end, "name")) for key in lists for end in get(node, key))


def mcap_ros2(path):
    """By the packages `mcap` and `mcap-ros2-support`: the graphs by their times, and the texts of events."""
    graphs, texts = {}, []
    with open(path, "rb") as file:
        for _, channel, message, decoded in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            if channel.topic == "/rosgraph":
                graphs[message.log_time] = set(ends(decoded.nodes, getattr))
            else:
                texts.append(decoded.message)
    return graphs, texts


def rerun(path):
    """By Rerun's importer of MCAP."""
    from rerun.chunk import McapReader

    graphs, texts = {}, []
    for chunk in McapReader(path).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.endswith(":message"):
                times = batch.column("message_log_time").cast("int64").to_pylist()
                for time, [message] in zip(times, batch.column(name).to_pylist()):
                    if "Graph" in name:
                        graphs[time] = set(ends(message["nodes"], dict.__getitem__))
                    else:
                        texts.append(message["message"])
    return graphs, texts


def lives(mission, time):
    """The nodes and edges that exist at a time, in the words of `ends`."""
    for element in mission["elements"]:
        is_guess = element["evidence"] and GUESSES.issuperset(element["evidence"])
        if element["what"] != "topic" and not is_guess and any(a <= time < b for a, b in element["lives"]):
            yield element["name"] if element["what"] == "node" else (element["what"], element["node"], element["topic"])


def main():
    readers = [mcap_ros2]
    try:
        import rerun as _

        readers.append(rerun)
    except ImportError:
        pass
    with tempfile.TemporaryDirectory() as folder:
        for bag in ["warehouse.bag", "courier.mcap"]:
            graph, data = Path(folder) / "graph.mcap", Path(folder) / "mission.json"
            bagreel("render", EXAMPLES / bag, "-o", graph, "-o", data)
            mission = json.loads(data.read_text())
            for reader in readers:
                graphs, texts = reader(str(graph))
                for time, seen in graphs.items():
                    there = set(lives(mission, time))
                    assert seen == there, (bag, reader.__name__, time, seen ^ there)
                assert len(graphs) > 10 and texts[-1] == "the recording ends", (bag, len(graphs), texts[-1:])
                print(f"ok      {bag}: {len(graphs)} graphs and {len(texts)} events by {reader.__name__}", flush=True)


main()
