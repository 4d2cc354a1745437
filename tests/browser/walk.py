"""Walks through the changes of any page on screens of three sizes: walk.py PAGE...

Every change is visible after "next change", the place and the sentence agree, the list names every change once, in order of time, and
as many as the sentence counts, what can be read is 9 pixels high, nothing is wider than the screen, and the browser reports no error."""

import pathlib
import re
import sys
import time

import webdriver
from changes import CHANGED, HOME, ROWS, SCREENS
from sight import SMALLEST
from webdriver import Browser

# The most changes of a page that are visited: every one of them takes a second.
MOST = 12
SEEK = "return +document.getElementById('seek').value"
EMPTY = """
return [...document.querySelectorAll('aside > :is(section, details)')].filter(part => part.getClientRects().length
    && ![...part.querySelectorAll('input, button, svg, td, label, li, #changes > p')].length && part.querySelector('.list, #legend')).map(part => part.id || part.textContent);
"""


def walk(b, name, wide):
    is_timeline = b.js("return document.body.classList.contains('topic-timeline')")
    texts, smallest, page = b.js(SMALLEST)
    assert not texts or smallest >= 8.99, (name, wide, texts, smallest)
    assert page <= wide, f"{name} is {page} pixels wide on {wide}"
    assert not b.js(EMPTY), f"{name}: headings with nothing below: {b.js(EMPTY)}"
    rows = b.js(ROWS)
    assert [row[1] for row in rows] == sorted(row[1] for row in rows), f"{name}: not in order of time"
    entries = [row[0] for row in rows if row[0] is not None and " is back " not in row[3]]
    assert len(entries) == len(set(entries)), f"{name}: a change is listed twice"
    sentence = b.js("return document.getElementById('sentence').textContent")
    is_quiet = sentence.endswith("nothing changed")
    assert sentence and "None" not in sentence and is_quiet == (not rows), (name, sentence, len(rows))
    counts = re.findall(r"(\d+) (?:change|interruption)s?\b", sentence.split(". ")[0])
    listed = [row for row in rows if " is back " not in row[3]]
    # A longer list is cut, and says so.
    assert sum(map(int, counts)) == len(listed) or len(rows) == 200, (name, sentence, len(listed))
    b.keys(HOME)
    last, visited = b.js(SEEK), 0
    while visited < MOST:
        b.keys("n")
        time.sleep(0.05)
        many, seen, at = b.js(CHANGED)
        if at == last:
            break
        last, visited = at, visited + 1
        assert b.js("return document.querySelector('#changes button') != null"), f"{name}: no change is listed in window {at}"
        assert is_timeline or many and seen, f"{name}: {seen} of {many} changes are visible in window {at} on {wide} pixels"
    assert not b.log("browser"), name
    return visited


def main(*pages):
    reason = webdriver.missing()
    if reason:
        print(f"skipped: {reason}")
        return
    visited = 0
    for wide, high in SCREENS:
        with Browser(wide, high) as b:
            b.cdp("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=wide < 500)
            for page in pages:
                path = pathlib.Path(page).resolve()
                b.open("about:blank")
                b.log("browser")
                b.open(path.as_uri())
                time.sleep(0.5)
                visited += walk(b, path.name, wide)
    assert visited >= len(pages), visited
    print(f"  {visited} changes of {len(pages)} pages are visible on three screens")
    print("all well")


if __name__ == "__main__":
    main(*sys.argv[1:])
