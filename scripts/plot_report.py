#!/usr/bin/env python3
"""One page of figures from a dataset's report.

Usage: cairn report site.cairn --json > site.json
       scripts/plot_report.py site.json -o site.png        (or .pdf, .svg)

Shows how uniform node sizes are on every level, the errors by level, the normal thresholds and grids that
merging reached, what the bytes go to, time, processor time and memory of each stage, and what became of
every record of every scan. Needs Python 3 with matplotlib (Debian: python3-matplotlib).
"""

import argparse
import json
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit(f"plot_report.py: error: {error}; Debian has it as python3-matplotlib")

BLUE, ORANGE, GREEN, RED, GREY = "#31688e", "#e08214", "#35b779", "#b2182b", "#9a9a9a"


def level_labels(levels):
    return [f"{level['level']}" for level in levels]


def plot_sizes(axes, report):
    """Node sizes by level: the range, the mean and the number of nodes."""
    levels = report["levels"]
    for row, level in enumerate(levels):
        sizes = level["node_points"]
        most = max(entry["nodes"] for entry in sizes["histogram"])
        for entry in sizes["histogram"]:
            centre = (entry["min"] + entry["max"]) / 2
            axes.scatter(centre, row, s=20 + 160 * entry["nodes"] / most, color=BLUE, alpha=0.7, linewidths=0)
        noun = "node" if level["nodes"] == 1 else "nodes"
        axes.annotate(f"{level['nodes']:,} {noun}, variation {sizes['variation']:.2g}", (0.03, row + 0.05),
                      xycoords=("axes fraction", "data"), fontsize=8, color="#444444")
    target = report["tree"]["target_points"]
    axes.axvline(report["tree"]["node_points"], color=ORANGE, lw=1, label=f"s' = {report['tree']['node_points']:,}")
    axes.axvline(target, color=GREY, lw=1, ls=":", label=f"asked for {target:,}")
    axes.set_xlim(0, 1.15 * max(target, max(level["node_points"]["max"] for level in levels)))
    axes.set_yticks(range(len(levels)), level_labels(levels))
    axes.set_ylim(len(levels) - 0.5, -1.1)
    axes.set(title="Node sizes", xlabel="points a node", ylabel="level")
    axes.legend(fontsize=8, loc="upper left", ncols=2)


def plot_errors(axes, report):
    """RMS and largest bound by level. What is exact, such as leaves that stand for themselves, has no place on a
    logarithmic axis and is left out."""
    levels = report["levels"]
    x = range(len(levels))

    def shown(values):
        return [value if value > 0 else float("nan") for value in values]

    rms = shown([level["rms"] for level in levels])
    low = shown([level["node_bound"]["min"] for level in levels])
    high = shown([level["node_bound"]["max"] for level in levels])
    axes.plot(x, rms, "o-", color=BLUE, label="RMS over all input points")
    axes.fill_between(x, low, high, color=ORANGE, alpha=0.25, label="bounds of nodes, least to most")
    axes.plot(x, high, "s-", color=ORANGE, ms=4, label="no point is farther")
    if any(value > 0 for value in high):
        axes.set_yscale("log")
    exact = [level["level"] for level in levels if level["node_bound"]["max"] == 0]
    if exact:
        axes.annotate(f"exact: level {', '.join(map(str, exact))}", (0.98, 0.03), xycoords="axes fraction", ha="right",
                      fontsize=8, color="#444444")
    axes.set_xticks(list(x), level_labels(levels))
    axes.set_xlim(-0.3, len(levels) - 0.7)
    axes.set(title="Distance of input points to their representatives", xlabel="level", ylabel="units of the scans")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)


def plot_merging(axes, report):
    """Normal threshold and grid that merging reached on inner levels."""
    inner = report["levels"][:-1]
    axes.set(title="Merging: threshold and grid reached", xlabel="level")
    if not inner:
        axes.text(0.5, 0.5, "one node: nothing was merged", ha="center", transform=axes.transAxes)
        return
    x = list(range(len(inner)))

    def spread(on, key, color, offset):
        middle = [level[key]["median"] for level in inner]
        errors = [[m - level[key]["min"] for m, level in zip(middle, inner)],
                  [level[key]["max"] - m for m, level in zip(middle, inner)]]
        return on.errorbar([i + offset for i in x], middle, yerr=errors, fmt="o", color=color, capsize=4)

    axes.set_ylabel("theta, degrees", color=BLUE)
    if any(level["theta"]["max"] > 0 for level in inner):
        spread(axes, "theta", BLUE, -0.06)
        axes.set_ylim(bottom=0)
    else:
        axes.set_yticks([])
        axes.set_ylabel("theta: not used, there are no normals", color=BLUE)
    right = axes.twinx()
    spread(right, "grid", GREEN, 0.06)
    right.set_ylabel("grid, cells along the longest axis", color=GREEN)
    right.set_ylim(bottom=0)
    axes.set_xticks(x, level_labels(inner))


