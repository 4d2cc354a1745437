"""Measures the speedup with more workers, as threads and as processes, for bags on a slow server."""

import subprocess
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

LATE = 0.05
"""Seconds before each answer."""
BAGS = 96
WORKERS = (1, 2, 4, 8)


class Late(BaseHTTPRequestHandler):
    """Serves parts of files, each after a delay."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        time.sleep(LATE)
        whole = self.server.files[self.path]
        first, last = (int(place) for place in self.headers["Range"].removeprefix("bytes=").split("-"))
        part = whole[first : last + 1]
        self.send_response(206)
        self.send_header("Content-Length", str(len(part)))
        self.send_header("Content-Range", f"bytes {first}-{first + len(part) - 1}/{len(whole)}")
        self.send_header("ETag", '"1"')
        self.end_headers()
        self.wfile.write(part)

    def log_message(self, *_):
        pass


def run(root, folder, command, of_folder):
    """Prints the seconds by number of workers; returns the variants with a different digest."""
    bag = (Path(root) / "examples/courier.mcap").read_bytes()
    server = ThreadingHTTPServer(("127.0.0.1", 0), Late)
    server.files = {f"/{k}.mcap": bag for k in range(BAGS)}
    threading.Thread(target=server.serve_forever, daemon=True).start()
    uris = [f"http://127.0.0.1:{server.server_port}{path}" for path in server.files]
    (folder / "late.txt").write_text("\n".join(uris))
    tables = [*command, "--manifest", str(folder / "late.txt"), "-o"]

    def threads(to, count):
        return [*tables, str(to), "--jobs", str(count)]

    def processes(to, count):
        shard = [*tables, str(to), "--jobs", "1", "--shard", "{}/" + str(count)]
        return ["sh", "-c", f'seq 1 {count} | xargs -P {count} -I{{}} "$@"', "sh", *shard]

    differ, expected = [], None
    for way in (threads, processes):
        alone = None
        for count in WORKERS:
            to = folder / "late" / f"{way.__name__}{count}"
            started = time.time()
            subprocess.run(way(to, count), check=True)
            took = time.time() - started
            alone = alone or took
            got = of_folder(to)
            expected = expected or got
            if got != expected:
                differ.append(f"{count} {way.__name__}")
            right = "equal" if got == expected else "DIFFERS"
            print(f"| {BAGS} bags, each answer {LATE * 1000:.0f} ms late, {count} {way.__name__} | {right} | {took:.1f} s, {alone / took:.1f}x |", flush=True)
    server.shutdown()
    return differ
