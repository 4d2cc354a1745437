"""Drives a page in headless Chromium and Firefox: clicks, types, slides, and reads its text and the console.

usage: drive.py PAGE.html EVOLUTION.json HOSTILE.html ANIMATION.svg FOLDED.html TOPIC_TIMELINE.html REPORT.md QUIET.html BAG.html COMPARISON.html
The first page, the folded one and the timeline are of the evolution, whose every window is compared with the page; BAG.html is
of examples/warehouse.bag.
"""

import base64
import html
import json
import pathlib
import re
import sys
import tempfile
import time
import zlib

import axe
import choose
import firefox
import folded
import habits
import sight
import changes
import touch
import webdriver
from webdriver import Browser

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
from windows import split

SHIFT, LEFT, RIGHT, END, HOME, ENTER, ESC, CTRL = "\ue008", "\ue012", "\ue014", "\ue010", "\ue011", "\ue007", "\ue00c", "\ue009"


def hertz(hz):
    """A rate in the program's format."""
    text = f"{hz:.0f}" if abs(hz) >= 99.95 else f"{hz:.1f}" if abs(hz) >= 0.95 else f"{hz:.2f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def data_of(page):
    """The page's data, unpacked."""
    kind, text = re.search(r'<script id="data" type="([^"]*)">(.*?)</script>', page, re.S).groups()
    return json.loads(zlib.decompress(base64.b64decode(text), -15) if kind == "deflated" else text)


def at(spells, window):
    start = value = 0
    for step, next_value in zip(spells[::2], spells[1::2]):
        start += step
        if start > window:
            break
        value = next_value
    return value


def compare_data(page, evolution):
    """Every value of every window: presence, state, rate."""
    data, compared = data_of(page), 0
    graph = data["graphs"][0]
    facts = [" ".join(data["words"][f] for f in own) for own in graph["facts"]]
    runs = [[lists[k] if k < len(lists) else [] for k in range(5)] for lists in graph["runs"]]
    items = {}
    for i, name in enumerate(graph["names"]):
        items.setdefault(name, []).append(i)
    count = len(graph["names"])
    arrows = {(graph["names"][a], graph["names"][b]): count + k for k, (a, b, _) in enumerate(graph["arrows"])}
    near = {i: {e for a, b, _ in graph["arrows"] if i in (a, b) for e in (a, b)} for i in range(len(runs))}
    restarted = {e["name"] for e in evolution["events"] if e["kind"] == "restarted"}
    for w, window in enumerate(evolution["windows"]):
        there = set()
        rows = [(items.get(e["name"], [None])[0], e) for e in window["nodes"]]
        rows += [(items.get(e["name"], [None])[-1], e) for e in window["topics"]]
        rows += [(arrows.get((e["node"], e["topic"])), e) for e in window["publishes"]]
        rows += [(arrows.get((e["topic"], e["node"])), e) for e in window["subscribes"]]
        for i, element in rows:
            if i is None or "together" in facts[i]:
                continue
            words = graph["classes"][at(runs[i][0], w)].split()
            label = graph["labels"][at(runs[i][1], w)]
            assert words[0] == element["state"], (w, element, words)
            if element["hz"] is not None:
                assert label == hertz(element["hz"]) + " Hz", (w, element, label)
                exact = float(graph["labels"][at(runs[i][4], w)])
                assert abs(exact - element["hz"]) <= 1e-5 * element["hz"], (w, element, exact)
            there.add(i)
            compared += 1
        for i, own in enumerate(runs):
            words = graph["classes"][at(own[0], w)].split()
            ends = graph["arrows"][i - count][:2] if i >= count else []
            grouped = any("together" in facts[e] for e in [i, *ends])
            # A node that is away stays, with its topics.
            away = words[0] == "silent" and any(graph["names"][e] in restarted for k in {i, *ends} for e in {k, *near[k]} if e < count)
            assert i in there or grouped or words == ["off"] or "removed" in words or away, (w, i, words)
    assert compared > 1000, compared
    print(f"  {compared} values of the data equal the evolution's")
    return data


