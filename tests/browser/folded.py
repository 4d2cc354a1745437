"""Tests that groups of the picture expand in place and collapse again."""

import time

from webdriver import Browser

OUTSIDE = """
const stage = document.getElementById('stage').getBoundingClientRect(), shown = document.querySelector('.graph:not([hidden])');
const boxes = [...shown.querySelectorAll('.items > .near')].map(e => e.getBoundingClientRect());
return [boxes.length, boxes.filter(r => r.left < stage.left || r.top < stage.top || r.right > stage.right || r.bottom > stage.bottom).length,
    shown.id, shown.querySelectorAll('.items > :not(.near)').length, shown.getAttribute('viewBox'), shown.classList.contains('pinned')];
"""


def check(url, data):
    folded = data["graphs"][1]
    place = max(range(len(folded["names"])), key=lambda k: (folded["kinds"][k] == 3, -k))
    name, held = folded["names"][place], folded["members"][place]
    with Browser(1440, 900) as b:
        b.open(url)
        time.sleep(0.3)
        b.js("document.querySelectorAll('#folded .items > g')[arguments[0]].querySelector('rect').dispatchEvent(new MouseEvent('click', {bubbles: true}))", place)
        assert b.js("return document.getElementById('name').textContent") == name
        assert b.js("return document.querySelectorAll('#ends button').length") == min(50, len(held))
        before = b.js(OUTSIDE)
        b.click("#unfold")
        boxes, outside, which, others, _, is_pinned = b.js(OUTSIDE)
        items = [k for k in held if k < len(data["graphs"][0]["names"])]
        assert which == "graph" and is_pinned and boxes == len(items) and others > 0, (boxes, items)
        assert outside == 0, f"{outside} of {boxes} are not on the stage"
        assert b.js("return document.getElementById('name').textContent") == name
        b.keys("o")
        assert b.js(OUTSIDE) == before, "folding again leads back to the same view"
        time.sleep(0.2)
        link = b.js("return location.hash")
        assert f"sel=namespace:{name}" in link, link
        b.open("about:blank")
        b.open(url + link)
        time.sleep(0.3)
        assert b.js("return document.getElementById('name').textContent") == name
        b.keys("\ue00c")
        assert b.js("return document.getElementById('card').hidden") and not b.js(OUTSIDE)[5]
    print("  a folded namespace opens in place, and folds again")
