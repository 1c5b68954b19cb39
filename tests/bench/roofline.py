#!/usr/bin/env python3
"""What each stage costs a point, beside what memory and disk allow: a roofline as a table.

Usage: tests/bench/roofline.py [--points N] [--turns R] [--program PATH] [--keep DIR] --generator SOURCE.cpp

Builds a scan (LAS) with one thread and with two, in turns, and prints for each stage with two threads the nanoseconds a
point, the bytes that its passes read and write a point, how much of the machine's memory rate that is (measured here: two
threads that copy, bytes read and written), and the parallel efficiency: the time with one thread over twice the time with
two. Bytes are counted from the passes that the code makes over records (import: the file, a record; split: keys and
records, records and their new place, a level, and checksums of two levels; cluster: records twice, packed nodes; index:
packed nodes twice), not measured: what stays in caches moves less. Last come the rates of the disk, once written and synced,
once read with nothing of it in memory, and what they allow for the file and the dataset.

Example:
  tests/bench/roofline.py --generator ../shared/bench/gen_scan.cpp --turns 5
"""

import argparse
import concurrent.futures
import ctypes
import json
import os
import pathlib
import statistics
import subprocess
import time

import builds

COPIED = 256 * 2**20
DISK_BYTES = 2 * 2**30


def memory_rate(threads):
    """Bytes a second, read and written, of threads that copy buffers larger than any cache; the best of some runs."""
    memcpy = ctypes.CDLL(None).memcpy  # gives up Python's lock
    memcpy.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
    buffers = [(ctypes.create_string_buffer(COPIED), ctypes.create_string_buffer(COPIED)) for _ in range(threads)]
    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        def copy():
            start = time.monotonic()
            list(pool.map(lambda pair: memcpy(ctypes.addressof(pair[0]), ctypes.addressof(pair[1]), COPIED), buffers))
            return time.monotonic() - start
        return 2 * COPIED * threads / min(copy() for _ in range(6))


def disk_rates(folder):
    """Bytes a second, written and synced, then read."""
    path = folder / "disk"
    block = os.urandom(2**24)
    start = time.monotonic()
    with open(path, "wb", buffering=0) as file:
        for _ in range(DISK_BYTES // len(block)):
            file.write(block)
        os.fsync(file.fileno())
    written = DISK_BYTES / (time.monotonic() - start)
    builds.forget(path)
    start = time.monotonic()
    with open(path, "rb", buffering=0) as file:
        while file.read(len(block)):
            pass
    read = DISK_BYTES / (time.monotonic() - start)
    path.unlink()
    return written, read


def scalar_bytes(name):
    """Of a type such as uint16."""
    return int("".join(filter(str.isdigit, name))) // 8


def record_bytes(info):
    """Of a work record: a position and all attributes."""
    return 12 + sum(scalar_bytes(attribute["type"]) * attribute["components"] for attribute in info["schema"])


def bytes_a_point(info, scan, output):
    """What the passes of each stage read and write."""
    points, record = info["points"], record_bytes(info)
    source = scan.stat().st_size / points
    packed = (output / "nodes.bin").stat().st_size / points
    levels = max(level["level"] for level in info["levels"])
    return {"import": source + record, "split": levels * 3 * record + min(levels, 2) * record,
            "cluster": 2 * record + packed, "index": 2 * packed}, source + packed


def seconds_of(records, stage):
    return statistics.median(entry["seconds"] for record in records for entry in record["stages"]
                             if entry["name"] == stage)


def print_report(arguments, runs, moved, through_disk, folder):
    memory = memory_rate(2)
    points = arguments.points
    print(f"{points:,} points, {arguments.turns} turns, {runs[2][0]['machine']['processor']}; memory "
          f"{memory / 1e9:.1f} GB/s with two threads, {memory_rate(1) / 1e9:.1f} with one\n")
    print("| stage | ns a point | bytes a point | of the memory's rate | efficiency of two threads |")
    print("| --- | --- | --- | --- | --- |")
    for stage, amount in moved.items():
        one, two = (seconds_of(runs[threads], stage) for threads in (1, 2))
        print(f"| {stage} | {two / points * 1e9:.1f} | {amount:.0f} | {100 * amount * points / memory / two:.1f} % | "
              f"{one / two / 2:.2f} |")
    walls = {threads: [record["wall_s"] for record in records] for threads, records in runs.items()}
    one, two = (statistics.median(walls[threads]) for threads in (1, 2))
    total = sum(moved.values())
    print(f"| whole | {two / points * 1e9:.1f} | {total:.0f} | {100 * total * points / memory / two:.1f} % | "
          f"{one / two / 2:.2f} |")
    print(f"\nwhole: {builds.spread(walls[1], 2)} s with one thread, {builds.spread(walls[2], 2)} s with two")
    written, read = disk_rates(folder)
    print(f"disk: {written / 1e6:.0f} MB/s written and synced, {read / 1e6:.0f} MB/s read; {through_disk:.0f} bytes a point "
          f"that have to go through it take {through_disk / min(written, read) * 1e9:.0f} ns at the lower rate")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser, points=20_000_000)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--generator", type=pathlib.Path, required=True, help="C++ source of a `gen_scan N PREFIX las`")
    arguments = parser.parse_args()
    with builds.workplace(arguments.keep) as folder:
        scan = builds.generate(arguments.generator, arguments.points, "las", folder)
        output = folder / "bench.cairn"
        runs = {1: [], 2: []}
        for turn in range(arguments.turns + 1):  # the first is not counted
            for threads, records in runs.items():
                record = builds.build(arguments.program, scan, output, threads)
                if turn > 0:
                    records.append(record)
        info = json.loads(subprocess.run([arguments.program, "info", output, "--json"], check=True,
                                         stdout=subprocess.PIPE, text=True).stdout)
        print_report(arguments, runs, *bytes_a_point(info, scan, output), folder)


if __name__ == "__main__":
    main()
