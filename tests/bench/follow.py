#!/usr/bin/env python3
"""Writes an MCAP file of 200 topics at 50 Hz as a recorder does, follows it, and measures the follower.

    python3 tests/bench/follow.py target/release/bagreel [SECONDS] [TOPICS] [--unchunked]

Prints the share of a core, the largest memory, and the time from the last byte of a new topic's tenth message to its line.
"""

import os
import struct
import subprocess
import sys
import tempfile
import threading
import time

MAGIC = b"\x89MCAP0\r\n"


def record(kind, body):
    return struct.pack("<BQ", kind, len(body)) + body


def text(value):
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def channel(at):
    metadata = text("callerid") + text(f"/node{at // 4}")
    name = text(f"/topic{at}") + text("ros1")
    return record(4, struct.pack("<HH", at, 1) + name + struct.pack("<I", len(metadata)) + metadata)


def message(at, sequence, now):
    return record(5, struct.pack("<HIQQ", at, sequence, now, now) + b"\5\0\0\0hello")


def chunk(records, first, last):
    head = struct.pack("<QQQI", first, last, len(records), 0) + text("") + struct.pack("<Q", len(records))
    return record(6, head + records)


def usage(pid):
    fields = open(f"/proc/{pid}/stat").read().rsplit(") ", 1)[1].split()
    ticks = int(fields[11]) + int(fields[12])
    peak = next(line for line in open(f"/proc/{pid}/status") if line.startswith("VmHWM"))
    now = next(line for line in open(f"/proc/{pid}/status") if line.startswith("VmRSS"))
    return ticks / os.sysconf("SC_CLK_TCK"), int(peak.split()[1]) / 1024, int(now.split()[1]) / 1024


def main():
    bagreel = sys.argv[1]
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60
    topics = int(sys.argv[3]) if len(sys.argv) > 3 else 200
    is_chunked = "--unchunked" not in sys.argv
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "r.mcap")
    out = open(path, "wb", buffering=0)
    schema = struct.pack("<H", 1) + text("std_msgs/String") + text("ros1msg") + text("string data\n")
    out.write(MAGIC + record(1, text("ros1") + text("bench")) + record(3, schema))
    out.write(b"".join(channel(at) for at in range(topics)))
    follower = subprocess.Popen([bagreel, "follow", path], stdout=subprocess.PIPE, text=True)
    lines = []

    def listen():
        for line in follower.stdout:
            lines.append((time.time(), line.rstrip()))

    threading.Thread(target=listen, daemon=True).start()
    begun, sequence, new, born, delays = time.time(), 0, topics, {}, []
    report = begun + 60
    while time.time() - begun < seconds:
        now = time.time_ns()
        living = list(range(topics)) + list(born)
        records = b"".join(message(at, sequence, now) for at in living)
        sequence += 1
        # Every ten seconds another node, whose ten messages a second later are a start.
        if sequence % 500 == 0:
            new += 4
            out.write(channel(new))
            born[new] = None
        out.write(chunk(records, now, now) if is_chunked else records)
        for at in born:
            if born[at] is None:
                born[at] = time.time()
        if time.time() > report:
            report += 60
            print(f"{time.time() - begun:.0f} s", usage(follower.pid), flush=True)
        time.sleep(max(0, begun + sequence / 50 - time.time()))
    cpu, peak, now = usage(follower.pid)
    for at, when in born.items():
        lines_of = [t for t, line in lines if f"/node{at // 4} started" in line]
        delays += [lines_of[0] - when] if lines_of else []
    follower.terminate()
    follower.wait()
    size = os.path.getsize(path) / 1e6
    print(f"{topics} topics at 50 Hz for {seconds:.0f} s, {size:.0f} MB: {100 * cpu / seconds:.1f} % of a core, {peak:.0f} MB at most, {now:.0f} MB at the end")
    if delays:
        delays.sort()
        print(f"{len(delays)} of {len(born)} starts reported, after {delays[len(delays) // 2]:.2f} s (median), at most {delays[-1]:.2f} s")


main()
