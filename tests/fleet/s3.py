"""Tests the fleet on a local S3 server (moto), behind a proxy that counts requests, fails, refuses and replaces objects."""

import http.client
import json
import logging
import os
import subprocess
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import bagreel


class Proxy(BaseHTTPRequestHandler):
    """Forwards requests to moto, with the additional behaviour in `rules`."""

    protocol_version = "HTTP/1.1"
    rules = {"requests": 0, "bytes": 0, "stumbles": 0, "refuses": False, "at": None, "then": None}
    lock = threading.Lock()

    def do(self):
        rules = self.rules
        with self.lock:
            rules["requests"] += 1
            number = rules["requests"]
            if rules["at"] == number:
                rules["then"]()
        if rules["refuses"]:
            return self.send(403, {}, b"<Error><Code>AccessDenied</Code></Error>")
        # Every fifth request: 20 %.
        if rules["stumbles"] and number % 5 == 3:
            return self.send(503, {}, b"<Error><Code>SlowDown</Code></Error>")
        moto = http.client.HTTPConnection("127.0.0.1", self.server.moto)
        moto.request(self.command, self.path, headers=dict(self.headers))
        answer = moto.getresponse()
        body = answer.read()
        with self.lock:
            rules["bytes"] += len(body)
        self.send(answer.status, dict(answer.getheaders()), body)

    do_GET = do_HEAD = do

    def send(self, status, headers, body):
        self.send_response(status)
        for name, value in headers.items():
            if name.lower() not in ("transfer-encoding", "connection", "content-length", "date", "server"):
                self.send_header(name, value)
        length = headers.get("Content-Length", headers.get("content-length")) if self.command == "HEAD" else None
        self.send_header("Content-Length", length or str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, *_):
        pass


class Server(ThreadingHTTPServer):
    """Ignores clients that disconnect before they have read everything."""

    def handle_error(self, *_):
        pass


