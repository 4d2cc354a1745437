#!/usr/bin/env python3
"""Takes the README's picture of the page in headless Chromium; a test compares the picture with the current page. To be run
by hand when the page has changed:

    bagreel render examples/warehouse.bag --period 10 -o run.html && tests/browser/page.py run.html docs/src/images/page.webp
"""

import base64
import pathlib
import sys
import time

from webdriver import Browser, missing

# Of the window; the picture has 1100 by 688 pixels.
SIZE = {"width": 1600, "height": 1000}


def main(page: str, picture: str) -> None:
    if missing():
        print(f"skipped: {missing()}")
        return
    with Browser(**SIZE) as b:
        b.cdp("Emulation.setDeviceMetricsOverride", **SIZE, deviceScaleFactor=0.6875, mobile=False)
        b.open(pathlib.Path(page).resolve().as_uri() + "#t=170")
        time.sleep(2)
        shot = b.cdp("Page.captureScreenshot", format="webp", quality=90)
        pathlib.Path(picture).write_bytes(base64.b64decode(shot["data"]))
    print("all well")


if __name__ == "__main__":
    main(*sys.argv[1:])
