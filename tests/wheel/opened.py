"""Checks that other programs read the Parquet files of `extract` and `render` with the same values as the CSV files.

Usage: opened.py [spark], in an environment with the wheel, pyarrow, pandas, DuckDB and Polars, and with PySpark if that
is named. Exits with 1 if anything differs.
"""

import csv
import datetime
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

ROOT = Path(__file__).resolve().parents[2]
BAGS = [ROOT / "examples/warehouse.bag", ROOT / "examples/courier.mcap", ROOT / "examples/courier"]
FAILED = []


def bagreel(*args):
    subprocess.run([sys.executable, "-m", "bagreel", "--quiet", *map(str, args)], check=True)


def arrow(path):
    """Its rows by the Parquet reader of Arrow (C++); times as whole nanoseconds."""
    table = pq.read_table(path)
    for at, field in enumerate(table.schema):
        if pa.types.is_timestamp(field.type):
            table = table.set_column(at, field.name, table.column(at).cast(pa.int64()))
        elif pa.types.is_list(field.type) and pa.types.is_timestamp(field.type.value_type):
            table = table.set_column(at, field.name, table.column(at).cast(pa.list_(pa.int64())))
    return rows(table.to_pydict())


def duckdb(path):
    import duckdb

    # Its own reader of the file; a time would be cut to microseconds in Python, so as nanoseconds.
    relation = duckdb.sql(f"FROM read_parquet('{path}')")

    def cell(name, kind):
        if "TIMESTAMP" not in kind:
            return f'"{name}"'
        if kind.endswith("[]"):
            return f'list_transform("{name}", lambda time: epoch_ns(time)) AS "{name}"'
        return f'epoch_ns("{name}") AS "{name}"'

    cells = [cell(name, str(kind)) for name, kind in zip(relation.columns, relation.types)]
    return rows(relation.project(", ".join(cells)).to_arrow_table().to_pydict())


def polars(path):
    import polars

    frame = polars.read_parquet(path, use_pyarrow=False)
    casts = []
    for name, kind in frame.schema.items():
        if isinstance(kind, polars.Datetime):
            casts.append(polars.col(name).cast(polars.Int64))
        elif isinstance(kind, polars.List) and isinstance(kind.inner, polars.Datetime):
            casts.append(polars.col(name).cast(polars.List(polars.Int64)))
    return rows(frame.with_columns(casts).to_dict(as_series=False))


def pandas(path):
    import pandas

    frame = pandas.read_parquet(path)

    def cell(value):
        if isinstance(value, pandas.Timestamp):
            return value.value
        return None if pandas.api.types.is_scalar(value) and pandas.isna(value) else value

    return rows({name: [cell(value) for value in frame[name]] for name in frame.columns})


def spark_of(session):
    def spark(path):
        frame = session.read.parquet(str(path))
        return rows(frame.toArrow().to_pydict())

    return spark


def rows(columns):
    return [tuple(map(plain, row)) for row in zip(*columns.values())]


def plain(cell):
    """A common form of values that programs represent differently: lists, and integers that pandas converts because of missing values."""
    if cell is None or isinstance(cell, (str, bytes, bool)):
        return cell
    if isinstance(cell, datetime.datetime):
        raise TypeError("a time that is no number any more")
    if hasattr(cell, "tolist"):
        cell = cell.tolist()
    if isinstance(cell, (list, tuple)):
        return tuple(map(plain, cell))
    if isinstance(cell, float):
        return None if cell != cell else int(cell) if cell.is_integer() else cell
    return cell


def csv_rows(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))[1:]


def differs(name, what):
    FAILED.append(name)
    print(f"FAILED  {name}: {what}", flush=True)


def same(name, path, readers):
    """Asserts that every reader's rows equal Arrow's."""
    expected = arrow(path)
    for reader in readers:
        try:
            got = reader(path)
        except Exception as error:
            differs(f"{name} by {reader.__name__}", f"{type(error).__name__}: {str(error)[:300]}")
            continue
        if got != expected:
            first = next((pair for pair in zip(expected, got) if pair[0] != pair[1]), (len(expected), len(got)))
            differs(f"{name} by {reader.__name__}", f"{first[0]} and {first[1]}")
    return expected


def main():
    readers = [pandas, duckdb, polars]
    if "spark" in sys.argv[1:]:
        from pyspark.sql import SparkSession

        session = SparkSession.builder.master("local[2]").config("spark.ui.enabled", "false")
        # Spark has no times in nanoseconds and refuses such a column otherwise.
        session = session.config("spark.sql.legacy.parquet.nanosAsLong", "true").getOrCreate()
        session.sparkContext.setLogLevel("OFF")
        readers.append(spark_of(session))
    names = ", ".join(reader.__name__ for reader in readers)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for bag in BAGS:
            # The table of messages, compared with the text output.
            bagreel("extract", bag, "-o", folder / "m.parquet")
            bagreel("extract", bag, "-o", folder / "m.csv")
            messages = same(f"{bag.name}, messages", folder / "m.parquet", readers)
            text = [tuple("" if cell is None else str(cell) for cell in row) for row in messages]
            if text != [tuple(row) for row in csv_rows(folder / "m.csv")]:
                differs(f"{bag.name}, messages", "the CSV file has others")
            # A table per topic with every field, and those of a mission.
            fields, mission = folder / f"{bag.name} fields", folder / f"{bag.name} mission"
            bagreel("extract", bag, "-o", f"{fields}/", "--fields", "--format", "parquet")
            mission.mkdir()
            bagreel("render", bag, "-o", mission / "x.parquet", "--period", "10s")
            files = sorted([*fields.glob("*.parquet"), *mission.rglob("*.parquet")])
            total = sum(len(same(f"{bag.name}, {file.name}", file, readers)) for file in files)
            print(f"ok      {bag.name}: {len(messages)} messages, {len(files)} tables of {total} rows, by {names}", flush=True)
    print("failed: " + ", ".join(FAILED) if FAILED else "all equal")
    sys.exit(bool(FAILED))


if __name__ == "__main__":
    main()
