"""The commands as functions: each runs `bagreel` in a process of its own, which Ctrl-C ends like any other."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ._bagreel import BagreelError, Mission

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]
Bags = Paths | Mission

# Done, and done of a damaged bag.
DONE = (0, 3)


def texts(paths: Paths, name: str = "paths") -> list[str]:
    """One path or text, or several, as texts; `name` is that of the argument."""
    if isinstance(paths, (str, os.PathLike)):
        paths = [paths]
    try:
        return [os.fspath(path) for path in paths]
    except TypeError:
        raise TypeError(f"{name}={paths!r} is no path or text, and no list of these") from None


def listed(**options: Paths) -> list[list[str]]:
    """The values of repeatable options, of which one may be a text."""
    return [texts(value, name) for name, value in options.items()]


def given(values: Mapping[str, Any], *others: str) -> dict[str, Any]:
    """The options among a function's arguments."""
    return {name: value for name, value in values.items() if name not in others}


def _words(options: Mapping[str, Any]) -> list[str]:
    words = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is True:
                words.append(option)
            elif one is not False and one is not None:
                words.append(f"{option}={os.fspath(one) if isinstance(one, os.PathLike) else one}")
    return words


def run(command: str, *bags: Bags, fine: tuple[int, ...] = DONE, **options: Any) -> tuple[int, str]:
    """Runs a command and returns its exit code and its results. Raises `BagreelError` with its messages if it failed.

    The exit codes in `fine` are no failures, but those that are not in `DONE` only if there are results.
    """
    with ExitStack() as stack:
        paths = []
        for one in bags:
            if isinstance(one, Mission):
                folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="bagreel-"))
                path = Path(folder) / "mission.json"
                path.write_text(one.to_json(), encoding="utf-8")
                paths.append(str(path))
            else:
                paths += texts(one)
        args = [sys.executable, "-m", "bagreel", "--quiet", command, *_words(options), "--", *paths]
        done = subprocess.run(args, capture_output=True, encoding="utf-8", check=False)
    if done.returncode in DONE or done.returncode in fine and done.stdout:
        return done.returncode, done.stdout
    said, _, _ = done.stderr.removeprefix("error: ").partition("\n\nFor more information")
    raise BagreelError(said.strip() or f"the command ended with {done.returncode}")
