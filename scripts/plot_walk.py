#!/usr/bin/env python3
"""What every frame of a camera path cost and drew.

Usage: cairn render site.cairn --path walk.toml --budget 1000000 -o walk.csv
       scripts/plot_walk.py walk.csv -o walk.png --budget 1000000        (or .pdf, .svg)

The rows are CSV with the header line

    frame,time_s,points,nodes,loads,forced_loads,hits,missing,finest,pixel_bound,select_ms,draw_ms

one a frame: points drawn, nodes in use, nodes that arrived from the disk, of which forced ones were waited for, nodes
that were there already, nodes that others stood in for, 1 where all that is visible is drawn from leaves, the bound of the error on the screen in pixels (inf where
there is none), and milliseconds for selecting and for drawing. Lines that begin with # are skipped. Shows points
against the budget, the nodes, the loads, the bound and the times, along the path. Needs Python 3 with matplotlib
(Debian: python3-matplotlib).
"""

import argparse
import csv
import math
import statistics
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit(f"plot_walk.py: error: {error}; Debian has it as python3-matplotlib")

BLUE, ORANGE, GREEN, RED, GREY = "#31688e", "#e08214", "#35b779", "#b2182b", "#9a9a9a"

COLUMNS = ("frame", "time_s", "points", "nodes", "loads", "forced_loads", "hits", "missing", "finest", "pixel_bound",
           "select_ms", "draw_ms")
OVER_A_NETWORK = ("elapsed_s", "fetched_bytes")  # behind these, and not shown


def read_rows(file):
    """One list of numbers a column. Raises ValueError, naming the line, for what is no such table."""
    lines = [(number, line) for number, line in enumerate(file, start=1) if line.strip() and not line.startswith("#")]
    names = next(csv.reader([lines[0][1].strip()])) if lines else []
    if names not in (list(COLUMNS), list(COLUMNS + OVER_A_NETWORK)):
        raise ValueError(f"line {lines[0][0] if lines else 1}: expected the header {','.join(COLUMNS)}")
    columns = {name: [] for name in COLUMNS}
    for number, line in lines[1:]:
        values = next(csv.reader([line.strip()]))
        if len(values) != len(names):
            raise ValueError(f"line {number}: found {len(values)} values, expected {len(names)}")
        for name, text in zip(COLUMNS, values):
            try:
                value = float(text)
            except ValueError:
                raise ValueError(f"line {number}: {name}: found {text!r}, expected a number") from None
            if not value >= 0 or (math.isinf(value) and name != "pixel_bound"):
                raise ValueError(f"line {number}: {name}: found {text!r}, expected a number from 0 on")
            columns[name].append(value)
    if not columns["frame"]:
        raise ValueError("no frame")
    return columns


def leave_room(axes, values):
    """A logarithmic axis with room above the values for the legend."""
    low, high = min(values) / 1.5, max(values) * 1.5
    axes.set_yscale("log")
    axes.set_ylim(low, high * (high / low) ** 0.3)


def plot_points(axes, rows, budget):
    """Points drawn; where they are above the budget, in red."""
    times, points = rows["time_s"], rows["points"]
    axes.plot(times, points, color=BLUE, lw=1.2, label="points drawn")
    if budget is not None:
        axes.axhline(budget, color=ORANGE, lw=1, label=f"budget {budget:,}")
        above = [(time, count) for time, count in zip(times, points) if count > budget]
        if above:
            axes.plot(*zip(*above), ".", color=RED, label=f"above: {len(above)} frames")
    axes.set_ylim(0, 1.25 * max([1, *points, budget or 0]))
    axes.set_ylabel("points")
    axes.yaxis.set_major_formatter(matplotlib.ticker.EngFormatter())


def plot_nodes(axes, rows):
    """Nodes in use, and those of them that are not there yet."""
    axes.plot(rows["time_s"], rows["nodes"], color=BLUE, lw=1.2, label="in use")
    axes.plot(rows["time_s"], rows["missing"], color=RED, lw=1, label="missing: others stand in")
    axes.set_ylim(0, 1.25 * max([1, *rows["nodes"], *rows["missing"]]))
    axes.set_ylabel("nodes")


