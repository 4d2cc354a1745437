"""See how a robot's software reconfigures during a mission, straight from its bag files.

`tables` counts one bag by its index, wherever it lies; `merge` and `finish` make a mission of what was counted. `read`
reads bags into a mission at once, `render` draws one. Tables are Arrow: pyarrow, pandas, polars and DuckDB take them
without copying.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable

from . import _bagreel
from ._bagreel import BagreelError, Mission, StoreError, Table

__all__ = [
    "BagreelError",
    "Mission",
    "StoreError",
    "Table",
    "finish",
    "merge",
    "plan",
    "read",
    "render",
    "tables",
    "to_dict",
]

_Paths = str | os.PathLike | Iterable[str | os.PathLike]


def _texts(paths: _Paths) -> list[str]:
    if isinstance(paths, (str, os.PathLike)):
        paths = [paths]
    return [os.fspath(path) for path in paths]


def plan(sources: _Paths, *, period="10s", align="clock", mission=None) -> list[dict]:
    """Lists the bags of paths, folders, URLs and prefixes of stores: `uri`, `mission` and `origin_ns` of each."""
    return _bagreel.plan(_texts(sources), period=period, align=align, mission=mission)


def tables(uri: str | os.PathLike, **options) -> dict[str, Table]:
    """Counts one bag, or a part of its time: the tables `counts` and `bags`. See the stub for the options."""
    return _bagreel.tables(os.fspath(uri), **options)


def _batches(counts) -> list[Table]:
    """The record batches of a table, or of several."""
    if isinstance(counts, Table):
        return [counts]
    if hasattr(counts, "to_batches"):
        return [Table(batch) for batch in counts.to_batches()]
    if hasattr(counts, "__arrow_c_array__"):
        return [Table(counts)]
    if not isinstance(counts, Iterable):
        raise TypeError(f"give Arrow tables or record batches, not `{type(counts).__name__}`")
    return [batch for one in counts for batch in _batches(one)]


def merge(counts) -> Table:
    """Makes one table `counts` of those of all parts of one or more bags, in any order."""
    return _bagreel.merge(_batches(counts))


def finish(counts) -> Mission:
    """Makes the mission that the counts of its bags tell of: states, rates, what changed from window to window."""
    return _bagreel.finish(_batches(counts))


def read(uris: _Paths, *, period: str | None = None, align: str = "bag") -> Mission:
    """Reads bags, or a mission's own JSON, as one mission."""
    return _bagreel.read(_texts(uris), period=period, align=align)


def to_dict(mission: Mission) -> dict:
    """The mission as `render -o x.json` writes it: `windows`, `ledger`, `phases` and more."""
    return json.loads(mission.to_json())


def render(bags: _Paths, outputs: _Paths, **options) -> None:
    """Draws and writes outputs, as `bagreel render` does.

    Options are those of the command: `period="10s"`, `figure="lives"`, `skip_unchanged=True`, a list for one that may
    be repeated. It runs in a process of its own, which Ctrl-C ends like any other. Raises `BagreelError` with what the
    command said.
    """
    command = [sys.executable, "-m", "bagreel", "--quiet", "render", *_texts(bags)]
    for output in _texts(outputs):
        command += ["--output", output]
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        values = value if isinstance(value, (list, tuple)) else [value]
        for one in values:
            if one is True:
                command.append(option)
            elif one is not False and one is not None:
                command.append(f"{option}={os.fspath(one) if isinstance(one, os.PathLike) else one}")
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    # 3: done, but the bag is damaged.
    if done.returncode not in (0, 3):
        raise BagreelError(done.stderr.strip() or f"the command ended with {done.returncode}")
