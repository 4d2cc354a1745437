"""`ros2 bagreel …` and `ros2 bag graph …` of the installed wheel behave like `bagreel …` and `bagreel render …`: the same output,
messages and exit code, whatever the arguments. Run with Python; exits with 1 if anything differs.

Where `ros2cli` and `ros2bag` are installed too, the arguments pass through them (of ROS itself, only `rclpy` is replaced by a stub); elsewhere
through parsers that are built, used twice and nested as theirs are.
"""

import argparse
import subprocess
import sys
import tempfile
import types
from importlib.metadata import entry_points
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WAREHOUSE = ROOT / "examples/warehouse.bag"
COURIER = ROOT / "examples/courier.mcap"


def extension(group, name):
    """A new extension, created as by ros2cli."""
    (found,) = entry_points(group=group, name=name)
    return found.load()()


def as_ros2cli(argv):
    """Parses and runs as ros2cli does: first with parsers that know the commands' names only, then with what these add."""
    root = argparse.ArgumentParser(prog="ros2")
    root.add_argument("--use-python-default-buffering", action="store_true")
    commands = root.add_subparsers()
    bag, ours = commands.add_parser("bag"), commands.add_parser("bagreel")
    graph = bag.add_subparsers().add_parser("graph")
    for parser in (ours, graph):
        parser.print_help = lambda: None
        parser.exit = lambda status=0, message=None: sys.exit(message) if status else None
    root.parse_known_args(argv)
    for parser in (ours, graph):
        del parser.print_help, parser.exit
    command, verb = extension("ros2cli.command", "bagreel"), extension("ros2bag.verb", "graph")
    command.add_arguments(ours, "ros2 bagreel")
    verb.add_arguments(graph, "ros2 bag graph")
    ours.set_defaults(run=lambda args: command.main(parser=root, args=args))
    graph.set_defaults(run=lambda args: verb.main(args=args))
    args = root.parse_args(argv)
    return args.run(args)


def ros2(argv):
    # Where ros2cli reads the command line a second time.
    sys.argv = ["ros2", *argv]
    try:
        rclpy, executors = types.ModuleType("rclpy"), types.ModuleType("rclpy.executors")
        executors.ExternalShutdownException = type("ExternalShutdownException", (Exception,), {})
        sys.modules |= {"rclpy": rclpy, "rclpy.executors": executors}
        from ros2cli.cli import main
    except ImportError:
        return as_ros2cli(argv)
    return main()


def same(ours, theirs):
    """Whether both command lines behave equally; prints their outcome."""
    runs = []
    for command in ([sys.executable, "-m", "bagreel", *ours], [sys.executable, __file__, "--", *theirs]):
        done = subprocess.run([str(word) for word in command], capture_output=True, check=False)
        runs.append((done.returncode, done.stdout, done.stderr))
    ok = runs[0] == runs[1]
    print("ok     " if ok else "FAILED ", runs[0][0], "ros2", *theirs, flush=True)
    if not ok:
        print(*(str(run)[:1000] for run in runs), sep="\n")
    return ok, runs[0][0]


def main():
    with tempfile.TemporaryDirectory() as folder:
        damaged = Path(folder) / "damaged.bag"
        damaged.write_bytes(WAREHOUSE.read_bytes()[:-1_000_000])
        page = Path(folder) / "x.json"
        done = [
            same([*args], ["bagreel", *args])
            for args in (
                [], ["--version"], ["--help"], ["-h"], ["render", "--help"], ["-q", "info", COURIER], ["info", COURIER, "--format=json"],
                ["info", damaged], ["info", "no_such.bag"], ["info", "--", "-h"], ["info", COURIER, "--no-such-option"], [""],
                ["--use-python-default-buffering"], ["events", COURIER, "--start", "-30s"],
            )  # fmt: skip
        ]
        done += [
            same(["render", *args], ["bag", "graph", *args])
            for args in (
                ["--help"], [COURIER, "-q", "-o", "-", "--format", "json"], ["-q", "--period=10s", COURIER, "-o", page], ["no_such.bag"],
                ["--", "--help"], [COURIER, "--period", "often"], [],
            )  # fmt: skip
        ]
        assert page.is_file() and {0, 1, 2, 3} == {code for _, code in done}, done
    sys.exit(not all(ok for ok, _ in done))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--"]:
        sys.exit(ros2(sys.argv[2:]))
    main()
