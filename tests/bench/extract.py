"""Compares `bagreel extract` with pip `rosbags`: every value of every message, and the time of both.

Usage: extract.py BAGREEL BAG…, with the feature `parquet`, in an environment with `rosbags` and `pyarrow`. Times are medians of processor time in
processes of their own, ours with the Parquet files written; theirs without what the interpreter takes to begin. Three
jobs: the table of messages (theirs as a sorted list), every message decoded (theirs not kept), and the same tables of
fields written by pyarrow. Ends with 1 if a value differs.
"""

import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

RUNS = int(os.environ.get("RUNS", "5"))
OURS = ("time_ns", "publisher")
NOTHING = "structure_needs_at_least_one_member"


def reader(bag):
    return AnyReader([Path(bag)], default_typestore=get_typestore(Stores.ROS2_HUMBLE))


def flat(store, typename, message):
    """The fields of a message, named like our columns."""
    row = {}
    for name, (kind, of) in store.fielddefs[typename][1]:
        if name == NOTHING:
            continue
        value = None if message is None else getattr(message, name)
        if kind == Nodetype.BASE:
            row[name] = value
        elif kind == Nodetype.NAME and of.endswith("/Time") and of.startswith("builtin_interfaces"):
            row[name] = None if value is None else value.sec * 10**9 + value.nanosec
        elif kind == Nodetype.NAME:
            row.update({f"{name}.{key}": v for key, v in flat(store, of, value).items()})
        elif of[0][0] == Nodetype.BASE:
            row[name] = None if value is None else [plain(v) for v in value]
        else:
            rows = [flat(store, of[0][1], one) for one in value or []]
            for key in flat(store, of[0][1], None):
                row[f"{name}.{key}"] = [one[key] for one in rows]
    return row


def plain(value):
    return value.item() if hasattr(value, "item") else value


def same(ours, theirs):
    ours, theirs = plain(ours), plain(theirs)
    if isinstance(ours, (list, bytes)):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(ours, float):
        return ours == theirs or math.isnan(ours) and math.isnan(theirs)
    return ours == theirs


def theirs_index(bag):
    with reader(bag) as bag:
        return sorted(
            (at, c.topic, c.msgtype, getattr(c.ext, "callerid", None), len(data)) for c, at, data in bag.messages()
        )


def theirs_fields(bag):
    """The rows in order of time, by topic and type, and the number of messages that they cannot decode."""
    rows, lost = {}, 0
    with reader(bag) as bag:
        for connection, at, data in bag.messages():
            try:
                message = bag.deserialize(data, connection.msgtype)
            except Exception:
                lost += 1
                continue
            rows.setdefault((connection.topic, connection.msgtype), []).append((at, message))
        return {
            (topic, of): [(at, flat(bag.typestore, of, message)) for at, message in all]
            for (topic, of), all in rows.items()
        }, lost


def ours_fields(folder):
    """The tables by topic and type; rows of one time in the order of the bag."""
    tables = {}
    for file in folder.glob("*.parquet"):
        if file.stem == "index":
            continue
        facts = pq.read_metadata(file).metadata
        table = pq.read_table(file)
        order = sorted(range(table.num_rows), key=nanos(table).__getitem__)
        tables[facts[b"topic"].decode(), kind(facts[b"type"].decode())] = table.take(order)
    return tables


def numbers(column):
    """The values, times as whole nanoseconds."""
    levels = str(column.type).count("list<")
    if "timestamp" in str(column.type):
        of = pa.int64()
        for _ in range(levels):
            of = pa.list_(of)
        column = column.cast(of)
    return column.to_pylist()


def nanos(table):
    return table["time_ns"].cast("int64").to_pylist()


def ours_index(file):
    table = pq.read_table(file)
    columns = [table[name].to_pylist() for name in ("topic", "type", "publisher", "size_bytes")]
    return sorted(zip(nanos(table), *columns, strict=True))


def kind(name):
    """`pkg/msg/Type` and `pkg/Type` are one type."""
    return name.replace("/msg/", "/")


