#!/usr/bin/env python3
"""Builds beside the out-of-core octree of PCL, in turns: how many times its points a second, as medians.

Usage: tests/bench/peers.py --generator SOURCE.cpp [--points N] [--turns R] [--threads T] [--program PATH]
                            [--keep DIR] [--quick]

Runs `pcl_outofcore_process -gen_lod -depth 6` (Debian's pcl-tools) on 5 million points, and `cairn build` on N points as
LAS, the same with the preset `preview`, and as PLY with normals: one after the other, R times. Absolute times move with
the machine and what else it does, ratios less. `--quick` takes 5 million points and one turn and shows beside each ratio
the one in tests/bench/recorded.json.

Example:
  tests/bench/peers.py --generator ../shared/bench/gen_scan.cpp --turns 5
"""

import argparse
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import time

import builds

PCL_POINTS = 5_000_000
RECORDED = pathlib.Path(__file__).with_name("recorded.json")
PRESET = builds.ROOT / "configs/preview.toml"
BUILDS = {"LAS": ("las", []), "LAS, preview": ("las", ["--config", PRESET]), "PLY with normals": ("ply", [])}


def run_pcl(scan, output):
    """Seconds."""
    start = time.monotonic()
    subprocess.run(["pcl_outofcore_process", "-gen_lod", "-depth", "6", scan, output], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seconds = time.monotonic() - start
    shutil.rmtree(output)
    return seconds


def measure(arguments, folder):
    """Million points a second of each, a turn."""
    pcl_scan = builds.generate(arguments.generator, PCL_POINTS, "pcd", folder)
    scans = {name: builds.generate(arguments.generator, arguments.points, kind, folder)
             for name, (kind, _) in BUILDS.items()}
    rates = {"PCL, out of core": [], **{name: [] for name in BUILDS}}
    for _ in range(arguments.turns):
        rates["PCL, out of core"].append(PCL_POINTS / 1e6 / run_pcl(pcl_scan, folder / "octree"))
        for name, (_, flags) in BUILDS.items():
            record = builds.build(arguments.program, scans[name], folder / "bench.cairn", arguments.threads, flags)
            rates[name].append(arguments.points / 1e6 / record["wall_s"])
    return rates


def print_report(arguments, rates):
    recorded = json.loads(RECORDED.read_text()) if arguments.quick else {}
    print(f"{arguments.points:,} points, {arguments.threads} threads, {arguments.turns} turns\n")
    print("| build | million points a second | of PCL's |" + (" recorded |" if recorded else ""))
    print("| --- | --- | --- |" + (" --- |" if recorded else ""))
    pcl = statistics.median(rates["PCL, out of core"])
    for name, values in rates.items():
        ratio = statistics.median(values) / pcl
        print(f"| {name} | {builds.spread(values, 2)} | {ratio:.2f} |" + (f" {recorded[name]:.2f} |" if recorded else ""))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    builds.add_arguments(parser, points=60_000_000)
    parser.add_argument("--generator", type=pathlib.Path, required=True,
                        help="C++ source of a `gen_scan N PREFIX las|ply|pcd`")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    if shutil.which("pcl_outofcore_process") is None:
        sys.exit("peers: pcl_outofcore_process is not there; it comes with Debian's pcl-tools")
    if arguments.quick:
        arguments.points, arguments.turns = PCL_POINTS, 1
    with builds.workplace(arguments.keep) as folder:
        print_report(arguments, measure(arguments, folder))


if __name__ == "__main__":
    main()
