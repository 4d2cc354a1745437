"""`ros2 bagreel …`, and `ros2 bag graph …` for `bagreel render …`, as extensions of ros2cli.

ros2cli loads them by the entry points `ros2cli.command` and `ros2bag.verb`. Nothing is imported from it, so the wheel
does not need ROS.
"""

import argparse
import os


def _take_all(parser: argparse.ArgumentParser) -> None:
    """Makes `parser` pass on everything after the command's name unchanged, including options and `--help`."""
    # No argument begins with this, so none is mistaken for an option of the parser.
    parser.prefix_chars = "\0"
    parser.add_argument("args", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)


def _run(args: list[str]) -> int:
    """Runs the command in this process if the wheel is installed, else the one in the path; returns its exit code."""
    try:
        from bagreel._bagreel import main
    except ImportError:
        os.execvp("bagreel", ["bagreel", *args])
    return main(["bagreel", *args])


class Command:
    """See how a robot's software reconfigures during a mission, straight from its bag files."""

    NAME = "bagreel"
    EXTENSION_POINT_VERSION = "0.1"

    def add_arguments(self, parser, cli_name):
        """Accepts every argument."""
        _take_all(parser)

    def main(self, *, parser, args) -> int:
        """Runs `bagreel` with them; returns its exit code."""
        return _run(args.args)


class Graph:
    """Draw how the ROS graph changes during a bag: `bagreel render`."""

    NAME = "graph"
    EXTENSION_POINT_VERSION = "0.1"

    def add_arguments(self, parser, cli_name):
        """Accepts every argument."""
        _take_all(parser)

    def main(self, *, args) -> int:
        """Runs `bagreel render` with them; returns its exit code."""
        return _run(["render", *args.args])
