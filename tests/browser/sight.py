"""Tests the initial view: on screens of four sizes no text of the graph is smaller than 9 pixels, and no page is wider than its screen."""

import time

from webdriver import Browser

SCREENS = ((1440, 900), (1920, 1080), (1024, 768), (390, 844))
SMALLEST = """
const stage = document.getElementById('stage').getBoundingClientRect(), graph = document.querySelector('.graph:not([hidden])');
if (document.body.classList.contains('topic-timeline')) {
    const rows = [...document.querySelectorAll('#rownames button, #ticks span')].filter(row => row.getBoundingClientRect().width);
    return [rows.length, Math.min(...rows.map(row => parseFloat(getComputedStyle(row).fontSize))), document.documentElement.scrollWidth];
}
const sizes = [...graph.querySelectorAll('text')].filter(text => {
    const at = text.getBoundingClientRect(), is = getComputedStyle(text);
    return text.textContent && at.width && is.visibility == 'visible' && is.display != 'none'
        && at.right > stage.left && at.left < stage.right && at.bottom > stage.top && at.top < stage.bottom;
}).map(text => parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a);
return [sizes.length, Math.min(...sizes), document.documentElement.scrollWidth];
"""


def check(*urls):
    for wide, high in SCREENS:
        with Browser(wide, high) as b:
            b.cdp("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=wide < 500)
            for url in urls:
                b.open(url)
                time.sleep(0.3)
                texts, smallest, page = b.js(SMALLEST)
                assert texts > 3 and smallest >= 8.99 and page <= wide, (url, wide, texts, smallest, page)
    print("  what is seen first can be read, on four screens")
