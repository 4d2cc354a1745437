"""Tests the page with touch: a phone in Chromium, whose touches come from the browser and not from a script of the page."""

import time

from webdriver import Browser

WIDE, HIGH = 390, 844


def middle(b, css):
    return b.js("const r = document.querySelector(arguments[0]).getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]", css)


def touch(b, kind, *points):
    b.cdp("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)])


def drag(b, *ways, steps=8):
    """Fingers that move from one point to another and rest there, so that there is no momentum."""
    touch(b, "touchStart", *(way[0] for way in ways))
    for k in range(1, steps + 1):
        touch(b, "touchMove", *([a + (z - a) * k / steps for a, z in zip(*way)] for way in ways))
    time.sleep(0.3)
    touch(b, "touchEnd")
    time.sleep(0.3)


def tap(b, css):
    at = middle(b, css)
    touch(b, "touchStart", at)
    touch(b, "touchEnd")
    time.sleep(0.3)


def box(b):
    return [float(n) for n in b.js("return document.getElementById('graph').getAttribute('viewBox').split(' ')")]


def page_scale(b):
    return b.js("return visualViewport.scale"), b.js("return scrollY")


def check(url):
    with Browser(WIDE, HIGH) as b:
        b.cdp("Emulation.setDeviceMetricsOverride", width=WIDE, height=HIGH, deviceScaleFactor=2, mobile=True)
        b.cdp("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
        b.open(url)
        time.sleep(0.3)
        assert b.js("return innerWidth") == WIDE and b.js("return document.documentElement.scrollWidth") <= WIDE, "wider than the phone"
        x, y = middle(b, "#stage")
        before, page = box(b), page_scale(b)
        drag(b, ((x - 20, y), (x - 100, y)), ((x + 20, y), (x + 100, y)))
        after = box(b)
        assert 3.5 < before[2] / after[2] < 7, (before, after)
        assert page_scale(b) == page, "the page was zoomed, or scrolled"
        drag(b, ((x, y), (x - 60, y - 40)))
        moved = box(b)
        assert moved[0] > after[0] + 1 and moved[1] > after[1] + 1 and abs(moved[2] - after[2]) < 1, (after, moved)
        assert page_scale(b) == page and b.js("return document.getElementById('card').hidden"), "a drag is no tap"
        tap(b, "[data-key=f]")
        tap(b, "#graph .node:not(.off) :is(ellipse, rect)")
        name = b.js("return document.querySelector('#graph .node:not(.off)').dataset.name")
        assert b.js("return document.getElementById('name').textContent") == name
        tap(b, "#card [data-key=Escape]")
        axis = b.js("const r = document.getElementById('marks').getBoundingClientRect(); return [r.left, r.top + r.height / 2, r.width]")
        drag(b, ((axis[0] + 5, axis[1]), (axis[0] + axis[2] - 5, axis[1])))
        last = b.js("return +document.getElementById('seek').max")
        assert b.js("return +document.getElementById('seek').value") == last, "a finger along the time"
        b.js("document.querySelector('#allchanges a').scrollIntoView({block: 'center'})")
        tap(b, "#allchanges a")
        where = b.js("const r = document.getElementById('stage').getBoundingClientRect(); return [r.top, r.bottom]")
        assert -1 <= where[0] and where[1] <= HIGH and b.js("return +document.getElementById('seek').value") < last, where
    print("  fingers pinch, drag, tap and scrub")
