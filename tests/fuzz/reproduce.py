#!/usr/bin/env python3
"""Runs every command over every file of a folder of hostile inputs, and checks each run against the documented limits.

    cargo build --release
    tests/fuzz/reproduce.py FOLDER [target/release/bagreel]

A run ends within 10 seconds of processor time and 600 MB with an exit code of 0 to 3, prints no control character, and
leaves no file beside its input and none where it failed. One that is still there after two minutes by the clock is ended
and counts as hung. Prints the runs that break this, and the slowest and largest.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

SECONDS = 10
MEGABYTES = 600
EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "courier.mcap"


def commands(path):
    """The arguments of the runs over one input; outputs go into the working folder."""
    name = str(path)
    if path.suffix == ".launch":
        return [["render", str(EXAMPLE), "--topology", name, "-o", "x.json"]]
    if path.suffix in (".ttf", ".otf"):
        return [["render", str(EXAMPLE), "--font", name, "-o", "x.svg"]]
    drawn = ["render", name, "-o", "x.svg", "-o", "x.html", "-o", "x.json", "-o", "x.csv", "-o", "x.dot", "-o", "x.md"]
    all_of_it = [["info", name], ["info", name, "--format", "json"], ["events", name, "--all"], drawn]
    if path.suffix != ".json":
        all_of_it += [["render", name, "--verify", "-o", "x.json"], ["extract", name, "-o", "x.csv"]]
        all_of_it += [["extract", name, "--fields", "-o", "tables/"], ["baseline", name, "-o", "x.yaml"]]
    return all_of_it


def run(program, arguments, folder):
    """The exit code, seconds of processor time, megabytes and the output."""
    with open(os.path.join(folder, "printed"), "wb+") as printed:
        begin = time.monotonic()
        child = subprocess.Popen([program, *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=printed, stderr=printed)
        while True:
            done, status, usage = os.wait4(child.pid, os.WNOHANG)
            if done:
                break
            if time.monotonic() - begin > 12 * SECONDS:
                child.kill()
            time.sleep(0.002)
        printed.seek(0)
        seconds = usage.ru_utime + usage.ru_stime
        return os.waitstatus_to_exitcode(status), seconds, usage.ru_maxrss / 1024, printed.read()


def broken(code, seconds, megabytes, printed):
    """The violated limits."""
    if code not in range(4):
        yield f"exit code {code}"
    if seconds > SECONDS:
        yield f"{seconds:.1f} s"
    if megabytes > MEGABYTES:
        yield f"{megabytes:.0f} MB"
    text = printed.decode(errors="replace")
    if any(c < " " and c != "\n" for c in text) or any("\x7f" <= c <= "\x9f" or "\u202a" <= c <= "\u202e" for c in text):
        yield "control characters"


def main():
    inputs = pathlib.Path(sys.argv[1]).resolve()
    program = str(pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else "target/release/bagreel").resolve())
    before = sorted(inputs.iterdir())
    faults, runs = 0, []
    for path in before:
        for arguments in commands(path):
            with tempfile.TemporaryDirectory() as folder:
                result = run(program, arguments, folder)
            runs.append((result[1], result[2], arguments[0], path.name))
            for what in broken(*result):
                faults += 1
                print(f"{path.name}: {' '.join(arguments[:1] + arguments[2:])}: {what}")
    if sorted(inputs.iterdir()) != before:
        faults += 1
        print("files were left beside the inputs")
    print(f"{len(runs)} runs over {len(before)} files, {faults} faults")
    print("slowest: {0:.1f} s, {2} {3}".format(*max(runs)))
    print("largest: {1:.0f} MB, {2} {3}".format(*max(runs, key=lambda r: r[1])))
    sys.exit(faults > 0)


main()
