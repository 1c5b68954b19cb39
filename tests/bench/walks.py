#!/usr/bin/env python3
"""Holds the budget along the camera paths of configs/walks/ to what it promises, and tells what frames cost.

    tests/bench/walks.py CAIRN DATASET=WALK.toml[,WALK.toml...]... [--budgets 100000,...] [--realtime]

Each path is drawn on the processor, as points, with each budget B. With every frame waiting for its nodes (the default) no frame may
draw more than B points, nor fewer than B - s' (s' the dataset's node size) unless all that is visible is drawn from
leaves. With --realtime frames do not wait: no frame may draw more than B, and only the root may be waited for. Prints
a table in Markdown; exits with 1 if a promise is broken.
"""
import argparse
import csv
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path


def play(cairn, dataset, walk, budget, realtime):
    """The rows of one path, numbers by column name."""
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder, "walk.csv")
        command = [cairn, "render", dataset, "--path", walk, "--budget", str(budget), "--draw", "points", "-o", table]
        subprocess.run(command + ([] if realtime else ["--wait"]), check=True, stdout=subprocess.DEVNULL)
        return [{name: float(text) for name, text in row.items()} for row in csv.DictReader(table.open())]


def broken(rows, budget, node_points, realtime):
    """The frames that break a promise."""
    return [row for row in rows if row["points"] > budget or row["forced_loads"] > (row["frame"] == 0) or
            (not realtime and not row["finest"] and row["points"] < budget - node_points)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cairn")
    parser.add_argument("walks", nargs="+", metavar="DATASET=WALK,...")
    parser.add_argument("--budgets", default="100000,500000,1000000,3000000")
    parser.add_argument("--realtime", action="store_true")
    arguments = parser.parse_args()
    failed = False
    print("| path | budget | frames | points least, median, greatest | B - s' | finest | stood in | loads | "
          "select ms median, greatest | draw ms median | |")
    print("| --- " * 11 + "|")
    for group in arguments.walks:
        dataset, walks = group.split("=", 1)
        info = json.loads(subprocess.run([arguments.cairn, "info", "--json", dataset], check=True,
                                         capture_output=True).stdout)
        node_points = info["tree"]["node_points"]
        for walk in walks.split(","):
            for budget in map(int, arguments.budgets.split(",")):
                rows = play(arguments.cairn, dataset, walk, budget, arguments.realtime)
                column = {name: [row[name] for row in rows] for name in rows[0]}
                bad = broken(rows, budget, node_points, arguments.realtime)
                failed |= bool(bad)
                points = column["points"]
                print(f"| {Path(walk).stem} | {budget:,} | {len(rows)} | {min(points):,.0f}, "
                      f"{statistics.median(points):,.0f}, {max(points):,.0f} | {budget - node_points:,} | "
                      f"{sum(column['finest']):.0f} | {sum(m > 0 for m in column['missing'])} | "
                      f"{sum(column['loads']):.0f} | {statistics.median(column['select_ms']):.2f}, "
                      f"{max(column['select_ms']):.2f} | {statistics.median(column['draw_ms']):.1f} | "
                      f"{'holds' if not bad else f'BROKEN in {len(bad)} frames'} |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
