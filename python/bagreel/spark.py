"""Bags as a data source of Apache Spark 4 (and of Sail): `spark.read.format("bagreel")`.

Options: `path` (paths or folders, separated by commas), `table` (`counts` or `bags`), `period`,
`align`, `mission`, `tier`, as for `bagreel.tables`, and `shards`, the number of tasks among which the bags are divided
(default 64; four per core of the cluster is a good number). The wheel must be installed on the workers.
"""

from __future__ import annotations

from collections.abc import Iterator

from pyspark.sql.datasource import DataSource, DataSourceReader, InputPartition

_NUMBERS = {
    "period_ns", "win", "start_ns", "end_ns", "n", "bytes", "first_ns", "last_ns", "max_gap_ns", "file_bytes",
    "messages", "origin_ns", "schema_version",
}  # fmt: skip
_COLUMNS = {
    "counts": "mission bag format period_ns win start_ns end_ns topic type node node_role n bytes first_ns last_ns max_gap_ns",
    "bags": "uri mission file_bytes format tier is_complete messages content start_ns end_ns period_ns origin_ns lost "
    "error bagreel schema_version",
}


def _type(column: str) -> str:
    return "bigint" if column in _NUMBERS else "boolean" if column == "is_complete" else "string"


class Shard(InputPartition):
    """The bags of one task."""

    def __init__(self, bags: list[dict]) -> None:
        self.bags = bags


class BagreelDataSource(DataSource):
    """The tables `counts` and `bags` of a fleet. An unreadable bag is a row of `bags`, never an exception."""

    @classmethod
    def name(cls) -> str:
        return "bagreel"

    def schema(self) -> str:
        table = self.options.get("table", "counts")
        if table not in _COLUMNS:
            raise ValueError(f"`{table}` is not a table of bagreel: counts, bags")
        return ", ".join(f"`{column}` {_type(column)}" for column in _COLUMNS[table].split())

    def reader(self, schema) -> DataSourceReader:
        return Reader(dict(self.options))


class Reader(DataSourceReader):
    """Divides the bags among tasks, and counts those of one."""

    def __init__(self, options: dict) -> None:
        self.table = options.get("table", "counts")
        self.paths = [path for path in options.get("path", "").split(",") if path]
        self.shards = int(options.get("shards", "64"))
        self.planning = {key: options[key] for key in ("period", "align", "mission") if key in options}
        self.counting = {key: options[key] for key in ("period", "tier") if key in options}

    def partitions(self) -> list[InputPartition]:
        import bagreel

        bags = bagreel.plan(self.paths, **self.planning)
        count = max(1, min(self.shards, len(bags)))
        return [Shard(bags[at::count]) for at in range(count)]

    def read(self, partition) -> Iterator:
        import bagreel

        for bag in partition.bags:
            one = bagreel.tables(
                bag["uri"], mission=bag["mission"], origin_ns=bag["origin_ns"], **self.counting
            )[self.table]
            if len(one):
                yield one.to_pyarrow()


def register(spark) -> None:
    """Registers `spark.read.format("bagreel")` in a session."""
    spark.dataSource.register(BagreelDataSource)
