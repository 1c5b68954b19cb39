#!/usr/bin/env python3
"""How the time a point grows with their number where memory is short: builds inside memory control groups.

Usage: tests/bench/growth.py --generator SOURCE.cpp [--sizes N ...] [--memory SIZE ...] [--turns R] [--threads T]
                             [--program PATH] [--keep DIR]

Builds scans of each size (LAS) with each bound of memory, inside a group (version 1, needs root) that has twice that
much, the cache of files included: what is larger has to go through the disk. Prints seconds and seconds a million points,
as medians of some turns, and the peaks of resident memory and of what the work folder takes of the disk, also in bytes a
point.

Example:
  tests/bench/growth.py --generator ../shared/bench/gen_scan.cpp --sizes 20000000 187000000 --memory 1GiB 4GiB
"""

import argparse
import pathlib
import shutil
import subprocess
import threading

import builds


def gibibytes(text):
    if not text.endswith("GiB") or not text[:-3].isdigit():
        raise argparse.ArgumentTypeError(f"{text} is no size such as 4GiB")
    return int(text[:-3])


class WorkWatch:
    """What a folder takes of the disk at most, looked at four times a second, as a context."""

    def __init__(self, folder):
        self.folder = folder
        self.most = 0
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.watch)

    def watch(self):
        while not self.over.wait(0.25):
            found = subprocess.run(["du", "--block-size=1", "--summarize", self.folder], check=False, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout  # files come and go
            if found:
                self.most = max(self.most, int(found.split()[0]))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()


def build(arguments, scan, memory, folder):
    """Seconds, peak of resident memory, peak of the work folder."""
    output = folder / "bench.cairn"
    builds.forget(scan)
    with builds.MemoryGroup(2 * memory * 2**30) as group, WorkWatch(folder / "bench.cairn.work") as watch:
        record = builds.build(arguments.program, scan, output, arguments.threads, ["--memory", f"{memory}GiB"], group)
    shutil.rmtree(output)
    return record["wall_s"], record["peak_memory_bytes"], watch.most


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser)
    parser.add_argument("--generator", type=pathlib.Path, required=True, help="C++ source of a `gen_scan N PREFIX las`")
    parser.add_argument("--sizes", type=int, nargs="+", default=[20_000_000, 187_000_000])
    parser.add_argument("--memory", type=gibibytes, nargs="+", default=[1, 4])
    parser.add_argument("--turns", type=int, default=1)
    arguments = parser.parse_args()
    with builds.workplace(arguments.keep) as folder:
        scans = {points: builds.generate(arguments.generator, points, "las", folder) for points in arguments.sizes}
        runs = {(points, memory): [] for points in arguments.sizes for memory in arguments.memory}
        for _ in range(arguments.turns):
            for (points, memory), records in runs.items():
                records.append(build(arguments, scans[points], memory, folder))
        print("| points | memory, GiB | of the group | seconds | a million points | peak resident, MiB | "
              "peak of work files, GiB | bytes a point |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for (points, memory), records in runs.items():
            seconds, resident, work = zip(*records)
            print(f"| {points:,} | {memory} | {2 * memory} | {builds.spread(seconds, 1)} | "
                  f"{builds.spread([s / points * 1e6 for s in seconds], 3)} | {max(resident) / 2**20:.0f} | "
                  f"{max(work) / 2**30:.2f} | {max(work) / points:.1f} |")


if __name__ == "__main__":
    main()