def plot_loads(axes, rows):
    """Loads of each frame as bars from zero, forced ones before all others, and the share that was there already."""
    times = rows["time_s"]
    hits, loads = sum(rows["hits"]), sum(rows["loads"])
    share = f", {hits / (hits + loads):.1%} hits" if hits + loads > 0 else ""
    axes.vlines(times, 0, rows["loads"], color=GREEN, lw=1.2, label=f"loads: {loads:,.0f} in all{share}")
    forced = sum(rows["forced_loads"])
    axes.vlines(times, 0, rows["forced_loads"], color=RED, lw=1.6, label=f"forced: {forced:,.0f} in all")
    axes.set_ylim(0, 1.35 * max([1, *rows["loads"], *rows["forced_loads"]]))
    axes.set_ylabel("nodes loaded")


def plot_bound(axes, rows):
    """The bound of the error on the screen; frames without one leave a gap."""
    bound = [value if math.isfinite(value) else float("nan") for value in rows["pixel_bound"]]
    axes.plot(rows["time_s"], bound, color=ORANGE, lw=1.2, label="no point is farther from its place")
    known = [value for value in bound if value > 0]
    if known and max(known) > 20 * min(known):
        leave_room(axes, known)
    else:
        axes.set_ylim(0, 1.25 * max([0.1, *known]))
    axes.set_ylabel("error, pixels")
    unbounded = sum(math.isnan(value) for value in bound)
    if unbounded:
        axes.plot([], [], " ", label=f"no bound: {unbounded} frames")


def plot_times(axes, rows):
    """Milliseconds of drawing and of selecting; logarithmic, as they differ by orders of magnitude."""
    for name, color, label in (("draw_ms", BLUE, "draw"), ("select_ms", GREEN, "select")):
        shown = [value if value > 0 else float("nan") for value in rows[name]]
        axes.plot(rows["time_s"], shown, color=color, lw=1.2,
                  label=f"{label}: median {statistics.median(rows[name]):.3g}, most {max(rows[name]):.3g}")
    known = [value for name in ("draw_ms", "select_ms") for value in rows[name] if value > 0]
    if known:
        leave_room(axes, known)
    axes.set_ylabel("ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", help="what `cairn render --path` printed; - for standard input")
    parser.add_argument("-o", "--output", required=True, help="picture to write: .png, .pdf or .svg")
    parser.add_argument("--budget", type=int, help="points that no frame may exceed: drawn as a line")
    parser.add_argument("--title", default="", help="above the picture, before the number of frames")
    arguments = parser.parse_args()
    try:
        with sys.stdin if arguments.rows == "-" else open(arguments.rows, encoding="utf-8") as file:
            rows = read_rows(file)
    except (OSError, ValueError) as error:
        sys.exit(f"plot_walk.py: error: cannot read the rows: {error}")
    figure, axes = plt.subplots(5, 1, figsize=(11, 11), sharex=True, layout="constrained",
                                height_ratios=(1.4, 1, 1, 1, 1))
    plot_points(axes[0], rows, arguments.budget)
    for plot, place in zip((plot_nodes, plot_loads, plot_bound, plot_times), axes[1:]):
        plot(place, rows)
    for place in axes:
        place.margins(x=0.01)
        place.grid(alpha=0.3)
        place.legend(fontsize=8, loc="upper right", ncols=3)
        for side in ("top", "right"):
            place.spines[side].set_visible(False)
    axes[-1].set_xlabel("time along the path, seconds")
    title = f"{arguments.title}: " if arguments.title else ""
    figure.suptitle(f"{title}{len(rows['frame']):,} frames, {max(rows['points']):,.0f} points at most", fontsize=13)
    figure.savefig(arguments.output, dpi=110)


if __name__ == "__main__":
    main()