def compare_index(binary, bag, folder):
    done = subprocess.run([binary, "--quiet", "extract", bag, "-o", folder / "m.parquet"], check=False)
    assert done.returncode in (0, 3), done
    key = lambda row: (row[0], row[1], kind(row[2]), row[4])
    ours, theirs = ours_index(folder / "m.parquet"), theirs_index(bag)
    # A publisher that their reader does not name is left out of the comparison.
    assert sorted(map(key, ours)) == sorted(map(key, theirs)), f"{bag}: the tables of messages differ"
    named = [row[3] for row in theirs if row[3]]
    assert not named or sorted(row[3] or "" for row in ours) == sorted(row[3] or "" for row in theirs), bag
    return len(ours)


def compare_fields(binary, bag, folder):
    done = subprocess.run([binary, "--quiet", "extract", bag, "-o", folder / "t", "--fields", "--format", "parquet"], check=False)
    assert done.returncode in (0, 3), done
    theirs, lost = theirs_fields(bag)
    ours = ours_fields(folder / "t")
    values, wrong, absent = 0, [], []
    for (topic, of), rows in theirs.items():
        table = ours.get((topic, kind(of)))
        if table is None:
            absent.append(topic)
            continue
        columns = {name: numbers(table[name]) for name in table.column_names if name not in OURS}
        rows = sorted(rows, key=lambda row: row[0])
        if nanos(table) != [at for at, _ in rows]:
            wrong.append(f"{topic}: times")
            continue
        if set(columns) != set(rows[0][1]):
            wrong.append(f"{topic}: columns {sorted(set(columns) ^ set(rows[0][1]))}")
            continue
        for name, column in columns.items():
            values += len(column)
            different = sum(not same(a, row[name]) for a, (_, row) in zip(column, rows, strict=True))
            if different:
                wrong.append(f"{topic}: {different} values of {name}")
    return done.returncode, values, wrong, absent, lost


def seconds(command):
    """Processor time, the median of some runs."""
    times = []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(times)


def ratios(binary, bag, folder):
    """The times of both programs for each of the jobs."""
    own = [sys.executable, __file__]
    empty = seconds([*own, "--nothing"])
    theirs = [seconds([*own, *job]) - empty for job in (["--index", bag], ["--decode", bag], ["--tables", bag, folder / "p"])]
    index = seconds([binary, "extract", bag, "-o", folder / "m.parquet"])
    fields = seconds([binary, "extract", bag, "-o", folder / "t", "--fields", "--format", "parquet"])
    return zip(theirs, (index, fields, fields), strict=True)


def decode_all(bag):
    with reader(bag) as bag:
        for connection, _, data in bag.messages():
            try:
                bag.deserialize(data, connection.msgtype)
            except Exception:
                pass


def write_all(bag, folder):
    Path(folder).mkdir(exist_ok=True)
    for (topic, of), rows in theirs_fields(bag)[0].items():
        columns = {"time_ns": [at for at, _ in rows]} | {name: [row[name] for _, row in rows] for name in rows[0][1]}
        pq.write_table(pa.table(columns), Path(folder) / f"{topic} {of}.parquet".replace("/", "."), compression="zstd")


def main():
    if sys.argv[1].startswith("--"):
        jobs = {"--nothing": lambda: None, "--index": theirs_index, "--decode": decode_all, "--tables": write_all}
        jobs[sys.argv[1]](*sys.argv[2:])
        return
    binary, failed = sys.argv[1], False
    print("| bag | messages | values compared | table of messages | every field decoded | tables of fields |\n|---|---|---|---|---|---|")
    for bag in sys.argv[2:]:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            try:
                messages = compare_index(binary, bag, folder)
                code, values, wrong, absent, lost = compare_fields(binary, bag, folder)
            except Exception as error:
                print(f"| {Path(bag).name} | not compared: {type(error).__name__}: {str(error)[:150]} |", flush=True)
                continue
            cell = lambda theirs, ours: f"{theirs:.2f} s / {ours:.3f} s = {theirs / max(ours, 0.001):.0f}x"
            cells = " | ".join(cell(*pair) for pair in ratios(binary, bag, folder))
            print(f"| {Path(bag).name} | {messages} | {values} | {cells} |", flush=True)
            if wrong or absent or code == 3 or lost:
                print(f"  exit {code}; differ: {wrong[:5]}; only theirs: {absent[:5]}; theirs cannot decode: {lost}", flush=True)
            failed |= bool(wrong)
    sys.exit(failed)


if __name__ == "__main__":
    main()
