#!/usr/bin/env python3
"""What the shape of a cloud costs: the time and peak memory of builds, as medians over several turns.

Usage: tests/bench/shapes.py [--points N] [--turns R] [--threads T] [--program PATH] [--keep DIR]

Makes four clouds of N points (LAS, point format 0): a surface, the same with one point 100 km away, points that fill a
cube, and points that all are the same. Builds them in turns, after one turn that is not counted, so that what else the
machine does meets all of them, and prints their medians with the fastest and slowest run, and the ratios to the surface.
"""

import argparse
import math
import pathlib
import random
import statistics
import struct

import builds

RECORD = struct.Struct("<iii8x")
EXTENT = 1_000_000  # steps of a millimetre


def surface(unit):
    x, y = int(EXTENT * unit()), int(EXTENT * unit())
    return x, y, int(20_000 * math.sin(x / 50_000) * math.cos(y / 70_000))


def volume(unit):
    return int(EXTENT * unit()), int(EXTENT * unit()), int(EXTENT * unit())


def identical(_):
    return 0, 0, 0


FAR = (100_000_000, 0, 0)
CLOUDS = {"surface": (surface, []), "surface and one far point": (surface, [FAR]), "volume": (volume, []),
          "identical points": (identical, [])}


def write_las(path, count, place, more):
    """`count` points from `place`, then those of `more`."""
    unit = random.Random(1).random
    header = bytearray(227)
    struct.pack_into("<4s20xBB68xHI5xHI20x3d", header, 0, b"LASF", 1, 2, 227, 227, RECORD.size, count + len(more),
                     0.001, 0.001, 0.001)
    with open(path, "wb") as file:
        file.write(header)
        for first in range(0, count, 100_000):
            points = (place(unit) for _ in range(min(100_000, count - first)))
            file.write(b"".join(RECORD.pack(*point) for point in points))
        file.write(b"".join(RECORD.pack(*point) for point in more))


def print_report(arguments, runs):
    print(f"{arguments.points:,} points, {arguments.threads} threads, {arguments.turns} turns\n")
    print("| cloud | seconds | to the surface | peak memory, MiB | to the surface |")
    print("| --- | --- | --- | --- | --- |")
    middle = {name: [statistics.median(values) for values in zip(*results)] for name, results in runs.items()}
    for name, results in runs.items():
        seconds, memory = zip(*results)
        ratios = [here / there for here, there in zip(middle[name], middle["surface"])]
        print(f"| {name} | {builds.spread(seconds, 2)} | {ratios[0]:.2f} | {builds.spread(memory, 0)} | {ratios[1]:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser, points=5_000_000)
    parser.add_argument("--turns", type=int, default=5)
    arguments = parser.parse_args()
    with builds.workplace(arguments.keep) as folder:
        scans = {name: folder / f"{name.replace(' ', '-')}-{arguments.points}.las" for name in CLOUDS}
        for name, scan in scans.items():
            if not scan.exists():
                write_las(scan, arguments.points, *CLOUDS[name])
        runs = {name: [] for name in CLOUDS}
        for turn in range(arguments.turns + 1):
            for name, scan in scans.items():
                record = builds.build(arguments.program, scan, folder / "shape.cairn", arguments.threads)
                if turn > 0:
                    runs[name].append((record["wall_s"], record["peak_memory_bytes"] / 2**20))
        print_report(arguments, runs)


if __name__ == "__main__":
    main()
