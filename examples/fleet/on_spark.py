"""Counts the messages of every bag below a folder with Spark: `spark-submit on_spark.py FOLDER counts/`.

Spark divides the bags among its executors, on which the wheel is installed, and runs the tasks of one that dies again.
"""

import sys
from pathlib import Path

import bagreel
import pyarrow as pa
from pyspark.sql import SparkSession

TEXTS = "bag, format, topic, type, node, node_role, error"
NUMBERS = "period_ns, win, start_ns, end_ns, n, bytes, first_ns, last_ns, max_gap_ns"
COLUMNS = [(name, pa.string()) for name in TEXTS.split(", ")] + [(name, pa.int64()) for name in NUMBERS.split(", ")]


def counts(batches):
    """A row per publisher, topic and window; for a bag that cannot be read, one row with the reason."""
    for bag in (bag for batch in batches for bag in batch["bag"].to_pylist()):
        try:
            rows = bagreel.tables(bag).to_pyarrow()
            rows = rows.append_column("error", pa.nulls(len(rows), pa.string()))
        except bagreel.BagreelError as error:
            rows = pa.RecordBatch.from_pylist([{"bag": bag, "error": str(error)}], pa.schema(COLUMNS))
        yield rows.select([name for name, _ in COLUMNS])


def main(folder, out):
    bags = [(str(path),) for path in sorted(Path(folder).rglob("*")) if path.suffix in (".bag", ".db3", ".mcap")]
    spark = SparkSession.builder.getOrCreate()
    schema = ", ".join(f"`{name}` {'string' if kind == pa.string() else 'long'}" for name, kind in COLUMNS)
    frame = spark.createDataFrame(bags, "bag string").repartition(max(1, len(bags) // 4))
    frame.mapInArrow(counts, schema).write.mode("overwrite").parquet(out)


if __name__ == "__main__":
    main(*sys.argv[1:])
