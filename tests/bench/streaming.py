#!/usr/bin/env python3
"""How a dataset comes over a slow network: first picture, full front, and what was fetched for them.

    tests/bench/streaming.py --folder DIR_OF_THE_SCANS [--program CAIRN] [--dataset NAME.cairn] [--quick]

Builds the airborne campaign of configs/campaigns/autzen.toml (or takes a dataset), serves it by nginx and draws it over a
link of 10 Mbit/s whose round trip takes 50 ms. As root nginx runs in a network namespace behind a token bucket (tc tbf), else
the relay of tests/support/delay_relay.py does that, too, as it always does the delay: every byte waits 25 ms on either
way, and a connection begins with a round trip. Runs, in turns:

  still    the whole campaign, a camera at rest, a budget of a million points
  again    the same with what the first run kept
  turn     the path configs/walks/autzen_turn.toml in real time

Prints a table in Markdown. Exits with 1 where a promise is broken: the first picture within 2 s, the full front within twice
the time that its bytes alone need, at most 1.2 times the bytes of the index and of the nodes drawn in any frame, and
no byte of nodes.bin sent twice but the first, which tells its size. --quick: a smaller budget and no turn, for a test.
"""
import argparse
import contextlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BYTES_PER_SECOND = 10_000_000 / 8
ROUND_TRIP_MS = 50
NGINX = """
daemon off; pid {work}/nginx.pid; error_log {work}/error.log; worker_processes 1; {user}
events {{ }}
http {{
  log_format ranges '$uri $status $body_bytes_sent $http_range';
  access_log {work}/access.log ranges; root {root}; sendfile on; tcp_nopush on;
  client_body_temp_path {work}/t1; proxy_temp_path {work}/t2; fastcgi_temp_path {work}/t3;
  uwsgi_temp_path {work}/t4; scgi_temp_path {work}/t5;
  server {{ listen {address}; }}
}}
"""


