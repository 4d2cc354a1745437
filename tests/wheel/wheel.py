"""Tests the installed wheel: results, exceptions and side effects of its functions. Run with Python; exits with 1 on failure."""

import ast
import inspect
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import warnings
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
        assert what in str(error), f"{error!r} does not contain `{what}`"
    else:
        raise AssertionError(f"no {kind.__name__}")


def tables_are_arrow():
    counts = bagreel.tables(WAREHOUSE)
    assert counts.num_rows == len(counts) > 1000, counts
    batch = pa.record_batch(counts)
    assert batch.schema.names == counts.column_names and batch.num_rows == len(counts)
    assert sum(batch["n"].to_pylist()) == bagreel.read(WAREHOUSE).messages == 26_719
    assert set(batch["bag"].to_pylist()) == {str(WAREHOUSE)}
    assert batch.equals(counts.to_pyarrow()) and pa.table(counts).to_batches()[0].equals(batch)
    assert pa.RecordBatchReader.from_stream(counts).read_all().num_rows == len(counts)
    assert pa.schema(counts) == batch.schema
    # The buffers are those of the Rust side: taken twice, they are the same memory.
    address = lambda table: pa.record_batch(table)["n"].buffers()[1].address
    assert address(counts) == address(counts)
    assert counts.to_pandas().shape == (len(counts), len(counts.column_names))


def tables_outlive_their_owner():
    batch = pa.record_batch(bagreel.tables(COURIER))
    assert sum(batch["n"].to_pylist()) == 3236


def duckdb_takes_them():
    import duckdb

    counts = bagreel.tables(WAREHOUSE).to_pyarrow()  # noqa: F841
    assert duckdb.sql("SELECT sum(n) FROM counts").fetchall() == [(26_719,)]


def polars_takes_them():
    import polars

    counts = bagreel.tables(WAREHOUSE)
    frame = polars.DataFrame(counts)
    assert frame["n"].sum() == 26_719 and frame.columns == counts.column_names


def losses_are_warnings():
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        cut = Path(folder) / "cut.bag"
        cut.write_bytes(WAREHOUSE.read_bytes()[:300_000])
        assert 0 < len(bagreel.tables(cut)) < len(bagreel.tables([WAREHOUSE]))
        texts = [str(warning.message) for warning in seen]
        assert any(text.startswith(f"{cut}: the bag is cut at byte") for text in texts), texts
        # They name the line that called the function, through the package's own.
        assert {Path(warning.filename) for warning in seen} == {Path(__file__)}, seen


def missions_are_read():
    mission = bagreel.read(COURIER, period="10s")
    data = bagreel.to_dict(mission)
    assert len(mission) == len(data["windows"]) > 2 and data["events"], mission
    tables = mission.tables()
    assert set(tables) == {"edges", "topics", "nodes", "changes", "events", "phases", "bags"}, tables
    assert tables["events"].to_pyarrow().num_rows == len(data["events"])


def pictures_are_drawn():
    with tempfile.TemporaryDirectory() as folder:
        outputs = [Path(folder) / "x.svg", Path(folder) / "x.json"]
        bagreel.render(COURIER, outputs, period="all", bare=True)
        assert outputs[0].read_text().startswith("<svg") and json.loads(outputs[1].read_text())["windows"]
        raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.render("no_such.bag", outputs))


def errors_have_their_types():
    raises(ValueError, 'period="often"', lambda: bagreel.tables(WAREHOUSE, period="often"))
    raises(ValueError, 'align="noon"', lambda: bagreel.read(WAREHOUSE, align="noon"))
    raises(TypeError, "ns=3", lambda: bagreel.read(WAREHOUSE, ns=3))
    raises(bagreel.BagreelError, "'--period", lambda: bagreel.render(WAREHOUSE, "x.gif", period="often"))
    assert dir(bagreel) == sorted(bagreel.__all__), dir(bagreel)
    raises(ValueError, "recordings", lambda: bagreel.tables(ROOT / "examples"))
    raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.read("no_such.bag"))
    raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.tables("no_such.bag"))



def missions_say_what_is_in_them():
    mission = bagreel.read(WAREHOUSE)
    assert mission.messages == 26_719 and 320 < mission.duration < 330 and mission.bags == ["warehouse.bag"]
    assert mission.nodes == sorted(mission.nodes) and "/robot1/amcl" in mission.nodes, mission.nodes
    assert "/robot1/scan" in mission.topics and len(mission.windows) == len(mission)
    assert sum(window["messages"] for window in mission.windows) == mission.messages
    assert mission.events == bagreel.events(WAREHOUSE) != [], mission.events[:1]
    assert bagreel.__version__ == subprocess.run(
        [sys.executable, "-m", "bagreel", "--version"], capture_output=True, text=True, check=True
    ).stdout.split()[-1]
    shown = mission._repr_html_()
    assert "warehouse.bag" in shown and "data:image/svg+xml;base64," in shown, shown[:300]


