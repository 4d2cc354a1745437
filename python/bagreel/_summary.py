"""A mission as a notebook shows it: a line of numbers, and who lives when."""

from __future__ import annotations

import html as markup
import tempfile
from pathlib import Path

from ._bagreel import BagreelError, Mission
from ._command import run
from ._results import image


def html(mission: Mission) -> str:
    """A summary of a mission, and its lives as a picture where it names what could have any."""
    counts = [
        (mission.duration, "s"),
        (len(mission.nodes), "nodes"),
        (len(mission.topics), "topics"),
        (mission.messages, "messages"),
        (len(mission.events), "changes"),
    ]
    numbers = " · ".join(f"{n:,.0f} {what}" if n >= 10 else f"{n:.3g} {what}" for n, what in counts)
    head = f"<p><b>{markup.escape(', '.join(mission.bags))}</b>: {numbers}</p>"
    with tempfile.TemporaryDirectory(prefix="bagreel-") as folder:
        picture = Path(folder) / "lives.svg"
        try:
            run("figure", mission, output=picture, width="180mm")
        except BagreelError:
            return head
        return head + image(picture)
