"""The installed wheel: what its functions give, raise and leave alone. Run with Python; ends with 1 if anything is wrong."""

import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import pyarrow as pa

import bagreel

ROOT = Path(__file__).resolve().parents[2]
WAREHOUSE = ROOT / "examples/warehouse.bag"
COURIER = ROOT / "examples/courier.mcap"


def raises(kind, what, run):
    try:
        run()
    except kind as error:
        assert what in str(error), f"{error!r} does not say `{what}`"
    else:
        raise AssertionError(f"no {kind.__name__}")


def tables_are_arrow():
    tables = bagreel.tables(WAREHOUSE)
    counts, bags = tables["counts"], tables["bags"]
    assert len(bags) == 1 and counts.num_rows == len(counts) > 1000, tables
    batch = pa.record_batch(counts)
    assert batch.schema.names == counts.column_names and batch.num_rows == len(counts)
    assert sum(batch["n"].to_pylist()) == bags.to_pyarrow()["messages"][0].as_py() == 26_719
    assert batch.equals(counts.to_pyarrow()) and pa.table(counts).to_batches()[0].equals(batch)
    assert pa.RecordBatchReader.from_stream(counts).read_all().num_rows == len(counts)
    assert pa.schema(counts) == batch.schema
    # The buffers are those of the Rust side: taken twice, they are the same memory.
    address = lambda table: pa.record_batch(table)["n"].buffers()[1].address
    assert address(counts) == address(counts)
    assert counts.to_pandas().shape == (len(counts), len(counts.column_names))


def tables_outlive_their_owner():
    batch = pa.record_batch(bagreel.tables(COURIER)["counts"])
    assert sum(batch["n"].to_pylist()) == 3236


def duckdb_takes_them():
    import duckdb

    counts = bagreel.tables(WAREHOUSE)["counts"].to_pyarrow()  # noqa: F841
    assert duckdb.sql("SELECT sum(n) FROM counts").fetchall() == [(26_719,)]


def polars_takes_them():
    import polars

    counts = bagreel.tables(WAREHOUSE)["counts"]
    frame = polars.DataFrame(counts)
    assert frame["n"].sum() == 26_719 and frame.columns == counts.column_names


def parts_make_the_whole():
    whole = bagreel.tables(WAREHOUSE)["counts"].to_pyarrow()
    starts = sorted(set(whole["start_ns"].to_pylist()))
    cut = starts[len(starts) // 2] + 3_333_333_333
    parts = [bagreel.tables(WAREHOUSE, end_ns=cut)["counts"], bagreel.tables(WAREHOUSE, start_ns=cut)["counts"]]
    assert bagreel.merge(parts[::-1]).to_pyarrow().equals(whole)
    # Whatever library they come from.
    assert bagreel.merge(pa.Table.from_batches([part.to_pyarrow() for part in parts])).to_pyarrow().equals(whole)
    mission = bagreel.finish(whole)
    assert len(mission) == len(starts) and len(mission.tables()["edges"]) > 100, mission
    assert bagreel.to_dict(mission)["messages"] == 26_719


def missions_are_read():
    mission = bagreel.read(COURIER, period="10s")
    data = bagreel.to_dict(mission)
    assert len(mission) == len(data["windows"]) > 2 and data["ledger"], mission
    tables = mission.tables()
    assert set(tables) == {"edges", "topics", "nodes", "changes", "ledger", "phases", "bags"}, tables
    assert tables["ledger"].to_pyarrow().num_rows == len(data["ledger"])


def plans_name_every_bag():
    plan = bagreel.plan(ROOT / "examples")
    names = sorted(Path(bag["uri"]).name for bag in plan)
    assert names == ["courier", "courier.mcap", "warehouse.bag"], names
    assert all(bag["origin_ns"] == 0 and bag["mission"] for bag in plan)


def pictures_are_drawn():
    with tempfile.TemporaryDirectory() as folder:
        outputs = [Path(folder) / "x.svg", Path(folder) / "x.json"]
        bagreel.render(COURIER, outputs, period="all", bare=True)
        assert outputs[0].read_text().startswith("<svg") and json.loads(outputs[1].read_text())["windows"]
        raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.render("no_such.bag", outputs))


def errors_have_their_types():
    raises(ValueError, "period", lambda: bagreel.tables(WAREHOUSE, period="often"))
    raises(ValueError, "index", lambda: bagreel.tables(WAREHOUSE, tier="all"))
    raises(ValueError, "not one bag", lambda: bagreel.tables(ROOT / "examples"))
    raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.read("no_such.bag"))
    raises(TypeError, "record batch", lambda: bagreel.merge([1]))
    # Nobody listens there.
    raises(bagreel.StoreError, "http://127.0.0.1:9/x.bag", lambda: bagreel.tables("http://127.0.0.1:9/x.bag"))
    gone = bagreel.tables("no_such.bag")
    assert len(gone["counts"]) == 0 and "no_such.bag" in gone["bags"].to_pyarrow()["error"][0].as_py()


def other_threads_go_on():
    gap, done = 0.0, threading.Event()

    def tick():
        nonlocal gap
        last = time.monotonic()
        while not done.is_set():
            now = time.monotonic()
            gap, last = max(gap, now - last), now

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    began = time.monotonic()
    for _ in range(5):
        bagreel.read(WAREHOUSE, period="1s")
    took = time.monotonic() - began
    done.set()
    thread.join()
    # Five times without the lock, or once for the time of one reading at least.
    assert gap < took / 10, f"{gap:.3f} s of {took:.3f} s"


def the_command_is_there():
    for command in ([sys.executable, "-m", "bagreel"], [str(Path(sys.executable).parent / "bagreel")]):
        said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout
        assert said.startswith("bagreel "), said
        assert subprocess.run([*command, "info", "no_such.bag"], capture_output=True, check=False).returncode == 1


def main():
    failed = 0
    for test in (
        tables_are_arrow, tables_outlive_their_owner, duckdb_takes_them, polars_takes_them, parts_make_the_whole, missions_are_read,
        plans_name_every_bag, pictures_are_drawn, errors_have_their_types, other_threads_go_on, the_command_is_there,
    ):  # fmt: skip
        try:
            test()
            print(f"ok      {test.__name__}", flush=True)
        except Exception as error:
            failed += 1
            print(f"FAILED  {test.__name__}: {type(error).__name__}: {error}", flush=True)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