def notebooks_show_what_was_made():
    for what in (COURIER, bagreel.read(COURIER)):
        shown = bagreel.show(what, height=400, collapse=["/nav"])
        assert shown.html.count("<iframe") == 1 and "srcdoc=" in shown.html and "data:image/svg+xml" in shown.html
        assert "height:400px" in shown._repr_html_()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        frames = bagreel.render(COURIER, [folder / "f{n}.png", folder / "t.csv"], period="30s")
        assert [path.name for path in frames[:2]] == ["f0.png", "f1.png"] and folder / "t.edges.csv" in frames
        assert "data:image/png" in frames._repr_html_()
        lives = bagreel.figure(WAREHOUSE, folder / "lives.svg", width="180mm")
        assert "data:image/svg+xml" in lives._repr_html_() and len(lives) == 1
        report = bagreel.render(COURIER, folder / "r.md")
        assert report._repr_html_() is None and "courier.mcap" in report._repr_markdown_()


def missions_are_judged():
    with tempfile.TemporaryDirectory() as folder:
        graph = Path(folder) / "graph.yaml"
        text = bagreel.baseline(COURIER, graph)
        assert text == graph.read_text() and text.startswith("schema: bagreel.expect/1")
        kept = bagreel.check(COURIER, graph)
        assert kept.ok and kept and not kept.findings and "no findings" in str(kept), kept
        graph.write_text("schema: bagreel.expect/1\nnodes:\n  /gone: {}\n")
        broken = bagreel.check(COURIER, graph)
        assert not broken.ok and broken.errors == 1 and broken.findings[0]["name"] == "/gone", broken
        assert broken._repr_markdown_().startswith("### ❌ ")
        raises(bagreel.BagreelError, "no_such.bag", lambda: bagreel.check("no_such.bag", graph))
        graph.write_text("nodes: 3\n")
        raises(bagreel.BagreelError, "graph.yaml", lambda: bagreel.check(COURIER, graph))
        page = Path(folder) / "d.html"
        other = bagreel.diff(COURIER, WAREHOUSE, page)
        assert not other.same and len(other) > 50 and other[0]["kind"] == "node" and page.exists()
        assert bagreel.diff(COURIER, COURIER).same
        table = bagreel.extract(COURIER, Path(folder) / "t", fields=True, topic_filter="/scan")
        assert sorted(path.name for path in table.iterdir()) == ["index.csv", "scan.csv"]


def signatures_are_those_of_the_command():
    for command, left_out in (
        ("render", {"output", "quiet", "verbose", "help", "color"}),
        ("figure", {"output", "quiet", "verbose", "help", "color"}),
        ("extract", {"output", "quiet", "verbose", "help", "color"}),
    ):
        said = subprocess.run([sys.executable, "-m", "bagreel", command, "--help"], capture_output=True, text=True, check=True)
        options = set(re.findall(r"^ +(?:-\w, )?--([a-z-]+)", said.stdout, re.MULTILINE)) - left_out
        named = inspect.signature(getattr(bagreel, command)).parameters
        ours = {name.rstrip("_").replace("_", "-") for name in named} - {"bags", "outputs", "output"}
        assert ours == options, f"{command}: {ours ^ options}"


def the_examples_run():
    tests = ROOT / "examples/python"
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", tests], check=True, stdout=subprocess.DEVNULL)
    cells = json.loads((tests / "mission.ipynb").read_text())["cells"]
    cells = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(cells) > 8
    scope, before = {}, os.getcwd()
    os.chdir(tests)
    try:
        for cell in cells:
            # Notebooks display the last line of a cell.
            *lines, last = ast.parse("".join(cell["source"])).body
            exec(compile(ast.Module(lines, []), "mission.ipynb", "exec"), scope)
            if isinstance(last, ast.Expr):
                displayed(cell, eval(compile(ast.Expression(last.value), "mission.ipynb", "eval"), scope))
            else:
                exec(compile(ast.Module([last], []), "mission.ipynb", "exec"), scope)
    finally:
        os.chdir(before)


def displayed(cell, value):
    """The stored output of a cell is what bagreel displays now; pages and pictures are not compared."""
    for output in cell["outputs"]:
        stored = "".join(output["data"].get("text/markdown", ""))
        assert not stored or stored == value._repr_markdown_(), "`jupyter nbconvert --to notebook --execute --inplace` runs it again"


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
        tables_are_arrow, tables_outlive_their_owner, duckdb_takes_them, polars_takes_them, losses_are_warnings, missions_are_read,
        missions_say_what_is_in_them, notebooks_show_what_was_made, missions_are_judged,
        signatures_are_those_of_the_command, the_examples_run, pictures_are_drawn, errors_have_their_types, other_threads_go_on, the_command_is_there,
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
