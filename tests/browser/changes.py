"""Tests that the page tells the mission truly and shows what it tells: the sentence, the list of all changes, its marks, and the
view after "next change", on screens of three sizes."""

import re
import time

from webdriver import Browser

ESC, HOME = "\ue00c", "\ue011"
SCREENS = ((1440, 900), (1100, 700), (390, 844))
# How many elements changed, and how many of them are on the stage and under nothing.
CHANGED = """
const stage = document.getElementById('stage').getBoundingClientRect(), mini = document.getElementById('mini');
const covers = getComputedStyle(mini).opacity > .5 ? [...mini.getClientRects()] : [], graph = document.querySelector('.graph:not([hidden])');
const changed = layer => [...graph.querySelectorAll(layer + ' > :is(.added, .removed, .changed)')];
const items = changed('.items'), all = items.length ? items : changed('.arrows');
const middle = e => { const r = e.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]; };
const inside = (r, [x, y]) => x > r.left && x < r.right && y > r.top && y < r.bottom;
return [all.length, all.filter(e => inside(stage, middle(e)) && !covers.some(r => inside(r, middle(e)))).length, +document.getElementById('seek').value];
"""
ROWS = "return [...document.querySelectorAll('#allchanges tr')].map(row => [+row.dataset.entry, +row.querySelector('a').hash.slice(3), row.querySelector('a').textContent, row.cells[1].textContent])"
# The events of the marks of the axis and of the rows, and how many marks of rows are visible.
MARKS = """
const box = document.getElementById('lifelines').getBoundingClientRect(), paths = [...document.querySelectorAll('#plot .events path')];
const ids = path => (path.dataset.entries ?? path.dataset.entry).split(' ').map(Number);
const seen = paths.filter(path => { const r = path.getBoundingClientRect(); return r.top >= box.top - 1 && r.bottom <= box.bottom + 1; });
return [[...document.querySelectorAll('#marks path')].flatMap(ids), paths.flatMap(ids), seen.length, paths.length];
"""
NAMES = """
const texts = [...document.querySelectorAll('.graph:not([hidden]) .items > g:not(.off) > text')];
return texts.filter(text => text.textContent && getComputedStyle(text).visibility == 'visible').map(text => parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a);
"""