def headlines(evolution):
    """Per window, the headlines."""
    parts = {part for e in evolution["events"] for part in e.get("parts", [])}
    own = [e for e in evolution["events"] if not e["quiet"] and e["id"] not in parts]
    inside = lambda e, w: w["start_ns"] <= e["time_ns"] < w["end_ns"]
    return [[e for e in own if inside(e, w)] for w in evolution["windows"]]


def check_console(b):
    errors = [e for e in b.log("browser") if e["level"] in ("SEVERE", "WARNING")]
    assert not errors, errors
    for entry in b.log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            assert url.startswith(("file:", "data:", "about:", "chrome")), url


def until(b, script, wanted=True, seconds=10):
    """Waits for a value, since pages respond asynchronously; fails if it does not appear."""
    for _ in range(10 * seconds):
        found = b.js("return " + script)
        if found == wanted:
            return
        time.sleep(0.1)
    raise AssertionError(f"{script} is {found}, not {wanted}")


def window(b):
    return int(b.js("return document.getElementById('seek').value"))


def drive(b, url, evolution, data):
    windows = evolution["windows"]
    counts = [len(own) for own in headlines(evolution)]
    last = len(windows) - 1
    b.open(url)
    assert window(b) == data["still"] == counts.index(max(counts)), (window(b), data["still"], counts)
    b.keys(HOME, RIGHT)
    assert window(b) == 1
    b.keys((SHIFT, RIGHT))
    assert window(b) == 11
    b.keys(",", END)
    assert window(b) == last
    b.keys(HOME, "5")
    assert window(b) == int(last / 2 + 0.5), window(b)
    b.keys((CTRL, RIGHT))
    assert window(b) == int(last / 2 + 0.5)
    b.keys(HOME, "]")
    first_change = next(w for w in range(1, len(windows)) if counts[w])
    assert window(b) == first_change, (window(b), first_change)
    value = b.js("return document.getElementById('seek').ariaValueText")
    assert f"window {first_change + 1} of {len(windows)}" in value, value
    assert b.js("return document.getElementById('live').textContent")
    b.keys(HOME)
    seen = [0] if counts[0] else []
    while len(seen) < 2 or seen[-1] != seen[-2]:
        b.keys("n")
        seen.append(window(b))
    assert seen[:-1] == [w for w, n in enumerate(counts) if n], (seen, counts)
    b.keys("p")
    assert window(b) == seen[-3], (window(b), seen)
    print("  keys move through the mission, n and p from change to change")

    b.js("const s = document.getElementById('seek'); s.value = 7; s.dispatchEvent(new Event('input'))")
    assert window(b) == 7
    live = b.js("return document.getElementById('live').textContent")
    b.click("#play")
    time.sleep(1.8)
    assert window(b) > 7
    assert b.js("return document.getElementById('live').textContent") == live, "it talks while playing"
    b.click("#play")
    assert b.js("return location.hash").startswith("#t=")
    print("  the slider slides, play plays and keeps silent")

    topic = windows[0]["topics"][0]["name"]
    b.keys("/")
    b.type("#q", topic.upper())
    assert window(b) and b.js("return document.activeElement.id") == "q"
    assert b.js("return document.querySelectorAll('#hits button').length") > 0
    b.keys(ENTER)
    assert topic in b.js("return document.getElementById('name').textContent")
    assert b.js("return document.querySelectorAll('#graph .near').length") > 1
    until(b, f"location.hash.includes('sel=topic:{topic}')")
    b.keys(ESC, ESC)
    assert b.js("return document.getElementById('card').hidden && document.getElementById('hits').children.length == 0")
    node = windows[0]["nodes"][0]["name"]
    b.js("document.querySelector('.node[data-name=\"%s\"] text').dispatchEvent(new MouseEvent('click', {bubbles: true}))" % node)
    assert b.js("return document.getElementById('name').textContent") == node
    b.keys("?")
    assert b.js("return document.getElementById('help').open")
    b.keys(ESC)
    print("  search, selection and help")

    start = b.js("return document.getElementById('graph').getAttribute('viewBox')")
    b.keys("+")
    until(b, f"document.getElementById('graph').getAttribute('viewBox') != '{start}'")
    b.keys("f")

    seconds = (windows[30]["start_ns"] - windows[0]["start_ns"]) / 1e9
    b.open("about:blank")
    b.open(f"{url}#t={seconds:g}&sel={node}")
    assert window(b) == 30 and b.js("return document.getElementById('name').textContent") == node
    w, absent = next((w, n["name"]) for w in range(1, last) for n in windows[w - 1]["nodes"] if n["name"] not in {m["name"] for m in windows[w]["nodes"]})
    b.open("about:blank")
    b.open(f"{url}#t={(windows[w]['start_ns'] - windows[0]['start_ns']) / 1e9:g}&sel=node:{absent}")
    assert window(b) == w and b.js("return document.getElementById('name').textContent") == absent, (window(b), w, absent)
    b.open("about:blank")
    b.open(f"{url}#t=0&sel=topic:{topic}")
    assert b.js("return document.getElementById('state').textContent").startswith("topic")
    b.js("location.hash = '#t=0&q=scan'")
    until(b, "document.getElementById('q').value", "scan")
    assert window(b) == 0
    print("  links show the element and window that they name")

    compare_drawing(b, windows)
    compare_telling(b, evolution)
    compare_table(b, evolution, data)
    compare_windows(b, evolution, data)
    check_console(b)


