#!/usr/bin/env python3
"""How the time a point grows with their number where memory is short: builds inside memory control groups.

Usage: tests/bench/growth.py --generator SOURCE.cpp [--sizes N ...] [--memory SIZE ...] [--threads T] [--program PATH]
                             [--keep DIR]

Builds scans of each size (LAS) with each bound of memory, inside a group (version 1, needs root) that has twice that
much, the cache of files included: what is larger has to go through the disk. Prints seconds, seconds a million points and
the peak of resident memory.

Example:
  tests/bench/growth.py --generator ../shared/bench/gen_scan.cpp --sizes 20000000 187000000 --memory 1GiB 4GiB
"""

import argparse
import pathlib
import shutil

import builds


def gibibytes(text):
    if not text.endswith("GiB") or not text[:-3].isdigit():
        raise argparse.ArgumentTypeError(f"{text} is no size such as 4GiB")
    return int(text[:-3])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser)
    parser.add_argument("--generator", type=pathlib.Path, required=True, help="C++ source of a `gen_scan N PREFIX las`")
    parser.add_argument("--sizes", type=int, nargs="+", default=[20_000_000, 187_000_000])
    parser.add_argument("--memory", type=gibibytes, nargs="+", default=[1, 4])
    arguments = parser.parse_args()
    with builds.workplace(arguments.keep) as folder:
        print("| points | memory, GiB | of the group | seconds | a million points | peak resident, MiB |")
        print("| --- | --- | --- | --- | --- | --- |")
        for points in arguments.sizes:
            scan = builds.generate(arguments.generator, points, "las", folder)
            for memory in arguments.memory:
                builds.forget(scan)
                with builds.MemoryGroup(2 * memory * 2**30) as group:
                    record = builds.build(arguments.program, scan, folder / "bench.cairn", arguments.threads,
                                          ["--memory", f"{memory}GiB"], group)
                print(f"| {points:,} | {memory} | {2 * memory} | {record['wall_s']:.1f} | "
                      f"{record['wall_s'] / points * 1e6:.3f} | {record['peak_memory_bytes'] / 2**20:.0f} |", flush=True)
                shutil.rmtree(folder / "bench.cairn")


if __name__ == "__main__":
    main()
