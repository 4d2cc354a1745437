"""Maps the wheel over many bags with Dask while a worker is killed, and compares every row with `bagreel tables`.

usage: engine.py FOLDER, in an environment with the wheel and Dask (see `run`); BAGS=2000 makes more bags.
"""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import duckdb
import pyarrow.parquet as pq
from dask.distributed import LocalCluster

ROOT = Path(__file__).resolve().parents[2]
BAGS = int(os.environ.get("BAGS", "40"))
sys.path.insert(0, str(ROOT / "examples/fleet"))


def many(folder):
    """Links to the project's own bags, with damaged, empty and foreign ones among them."""
    bags, own = folder / "bags", folder / "own"
    for made in (bags, own):
        shutil.rmtree(made, ignore_errors=True)
        made.mkdir(parents=True)
    warehouse = (ROOT / "examples/warehouse.bag").read_bytes()
    (own / "cut.bag").write_bytes(warehouse[: len(warehouse) // 2])
    (own / "empty.bag").write_bytes(b"")
    (own / "foreign.bag").write_bytes(b"no bag at all")
    hostile = ROOT / "tests/data/hostile"
    sources = [
        ROOT / "examples/warehouse.bag", ROOT / "examples/courier.mcap", ROOT / "examples/courier/courier_0.db3",
        own / "cut.bag", own / "empty.bag", own / "foreign.bag", hostile / "01_escapes.bag", hostile / "08_jump1970.bag",
    ]  # fmt: skip
    for k in range(BAGS):
        source = sources[k % len(sources)]
        os.link(source, bags / f"bag{k:05}x{source.suffix}")
    return bags


def of_command(bags, out):
    """The rows of all tables that the command writes, and the number of bags without one."""
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "bagreel", "--quiet", "tables", bags, "-o", out, "--format", "parquet"], check=False)
    tables = [pq.read_table(table).to_pylist() for table in out.rglob("*.parquet")]
    rows = [row | {"bag": str(bags / row["bag"])} for table in tables for row in table]
    return in_order(rows), BAGS - len(tables)


def of_engine(out):
    """The rows that the engine wrote, and the number of those with an error."""
    rows = pq.read_table(out).to_pylist()
    errors = [row for row in rows if row.pop("error") is not None]
    return in_order(row for row in rows if row["topic"] is not None), len(errors)


def in_order(rows):
    """The rows sorted, with their cells by the names of the columns."""
    return sorted(repr(sorted(row.items())) for row in rows)


def with_dask(bags, out, kill):
    """Runs the example on two workers; returns how many bags were counted when one of them was killed."""
    import on_dask

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        job = threading.Thread(target=on_dask.main, args=(bags, out, cluster.scheduler_address))
        job.start()
        counted = lambda: sum(task.state == "memory" for task in list(cluster.scheduler.tasks.values()))
        while kill and job.is_alive() and not counted():
            time.sleep(0.001)
        killed_at = counted()
        if kill:
            os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
        job.join()
    return killed_at


def main():
    folder = Path(sys.argv[1]).resolve()
    bags = many(folder)
    expected = of_command(bags, folder / "counts")
    out = folder / "counts.parquet"
    for kill in (False, True):
        started = time.time()
        killed_at = with_dask(bags, out, kill)
        rows, errors = of_engine(out)
        what = f"a worker killed with -9 with {killed_at} of {BAGS} bags counted" if kill else f"{BAGS} bags"
        print(f"Dask, 2 workers, {what}: {len(rows)} rows, {errors} unreadable bags, {time.time() - started:.1f} s", flush=True)
        assert (rows, errors) == expected, "these are not the rows of `bagreel tables`"
        assert not kill or killed_at < BAGS, "all bags were counted when the worker was killed"
    database = duckdb.connect()
    database.execute(f"CREATE VIEW counts AS FROM '{folder}/counts/*.parquet'")
    for question in sorted((ROOT / "examples/fleet").glob("*.sql")):
        answer = database.execute(question.read_text()).fetchall()
        print(f"{question.stem}: {len(answer)} rows", flush=True)
        assert answer, question


if __name__ == "__main__":
    main()
