#!/usr/bin/env python3
"""Throughput of every stage and of the whole build, as medians over several runs.

Usage: tests/bench/throughput.py [--points N] [--runs R] [--threads T] [--program PATH]
                                 [--generator SOURCE.cpp | --scan FILE] [--keep DIR] -- [flags of `cairn build`]

Makes a synthetic scan once (LAS, point format 2), builds it R times after one run that is not counted, and
prints for each stage and for the whole the median, the fastest and the slowest run, in seconds and million
points a second, with the peak memory and the bytes of the dataset. Takes what the program itself
recorded in run.json, and the wall time of the whole process beside it.

Examples:
  tests/bench/throughput.py
  tests/bench/throughput.py --points 20000000 --runs 5 --threads 2
  tests/bench/throughput.py --scan site.las -- --reducer random
"""

import argparse
import json
import pathlib
import statistics
import subprocess

import builds


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser, points=20_000_000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--generator", type=pathlib.Path,
                        help="C++ source of a `gen_scan N PREFIX las`; without it make_scan is used")
    parser.add_argument("--scan", type=pathlib.Path, help="an input to take instead of a synthetic one")
    parser.add_argument("flags", nargs="*", help="flags for `cairn build`")
    return parser.parse_args()


def make_scan(arguments, folder):
    """The input: given, kept from an earlier call, or made."""
    if arguments.scan:
        return arguments.scan
    if arguments.generator:
        return builds.generate(arguments.generator, arguments.points, "las", folder)
    scan = folder / f"statue-{arguments.points}.las"
    if not scan.exists():
        subprocess.run([arguments.program.parent / "make_scan", "--points", str(arguments.points),
                        "--shape", "statue", "-o", scan], check=True)
    return scan


def row(name, seconds, points):
    median = statistics.median(seconds)
    rate = f"{points / median / 1e6:.2f}" if points and median > 0 else ""
    print(f"{name:<12} {median:9.2f} s {min(seconds):9.2f} {max(seconds):9.2f} {rate:>12}".rstrip())


def print_report(arguments, scan, output, records):
    info = json.loads(subprocess.run([arguments.program, "info", output, "--json"], check=True,
                                     stdout=subprocess.PIPE, text=True).stdout)
    points = info["points"]
    print(f"{points:,} points, {scan.stat().st_size / 1e6:,.0f} MB in, {arguments.threads} threads, "
          f"{len(records)} runs, {records[0]['machine']['processor']}")
    print(f"{'stage':<12} {'median':>11} {'fastest':>9} {'slowest':>9} {'M points/s':>12}")
    for first in records[0]["stages"]:
        # Several passes of a stage count as one here; a stage without points, such as opening the scans, has no rate.
        row(first["name"], [entry["seconds"] for record in records for entry in record["stages"]
                            if entry["name"] == first["name"]], points if first["points"] else 0)
    row("whole", [record["wall_s"] for record in records], points)
    stored = sum(level["points"] for level in info["levels"]) if "levels" in info else None
    size = info["bytes"]["total"]
    print(f"peak memory {max(record['peak_memory_bytes'] for record in records) / 2**20:,.0f} MiB; dataset "
          f"{size / 1e6:,.1f} MB, {size / points:.2f} bytes an input point"
          + (f", {info['bytes']['nodes'] / stored:.2f} a stored point" if stored else ""))


def main():
    arguments = parse_arguments()
    with builds.workplace(arguments.keep) as folder:
        scan = make_scan(arguments, folder)
        output = folder / "bench.cairn"
        records = [builds.build(arguments.program, scan, output, arguments.threads, arguments.flags)
                   for _ in range(arguments.runs + 1)][1:]
        print_report(arguments, scan, output, records)


if __name__ == "__main__":
    main()