def plot_bytes(axes, report):
    """Bytes a stored point by section, stacked, for every level."""
    levels = report["levels"]
    bottom = [0.0] * len(levels)
    names = [name for name in levels[0]["section_bytes"]
             if any(level["section_bytes"][name] for level in levels)]
    colors = plt.get_cmap("tab20").colors
    for i, name in enumerate(names):
        height = [level["section_bytes"][name] / level["points"] for level in levels]
        axes.bar(range(len(levels)), height, 0.6, bottom=bottom, label=name, color=colors[i % len(colors)])
        bottom = [b + h for b, h in zip(bottom, height)]
    for i, total in enumerate(bottom):
        axes.annotate(f"{total:.2f}", (i, total), ha="center", va="bottom", fontsize=8)
    axes.set_ylim(0, 1.15 * max(bottom))
    axes.set_xlim(-0.6, len(levels) + 0.8)
    axes.set_xticks(range(len(levels)), level_labels(levels))
    axes.set(title="Bytes a stored point", xlabel="level", ylabel="bytes")
    axes.legend(fontsize=7, loc="upper right")


def plot_cost(axes, report):
    """Time and processor time of each stage, with its peak memory."""
    run = report["run"]
    axes.set(title="Cost of the build", xlabel="seconds")
    if run is None:
        axes.text(0.5, 0.5, "run.json is not there", ha="center", transform=axes.transAxes)
        return
    stages = run["stages"]
    rows = range(len(stages))
    longest = max(max(stage["seconds"], stage["cpu_seconds"]) for stage in stages)
    axes.barh([r - 0.2 for r in rows], [s["seconds"] for s in stages], 0.38, color=BLUE, label="time")
    axes.barh([r + 0.2 for r in rows], [s["cpu_seconds"] for s in stages], 0.38, color=GREY, label="processor time")
    for row, stage in enumerate(stages):
        axes.annotate(f"{stage['peak_memory_bytes'] / 2**20:,.0f} MiB",
                      (max(stage["seconds"], stage["cpu_seconds"]) + 0.02 * longest, row), va="center", fontsize=8)
    axes.set_xlim(0, 1.25 * longest if longest > 0 else 1)
    axes.set_yticks(list(rows), [stage["name"] for stage in stages])
    axes.invert_yaxis()
    axes.legend(fontsize=8, loc="lower right")


def plot_ledger(axes, report):
    """What became of each scan's records; of many scans the largest are shown."""
    shown = sorted(report["sources"], key=lambda source: -source["claimed"])[:12]
    rows = range(len(shown))
    left = [0] * len(shown)
    parts = [("kept", BLUE, lambda s: s["kept"]), ("not finite", ORANGE, lambda s: s["dropped"]["non_finite"]),
             ("no return", GREY, lambda s: s["dropped"]["no_return"]), ("missing", RED, lambda s: s["missing"])]
    effects = [effect["name"] for effect in report.get("effects", []) if "removed" in effect]
    for name, color in zip(effects, plt.get_cmap("Set2").colors):
        parts.append((name, color, lambda s, name=name: s["dropped"][name]))
    for name, color, count in parts:
        counts = [count(source) for source in shown]
        if name == "kept" or any(counts):
            axes.barh(list(rows), counts, 0.6, left=left, color=color, label=name)
        left = [a + b for a, b in zip(left, counts)]
    rest = len(report["sources"]) - len(shown)
    axes.set_yticks(list(rows), [source["name"] for source in shown], fontsize=8)
    axes.invert_yaxis()
    axes.set(title="Ledger: records of the scans" + (f" (and {rest} smaller ones)" if rest else ""), xlabel="records")
    axes.xaxis.set_major_formatter(matplotlib.ticker.EngFormatter())
    axes.legend(fontsize=8, loc="lower right")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", help="what `cairn report --json` printed; - for standard input")
    parser.add_argument("-o", "--output", required=True, help="picture to write: .png, .pdf or .svg")
    arguments = parser.parse_args()
    try:
        with sys.stdin if arguments.report == "-" else open(arguments.report, encoding="utf-8") as file:
            report = json.load(file)
    except (OSError, json.JSONDecodeError) as error:
        parser.error(f"cannot read the report: {error}")
    figure, axes = plt.subplots(2, 3, figsize=(16.5, 9.5), layout="constrained")
    plots = (plot_sizes, plot_errors, plot_merging, plot_bytes, plot_cost, plot_ledger)
    for plot, place in zip(plots, axes.flat):
        plot(place, report)
        place.title.set_fontsize(11)
        for side in ("top", "right"):
            place.spines[side].set_visible(False)
    figure.suptitle(f"{report['dataset']}: {report['points']:,} points kept of {report['read']:,} read, "
                    f"{report['dropped']:,} dropped, {report['missing']:,} missing", fontsize=13)
    figure.savefig(arguments.output, dpi=110)


if __name__ == "__main__":
    main()
