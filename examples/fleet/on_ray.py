"""Counts the messages of every bag below a folder with Ray: `python on_ray.py FOLDER counts.parquet [ADDRESS]`.

Ray divides the bags among its workers, on which the wheel is installed, and runs the tasks of a worker that dies again.
"""

import sys
from pathlib import Path

import bagreel
import pyarrow as pa
import pyarrow.parquet as pq
import ray


@ray.remote(max_retries=3)
def counts(bag):
    """A row per publisher, topic and window; for a bag that cannot be read, one row with the reason."""
    try:
        rows = bagreel.tables(bag).to_pyarrow()
    except bagreel.BagreelError as error:
        return pa.table({"bag": [bag], "error": [str(error)]})
    return pa.table(rows).append_column("error", pa.nulls(len(rows), pa.string()))


def main(folder, out, address=None):
    bags = [str(path) for path in sorted(Path(folder).rglob("*")) if path.suffix in (".bag", ".db3", ".mcap")]
    ray.init(address)
    tables = ray.get([counts.remote(bag) for bag in bags])
    pq.write_table(pa.concat_tables(tables, promote_options="default"), out)


if __name__ == "__main__":
    main(*sys.argv[1:])
