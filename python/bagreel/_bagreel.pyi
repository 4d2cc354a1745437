"""The part written in Rust."""

from os import PathLike
from typing import Any, final

class BagreelError(RuntimeError):
    """A bag could not be read, or a table could not be created."""

__version__: str

@final
class Table:
    """An Arrow record batch, by the PyCapsule interface."""

    @property
    def num_rows(self) -> int: ...
    @property
    def column_names(self) -> list[str]: ...
    def __arrow_c_schema__(self) -> Any: ...
    def __arrow_c_array__(self, requested_schema: Any = None) -> tuple[Any, Any]: ...
    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any: ...
    def __len__(self) -> int: ...
    def to_pyarrow(self) -> Any:
        """As `pyarrow.RecordBatch`, without copying."""
    def to_pandas(self) -> Any:
        """As `pandas.DataFrame`."""

@final
class Mission:
    """A mission: its windows with their graphs and changes."""

    def tables(self) -> dict[str, Table]:
        """By name: edges, topics, nodes, changes, events, phases, bags."""
    def to_json(self) -> str: ...
    @property
    def nodes(self) -> list[str]:
        """The names of its nodes, sorted."""
    @property
    def topics(self) -> list[str]:
        """The names of its topics, sorted."""
    @property
    def events(self) -> list[dict[str, Any]]:
        """The event log, in order of time: `kind`, `what`, `name`, `time_ns` and more."""
    @property
    def windows(self) -> list[dict[str, Any]]:
        """Its windows: `index`, `start_ns`, `end_ns`, `partial`, `messages`, `changes`."""
    @property
    def duration(self) -> float:
        """From its first message to its last, in seconds."""
    @property
    def messages(self) -> int:
        """The number of its messages."""
    @property
    def bags(self) -> list[str]:
        """The names of its bags."""
    def _repr_html_(self) -> str: ...
    def __len__(self) -> int:
        """The number of windows."""

def tables(uris: list[str], *, period: str = "10s", align: str = "clock") -> Table: ...
def read(uris: list[str], *, period: str | None = None, align: str = "bag") -> Mission: ...
def main(args: list[str | PathLike[str]]) -> int: ...
