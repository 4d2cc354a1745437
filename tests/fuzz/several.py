#!/usr/bin/env python3
"""Reads pairs and triples of bags in every order, and checks that the order changes nothing.

    cargo build --release
    tests/fuzz/several.py [--runs 10000] [--seed 1] [--program target/release/bagreel] FOLDER...

The bags are those below the folders, up to --largest bytes each, in random sets and with random `--ns`, `--offset`,
`--start` and `--end`. Every set is read by `events`, `info` and `render -o x.json` in all its orders. No run panics or hangs,
no life, event or interruption lies outside of its mission, and each command prints and writes the same bytes and exits with
the same code in every order. Prints what breaks this, with a command line that shows it.
"""

import argparse
import concurrent.futures
import itertools
import json
import os
import pathlib
import random
import re
import shlex
import subprocess
import tempfile

SECONDS = 120
# Bags whose times are years apart are moved together now and then.
OFFSETS = ["+1.5s", "-30s", "+3600s", "+1700000000s", "-0.35s"]
SPACES = ["/robot2", "/a/b"]
COMMANDS = [["events", "--all"], ["info", "--format", "json"], ["render", "-o", "x.json"]]


def bags(folders, largest):
    """The bags below some folders, and the folders that are recordings."""
    found = set()
    for path in (path for folder in folders for path in pathlib.Path(folder).rglob("*")):
        if path.name == "metadata.yaml":
            path = path.parent
        elif path.suffix not in (".bag", ".mcap", ".db3", ".active"):
            continue
        files = path.iterdir() if path.is_dir() else [path]
        if sum(file.stat().st_size for file in files if file.is_file()) <= largest:
            found.add(path.resolve())
    return sorted(found)


def chosen(dice, paths):
    """The options of a set."""
    options = []
    if dice.random() < 0.3:
        options += ["--ns", f"{dice.choice(paths)}={dice.choice(SPACES)}"]
    if dice.random() < 0.3:
        options += ["--offset", f"{dice.choice(paths)}={dice.choice(OFFSETS)}"]
    if dice.random() < 0.2:
        options += [f"--start={dice.choice(['1', '0.5', '5', '1:00'])}"]
    if dice.random() < 0.2:
        options += [f"--end={dice.choice(['10', '-1', '30', '3'])}"]
    return options


def outside(mission):
    """What a mission's JSON contains outside of its time."""
    start, end = mission["start_ns"], mission["end_ns"]
    for element in mission["elements"]:
        for first, last in element.get("lives", []):
            if not start <= first < last <= end:
                yield f"{element} lives outside of {start}..{end}"
    for event in mission["events"]:
        for time in (event["time_ns"], event.get("until_ns") or start):
            if not start <= time <= end:
                yield f"{event} is outside of {start}..{end}"


def run(program, command, paths, options):
    """The exit code, what was printed and written, and what is wrong in itself."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [program, command[0], *map(str, paths), *options, *command[1:]]
        try:
            done = subprocess.run(arguments, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return None, [f"hangs: {shlex.join(arguments)}"]
        wrong = []
        if done.returncode not in range(4) or b"panicked" in done.stderr:
            wrong.append(f"exit {done.returncode}: {done.stderr.decode(errors='replace')[:600]}")
        file = os.path.join(folder, "x.json")
        written = pathlib.Path(file).read_bytes() if os.path.exists(file) else b""
        if written:
            wrong += list(outside(json.loads(written)))[:3]
        # The time that the run took.
        said = re.sub(rb", in [^ ]+ m?s\n", b"\n", done.stderr)
        return (done.returncode, done.stdout, said, written), [f"{one}\n  {shlex.join(arguments)}" for one in wrong]


def tried(case):
    """The number of runs of a set, and what they break."""
    program, paths, options = case
    many, broken = 0, []
    for command in COMMANDS:
        first = None
        for order in itertools.permutations(paths):
            many += 1
            result, wrong = run(program, command, order, options)
            broken += wrong
            first = first or (result, order)
            if result != first[0] and result and first[0]:
                parts = ["exit code", "output", "messages", "file"]
                what = [part for part, a, b in zip(parts, result, first[0]) if a != b]
                told = [shlex.join([program, command[0], *map(str, one), *options, *command[1:]]) for one in (first[1], order)]
                lines = [set(b"\n".join(one[1:]).splitlines()) for one in (first[0], result)]
                shown = [line.decode(errors="replace")[:300] for line in sorted(lines[0] ^ lines[1])[:4]]
                broken.append("\n  ".join([f"{', '.join(what)} differ:", *told, *shown]))
                break
    return many, broken


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("folders", nargs="+")
    args.add_argument("--runs", type=int, default=10_000)
    args.add_argument("--seed", type=int, default=1)
    args.add_argument("--jobs", type=int, default=os.cpu_count())
    args.add_argument("--largest", type=int, default=1_000_000)
    args.add_argument("--program", default=str(pathlib.Path(__file__).parents[2] / "target/release/bagreel"))
    args = args.parse_args()
    found = bags(args.folders, args.largest)
    print(f"{len(found)} bags", flush=True)
    dice = random.Random(args.seed)
    done, broken = 0, 0

    def cases():
        while done < args.runs:
            paths = dice.sample(found, dice.choice([2, 2, 2, 3]))
            yield args.program, paths, chosen(dice, paths)

    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        source = cases()
        while batch := list(itertools.islice(source, 4 * args.jobs)):
            for many, wrong in pool.map(tried, batch):
                done += many
                broken += len(wrong)
                for one in wrong:
                    print(one, flush=True)
    print(f"{done} runs, {broken} faults")
    raise SystemExit(broken > 0)


main()
