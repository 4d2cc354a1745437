"""See how a robot's software reconfigures during a mission, straight from its bag files.

`show` plays a mission in a notebook, `read` reads bags into a `Mission`, `render` draws it. `baseline`, `check` and `diff` compare
missions, `events` returns the event log, `extract` writes messages as tables, `tables` counts those of one bag by its index.
Tables are Arrow: pyarrow, pandas, polars and DuckDB use them without copying.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from . import _bagreel, _results
from ._bagreel import BagreelError, Mission, Table, __version__
from ._command import Bags, Paths, given, listed, run, texts
from ._results import Check, Diff, Rendered, Shown

__all__ = [
    "BagreelError",
    "Check",
    "Diff",
    "Mission",
    "Rendered",
    "Shown",
    "Table",
    "__version__",
    "baseline",
    "check",
    "diff",
    "events",
    "extract",
    "figure",
    "read",
    "render",
    "show",
    "tables",
    "to_dict",
]


def __dir__() -> list[str]:
    return __all__


def tables(bags: Paths, *, period: str | float = "10s", align: Literal["clock", "bag"] = "clock") -> Table:
    """Counts the messages of one recording, a bag or its parts, by its index: a row per publisher, topic and window.

    The columns are those of `bagreel tables`, which counts many bags in parallel; `bag` is the first path as given. Losses
    of a damaged bag are warnings.

    Raises:
        BagreelError: a bag cannot be read.
        ValueError: an option is invalid.
    """
    return _bagreel.tables(texts(bags), period=str(period), align=align)


def read(
    uris: Paths,
    *,
    period: str | float | None = None,
    align: Literal["clock", "bag"] = "bag",
    step: str | float | None = None,
    cut: Literal["phases", "changes"] | None = None,
    start: str | None = None,
    end: str | None = None,
    rate_change: float | None = None,
    phases: str | os.PathLike[str] | None = None,
    offset: Iterable[str] = (),
    ns: Iterable[str] = (),
    topology: Iterable[str | os.PathLike[str]] = (),
    source: str | os.PathLike[str] | None = None,
    infer: str | None = None,
) -> Mission:
    """Reads bags, or a mission's JSON, as one mission, with all evidence in payloads.

    The options are those of `bagreel render`; `period` is a text such as `30s`, or a number of seconds.
    """
    period = None if period is None else str(period)
    options: dict[str, Any] = {"start": start, "end": end, "source": source, "infer": infer}
    options |= {"step": step, "cut": cut, "rate_change": rate_change, "phases": phases}
    offset, ns, topology = listed(offset=offset, ns=ns, topology=topology)
    options |= {"offset": offset, "ns": ns, "topology": topology}
    if not any(options.values()):
        return _bagreel.read(texts(uris), period=period, align=align)
    with tempfile.TemporaryDirectory(prefix="bagreel-") as folder:
        path = Path(folder) / "mission.json"
        run("render", uris, output=path, period=period, align=align, **options)
        return _bagreel.read([str(path)])


def to_dict(mission: Mission) -> dict[str, Any]:
    """The mission in the form of `render -o x.json`: `windows`, `events`, `phases` and more."""
    return json.loads(mission.to_json())


def render(
    bags: Bags,
    outputs: Paths,
    *,
    offset: Iterable[str] = (),
    ns: Iterable[str] = (),
    format: str | None = None,  # noqa: A002
    period: str | float | None = None,
    step: str | None = None,
    start: str | None = None,
    end: str | None = None,
    align: str | None = None,
    cut: str | None = None,
    rate_change: float | None = None,
    topology: Iterable[str | os.PathLike[str]] = (),
    source: str | os.PathLike[str] | None = None,
    infer: str | None = None,
    mode: str | None = None,
    ns_filter: str | None = None,
    topic_filter: str | None = None,
    hide: str | None = None,
    group: str | None = None,
    collapse: Iterable[str] = (),
    rqt_defaults: bool = False,
    style: str | os.PathLike[str] | None = None,
    size: str | None = None,
    for_: str | None = None,
    width: str | None = None,
    fit: str | None = None,
    orientation: str | None = None,
    layout: str | None = None,
    layout_from: str | os.PathLike[str] | None = None,
    title: str | None = None,
    bare: bool = False,
    font: str | os.PathLike[str] | None = None,
    frame_ms: int | None = None,
    strip: str | None = None,
    max_bytes: str | None = None,
    link: Iterable[str] = (),
    phases: str | os.PathLike[str] | None = None,
) -> Rendered:
    """Draws and writes outputs, as `bagreel render` does; the options are those of the command, lists for repeatable
    ones. Returns the files, of which a notebook shows the first. Raises `BagreelError` with the command's message.
    """
    offset, ns, topology = listed(offset=offset, ns=ns, topology=topology)
    collapse, link = listed(collapse=collapse, link=link)
    options = given(locals(), "bags", "outputs")
    outputs = texts(outputs)
    run("render", bags, output=outputs, **options)
    return Rendered([path for output in outputs for path in _files(Path(output))])


def figure(
    bags: Bags,
    outputs: Paths,
    *,
    kind: Literal["lives", "graph", "holders", "steps"] = "lives",
    width: str | None = None,
    rows: str | None = None,
    steps: str | None = None,
    text: str | None = None,
    phases: str | os.PathLike[str] | None = None,
    bare: bool = False,
    font: str | os.PathLike[str] | None = None,
    start: str | None = None,
    end: str | None = None,
    rate_change: float | None = None,
    ns_filter: str | None = None,
    topic_filter: str | None = None,
    offset: Iterable[str] = (),
    ns: Iterable[str] = (),
    topology: Iterable[str | os.PathLike[str]] = (),
    source: str | os.PathLike[str] | None = None,
    infer: str | None = None,
) -> Rendered:
    """Draws a figure for a paper, as `bagreel figure` does: lifelines, the graph of publishers and subscribers, the holders
    of topics that change hands, or the reconfigurations one by one; `width` is its width on paper (default 88mm).
    """
    offset, ns, topology = listed(offset=offset, ns=ns, topology=topology)
    options = given(locals(), "bags", "outputs")
    outputs = texts(outputs)
    run("figure", bags, output=outputs, **options)
    return Rendered([path for output in outputs for path in _files(Path(output))])


def _files(output: Path) -> list[Path]:
    """The files that the command writes for an output."""
    if "{n}" in output.name:
        return sorted(output.parent.glob(output.name.replace("{n}", "[0-9]*")))
    if output.suffix in (".csv", ".parquet"):
        return sorted(output.parent.glob(f"{output.stem}.*{output.suffix}"))
    return [output]


def show(
    bags: Bags,
    *,
    height: int = 640,
    period: str | None = None,
    start: str | None = None,
    end: str | None = None,
    mode: str | None = None,
    style: str | None = None,
    ns_filter: str | None = None,
    topic_filter: str | None = None,
    collapse: Iterable[str] = (),
) -> Shown:
    """A player of bags, or of a mission, for a notebook; `height` is in pixels.

    If a notebook viewer removes embedded pages, a still picture of the whole mission is shown instead.
    """
    (collapse,) = listed(collapse=collapse)
    options = given(locals(), "bags", "height")
    with tempfile.TemporaryDirectory(prefix="bagreel-") as folder:
        page, still = Path(folder) / "player.html", Path(folder) / "still.svg"
        run("render", bags, output=page, **options)
        once = {} if isinstance(bags, Mission) else {"period": "all"}
        run("render", bags, output=still, **(options | once))
        text = page.read_text(encoding="utf-8")
        return Shown(_results.player(text, _results.image(still), height))


def events(
    bags: Bags,
    *,
    rate_change: float | None = None,
    parts: bool = False,
    all: bool = False,  # noqa: A002
    offset: Iterable[str] = (),
    ns: Iterable[str] = (),
    start: str | None = None,
    end: str | None = None,
    topology: Iterable[str | os.PathLike[str]] = (),
    source: str | os.PathLike[str] | None = None,
    infer: str | None = None,
) -> list[dict[str, Any]]:
    """The event log: starts, stops, restarts, rate changes, takeovers, in order of time; a dict each.

    `parts` adds the parts of each event, `all` housekeeping and the recorder.
    """
    offset, ns, topology = listed(offset=offset, ns=ns, topology=topology)
    _, text = run("events", bags, format="ndjson", **given(locals(), "bags"))
    return [json.loads(line) for line in text.splitlines()]


def baseline(
    bags: Paths,
    output: str | os.PathLike[str] | None = None,
    *,
    period: str | None = None,
    start: str | None = None,
    end: str | None = None,
    topology: Iterable[str | os.PathLike[str]] = (),
) -> str:
    """The expectations that all of these healthy runs (one bag each) meet, as YAML; also written to `output`, if given."""
    (topology,) = listed(topology=topology)
    _, text = run("baseline", bags, output="-", **given(locals(), "bags", "output"))
    if output is not None:
        Path(output).write_text(text, encoding="utf-8")
    return text


def check(
    bags: Bags,
    expect: str | os.PathLike[str],
    *,
    undecidable: Literal["allow", "error"] = "allow",
    start: str | None = None,
    end: str | None = None,
    topology: Iterable[str | os.PathLike[str]] = (),
    source: str | os.PathLike[str] | None = None,
    infer: str | None = None,
) -> Check:
    """Checks a mission against an expectation: `assert bagreel.check("run.bag", "graph.yaml").ok`.

    Raises `BagreelError` if the bag or the expectation cannot be read.
    """
    (topology,) = listed(topology=topology)
    options = given(locals(), "bags")
    with tempfile.TemporaryDirectory(prefix="bagreel-") as folder:
        text, markdown = Path(folder) / "check.txt", Path(folder) / "check.md"
        code, data = run("check", bags, fine=(0, 1, 2, 3), format="json", output=[text, markdown], **options)
        return Check(code in (0, 3), json.loads(data), *(_text(path) for path in (text, markdown)))


def diff(
    first: Bags,
    second: Bags,
    outputs: Paths = (),
    *,
    rate_change: float | None = None,
    start: str | None = None,
    end: str | None = None,
) -> Diff:
    """The differences between two missions; `outputs` are reports and pictures to write, as with `bagreel diff -o`."""
    options = given(locals(), "first", "second", "outputs")
    with tempfile.TemporaryDirectory(prefix="bagreel-") as folder:
        text, markdown = Path(folder) / "diff.txt", Path(folder) / "diff.md"
        output = [text, markdown, *texts(outputs)]
        code, data = run("diff", first, second, fine=(0, 1, 3), format="json", output=output, **options)
        differences = json.loads(data)["differences"]
        return Diff(code != 1, differences, *(_text(path) for path in (text, markdown)))


def extract(
    bags: Paths,
    output: str | os.PathLike[str],
    *,
    format: str | None = None,  # noqa: A002
    fields: bool = False,
    msg_path: Iterable[str | os.PathLike[str]] = (),
    topic_filter: str | None = None,
    start: str | None = None,
    end: str | None = None,
) -> Path:
    """Writes a table with a row per message, or with `fields` a folder with a table per topic; returns its path.

    In a folder, the table `index` lists which file contains which topic.
    """
    msg_path = list(msg_path)
    run("extract", bags, **given(locals(), "bags"))
    return Path(output)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