def compare_drawing(b, windows):
    """The drawing of every window: classes of the boxes, and rates beside the arrows."""
    b.keys(HOME, ESC, ESC)
    read = """return [...document.querySelectorAll('#graph [data-name], #graph [data-from]')].map(g =>
        [g.dataset.name || g.dataset.from + ' ' + g.dataset.to, g.getAttribute('class'), g.querySelector('.r')?.textContent])"""
    b.js("document.activeElement.blur()")
    for w, data in enumerate(windows):
        state = {e["name"]: e["state"] for e in data["topics"]} | {e["name"]: e["state"] for e in data["nodes"]}
        rates = {e["node"] + " " + e["topic"]: e["hz"] for e in data["publishes"]}
        for name, words, text in b.js(read):
            words = words.split()
            if "off" in words or "removed" in words:
                continue
            if name in state and name.count("/") > 1:
                assert state[name] in words, (w, name, words)
            if rates.get(name) is not None and text:
                assert text.endswith(hertz(rates[name]) + " Hz"), (w, name, text)
        b.keys(RIGHT)
    print("  every window shows what is in the evolution")


def compare_telling(b, evolution):
    """Badges, list and marks of every window: each counts the headlines of the event log."""
    b.keys(HOME)
    for w, own in enumerate(headlines(evolution)):
        entries, numbers, listed = b.js("""const counts = document.getElementById('counts'), back = / is back after | back$/;
            const lines = [...document.querySelectorAll('#changes button')], own = lines.filter(line => !back.test(line.textContent));
            return [counts.dataset.entries.split(' ').filter(Boolean).length - lines.length + own.length,
                [...counts.children].map(c => c.textContent).filter(text => !back.test(text)), own.length]""")
        assert entries == listed == len(own), (w, entries, listed, own)
        assert sum(int(n) for n in re.findall(r"\d+", " ".join(numbers))) == len(own), (w, numbers)
        for e in own[:1]:
            at = (e["time_ns"] - evolution["windows"][0]["start_ns"]) / 1e9
            went = b.js("""const axis = document.getElementById('axis').getBoundingClientRect(), marks = document.getElementById('marks');
                const total = Math.max(...JSON.parse(arguments[1]));
                marks.dispatchEvent(new PointerEvent('pointerdown', {bubbles: true, clientX: axis.left + axis.width * arguments[0] / total, clientY: 0}));
                return +document.getElementById('seek').value""", at + 1e-3, json.dumps(
                    [(x["end_ns"] - evolution["windows"][0]["start_ns"]) / 1e9 for x in evolution["windows"]]))
            assert went == w, (went, w)
        b.keys(RIGHT)
    print("  counts, lists and marks agree with the event log")


