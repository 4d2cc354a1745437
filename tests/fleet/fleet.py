"""Counts one fleet in every documented way while workers are killed, and compares digests.

Usage: fleet.py FOLDER, in an environment with the wheel (see `run`). Exits with 1 if anything differs.
"""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

import bagreel

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "bagreel", "--quiet", "tables"]
COPIES = int(os.environ.get("COPIES", "200"))
ONLY = set(filter(None, os.environ.get("ONLY", "").split(",")))
FAILED = []


def bags(folder):
    """A fleet of links to the project's own bags, with damaged, empty and foreign ones in the middle."""
    fleet = folder / "fleet"
    shutil.rmtree(fleet, ignore_errors=True)
    fleet.mkdir(parents=True)
    warehouse = (ROOT / "examples/warehouse.bag").read_bytes()
    own = folder / "own"
    own.mkdir(exist_ok=True)
    (own / "cut.bag").write_bytes(warehouse[: len(warehouse) // 2])
    (own / "empty.bag").write_bytes(b"")
    (own / "foreign.bag").write_bytes(b"no bag at all")
    hostile = ROOT / "tests/data/hostile"
    sources = [
        ROOT / "examples/warehouse.bag", ROOT / "examples/courier.mcap", ROOT / "examples/courier/courier_0.db3",
        own / "cut.bag", own / "empty.bag", own / "foreign.bag", hostile / "01_escapes.bag", hostile / "08_jump1970.bag",
    ]  # fmt: skip
    for k in range(COPIES):
        source = sources[k % len(sources)]
        os.link(source, fleet / f"bag{k:05}x{source.suffix}")
    return fleet


def digest(tables, what):
    """The digest of all rows, regardless of their order, and their number."""
    rows = sorted(repr(tuple(row.values())) for table in tables for row in table.to_pylist())
    if what == "bags":
        assert len({row for row in rows}) == len(rows), "a bag twice"
    return hashlib.sha256("\n".join(rows).encode()).hexdigest()[:16], len(rows)


def of_folder(folder, table="counts"):
    return digest([pq.read_table(file) for file in sorted((folder / table).glob("*.parquet"))], table)


def report(name, got, expected, started):
    right = got == expected
    if not right:
        FAILED.append(name)
    print(f"| {name} | `{got[0]}` | {got[1]} | {'equal' if right else 'DIFFERS'} | {time.time() - started:.1f} s |", flush=True)


def shards(fleet, to, count=16, jobs=2):
    """Runs the shards like `seq 1 16 | xargs -P 2`; returns the running `xargs`."""
    numbers = "\n".join(map(str, range(1, count + 1)))
    args = ["xargs", "-P", str(jobs), "-I{}", *COMMAND, str(fleet), "-o", str(to), "--shard", "{}/" + str(count), "--skip-existing"]
    process = subprocess.Popen(args, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    process.stdin.write(numbers)
    process.stdin.close()
    return process


def children(pid):
    """All processes below one of ours, with their command lines."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except (OSError, IndexError):
            continue
        if parent == pid:
            found += [(int(entry.name), command), *children(int(entry.name))]
    return found


def kill_one(pid, what, after, until=30):
    """Kills the first process below `pid` whose command line contains `what`, `after` seconds after it appears."""
    def run():
        end = time.time() + until
        while time.time() < end:
            found = [child for child, command in children(pid) if what in command]
            if found:
                time.sleep(after)
                try:
                    os.kill(found[-1], signal.SIGKILL)
                    print(f"(killed a process of `{what}`)", flush=True)
                    return
                except ProcessLookupError:
                    continue  # It has ended; try the next one.
            time.sleep(0.01)
        FAILED.append(f"no process of `{what}` was found to kill")
    thread = threading.Thread(target=run)
    thread.start()
    return thread


def done(to):
    """How many bags have been counted into the folder `to`."""
    return len(list((to / "bags").glob("*.parquet")))


def shards_killed(fleet, to):
    """Runs all shards and kills a worker once some bags are counted; returns how many are counted at the end."""
    shutil.rmtree(to, ignore_errors=True)
    process = shards(fleet, to)
    while process.poll() is None:
        workers = [child for child, command in children(process.pid) if "--shard" in command]
        if workers and done(to) >= COPIES // 16:
            try:
                os.kill(workers[-1], signal.SIGKILL)
                break
            except ProcessLookupError:
                continue  # It has ended; try the next one.
    process.wait()
    return done(to)


def xargs(fleet, folder, expected):
    to = folder / "shards"
    started = time.time()
    shards(fleet, to).wait()
    report("xargs -P 2, 16 shards", of_folder(to), expected, started)
    to = folder / "shards_killed"
    started = time.time()
    # A worker exists for a tenth of a second, so all may have been counted before this process is scheduled again.
    before = next((counted for _ in range(20) if (counted := shards_killed(fleet, to)) < COPIES), COPIES)
    if before == COPIES:
        FAILED.append("the workers had counted all bags when one was killed, twenty times")
    for file in [*(to / "counts").glob("*"), *(to / "bags").glob("*")]:
        assert file.suffix == ".parquet" and pq.read_metadata(file).num_rows >= 0, file
    shards(fleet, to).wait()
    report(f"the same, a worker killed with {before} of {COPIES} bags done, run again", of_folder(to), expected, started)


def wheel(fleet, folder, expected):
    started = time.time()
    tables = [bagreel.tables(b["uri"], mission=b["mission"], origin_ns=b["origin_ns"]) for b in bagreel.plan(fleet)]
    report("wheel, one process", digest([t["counts"].to_pyarrow() for t in tables], "counts"), expected, started)


def spark_job(spark, fleet, table, shards=16):
    from bagreel.spark import register

    register(spark)
    rows = spark.read.format("bagreel").option("path", str(fleet)).option("table", table).option("shards", shards).load()
    return rows.toArrow()


def sail(fleet, folder, expected):
    from pysail.spark import SparkConnectServer
    from pyspark.sql import SparkSession

    os.environ.setdefault("SAIL_MODE", "local-cluster")
    os.environ.setdefault("RUST_LOG", "warn")
    server = SparkConnectServer("127.0.0.1", 0)
    server.start(background=True)
    spark = SparkSession.builder.remote(f"sc://127.0.0.1:{server.listening_address[1]}").getOrCreate()
    started = time.time()
    report("Sail, local-cluster", digest([spark_job(spark, fleet, "counts")], "counts"), expected, started)
    spark.stop()
    server.stop()


def spark(fleet, folder, expected):
    from pyspark.sql import SparkSession

    session = (
        SparkSession.builder.master("local-cluster[2,1,1024]")
        .config("spark.ui.enabled", "false")
        .config("spark.ui.showConsoleProgress", "false")
        .config("spark.executorEnv.PYTHONPATH", os.pathsep.join(sys.path))
        .getOrCreate()
    )
    session.sparkContext.setLogLevel("OFF")
    started = time.time()
    report("Spark, local-cluster[2,1,1024]", digest([spark_job(session, fleet, "counts")], "counts"), expected, started)
    started = time.time()
    killer = kill_one(os.getpid(), "CoarseGrainedExecutorBackend", 0.5)
    got = digest([spark_job(session, fleet, "counts")], "counts")
    killer.join()
    report("the same, an executor killed with -9", got, expected, started)
    session.stop()


def dask(fleet, folder, expected):
    import logging

    from dask.distributed import Client, LocalCluster

    # The loss of a worker is intended.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)

    def one(bag):
        return bagreel.tables(bag["uri"], mission=bag["mission"], origin_ns=bag["origin_ns"])["counts"].to_pyarrow()

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        started = time.time()
        report("Dask, 2 workers", digest(client.gather(client.map(one, bagreel.plan(fleet), pure=False)), "counts"), expected, started)
        started = time.time()
        for _ in range(20):
            futures = client.map(one, bagreel.plan(fleet), pure=False)
            while not (finished := sum(future.done() for future in futures)):
                time.sleep(0.01)
            if finished < COPIES:
                break
        else:
            FAILED.append("Dask had counted all bags when its worker was killed, twenty times")
        os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
        report(f"the same, a worker killed with -9 with {finished} of {COPIES} bags done", digest(client.gather(futures), "counts"), expected, started)


def main():
    folder = Path(sys.argv[1]).resolve()
    fleet = bags(folder)
    for old in ("one", "shards", "shards_killed"):
        shutil.rmtree(folder / old, ignore_errors=True)
    print("| how | digest of `counts` | rows | | time |\n|---|---|---|---|---|")
    started = time.time()
    subprocess.run([*COMMAND, str(fleet), "-o", str(folder / "one")], check=False)
    expected = of_folder(folder / "one")
    report(f"one process, {COPIES} bags", expected, expected, started)
    uris = pa.concat_tables(pq.read_table(file) for file in (folder / "one/bags").glob("*.parquet"))
    assert sorted(uris["uri"].to_pylist()) == sorted(map(str, fleet.iterdir())), "not each bag exactly once"
    # Spark before Sail, after whose client no new Spark session is possible.
    for way in (wheel, xargs, dask, spark, sail):
        if not ONLY or way.__name__ in ONLY:
            way(fleet, folder, expected)
    print("failed: " + ", ".join(FAILED) if FAILED else "all equal")
    sys.exit(bool(FAILED))


if __name__ == "__main__":
    main()