def check(url, timeline, quiet, evolution, headlines):
    with Browser(1440, 900) as b:
        for page in (url, timeline):
            b.open(page)
            listed(b, evolution, headlines)
            marked(b, evolution)
        sentence(b, quiet)
    for wide, high in SCREENS:
        with Browser(wide, high) as b:
            b.cdp("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=wide < 500)
            b.open(url)
            time.sleep(0.3)
            changes(b, wide)
            saved(b)
    print("  the page tells every change with its time, and next change shows it, on three screens")


def listed(b, evolution, headlines):
    """A row per headline of the log, in order of time, with its time and a name that fits one element."""
    start = evolution["windows"][0]["start_ns"]
    events = {e["id"]: e for own in headlines for e in own}
    rows = b.js(ROWS)
    entries = [row for row in rows if not row[3].split(" ", 1)[1].startswith("is back")]
    assert sorted(row[0] for row in entries) == sorted(events), (len(entries), len(events))
    assert [row[1] for row in rows] == sorted(row[1] for row in rows), "not in order of time"
    for number, at, when, text in entries:
        event = events[number]
        exact = (event["time_ns"] - start) / 1e9
        assert abs(at - exact) < 2e-3, (at, exact, text)
        minutes, seconds = when.lstrip("~").split(":")
        assert abs(int(minutes) * 60 + float(seconds) - exact) < (1.01 if when.startswith("~") else 0.11), (when, exact, text)
        assert event.get("name", "") in text and text.startswith("/"), (event, text)


def marked(b, evolution):
    """Every mark is an event of the list, or a part of one; all marks of rows are visible without scrolling."""
    rows = {row[0] for row in b.js(ROWS)}
    parts = {part: e["id"] for e in evolution["events"] for part in e.get("parts", [])}
    axis, lanes, seen, all_of = b.js(MARKS)
    assert set(axis) == rows, set(axis) ^ rows
    assert all(parts.get(mark, mark) in rows for mark in lanes), lanes
    assert seen >= 0.9 * all_of > 5, (seen, all_of)


def sentence(b, quiet):
    """The sentence is on the page, in its title and in its description; a mission without changes has no empty list."""
    for page, end in ((None, None), (quiet, "nothing changed")):
        if page:
            b.open(page)
        text, title, about = b.js("return [document.getElementById('sentence').textContent, document.title, document.querySelector('meta[name=description]').content]")
        assert text == about and title.endswith(text) and " min" in text or " s: " in text, (text, title, about)
        assert not end or text.endswith(end), text
        assert "None" not in b.js("return document.body.innerText")
    shown = b.js("return [...document.querySelectorAll('#fresh, #allchanges, [data-key=\"]\"], [data-key=c], #marks')].filter(e => e.getClientRects().length).map(e => e.id || e.dataset.key)")
    assert not shown, f"{shown} cannot be used without changes"


SAVE = "const s = document.getElementById('save'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))"


def saved(b):
    """A saved picture has the name, the time, the sentence and the signs, and the policy of the page refuses none of it; a copied
    link is confirmed."""
    b.log("browser")
    b.js("HTMLAnchorElement.prototype.click = function () { window.got = decodeURIComponent(this.href); }")
    b.js(SAVE, "svg")
    picture, *told = b.js("return [window.got, ...['h1', '#where'].map(css => document.querySelector(css).textContent), document.getElementById('sentence').textContent.slice(0, 60)]")
    assert all(text in picture for text in told), (told, picture[:200])
    sign = re.search('<use href="(#[a-z]+)"', picture)[1]
    assert f'id="{sign[1:]}"' in picture, sign
    b.js(SAVE, "png")
    time.sleep(0.5)
    assert b.js("return window.got").startswith("data:image/png") and not b.log("browser")
    b.cdp("Browser.grantPermissions", permissions=["clipboardReadWrite", "clipboardSanitizedWrite"])
    b.js("window.prompt = () => {}")
    b.js(SAVE, "link")
    time.sleep(0.2)
    assert b.js("const tip = document.getElementById('tip'); return !tip.hidden && tip.getBoundingClientRect().width > 20 && tip.textContent.length > 5"), "copying a link is not confirmed"


def changes(b, wide):
    b.keys(HOME)
    last = -1
    while True:
        b.keys("n")
        many, seen, at = b.js(CHANGED)
        if at == last:
            break
        last = at
        assert many and seen, f"{seen} of {many} changes are visible in window {at} on {wide} pixels"
    words = b.js("const p = document.getElementById('headline'); return [p.getClientRects().length > 0, p.textContent.length > 3]")
    assert words == [wide < 1200, True], words
    box = "return document.querySelector('.graph:not([hidden])').getAttribute('viewBox')"
    before = b.js(box)
    b.type("#q", "planner") if wide >= 1200 else b.js("const q = document.getElementById('q'); q.value = 'planner'; q.dispatchEvent(new Event('input'))")
    rings = b.js("return document.querySelectorAll('.graph:not([hidden]) .items > .ring').length")
    assert rings, "hits have no ring"
    b.js("document.querySelector('#hits button').click()")
    assert not b.js("return document.getElementById('card').hidden")
    b.js("document.activeElement.blur()")
    b.keys(ESC, ESC)
    if wide > 1200:
        assert b.js(box) == before, "escape gives the view back"
    panel = b.js("return document.getElementById('side').getBoundingClientRect().width")
    assert panel == (wide if wide < 500 else 336), panel
    b.keys("f")
    time.sleep(0.2)
    small = [size for size in b.js(NAMES) if size < 8.99]
    assert not small, (wide, small)