def run(*command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@contextlib.contextmanager
def namespace(name="cairn-streaming"):
    """A network namespace whose link to here passes 10 Mbit/s: its address, and what starts a command in it; nothing where that
    may not be made."""
    here, there = "cairn0", "cairn1"
    inside = ["ip", "netns", "exec", name]
    try:
        run("ip", "netns", "add", name)
    except (OSError, subprocess.CalledProcessError):
        yield None
        return
    try:
        run("ip", "link", "add", here, "type", "veth", "peer", "name", there, "netns", name)
        run("ip", "addr", "add", "10.77.0.1/30", "dev", here)
        run("ip", "link", "set", here, "up")
        run(*inside, "ip", "addr", "add", "10.77.0.2/30", "dev", there)
        run(*inside, "ip", "link", "set", there, "up")
        run(*inside, "tc", "qdisc", "add", "dev", there, "root", "tbf", "rate", "10mbit", "burst", "16kb", "latency",
            "400ms")
        yield "10.77.0.2", inside
    finally:
        subprocess.run(["ip", "netns", "del", name], check=False)


@contextlib.contextmanager
def program(command, **options):
    process = subprocess.Popen(command, **options)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


class Line:
    """A server behind a slow line."""

    def __init__(self, stack, work, root):
        self.log = work / "access.log"
        net = stack.enter_context(namespace())
        self.shaped_by = "tc tbf" if net else "the relay"
        host, inside = net if net else ("127.0.0.1", [])
        port = 8080 if net else 18080 + os.getpid() % 10000
        conf = work / "nginx.conf"
        conf.write_text(NGINX.format(work=work, root=root, address=f"{host}:{port}",
                                     user="user root;" if os.geteuid() == 0 else ""))
        stack.enter_context(program([*inside, "nginx", "-c", str(conf)], stderr=subprocess.DEVNULL))
        relay = [sys.executable, str(ROOT / "tests/support/delay_relay.py"), "0", f"{host}:{port}", "--round-trip-ms",
                 str(ROUND_TRIP_MS)]
        if not net:
            relay += ["--bytes-per-second", str(BYTES_PER_SECOND)]
        process = stack.enter_context(program(relay, stdout=subprocess.PIPE, text=True))
        self.url = f"http://127.0.0.1:{int(process.stdout.readline())}/"
        time.sleep(0.5)  # until nginx listens

    def sent(self):
        """Since the last call: bytes of bodies, and those of nodes.bin that were sent more than once."""
        time.sleep(0.3)
        lines = self.log.read_text().splitlines()
        self.log.write_text("")
        pieces = []
        for line in lines:
            uri, status, size, *ranges = line.split()
            span = re.match(r"bytes=(\d+)-", ranges[0]) if ranges else None
            if uri.endswith("nodes.bin") and status == "206" and span:
                pieces.append((int(span[1]), int(span[1]) + int(size)))
        twice, end = 0, 0
        for first, last in sorted(pieces):
            twice += max(0, min(end, last) - first)
            end = max(end, last)
        return sum(int(line.split()[2]) for line in lines), twice


def write_still(cairn, dataset, path, seconds):
    """A path that rests where `--camera auto` stands."""
    told = json.loads(subprocess.run([cairn, "render", dataset, "-o", str(path) + ".png", "--budget", "200k", "--size",
                                      "320x180", "--stats", "json"], check=True, capture_output=True).stdout)
    camera = told["camera"]
    keyframe = "[[camera]]\ntime = {}\n" + "".join(f"{key} = {camera[key]}\n" for key in ("eye", "target", "up", "fov"))
    path.write_text("frames_per_second = 10\n" + keyframe.format(0) + keyframe.format(seconds))


def play(cairn, url, walk, budget, cache, table):
    command = [cairn, "render", url, "--path", walk, "--real-time", "--budget", str(budget), "--web-cache", cache, "-o",
               table, "--force", "--stats", "json", "--size", "960x540"]
    done = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
    if done.stderr:
        sys.exit(f"unexpected: {done.stderr}")
    return json.loads(done.stdout)["network"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", help="where the scans of configs/campaigns/autzen.toml are")
    parser.add_argument("--dataset", type=pathlib.Path, help="take this one, and do not play the turn, which is Autzen's")
    parser.add_argument("--program", default=str(ROOT / "build/release/cairn"))
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    if not options.folder and not options.dataset:
        parser.error("either --folder or --dataset is needed")
    budget, seconds = (250_000, 5) if options.quick else (1_000_000, 20)
    broken = []

    with contextlib.ExitStack() as stack:
        work = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cairn-streaming-")))
        root = work / "root"
        root.mkdir()
        dataset = root / "site.cairn"
        if options.dataset:
            shutil.copytree(options.dataset, dataset)
        else:
            run(options.program, "build", str(ROOT / "configs/campaigns/autzen.toml"), "--folder", options.folder, "-o",
                str(dataset))
        work.chmod(0o755)
        still = work / "still.toml"
        write_still(options.program, str(dataset), still, seconds)
        line = Line(stack, work, root)
        runs = [("still", still, "a"), ("again", still, "a")]
        if not options.quick and not options.dataset:
            runs.append(("turn", ROOT / "configs/walks/autzen_turn.toml", "b"))
        print(f"10 Mbit/s by {line.shaped_by}, round trip {ROUND_TRIP_MS} ms, budget {budget:,} points\n")
        print("| run | first picture, s | full front, s | its bytes alone, s | fetched, MB | of index and drawn nodes | requests "
              "| retries | sent twice, bytes |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
        for name, walk, cache in runs:
            network = play(options.program, line.url + "site.cairn", walk, budget, work / cache, work / "walk.csv")
            sent, twice = line.sent()
            alone, full = network["drawn_bytes"] / BYTES_PER_SECOND, network["full_front_s"]
            share = network["fetched_bytes"] / network["drawn_bytes"]
            print(f"| {name} | {network['first_picture_s']:.2f} | {'none' if full is None else f'{full:.2f}'} | {alone:.2f} | "
                  f"{network['fetched_bytes'] / 1e6:.2f} | {share:.3f} | {network['requests']} | {network['retries']} | {twice} |",
                  flush=True)
            promises = {"the first picture within 2 s": network["first_picture_s"] <= 2,
                        "at most 1.2 times the bytes of index and drawn nodes": share <= 1.2,
                        "no byte sent twice but the one that tells the size": twice <= 1,
                        "what the server sent was counted": sent >= network["fetched_bytes"]}
            if name != "turn":  # which ends with answers under way
                promises["no more was sent than was counted"] = sent == network["fetched_bytes"]
            if name == "still":
                promises["the full front within twice the time of its bytes"] = full is not None and full <= 2 * alone
            if name == "again":
                promises["nothing but a byte is fetched again"] = network["fetched_bytes"] <= 1
            broken += [f"{name}: {promise}" for promise, held in promises.items() if not held]
    for promise in broken:
        print(f"broken: {promise}", file=sys.stderr)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
