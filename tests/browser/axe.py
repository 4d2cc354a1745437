"""Checks that axe finds no violations in pages. `npm install --prefix target/browser` with this folder's `package.json` installs axe."""

import pathlib
import shutil
import subprocess
import tempfile
import time

from webdriver import Browser

PACKAGES = pathlib.Path(__file__).resolve().parents[2] / "target/browser/node_modules"
FIND = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ['violations', 'incomplete']}).then(found => done([found.violations.length + found.passes.length,
    found.violations.map(v => v.id + ': ' + v.help + ' ' + v.nodes.slice(0, 3).map(n => n.target.join(' ')).join(', '))]));
"""


def missing():
    """The reason why axe is unavailable; None if it is available."""
    if not shutil.which("node"):
        return "`node` is not installed"
    if not (PACKAGES / "axe-core/axe.min.js").exists():
        return "axe is not installed, see tests/browser/axe.py"
    return None


def find(b, where):
    b.js((PACKAGES / "axe-core/axe.min.js").read_text() + ";window.axe = axe")
    asked, found = b.call("POST", "/execute/async", {"script": FIND, "args": []})
    assert asked > 10, (where, asked)
    assert not found, (where, found)


def as_page(report):
    """The report as rendered by a code hosting service."""
    script = "const { marked } = require('marked'); process.stdout.write(marked.parse(require('fs').readFileSync(0, 'utf8')))"
    done = subprocess.run(["node", "-e", script], input=report, capture_output=True, text=True, check=True, cwd=PACKAGES.parent)
    return f'<!doctype html><html lang="en"><title>Report</title><main><h1>Report</h1>{done.stdout}</main></html>'


def check(graph, topic_timeline, report):
    """A page in every state of use, a page with a topic timeline, and a report."""
    with Browser(1440, 900) as b:
        b.call("POST", "/timeouts", {"script": 120000})
        for url, states in ((graph, ("", "n", "t", "\ue00c", "b", "?")), (topic_timeline, ("", "t"))):
            b.open(url)
            for key in states:
                if key:
                    b.keys(key)
                    time.sleep(0.3)
                find(b, (url, key))
        b.open("about:blank")
        b.open(graph + "#bare")
        find(b, "alone")
        b.open("about:blank")
        b.open(graph)
        b.keys("r", "\ue014")
        find(b, "a range")
        b.keys("r")
        b.js("document.querySelector('#graph .node:not(.off) :is(ellipse, rect)').dispatchEvent(new MouseEvent('click', {bubbles: true}))")
        find(b, "a selection")
        b.keys("g")
        find(b, "a plot")
        b.keys("\ue00c")
        b.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        find(b, "dark")
        b.cdp("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=1, mobile=True)
        find(b, "a phone")
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, "report.html")
            page.write_text(as_page(pathlib.Path(report).read_text()))
            b.open(page.as_uri())
            find(b, "the report")
    print("  axe finds nothing")
