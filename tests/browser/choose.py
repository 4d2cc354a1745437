"""Tests the reader's choices in the page: a range of the timeline, namespaces, a plot, searches, embedding and printing."""

import base64
import re
import time

from webdriver import Browser

ESC = "\ue00c"
ENTER = "\ue007"


def mouse(b, steps):
    b.call("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps}]})
    time.sleep(0.3)


def drag(b, start, end, is_released=True):
    """Drags the mouse from one point of the timeline to another; both are fractions of the time."""
    x, y, w = b.js("const r = document.getElementById('marks').getBoundingClientRect(); return [r.left, r.top + r.height / 2, r.width]")
    move = lambda share: {"type": "pointerMove", "duration": 20, "x": round(x + share * w), "y": round(y)}
    steps = [move(start), {"type": "pointerDown", "button": 0}, *(move(start + (end - start) * k / 8) for k in range(1, 9))]
    if is_released:
        steps.append({"type": "pointerUp", "button": 0})
    mouse(b, steps)


def there(window):
    return {e["name"] for kind in ("nodes", "topics") for e in window[kind]}


def compare_means(b, windows):
    """Labels, card and table of a range: messages by time."""
    length = lambda w: (w["end_ns"] - w["start_ns"]) / 1e9
    def means(kind, key):
        sums = {}
        for w in windows:
            for e in w[kind]:
                sums[key(e)] = sums.get(key(e), 0) + (e["hz"] or 0) * length(w)
        return {name: n / sum(map(length, windows)) for name, n in sums.items()}
    topics, nodes = (means(kind, lambda e: e["name"]) for kind in ("topics", "nodes"))
    drawn = {**nodes, **topics, **means("publishes", lambda e: e["node"] + " " + e["topic"])}
    differs = lambda text, mean: abs(float(text.split(" ")[0]) - mean) > 0.06
    labels = dict(b.js("return [...document.querySelectorAll('#graph :is([data-from], [data-name]):not(.off)')].map(g => [g.dataset.name ?? g.dataset.from + ' ' + g.dataset.to, g.querySelector('.r')?.textContent])"))
    wrong = [(name, text, drawn[name]) for name, text in labels.items() if text and differs(text, drawn[name])]
    assert not wrong and sum(map(bool, labels.values())) > 5, (wrong, labels)
    b.keys("t")
    rates = dict(b.js("return [...document.querySelectorAll('#sheet tbody tr[data-key]')].map(r => [r.dataset.key, r.children[2].textContent])"))
    wrong = [(name, rates["topic:" + name], mean) for name, mean in topics.items() if differs(rates["topic:" + name], mean)]
    assert not wrong and len(topics) > 5, wrong
    b.keys(ESC)
    name = max(topics, key=lambda name: name not in there(windows[0]))
    b.js("document.querySelector(`#graph [data-name='${arguments[0]}'] text`).dispatchEvent(new MouseEvent('click', {bubbles: true}))", name)
    state = b.js("return document.getElementById('state').textContent")
    assert " in this range" in state and "window" not in state, state
    assert not differs(next(part for part in state.split(" · ") if " Hz" in part), topics[name]), (state, topics[name])
    b.keys(ESC)


def ranges(b, url, evolution):
    windows = evolution["windows"]
    b.open("about:blank")
    b.open(url + "#t=0")
    drag(b, 10.5 / 50, 20.5 / 50)
    where = b.js("return document.getElementById('where').textContent")
    assert where.startswith("windows 11 to 21 of 50"), where
    drawn = set(b.js("return [...document.querySelectorAll('#graph .items > g:not(.off)')].map(g => g.dataset.name)"))
    wanted = set().union(*(there(w) for w in windows[10:21]))
    # Elements that ended as the range began existed only for a moment.
    assert wanted <= drawn <= wanted | there(windows[9]), (wanted - drawn, drawn - wanted)
    link = b.js("return location.hash")
    assert "t=100" in link and "e=210" in link, link
    compare_means(b, windows[10:21])
    b.keys(ESC)
    assert "windows" not in b.js("return document.getElementById('where').textContent")
    b.open("about:blank")
    b.open(url + link)
    assert b.js("return document.getElementById('where').textContent") == where, "a link keeps the range"
    b.keys(ESC, "r")
    for _ in range(3):
        b.keys("\ue014")
    assert b.js("return document.getElementById('where').textContent").split(" ")[3] == str(11 + 3)
    b.keys("r")
    print("  a drag, keys and a link choose a range, and its graph is what was there")


def snapping(b, url):
    """While the mouse is down, the timeline shades what it passed over, and frames and names the whole windows."""
    b.open("about:blank")
    b.open(url + "#t=0")
    drag(b, 10.3 / 50, 12.6 / 50, is_released=False)
    shares = """const marks = document.getElementById('marks').getBoundingClientRect();
        return ['passed', 'head'].map(id => document.getElementById(id).getBoundingClientRect()).flatMap(r => [r.left, r.right].map(x => (x - marks.left) / marks.width * 50))"""
    assert all(abs(share - wanted) < 0.2 for share, wanted in zip(b.js(shares), (10.3, 12.6, 10, 13))), b.js(shares)
    tip = "const tip = document.getElementById('tip'); return [tip.hidden, ...[...tip.children].map(line => line.textContent)]"
    assert b.js(tip) == [False, "01:40 – 02:10", "3 whole windows"], b.js(tip)
    mouse(b, [{"type": "pointerUp", "button": 0}])
    assert b.js("return document.getElementById('passed').hidden && document.getElementById('tip').hidden")
    print("  a drag shows the pointer's range, and the windows to which it snaps")


def ticks(b):
    """The labels of the large plot: round rates with a unit, round times, in order, apart from each other."""
    labels = b.js("""return [...document.querySelectorAll('#bigplot text')].map(t => { const r = t.getBoundingClientRect(); return [t.textContent, r.left, r.right, r.top, r.bottom]; })""")
    rates = [float(text.split(" ")[0]) for text, *_ in labels if text.endswith(" Hz")]
    steps = {round(after - before, 6) for before, after in zip(rates, rates[1:])}
    assert rates[0] == 0 and len(steps) == 1 and f"{steps.pop():e}"[0] in "125" and 3 <= len(rates) <= 7, rates
    times = [text for text, *_ in labels if ":" in text]
    seconds = [int(minutes) * 60 + int(rest) for minutes, rest in (text.split(":") for text in times[:-1])]
    assert len(seconds) > 3 and len({after - before for before, after in zip(seconds, seconds[1:])}) == 1, times
    assert all(s % 30 == 0 for s in seconds), times
    apart = lambda a, z: a[2] < z[1] or z[2] < a[1] or a[4] <= z[3] + 1 or z[4] <= a[3] + 1
    assert all(apart(one, other) for k, one in enumerate(labels) for other in labels[:k]), labels


def search(b):
    def hits(text):
        b.js("const q = document.getElementById('q'); q.value = arguments[0]; q.dispatchEvent(new Event('input'))", text)
        return b.js("return [...document.querySelectorAll('#hits button')].map(b => b.title)")
    assert hits("lidar")[0] == "/sensors/lidar", hits("lidar")
    assert hits("planer")[0] == "/nav/planner", hits("planer")
    assert hits("ctrllr")[0].startswith("/nav/controller"), hits("ctrllr")
    assert hits("caemra")[0] == "/sensors/camera" and hits("nav_planner")[0] == "/nav/planner", hits("nav_planner")
    assert hits("snsrs cam")[0] == "/sensors/camera", hits("snsrs cam")
    assert hits("ner -> out")[0] == "/nav/planner → /nav/planner/out", hits("ner -> out")
    assert not hits("zzzzzz")
    hits("")
    print("  search puts an exact last part first, and forgives letters")


def panel(b):
    count = "return [...document.querySelectorAll('#graph .items > g:not(.off)')].filter(g => getComputedStyle(g).visibility == 'visible' && g.dataset.name.startsWith('/nav/')).length"
    assert b.js(count) > 0
    b.js("document.querySelector('#spaces').open = true; [...document.querySelectorAll('#spacelist label')].find(l => l.textContent.includes('/nav ')).querySelector('input').click()")
    assert b.js(count) == 0, "a namespace is left out"
    left = "return [[...document.querySelectorAll('#graph .namespace')].filter(g => getComputedStyle(g).visibility == 'visible').length, [...document.querySelectorAll('#rownames .space')].filter(r => !r.hidden && r.textContent == '/nav').length, [...document.querySelectorAll('#changes button')].filter(b => b.title.startsWith('/nav/')).length, document.getElementById('counts').textContent]"
    hidden = b.js(left)
    assert hidden[1:3] == [0, 0], hidden
    b.js("document.querySelector('#spacelist input:not(:checked)').click()")
    assert b.js(count) > 0
    shown = b.js(left)
    assert shown[0] == hidden[0] + 1 and shown[1] == 1, (shown, hidden)
    b.js("document.querySelector('#graph .topic:not(.off) rect').dispatchEvent(new MouseEvent('click', {bubbles: true}))")
    b.js("document.activeElement.blur()")
    b.keys("g")
    line = b.js("return [document.getElementById('big').hidden, document.querySelectorAll('#bigplot .line').length, document.getElementById('bigplot').getBoundingClientRect().width]")
    assert line[0] is False and line[1] == 1 and line[2] > 600, line
    ticks(b)
    b.keys(ESC)
    assert b.js("return document.getElementById('big').hidden")
    print("  namespaces are left out, and a rate is plotted large")


COVERED = """const mini = document.getElementById('mini'), m = mini.getBoundingClientRect();
return [mini.hasAttribute('hidden') || mini.classList.contains('faint'), [...document.querySelectorAll('#graph .items > .near')].some(g => {
    const r = g.getBoundingClientRect();
    return r.width && r.left < m.right && r.right > m.left && r.top < m.bottom && r.bottom > m.top;
})]"""


def minimap(b):
    names = b.js("return [...document.querySelectorAll('#graph .items > g:not(.off)')].map(g => g.dataset.name)")
    for name in names:
        b.js("location.hash = '#t=0&sel=' + arguments[0]", name)
        time.sleep(0.15)
        gone, covers = b.js(COVERED)
        assert gone or not covers, name
        b.js("document.activeElement.blur()")
        b.keys("c")
        gone, covers = b.js(COVERED)
        assert gone or not covers, name
    print("  the minimap covers nothing that is selected")


def first_view(b, url):
    blank = """const stage = document.getElementById('stage').getBoundingClientRect();
return [...document.querySelectorAll('.graph:not([hidden]) .items > g:not(.off)')].filter(g => {
    const r = g.getBoundingClientRect(), text = g.querySelector('text');
    return r.right > stage.left && r.left < stage.right && r.bottom > stage.top && r.top < stage.bottom && getComputedStyle(text).visibility != 'visible';
}).length"""
    b.open("about:blank")
    b.open(url)
    time.sleep(0.3)
    assert b.js(blank) == 0, "empty boxes at first sight"


def timeline_page(b, url):
    b.open("about:blank")
    b.open(url)
    seen = b.js("""const shown = id => document.getElementById(id).getBoundingClientRect(), rows = [...document.querySelectorAll('#rownames button')];
        return [shown('stage').height, shown('controls').width, rows.length, rows.filter(r => r.querySelector('.type').textContent && r.querySelector('.hz').textContent).length,
            document.querySelectorAll('#legend .node, #legend .edge').length]""")
    assert seen[0] == 0 and seen[1] > 800 and seen[2] == seen[3] > 5 and seen[4] == 0, seen
    drag(b, 0.25, 0.75)
    assert b.js("return document.getElementById('where').textContent").startswith("windows ")
    b.keys("t")
    assert b.js("return document.getElementById('stage').getBoundingClientRect().height") > 200, "the table has room"
    print("  a page of topics is their timeline, with types and rates")


def embedded(b, url, topic_timeline):
    b.open("about:blank")
    b.open(url)
    b.keys("f")
    whole = b.js("return document.getElementById('graph').getAttribute('viewBox')")
    b.open("about:blank")
    b.open(url + "#bare")
    assert b.js("return +document.getElementById('seek').value") == 0, "it begins with the first window"
    assert b.js("return document.getElementById('graph').getAttribute('viewBox')") == whole, whole
    for page, part in ((url, "stage"), (topic_timeline, "time")):
        b.open("about:blank")
        b.open(page + "#bare&loop")
        time.sleep(0.3)
        assert b.js("return ['h1', 'aside', '#buttons'].every(css => getComputedStyle(document.querySelector(css)).display == 'none' || document.querySelector(css).getBoundingClientRect().height <= 1)")
        assert b.js("return document.getElementById(arguments[0]).getBoundingClientRect().width", part) > 1000
        assert b.js("const r = document.getElementById('where').getBoundingClientRect(); return r.height > 9 && r.width > 99 && document.elementFromPoint(r.left + 5, r.top + 5).id") == "where", "the time"
    b.js("const s = document.getElementById('seek'); s.value = s.max; s.dispatchEvent(new Event('input'))")
    b.keys(" ")
    time.sleep(1.4)
    assert b.js("const s = document.getElementById('seek'); return +s.value < +s.max"), "it begins again"
    print("  #bare&loop shows the picture alone, again and again")


def printed(b, *urls):
    """A printed page is landscape and shows all names; each lifeline is a table row, so that its name stays beside it on any sheet."""
    for url in urls:
        b.open("about:blank")
        b.open(url)
        paper = base64.b64decode(b.cdp("Page.printToPDF", printBackground=True, preferCSSPageSize=True)["data"])
        boxes = {tuple(float(n) for n in box.split()) for box in re.findall(rb"/MediaBox \[([^]]+)\]", paper)}
        assert paper.startswith(b"%PDF") and len(paper) > 20_000 and boxes and all(w > h for _, _, w, h in boxes), (len(paper), boxes)
        before = b.js("return [document.querySelector('.graph').getAttribute('viewBox'), document.getElementById('plot').getAttribute('height')]")
        b.cdp("Emulation.setEmulatedMedia", media="print")
        b.js("dispatchEvent(new Event('beforeprint'))")
        hidden, lines = b.js("""const all = [...document.querySelectorAll('.graph:not([hidden]) .items > g:not(.off) > text:not(.r)')];
            const lines = [...document.querySelectorAll('#printed tbody tr')].filter(tr => tr.querySelector('.lifetime, .inferred')?.getAttribute('d'));
            return [all.filter(t => getComputedStyle(t).visibility != 'visible').length, lines.map(tr => [tr.cells[0].textContent, ...[...tr.cells].map(cell => cell.getBoundingClientRect().top),
                tr.querySelector('svg').getBoundingClientRect().height, getComputedStyle(tr).breakInside])]""")
        assert hidden == 0 and len(lines) > 5, (hidden, lines)
        assert all(name and top == beside and high == 14 and split == "avoid" for name, top, beside, high, split in lines), lines
        b.js("dispatchEvent(new Event('afterprint'))")
        b.cdp("Emulation.setEmulatedMedia", media="")
        time.sleep(0.3)
        assert before == b.js("return [document.querySelector('.graph').getAttribute('viewBox'), document.getElementById('plot').getAttribute('height')]"), "the screen is as before"
    print("  printed pages are landscape and show all names and lifelines, a row each")


def drive(b, url, topic_timeline, evolution):
    first_view(b, url)
    ranges(b, url, evolution)
    snapping(b, url)
    search(b)
    panel(b)
    minimap(b)
    timeline_page(b, topic_timeline)
    embedded(b, url, topic_timeline)


def low(topic_timeline):
    """In a low frame, rows give way, and not the headline."""
    with Browser(830, 260) as b:
        b.open(topic_timeline + "#bare")
        time.sleep(0.3)
        shown, whole = b.js("const p = document.getElementById('headline'); return [p.clientHeight, p.scrollHeight]")
        assert shown >= whole > 9, f"of the headline, {shown} of {whole} pixels are visible"


def check(url, topic_timeline, evolution):
    low(topic_timeline)
    with Browser(1440, 900) as b:
        drive(b, url, topic_timeline, evolution)
        printed(b, url, topic_timeline)
