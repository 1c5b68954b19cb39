"""Scans that tests write, and datasets that the program makes of them.

What a dataset must give back is known from the arrays that its scans were written from; readers of Cairn have no part in it.
"""
import atexit
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
from functools import lru_cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np

import cairn

PROGRAM = os.environ["CAIRN_PROGRAM"]
SOURCE = Path(os.environ["CAIRN_SOURCE"])
FAULTS = os.environ["CAIRN_FAULTS"]  # see tests/faults/faults.cpp
SHARED_DATA = Path(os.environ["CAIRN_SHARED_DATA"])

_folder = tempfile.TemporaryDirectory(prefix="cairn-python-")
FOLDER = Path(_folder.name)
atexit.register(_folder.cleanup)
os.environ["XDG_CACHE_HOME"] = str(FOLDER / "caches")  # nothing of the user's is read or written
os.environ["no_proxy"] = "*"
signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs in the background may have begun without

# LAS 1.2, point format 3.
LAS_RECORD = np.dtype([("steps", "<i4", 3), ("intensity", "<u2"), ("flags", "u1"), ("classification", "u1"),
                       ("angle", "i1"), ("user_data", "u1"), ("source", "<u2"), ("gps_time", "<f8"),
                       ("color", "<u2", 3)])
SCALE = np.array([0.001, 0.001, 0.01])
OFFSET = np.array([500000.0, 4100000.0, 0.0])


def survey_records(count, seed):
    """Rolling ground with intensity, classes and colours, on the steps of a LAS file."""
    random = np.random.default_rng(seed)
    records = np.zeros(count, LAS_RECORD)
    xy = random.integers(0, 200_000, (count, 2))
    height = 30 * np.sin(xy[:, 0] / 3e4) * np.cos(xy[:, 1] / 2e4) + random.normal(0, 0.3, count)
    records["steps"] = np.column_stack([xy, np.round(height / SCALE[2])])
    records["intensity"] = random.integers(0, 65536, count)
    records["flags"] = 0b001001  # the first return of one
    records["classification"] = np.where(height > 10, 5, 2)
    records["user_data"] = random.integers(0, 256, count)
    records["gps_time"] = 1e8 + np.sort(random.uniform(0, 1e3, count))
    records["color"] = random.integers(0, 65536, (count, 3))
    return records


def write_las(path, records):
    header = bytearray(227)
    header[:4] = b"LASF"
    header[24:26] = 1, 2
    struct.pack_into("<HI", header, 94, 227, 227)
    struct.pack_into("<BHI", header, 104, 3, LAS_RECORD.itemsize, len(records))
    struct.pack_into("<6d", header, 131, *SCALE, *OFFSET)
    path.write_bytes(bytes(header) + records.tobytes())


def write_ply(path, **columns):
    """A binary PLY of float32 (n, 3) positions and normals, and float32 (n,) others."""
    names = {"xyz": ("x", "y", "z"), "normal": ("nx", "ny", "nz")}
    fields = [(name, "<f4") for column in columns for name in names.get(column, (column,))]
    rows = np.empty(len(columns["xyz"]), fields)
    for column, values in columns.items():
        for name, value in zip(names.get(column, (column,)), np.atleast_2d(np.transpose(values))):
            rows[name] = value
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n"
    header += "".join(f"property float {name}\n" for name, _ in fields) + "end_header\n"
    path.write_bytes(header.encode() + rows.tobytes())


def build(name, *arguments):
    """The path of a new dataset."""
    path = FOLDER / f"{name}.cairn"
    subprocess.run([PROGRAM, "build", "--progress", "none", "--threads", "2", "-o", path, *arguments], check=True,
                   stdout=subprocess.DEVNULL)
    return path


SURVEY_POINTS = 20_000


@lru_cache
def survey():
    """The path of a dataset of four levels, and the records of its scans."""
    records = survey_records(SURVEY_POINTS, seed=7)
    scans = [FOLDER / "west.las", FOLDER / "east.las"]
    write_las(scans[0], records[:12_000])
    write_las(scans[1], records[12_000:])
    path = build("survey", *scans, "--lossless-leaves", "--fanout", "4", "--node-points", "320", "--crs", "EPSG:32610")
    return path, records