def compare_table(b, evolution, data):
    """Every row of the table in some windows: presence and rate."""
    b.keys("t")
    for w in (0, 7, 23, 44):
        b.js(f"const s = document.getElementById('seek'); s.value = {w}; s.dispatchEvent(new Event('input'))")
        rows = b.js("""return [...document.querySelectorAll('#sheet tbody tr[data-key]')].map(r => [r.dataset.key, ...[2, 7].map(k => r.children[k].textContent)])""")
        assert len(rows) == len(data["graphs"][0]["names"]), len(rows)
        state = {"topic:" + e["name"]: e for e in evolution["windows"][w]["topics"]}
        state |= {"node:" + e["name"]: e for e in evolution["windows"][w]["nodes"]}
        for key, rate, shown in rows:
            if key in state and state[key]["hz"] is not None:
                assert rate == hertz(state[key]["hz"]) + " Hz", (w, key, rate, state[key])
                assert shown.startswith(state[key]["state"]), (w, key, shown)
            elif key not in state:
                assert rate == "–" and shown.startswith("absent"), (w, key, rate, shown)
    b.keys(ESC, ESC)
    assert b.js("return document.getElementById('sheet').hidden")
    print("  the table agrees with the evolution")


def compare_windows(b, evolution, data):
    """Two windows: exactly the elements that differ are reported."""
    def present(w):
        window, all_of = evolution["windows"][w], {}
        for kind, name in (("nodes", "node:{name}"), ("topics", "topic:{name}"),
                           ("publishes", "edge:{node} → {topic}"), ("subscribes", "edge:{topic} → {node}")):
            all_of |= {name.format(**e): e["hz"] or 0 for e in window[kind]}
        return all_of
    for before, after in ((3, 30), (30, 3), (10, 11)):
        b.js("document.activeElement.blur()")
        b.js(f"location.hash = '#t={data['starts'][after]}&b={data['starts'][before]}'")
        until(b, "document.getElementById('changestitle').textContent", f"Differences from window {before + 1}")
        until(b, "+document.getElementById('seek').value", after)
        old, new = present(before), present(after)
        moved = {k for k in old.keys() & new.keys() if abs(new[k] - old[k]) > 0.25 * (old[k] or new[k])}
        differs = (old.keys() ^ new.keys()) | moved
        shown = b.js("""const more = document.querySelector('#changes .more'); more?.click();
            const counts = document.getElementById('counts');
            return [[...counts.children].map(c => c.textContent), document.querySelectorAll('#changes button').length, 'entries' in counts.dataset]""")
        # Differences between two arbitrary windows are not events of the log: they are counted and listed without event ids.
        counted = sum(int(n) for n in re.findall(r"\d+", " ".join(shown[0])))
        assert [counted, *shown[1:]] == [len(differs), len(differs), False], (before, after, shown, len(differs))
        drawn = b.js("return document.querySelectorAll('#graph .items > :is(.added, .removed, .changed), #graph .arrows > :is(.added, .removed, .changed)').length")
        assert drawn == len(differs), (drawn, len(differs))
    print("  the comparison of two windows agrees with the evolution")


def hostile(url):
    with Browser() as b:
        b.open(url)
        for key in (RIGHT, "]", RIGHT):
            b.keys(key)
        b.type("#q", "/")
        b.keys(ENTER, ENTER, ENTER)
        time.sleep(0.3)
        assert b.js("return window.hit === undefined && document.querySelectorAll('img, script:not(#data):not([type=module])').length === 0")
        text = b.js("return document.title + document.body.innerText + document.getElementById('live').textContent")
        assert not re.search("[\u2028\u202a-\u202e\u2066-\u2069]", text)
        sel = b.js("return location.hash + document.getElementById('name').textContent")
        assert "<" not in b.js("return location.hash"), sel
        check_console(b)
    print("  hostile names stay names")


def elsewhere(url, page):
    """In the sandboxed frame of a notebook; without scripts; on paper."""
    with tempfile.TemporaryDirectory() as folder, Browser() as b:
        outer = pathlib.Path(folder, "outer.html")
        outer.write_text(f'<!doctype html><iframe sandbox="allow-scripts" width="1000" height="700" srcdoc="{html.escape(page)}"></iframe>')
        b.open(outer.as_uri())
        b.frame(0)
        # Before its script has run, the slider is at 0.
        until(b, "!!document.getElementById('seek').ariaValueText")
        before = window(b)
        b.click("[data-key=',']")
        until(b, "+document.getElementById('seek').value", before - 1)
        b.click("#toside")
        b.click("#allchanges a")
        assert window(b) >= 0 and b.js("return location.href") == "about:srcdoc", "a link left the frame"
        # The panel does not cover the button that closes it.
        b.click("#toside")
        assert b.js("return getComputedStyle(document.getElementById('side')).display") == "none"
        check_console(b)
        under_policies(b, outer, page)
        b.cdp("Emulation.setScriptExecutionDisabled", value=True)
        b.open(url)
        b.cdp("Emulation.setScriptExecutionDisabled", value=False)
        assert b.js("return document.querySelectorAll('tbody a').length") > 3
        assert b.js("return document.querySelectorAll('.items > .node:not(.off)').length") > 3
    print("  it works in a sandboxed frame, and lists the changes under three policies and without scripts")


