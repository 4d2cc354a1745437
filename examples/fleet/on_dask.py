"""Counts the messages of every bag below a folder with Dask: `python on_dask.py FOLDER counts.parquet [SCHEDULER]`.

Dask divides the bags among its workers, on which the wheel is installed, and runs the tasks of a worker that dies again.
"""

import sys
from pathlib import Path

import bagreel
import pyarrow as pa
import pyarrow.parquet as pq
from dask.distributed import Client


def counts(bag):
    """A row per publisher, topic and window; for a bag that cannot be read, one row with the reason."""
    try:
        rows = bagreel.tables(bag).to_pyarrow()
    except bagreel.BagreelError as error:
        return pa.table({"bag": [bag], "error": [str(error)]})
    return pa.table(rows).append_column("error", pa.nulls(len(rows), pa.string()))


def main(folder, out, scheduler=None):
    bags = [str(path) for path in sorted(Path(folder).rglob("*")) if path.suffix in (".bag", ".db3", ".mcap")]
    with Client(scheduler) as client:
        tables = client.gather(client.map(counts, bags))
    pq.write_table(pa.concat_tables(tables, promote_options="default"), out)


if __name__ == "__main__":
    main(*sys.argv[1:])
