#!/usr/bin/env python3
"""Measures how fast pages are in headless Chromium without a GPU. Run by hand, on a quiet machine:

    tests/bench/player.py PAGE.html...

Prints per page: its size, the time to the first window, processor time of script, style and layout per step, frames per
second while playing 4 windows a second, while panning and while zooming, and the memory of the renderer.
"""

import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "browser"))
import webdriver  # noqa: E402

STEPS = """
for (let i = 0; i < 60; i++) {
    const key = i % 20 < 10 ? 'ArrowRight' : 'ArrowLeft';
    document.body.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
    await new Promise(requestAnimationFrame);
}
"""

FRAMES = """
const [act, seconds] = arguments, stage = document.getElementById('stage'), ends = performance.now() + seconds * 1e3;
const fire = (type, more) => stage.dispatchEvent(new PointerEvent(type, {bubbles: true, isPrimary: true, pointerId: 1, ...more}));
let frames = 0, x = 400, gap = 0, last = performance.now();
if (act == 'play') { document.getElementById('speed').value = 4; document.getElementById('play').click(); }
if (act == 'pan') fire('pointerdown', {clientX: x, clientY: 300, buttons: 1});
while (performance.now() < ends) {
    await new Promise(requestAnimationFrame);
    gap = Math.max(gap, performance.now() - last);
    last = performance.now();
    frames++;
    if (act == 'pan') fire('pointermove', {clientX: x += frames % 120 < 60 ? 4 : -4, clientY: 300, buttons: 1});
    if (act == 'zoom') stage.dispatchEvent(new WheelEvent('wheel', {deltaY: frames % 120 < 60 ? -15 : 15, clientX: 500, clientY: 300, cancelable: true}));
}
if (act == 'play') document.getElementById('play').click();
return [frames / seconds, gap];
"""


def asynchronous(body):
    return f"const done = arguments[arguments.length - 1]; (async () => {{ {body} }})().then(done)"


def memory(profile):
    """The largest resident size of a process of this browser's renderers, in MB."""
    sizes = []
    for status in pathlib.Path("/proc").glob("[0-9]*/status"):
        try:
            command = (status.parent / "cmdline").read_bytes()
            if b"--type=renderer" in command and profile.encode() in command:
                line = next(l for l in status.read_text().splitlines() if l.startswith("VmRSS"))
                sizes.append(int(line.split()[1]) / 1024)
        except OSError:
            pass
    return max(sizes, default=0)


def metrics(b):
    return {m["name"]: m["value"] for m in b.cdp("Performance.getMetrics")["metrics"]}


def measure(path):
    with webdriver.Browser(1440, 900) as b:
        b.call("POST", "/timeouts", {"script": 60000})
        b.open(path.resolve().as_uri())
        load = b.js("const n = performance.getEntriesByType('navigation')[0]; const p = performance.getEntriesByName('first-contentful-paint')[0];"
                    "return Math.max(n.loadEventEnd, p ? p.startTime : 0)") / 1e3
        run = lambda body, *args: b.call("POST", "/execute/async", {"script": asynchronous(body), "args": list(args)})
        # The clock of the thread, so that a busy machine counts for less.
        b.cdp("Performance.enable", timeDomain="threadTicks")
        before = metrics(b)
        run(STEPS)
        after = metrics(b)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} KB, first window {load:.2f} s")
        spent = {key: (after[key] - before[key]) / 60 * 1e3 for key in after}
        print(f"  per step: script {spent['ScriptDuration']:.2f} ms, style {spent['RecalcStyleDuration']:.2f} ms,"
              f" layout {spent['LayoutDuration']:.2f} ms; JavaScript heap {after['JSHeapUsedSize'] / 1e6:.0f} MB")
        for act, seconds in (("play", 5), ("pan", 3), ("zoom", 3)):
            fps, gap = run(FRAMES.replace("arguments,", f"['{act}', {seconds}],"))
            print(f"  {act}: {fps:.0f} frames/s, longest gap {gap:.0f} ms")
            time.sleep(0.4)
        print(f"  renderer: {memory(b.profile.name):.0f} MB")


if __name__ == "__main__":
    reason = webdriver.missing()
    if reason:
        sys.exit(f"no measurement: {reason}")
    for name in sys.argv[1:]:
        measure(pathlib.Path(name))