STYLED = "default-src 'none';style-src 'unsafe-inline';font-src data:;img-src data:"
POLICIES = (
    (f"{STYLED};script-src 'unsafe-inline'", "allow-scripts", True),
    (STYLED, "allow-scripts", False),
    ("default-src *", "", False),
)


def under_policies(b, outer, page):
    """In frames of pages that allow scripts, refuse them by policy, and refuse them by sandbox."""
    for policy, sandbox, plays in POLICIES:
        outer.write_text(f'<!doctype html><meta http-equiv="Content-Security-Policy" content="{policy}">'
                         f'<iframe sandbox="{sandbox}" width="1000" height="700" srcdoc="{html.escape(page)}"></iframe>')
        b.open(outer.as_uri())
        b.frame(0)
        time.sleep(0.3)
        # On a busy machine the page's script takes longer.
        for _ in range(100):
            if (window(b) > 0) == plays:
                break
            time.sleep(0.1)
        assert (window(b) > 0) == plays, (policy, window(b))
        seen = b.js("return [document.querySelectorAll('#allchanges a').length, document.querySelectorAll('.items > .node:not(.off)').length, getComputedStyle(document.querySelector('.node :is(ellipse, rect)')).fill]")
        assert seen[0] > 3 and seen[1] > 3 and seen[2] != "rgb(0, 0, 0)", (policy, seen)
        b.log("browser")


def animation(svg):
    shots = {}
    for flags in ((), ("--force-prefers-reduced-motion",)):
        with tempfile.TemporaryDirectory() as folder, Browser(flags=flags) as b:
            outer = pathlib.Path(folder, "outer.html")
            outer.write_text(f'<!doctype html><img src="{pathlib.Path(svg).resolve().as_uri()}" width="1200">')
            b.open(outer.as_uri())
            time.sleep(0.5)
            first = b.screenshot()
            time.sleep(8)
            shots[flags] = (first, b.screenshot())
    moving, still = shots.values()
    assert moving[0] != moving[1], "the animation does not move"
    assert still[0] == still[1], "it moves although less motion is asked for"
    print("  the animation runs in an <img>, and stops for readers who prefer reduced motion")


def is_there(tool):
    """Whether a tool is installed; prints a line if not."""
    reason = tool.missing()
    if reason:
        print(f"skipped: {reason}")
    return not reason


def main(page, evolution, hostile_page, svg, folded_page, topic_timeline, report, quiet, bag, comparison):
    if not is_there(webdriver):
        return
    path = pathlib.Path(page).resolve()
    text = path.read_text()
    evolution = split(json.loads(pathlib.Path(evolution).read_text()))
    data = compare_data(text, evolution)
    url = lambda name: pathlib.Path(name).resolve().as_uri()
    with Browser() as b:
        drive(b, url(page), evolution, data)
    hostile(url(hostile_page))
    elsewhere(url(page), text)
    animation(svg)
    folded.check(url(folded_page), data_of(pathlib.Path(folded_page).read_text()))
    choose.check(url(page), url(topic_timeline), evolution)
    touch.check(url(page))
    sight.check(url(page), url(folded_page), url(topic_timeline))
    changes.check(url(page), url(topic_timeline), url(quiet), evolution, headlines(evolution))
    habits.check(url(page), url(bag), url(comparison))
    if is_there(axe):
        axe.check(url(page), url(topic_timeline), report)
    if is_there(firefox):
        with firefox.Firefox() as b:
            drive(b, url(page), evolution, data)
            choose.drive(b, url(page), url(topic_timeline), evolution)
        print("  all of this in Firefox, too")
    print("all well")


if __name__ == "__main__":
    main(*sys.argv[1:])