def world(records):
    return OFFSET + SCALE * records["steps"]


def shared_scan(name):
    """A scan of another program. Skips the test where these are not, unless they must be."""
    path = SHARED_DATA / name
    if not path.exists():
        if "CAIRN_SHARED_DATA_REQUIRED" in os.environ:
            raise AssertionError(f"no {path}")
        raise unittest.SkipTest(f"no {path}")
    return path


def copy_of(path, name):
    """A dataset that a test may damage."""
    to = FOLDER / f"{name}.cairn"
    shutil.copytree(path, to)
    return to


class WebServer(ThreadingHTTPServer):
    """Serves FOLDER by ranges on the loopback until the test ends, and misbehaves as the test tells it to."""
    daemon_threads = True
    block_on_close = False

    def __init__(self, test):
        super().__init__(("127.0.0.1", 0), WebAnswer)
        self.answered = []  # (file name, first byte, last byte) of each request
        self.most_at_once = 0
        self.at_once = 0
        self.delay_s = 0.0
        self.damage = None  # of answers about nodes.bin: how the body is changed
        self.flowing = threading.Event()  # while it is clear, bodies about nodes.bin stall after their first byte
        self.flowing.set()
        self.stalled = threading.Event()  # one does
        self.lock = threading.Lock()
        threading.Thread(target=self.serve_forever, args=(0.01,), daemon=True).start()
        test.addCleanup(self.server_close)
        test.addCleanup(self.shutdown)
        test.addCleanup(self.flowing.set)

    def url(self, path):
        return f"http://127.0.0.1:{self.server_address[1]}/{Path(path).name}"

    def handle_error(self, request, client_address):
        pass  # clients that go away


class WebAnswer(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        pass

    def do_GET(self):
        server = self.server
        with server.lock:
            server.at_once += 1
            server.most_at_once = max(server.most_at_once, server.at_once)
        try:
            threading.Event().wait(server.delay_s)
            self.answer(FOLDER / self.path[1:])
        finally:
            with server.lock:
                server.at_once -= 1

    def answer(self, path):
        if not path.is_file():
            return self.send_error(404)
        data = path.read_bytes()
        tag = f'"{len(data)}-{path.stat().st_mtime_ns}"'
        if self.headers.get("If-None-Match") == tag:
            self.send_response(304)
            self.send_header("ETag", tag)
            return self.end_headers()
        first, last = map(int, re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"]).groups())
        body = data[first:last + 1]
        self.server.answered.append((path.name, first, first + len(body) - 1))
        of_nodes = path.name == "nodes.bin" and len(body) > 1
        if of_nodes and self.server.damage:
            body = self.server.damage(bytearray(body))
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{first + len(body) - 1}/{len(data)}")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("ETag", tag)
        self.end_headers()
        if of_nodes and not self.server.flowing.is_set():
            self.wfile.write(body[:1])
            body = body[1:]
            self.server.stalled.set()
            self.server.flowing.wait()
        self.wfile.write(body)


def python(code, *arguments):
    """A process that runs code, its input and outputs piped."""
    return subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)], cwd=Path(__file__).parent,
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def sorted_rows(*columns):
    """Rows of columns side by side as a sorted list: equal for equal multisets."""
    rows = np.column_stack([np.asarray(column, np.float64) for column in columns])
    return rows[np.lexsort(rows.T)]


class SurveyCase(unittest.TestCase):
    """Tests of the survey, open."""

    @classmethod
    def setUpClass(cls):
        cls.path, cls.records = survey()
        cls.site = cairn.open(cls.path)
        cls.xyz = world(cls.records)

    def refusal(self, call, kind=cairn.UsageError):
        """The one line in which a call is refused."""
        with self.assertRaises(kind) as caught:
            call()
        message = str(caught.exception)
        self.assertNotIn("\n", message)
        return message
