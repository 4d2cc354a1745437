"""The results of the commands, as values that notebooks can display."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

_IMAGES = {
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".gif": "image/gif",
    ".webp": "image/webp",
}


def image(path: Path) -> str:
    """A picture for embedding in HTML, independent of the page's styles."""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{html.escape(path.stem)}" style="max-width:100%" src="data:{_IMAGES[path.suffix]};base64,{data}">'


def player(page: str, still: str, height: int) -> str:
    """A page embedded in another one, on top of a still picture for viewers that remove embedded pages."""
    frame = "position:absolute;inset:0;width:100%;height:100%;border:0;background:#fff"
    return (
        f'<div style="position:relative;height:{height}px;overflow:hidden">{still}'
        f'<iframe style="{frame}" sandbox="allow-scripts" srcdoc="{html.escape(page)}"></iframe></div>'
    )


class Shown:
    """A player for notebooks; `html` is its HTML, for your own pages."""

    def __init__(self, html: str) -> None:
        self.html = html

    def _repr_html_(self) -> str:
        return self.html

    def __repr__(self) -> str:
        return f"<bagreel.Shown: {len(self.html)} bytes of HTML>"


class Rendered(Sequence[Path]):
    """The files that were written, in order; a notebook shows the first that is a page, a picture or a report."""

    def __init__(self, files: list[Path]) -> None:
        self.files = files

    def __getitem__(self, at: Any) -> Any:
        return self.files[at]

    def __len__(self) -> int:
        return len(self.files)

    def __repr__(self) -> str:
        return f"Rendered({[str(path) for path in self.files]})"

    def _repr_html_(self) -> str | None:
        for path in self.files:
            if path.suffix == ".html":
                return player(path.read_text(encoding="utf-8"), "", 640)
            if path.suffix in _IMAGES:
                return image(path)
        return None

    def _repr_markdown_(self) -> str | None:
        reports = (path.read_text(encoding="utf-8") for path in self.files if path.suffix == ".md")
        return next(reports, None)


class Check:
    """The outcome of a check.

    `ok` is whether all rules passed, `findings` lists the broken and the undecidable ones (see `severity`), `errors`,
    `warnings` and `unknown` count them, and `data` is the whole report in the form of `check --format json`.
    """

    def __init__(self, ok: bool, data: dict[str, Any], text: str, markdown: str) -> None:
        self.ok = ok
        self.data = data
        self.text = text
        self.markdown = markdown

    @property
    def findings(self) -> list[dict[str, Any]]:
        return [finding for rule in self.data["rules"] for finding in rule.get("findings", [])]

    @property
    def errors(self) -> int:
        return self.data["errors"]

    @property
    def warnings(self) -> int:
        return self.data["warnings"]

    @property
    def unknown(self) -> int:
        return self.data["unknown"]

    def __bool__(self) -> bool:
        return self.ok

    def __repr__(self) -> str:
        return self.text.rstrip()

    def _repr_markdown_(self) -> str:
        return self.markdown


class Diff(Sequence[dict[str, Any]]):
    """The differences between two missions, a dict each: `kind`, `name`, `in`, `first`, `second`, `known`.

    `same` is whether no difference is known.
    """

    def __init__(self, same: bool, differences: list[dict[str, Any]], text: str, markdown: str) -> None:
        self.same = same
        self.differences = differences
        self.text = text
        self.markdown = markdown

    def __getitem__(self, at: Any) -> Any:
        return self.differences[at]

    def __len__(self) -> int:
        return len(self.differences)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.differences)

    def __repr__(self) -> str:
        return self.text.rstrip()

    def _repr_markdown_(self) -> str:
        return self.markdown
