"""See how a robot's software reconfigures during a mission, straight from its bag files."""

from collections.abc import Iterable
from os import PathLike
from typing import Any, Literal

from ._bagreel import BagreelError as BagreelError
from ._bagreel import Mission as Mission
from ._bagreel import StoreError as StoreError
from ._bagreel import Table as Table

_Path = str | PathLike[str]
_Paths = _Path | Iterable[_Path]

def plan(
    sources: _Paths,
    *,
    period: str = "10s",
    align: Literal["clock", "bag"] = "clock",
    mission: str | None = None,
) -> list[dict[str, Any]]:
    """Lists the bags of paths, folders, URLs and prefixes of stores (which end in a slash).

    Each is a dict of `uri`, `mission` and `origin_ns`, sorted by mission. `mission` is a regular expression whose first
    group, or whole match, in the path or URL names the mission.
    """

def tables(
    uri: _Path,
    *,
    period: str = "10s",
    align: Literal["clock", "bag"] = "clock",
    mission: str | None = None,
    origin_ns: int | None = None,
    tier: Literal["auto", "index", "chunks"] = "auto",
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> dict[str, Table]:
    """Counts one bag by its index: the tables `counts` (a row per publisher, topic and window) and `bags` (one row).

    A bag that cannot be read has its row in `bags` with an `error`. Only part of the bag's time is counted with
    `start_ns` and `end_ns` (half-open); `merge` makes the whole of such parts. `mission` is the mission's name;
    `origin_ns` a moment at which windows begin, as `plan` gives it.

    Raises:
        StoreError: the store refused or could not be reached; trying again may help.
        ValueError: an option makes no sense, or `uri` is not one bag.
    """

def merge(counts: Any) -> Table:
    """Makes one table `counts` of those of all parts of one or more bags, in any order.

    `counts` is an Arrow table or record batch (of any library), or any number of them. Exact for parts that do not
    overlap in time.
    """

def finish(counts: Any) -> Mission:
    """Makes the mission that the counts of its bags tell of: states, rates, what changed from window to window.

    Raises:
        ValueError: the counts are of several missions, or of none.
    """

def read(uris: _Paths, *, period: str | None = None, align: Literal["clock", "bag"] = "bag") -> Mission:
    """Reads bags, or a mission's own JSON, as one mission, with all evidence that payloads hold."""

def to_dict(mission: Mission) -> dict[str, Any]:
    """The mission as `render -o x.json` writes it: `windows`, `ledger`, `phases` and more."""

def render(bags: _Paths, outputs: _Paths, **options: Any) -> None:
    """Draws and writes outputs, as `bagreel render` does; options are those of the command, with underscores."""
