"""Tests the habits of users of players, profilers and maps: zooming the time, playing at a multiple of real time, looping a
stretch, hovering, going back, and asking why; on screens of three sizes."""

import time

from webdriver import Browser

ESC, HOME, END = "\ue00c", "\ue011", "\ue010"
SCREENS = ((1440, 900), (1100, 700), (390, 844))
WINDOW = "return +document.getElementById('seek').value"
TICKS = "return [...document.querySelectorAll('#ticks span')].map(tick => tick.textContent)"
TIP = "const tip = document.getElementById('tip'); return tip.hidden ? null : [...tip.children].map(line => line.textContent)"
SPEED = "const speed = document.getElementById('speed'); speed.value = arguments[0] ?? speed.value; speed.dispatchEvent(new Event('change')); document.activeElement.blur(); return [...speed.options].map(o => +o.value)"
VIEW = "return document.querySelector('.graph:not([hidden])').getAttribute('viewBox')"
# How much of the card is on the screen.
CARD = "const card = document.getElementById('card').getBoundingClientRect(); return Math.min(innerHeight, card.bottom) - Math.max(0, card.top)"


def check(url, bag, comparison):
    for wide, high in SCREENS:
        with Browser(wide, high) as b:
            b.cdp("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=wide < 500)
            for test in (zoomed, played, looped, hovered, returned, card):
                b.open("about:blank")
                b.open(url + "#t=0")
                time.sleep(0.3)
                test(b, wide)
            b.open(bag + "#t=170")
            time.sleep(0.3)
            why(b)
            silent(b)
            b.open(comparison)
            time.sleep(0.3)
            shown = b.js("if (document.body.matches('.noside')) document.getElementById('toside').click(); return ['changes', 'allchanges'].filter(id => document.getElementById(id)?.getClientRects().length)")
            assert shown == ["changes"], f"{shown} list the same differences"
            assert not [e for e in b.log("browser") if e["level"] in ("SEVERE", "WARNING")]
    print("  time is zoomed, played, looped and hovered, Back goes back, and a card says why, on three screens")


def zoomed(b, _):
    """Keys and the wheel with ctrl zoom the time; the visible stretch follows the window, and Esc shows all of it."""
    whole = b.js(TICKS)
    b.keys("w", "w", "w")
    near = b.js(TICKS)
    assert near[-1] < whole[-1] and near[0] == whole[0] and near != whole, (near, whole)
    b.keys(END)
    inside = "const [axis, head] = ['axis', 'head'].map(id => document.getElementById(id).getBoundingClientRect()); return head.right > axis.left && head.left < axis.right"
    assert b.js(inside) and b.js(TICKS)[-1] == whole[-1], b.js(TICKS)
    b.keys("s", "s", "s", "s")
    assert b.js(TICKS) == whole
    wheel = """const axis = document.getElementById('axis'), r = axis.getBoundingClientRect();
        axis.dispatchEvent(new WheelEvent('wheel', {deltaY: -300, ctrlKey: true, clientX: r.left + r.width / 2, clientY: r.top + 5, bubbles: true, cancelable: true}))"""
    b.keys("5")
    b.js(wheel)
    middle = b.js(TICKS)
    assert middle[0] > whole[0] and middle[-1] < whole[-1] and b.js(inside), middle
    b.keys(ESC)
    assert b.js(TICKS) == whole


def watched(b, seconds, speed):
    """The windows that are shown while playing."""
    b.js("window.seen = []; const seek = document.getElementById('seek'); (function look() { if (seen.at(-1) != +seek.value) seen.push(+seek.value); window.looking = requestAnimationFrame(look); })()")
    speeds = b.js(SPEED, speed)
    b.keys(" ")
    time.sleep(seconds)
    b.keys(" ")
    return b.js("cancelAnimationFrame(looking); return seen"), speeds


def played(b, _):
    """Windows of 10 s pass at the chosen multiple of real time, up to 60 in a second, or from change to change."""
    seen, speeds = watched(b, 2.2, "20")
    assert 3 <= seen[-1] <= 5 and seen == list(range(seen[-1] + 1)), seen
    assert speeds[-1] == 0 and max(speeds) / 10 <= 60 < 2.6 * max(speeds) / 10, speeds
    b.keys(HOME)
    seen, _ = watched(b, 0.7, str(max(speeds)))
    assert max(seen) > 15, seen
    b.keys(HOME)
    seen, _ = watched(b, 2.6, "0")
    b.keys(HOME, "n")
    first = b.js(WINDOW)
    b.keys("n")
    assert seen[-2:] == [first, b.js(WINDOW)] and first > 1, seen


def looped(b, _):
    """A dragged stretch is played again and again, and is there again after it."""
    b.js("location.hash = '#t=100&e=130'")
    time.sleep(0.3)
    where = b.js("return document.getElementById('where').textContent")
    assert where.startswith("windows 11 to 13"), where
    seen, _ = watched(b, 2.5, "20")
    assert set(seen[1:]) == {10, 11, 12} and len(seen) > 4, seen
    assert b.js("return document.getElementById('where').textContent") == where


def hovered(b, wide):
    """A lifeline shows its value under the pointer, and a click goes there."""
    if wide < 500:
        return
    at = """const plot = document.getElementById('plot').getBoundingClientRect(), names = [...document.querySelectorAll('#rownames button:not(.more)')].filter(row => row.getClientRects().length);
        const row = names[1].getBoundingClientRect(); return [plot.left + plot.width * .51, row.top + row.height / 2, names[1].title]"""
    x, y, name = b.js(at)
    move = {"type": "pointerMove", "duration": 20, "x": round(x), "y": round(y)}
    act = lambda *steps: b.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps}]})
    act(move)
    title, value = b.js(TIP)
    assert title.endswith(name) and value.startswith("04:1") and ("Hz" in value or "not present" in value), (title, value)
    act({"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0})
    assert b.js(WINDOW) == 25 and b.js("return document.getElementById('name').textContent") == name
    # An element on the stage: two lines, which are gone when it is pressed.
    b.keys(ESC, "f")
    x, y = b.js("const r = document.querySelector('#graph .node:not(.off) :is(ellipse, rect)').getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]")
    act({**move, "x": round(x), "y": round(y)})
    assert len(b.js(TIP)) == 2, b.js(TIP)
    act({"type": "pointerDown", "button": 0})
    assert b.js(TIP) is None
    act({"type": "pointerUp", "button": 0})


def returned(b, _):
    """Back leads to the place before each jump, with its view; steps are no places."""
    places = []
    for key in ("n", "n", "."):
        if key == "n":
            time.sleep(0.1)
            places.append((b.js(WINDOW), b.js(VIEW)))
        b.keys(key)
        time.sleep(0.1)
    for place in reversed(places):
        b.js("history.back()")
        time.sleep(0.3)
        assert (b.js(WINDOW), b.js(VIEW)) == place, (b.js(WINDOW), b.js(VIEW), place)


def card(b, wide):
    """The card comes into view wherever it was asked for; its evidence is below all else, and folded."""
    ways = ("document.querySelector('#graph .node:not(.off) :is(ellipse, rect)').dispatchEvent(new MouseEvent('click', {bubbles: true}))",
            "const q = document.getElementById('q'); q.value = 'lidar'; q.dispatchEvent(new Event('input')); document.querySelector('#hits button').click()",
            "document.querySelector('#totable').click(); document.querySelector('#sheet tbody button').click()",
            "document.querySelector('#rownames button').click()")
    for way in ways:
        b.js("document.getElementById('side').scrollTop = 1e6; scrollTo(0, 1e6);" + way)
        time.sleep(0.2)
        assert b.js(CARD) > 200, (wide, way, b.js(CARD))
        assert b.js("const [stage] = document.getElementById('stage').getClientRects(); return stage.top > -2"), "the picture is not in view"
        last = b.js("const last = document.getElementById('card').lastElementChild; return [last.tagName, last.open, !!last.querySelector('#facts')]")
        assert last == ["DETAILS", False, True], last
        b.keys(ESC, ESC)
        b.js("document.activeElement.blur()")
    # The styles of the graph end at the graph: a sparkline in a row of a vanished element has no line of its own.
    b.keys(HOME, "n", "t")
    lines = set(b.js("return [...document.querySelectorAll('#sheet tr:is(.added, .removed) path')].map(path => getComputedStyle(path).stroke)"))
    assert lines == {"none"}, (wide, lines)
    b.keys("t")


def why(b):
    """The card of a node that stopped: its last message and log texts, what else stopped, and what lost its only publisher."""
    b.js("document.querySelector('#graph [data-name=\"/robot1/controller\"] rect').dispatchEvent(new MouseEvent('click', {bubbles: true}))")
    title, lines = b.js("return [document.getElementById('whytitle').textContent, [...document.querySelectorAll('#why button')].map(line => line.textContent)]")
    assert title == "Why?", title
    for line in ("02:56.3 last message, on /robot1/local_plan", "02:55.1 “control loop missed its desired rate of 6 Hz (1308)”",
                 "02:56.3 /robot1/planner stopped", "02:56.3 /robot1/cmd_vel lost its only publisher"):
        assert line in lines, (line, lines)
    assert sum("“" in line for line in lines) == 3, lines
    b.js("[...document.querySelectorAll('#why button')].find(line => line.textContent.includes('costmap stopped')).click()")
    assert b.js("return document.getElementById('name').textContent") == "/robot1/costmap" and b.js(WINDOW) == 17
    b.js("[...document.querySelectorAll('#why button')].find(line => line.textContent.includes('last message')).click()")
    assert b.js(WINDOW) == 17
    b.js("location.hash = '#t=0&sel=node:/map_server'")
    time.sleep(0.3)
    assert b.js("return document.getElementById('whytitle').textContent") == "Last signs"


def silent(b):
    """A topic without a living sender is silent, not active."""
    b.js("location.hash = '#t=200&sel=topic:/robot1/cmd_vel'")
    time.sleep(0.3)
    state = b.js("return document.getElementById('state').textContent")
    assert state.startswith("topic · silent"), state
