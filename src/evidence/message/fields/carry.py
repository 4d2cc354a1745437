"""Writes `ros1.msg` or `ros2.msg`: the fields of the message types of common packages, for bags without definitions.

Usage: carry.py 1|2 CHECKOUT… > ros1.msg|ros2.msg

Each CHECKOUT is a clone of one of `REPOSITORIES`. Its `.msg` files are read as of the branch that ROS 1 Noetic was released
from (the branch of the clone), or as of that of ROS 2 Humble, the last release whose sqlite3 recordings contain no definitions.
A type whose fields differ in Galactic or Foxy is followed by its older fields, as `MSG: package/Name before`.
"""

import re
import subprocess
import sys
from pathlib import Path

# Where the definitions come from, and under which licence.
REPOSITORIES = {
    "1": {name: "BSD-3-Clause" for name in ["common_msgs", "ros_comm_msgs", "std_msgs", "geometry2", "geometry"]},
    "2": {
        "common_interfaces": "Apache-2.0",
        "rcl_interfaces": "Apache-2.0",
        "geometry2": "BSD-3-Clause",
        "unique_identifier_msgs": "BSD-3-Clause",
        "rmw_dds_common": "Apache-2.0",
    },
}
RELEASES = {"1": ["HEAD"], "2": ["humble", "galactic", "foxy"]}


def git(checkout, *args):
    return subprocess.run(["git", "-C", checkout, *args], check=True, capture_output=True, text=True).stdout


def messages(checkout, repository, release):
    """The fields of every message, by package and name."""
    found = {}
    for path in git(checkout, "ls-tree", "-r", "--name-only", release).split("\n"):
        match = re.fullmatch(r"(?:([^/]+)/)?msg/(\w+)\.msg", path)
        if match and match[1] != "test_msgs":
            text = git(checkout, "show", f"{release}:{path}")
            found[f"{match[1] or repository}/{match[2]}"] = fields(text)
    return found


def fields(text):
    """Type and name of each field, without comments, constants, defaults and bounds of texts."""
    lines = (line.split("#")[0].strip() for line in text.splitlines())
    found = (re.match(r"([\w/<=\[\]]+)\s+(\w+)\s*(=?)", line) for line in lines)
    return [f"{match[1]} {match[2]}" for match in found if match and not match[3]]


def main(ros, checkouts):
    names = RELEASES[ros]
    releases = {release: {} for release in names}
    print(f"# The fields of common message types of ROS {ros}, made by carry.py from")
    for checkout in checkouts:
        origin = Path(checkout)
        repository = next(name for name in REPOSITORIES[ros] if name in str(origin))
        commit = git(checkout, "rev-parse", "--short=12", names[0]).strip()
        print(f"# github.com/{'ros' if ros == '1' else 'ros2'}/{repository} {commit} ({REPOSITORIES[ros][repository]})")
        for release, found in releases.items():
            found.update(messages(checkout, repository, release))
    newest = releases[names[0]]
    for name, own in sorted(newest.items()):
        print(f"MSG: {name}", *own, sep="\n")
        others = [found[name] for found in releases.values() if found.get(name, own) != own]
        assert all(other == others[0] for other in others), f"{name} has changed twice"
        if others:
            print(f"MSG: {name} before", *others[0], sep="\n")


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in RELEASES:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2:])