def large(path, chunks):
    """A ROS 1 bag in chunks of a quarter of a megabyte, each 0.1 s: payloads are holes in the file."""
    import struct

    def header(**fields):
        return b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())

    def record(head, data, size=None):
        return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data) if size is None else size) + data

    number = lambda value: struct.pack("<I", value)
    stamp = lambda nanos: struct.pack("<II", nanos // 10**9, nanos % 10**9)
    start, payload = 1_700_000_000 * 10**9, 256 << 10
    tail = b""
    connection = header(topic=b"/camera", type=b"sensor_msgs/Image", md5sum=b"0" * 32, message_definition=b"", callerid=b"/cam")
    tail += record(header(op=b"\x07", topic=b"/camera", conn=number(0)), connection)
    with open(path, "wb") as bag:
        bag.write(b"#ROSBAG V2.0\n")
        place = bag.tell()
        bag.seek(place + 4096)
        for k in range(chunks):
            at = start + k * 100_000_000
            message = header(op=b"\x02", conn=number(0), time=stamp(at))
            size = 4 + len(message) + 4 + payload
            where = bag.tell()
            bag.write(record(header(op=b"\x05", compression=b"none", size=number(size)), b"", size))
            bag.write(record(message, b"", payload))
            bag.seek(payload, 1)
            index = header(op=b"\x04", ver=number(1), conn=number(0), count=number(1))
            bag.write(record(index, stamp(at) + number(0)))
            info = header(op=b"\x06", ver=number(1), chunk_pos=struct.pack("<Q", where), start_time=stamp(at), end_time=stamp(at), count=number(1))
            tail += record(info, number(0) + number(1))
        index_pos = bag.tell()
        bag.write(tail)
        head = header(op=b"\x03", index_pos=struct.pack("<Q", index_pos), conn_count=number(1), chunk_count=number(chunks))
        bag.seek(place)
        bag.write(record(head, b"", 4096 - 8 - len(head)))
    return path


MANY = 100
"""Chunks of a bag of which all indexes are read."""


def run(fleet, folder, expected, report, chunks, command):
    import boto3
    from moto.server import ThreadedMotoServer

    # An object that is replaced while it is read is an error of moto's too.
    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    moto = ThreadedMotoServer(port=0)
    moto.start()
    port = moto.get_host_and_port()[1]
    proxy = Server(("127.0.0.1", 0), Proxy)
    proxy.moto = port
    threading.Thread(target=proxy.serve_forever, daemon=True).start()
    keys = {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_REGION": "us-east-1"}
    os.environ.update(keys, AWS_ENDPOINT=f"http://127.0.0.1:{proxy.server_port}", AWS_ALLOW_HTTP="true")
    s3 = boto3.client("s3", endpoint_url=f"http://127.0.0.1:{port}", aws_access_key_id="test", aws_secret_access_key="test", region_name="us-east-1")
    s3.create_bucket(Bucket="fleet")
    total = 0
    for bag in sorted(fleet.iterdir()):
        s3.upload_file(str(bag), "fleet", f"day/{bag.name}")
        total += bag.stat().st_size
    rules = Proxy.rules

    def count(name, stumbles):
        rules.update(requests=0, bytes=0, stumbles=stumbles)
        started = time.time()
        to = folder / "s3" / name.split()[0]
        done = subprocess.run([*command, "s3://fleet/day/", "-o", str(to), "--tier", "index"], check=False)
        assert done.returncode == 3, done.returncode
        tables = plain(to, fleet)
        report(f"S3 {name}: {rules['requests']} requests, {rules['bytes'] / 1e6:.1f} of {total / 1e6:.1f} MB", tables, expected, started)

    count("plain", False)
    count("stumbling, 20 % of requests answered 503", True)
    rules.update(stumbles=False)
    big = large(folder / "large.bag", chunks)
    size = big.stat().st_size
    s3.upload_file(str(big), "fleet", "large.bag")
    rules.update(requests=0, bytes=0)
    far = bagreel.tables("s3://fleet/large.bag")
    share = rules["bytes"] / size
    print(f"S3, {size / 1e6:.0f} MB in {chunks} chunks: {rules['requests']} requests, {rules['bytes']} bytes ({share:.2%})")
    assert rules["requests"] <= 100 and share <= 0.01
    near = bagreel.tables(big, tier="chunks")
    cells = lambda tables: [{k: v for k, v in row.items() if k not in ("mission", "bag")} for row in tables["counts"].to_pyarrow().to_pylist()]
    assert cells(far) == cells(near) and sum(row["n"] for row in cells(far)) == chunks

    # A picture of it needs no further requests.
    few = bagreel.finish(far["counts"])
    assert bagreel.to_dict(few)["messages"] == chunks and len(few) > 5
    # The time of every message of a smaller object, since moto reads the whole object for each part.
    many = large(folder / "many.bag", MANY)
    s3.upload_file(str(many), "fleet", "many.bag")
    rules.update(requests=0, bytes=0)
    mission = bagreel.read("s3://fleet/many.bag", period="10s")
    share = rules["bytes"] / many.stat().st_size
    print(f"S3, the mission of a bag of {MANY} chunks: {rules['requests']} requests, {rules['bytes']} bytes ({share:.2%})")
    assert rules["requests"] <= MANY + 20 and share <= 0.01
    # Payloads of a small file are read, so their sizes are known.
    sizeless = lambda mission: json.loads(mission.to_json(), object_hook=lambda value: {**value, "bytes": None})
    assert sizeless(mission) == sizeless(bagreel.read(many, period="10s"))

    def refused(what):
        try:
            bagreel.tables("s3://fleet/large.bag", tier="index")
        except bagreel.StoreError as error:
            print(f"S3, {what}: raised: {error}")
        else:
            raise AssertionError(f"{what} did not raise")

    def replace():
        s3.put_object(Bucket="fleet", Key="large.bag", Body=b"another")

    rules.update(requests=0, at=10, then=replace)
    refused("replaced while it is read")
    rules.update(at=None, refuses=True)
    refused("403")
    rules.update(refuses=False)
    proxy.shutdown()
    moto.stop()


def plain(to, fleet):
    """The digest with URLs replaced by the corresponding paths."""
    import pyarrow.parquet as pq

    import fleet as way

    rows = [row for file in (to / "counts").glob("*.parquet") for row in pq.read_table(file).to_pylist()]
    for row in rows:
        for name in ("bag", "mission"):
            row[name] = row[name].replace("s3://fleet/day", str(fleet))

    class Rows:
        to_pylist = staticmethod(lambda: rows)

    return way.digest([Rows], "counts")
