"""Drives the page of `follow --serve` in headless Chromium and Firefox while its recording grows.

usage: live.py BAGREEL RECORDING.mcap
"""

import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

import firefox
import webdriver
from drive import END, LEFT, until, window

# A page is drawn in three percent of the time, so the next one may take a while on a busy machine.
GROWN = 120
# While the page reloads it has no slider, and comparisons with its value are false, so the wait continues.
SEEK = "Number(document.getElementById('seek')?.max)"
SHOWN = "Number(document.getElementById('seek')?.value)"


class Recording:
    """A recording that grows a part at a time, and the command that follows and serves it."""

    def __init__(self, bagreel, recording, folder):
        self.bytes = pathlib.Path(recording).read_bytes()
        self.file = open(pathlib.Path(folder, "r.mcap"), "wb", buffering=0)
        self.grow(0, 0.4)
        self.follower = subprocess.Popen(
            [bagreel, "follow", self.file.name, "--serve", "127.0.0.1:0", "-p", "5s"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        for line in self.follower.stderr:
            found = re.search(r"http://[\d.:]+/?", line)
            if found:
                self.url = found[0]
                break
        threading.Thread(target=self.follower.stderr.read, daemon=True).start()

    def grow(self, start, end):
        length = len(self.bytes)
        self.file.write(self.bytes[int(start * length):int(end * length)])

    def page(self):
        """The newest page."""
        with urllib.request.urlopen(self.url) as answer:
            return answer.read()

    def close(self):
        self.follower.terminate()
        self.follower.wait()
        self.file.close()


def drive(b, recording):
    b.open(recording.url)
    until(b, f"{SEEK} > 0", seconds=GROWN)
    first = b.js(f"return {SEEK}")
    assert window(b) == first, "the newest window is shown"
    recording.grow(0.4, 0.6)
    until(b, f"{SEEK} > {first}", seconds=GROWN)
    second = b.js(f"return {SEEK}")
    until(b, SHOWN, second)
    b.keys(LEFT)
    until(b, SHOWN, second - 1)
    served = recording.page()
    recording.grow(0.6, 0.8)
    while recording.page() == served:
        time.sleep(0.1)
    # Enough time for an erroneous reload.
    time.sleep(1)
    b.keys(LEFT)
    until(b, SHOWN, second - 2)
    assert b.js(f"return {SEEK}") == second, "a page that is looked at does not change"
    b.keys(END)
    until(b, f"{SEEK} > {second}", seconds=GROWN)
    third = b.js(f"return {SEEK}")
    until(b, SHOWN, third)
    print(f"  the film grows from {first + 1} to {second + 1} and {third + 1} windows, and stepping back works meanwhile")


def main(bagreel, recording):
    if webdriver.missing():
        print(f"skipped: {webdriver.missing()}")
        return
    browsers = [webdriver.Browser] + ([] if firefox.missing() else [firefox.Firefox])
    for browser in browsers:
        with tempfile.TemporaryDirectory() as folder:
            growing = Recording(bagreel, recording, folder)
            try:
                with browser() as b:
                    drive(b, growing)
            finally:
                growing.close()
    print("all well" if not firefox.missing() else f"skipped: {firefox.missing()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
