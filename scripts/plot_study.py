#!/usr/bin/env python3
"""What accuracy costs: the figures of a study.

Usage: cairn study configs/studies/reducers.toml -o reducers
       scripts/plot_study.py reducers/results.json -o reducers.png        (or .pdf, .svg, or --format)

A row an input: the RMS error against the build's time, with bars from the least to the greatest of the repetitions;
against bytes a point; on every level, against the share of the points that is drawn (dotted: from the nearest point); the
share of points that no splat covers, against the mean number of splats over a point; and, where the study drew pictures,
their PSNR against the time of a frame. A grey line joins the settings that no other beats in both. Needs Python 3 with
matplotlib (Debian: python3-matplotlib).
"""

import argparse
import json
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit(f"plot_study.py: error: {error}; Debian has it as python3-matplotlib")

GREY = "#9a9a9a"
COLORS = ("#31688e", "#e08214", "#35b779", "#b2182b", "#762a83", "#666666", "#1b9e9e", "#a6761d", "#e377c2", "#8c9a1f")
MARKERS = "osD^vP*Xph"


def median(value):
    return value["median"] if isinstance(value, dict) else value


def bars(value):
    """How far below and above its median a value was in other repetitions."""
    if not isinstance(value, dict):
        return 0, 0
    return value["median"] - value["min"], value["max"] - value["median"]


def style(index):
    """Color and marker of a setting: ten colors, and another marker whenever they begin again."""
    return {"color": COLORS[index % len(COLORS)],
            "marker": MARKERS[(index + index // len(COLORS)) % len(MARKERS)]}


def front(points, more_is_better):
    """Those of (cost, quality) that no other beats in both, cheapest first."""
    best, kept = None, []
    for x, y in sorted(points, key=lambda point: (point[0], -point[1] if more_is_better else point[1])):
        if best is None or (y > best if more_is_better else y < best):
            best = y
            kept.append((x, y))
    return kept


def plain_logarithmic(axis):
    """A logarithmic axis with ticks at 1, 2 and 5, written as people do."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(matplotlib.ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def plot_against(axes, results, cost, quality, more_is_better=False, factor=1):
    """One point a setting, and the front. `results` are (index of the setting, metrics); `factor` is on the quality."""
    points = []
    for index, metrics in results:
        if cost not in metrics or quality not in metrics:
            continue
        x, y = median(metrics[cost]), factor * median(metrics[quality])
        below, above = bars(metrics[cost])
        axes.errorbar(x, y, xerr=[[below], [above]], ms=7, capsize=3, lw=1, ls="", zorder=3, **style(index))
        points.append((x, y))
    if not points:
        axes.text(0.5, 0.5, "no level here: too few points", ha="center", transform=axes.transAxes)
        return
    axes.plot(*zip(*front(points, more_is_better)), color=GREY, lw=1.2, zorder=1)
    axes.margins(0.12)
    known = [y for _, y in points]
    if min(known) > 0 and max(known) > 2.5 * min(known):
        axes.set_yscale("log")
        plain_logarithmic(axes.yaxis)
    elif not more_is_better:
        axes.set_ylim(bottom=0)


def plot_levels(axes, results):
    """The errors of every level, against the share of the points that it holds."""
    for index, _, levels in results:
        for error, look in (("rms", {"ms": 4}), ("nearest_rms", {"ms": 2, "ls": ":"})):
            shown = [(100 * level["share"], level[error]) for level in levels if (level[error] or 0) > 0]
            if shown:
                axes.plot(*zip(*shown), lw=1, **look, **style(index))
    if axes.lines:
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_logarithmic(axes.xaxis)
        plain_logarithmic(axes.yaxis)


def picture_pairs(results):
    """(cost, quality, what was drawn) of the study's pictures, small budgets first: frame_ms@200k with psnr@200k."""
    names = {name for result in results for name in result["metrics"]}
    drawn = [name.split("@", 1)[1] for name in names if name.startswith("psnr@")]

    def order(text):
        budget, _, mode = text.partition("_")
        return mode, float(budget.replace("k", "e3").replace("M", "e6"))

    def words(text):
        budget, _, mode = text.partition("_")
        return f"{budget} points" + (f", drawn as {mode}" if mode else "")

    return [(f"frame_ms@{text}", f"psnr@{text}", words(text)) for text in sorted(drawn, key=order)
            if f"frame_ms@{text}" in names]


def draw_row(row, name, points, results, at, pairs):
    metrics = [(index, values) for index, values, _ in results]
    plot_against(row[0], metrics, "build_s", "rms")
    row[0].set(ylabel=f"{name}\n{points / 1e6:.3g} M points\n\nRMS, units of the scans", xlabel="build, seconds",
               title=f"RMS, {at}")
    plot_against(row[1], metrics, "bytes_per_point", "rms")
    row[1].set(xlabel="bytes a point of the input", ylabel="RMS", title=f"RMS, {at}")
    plot_levels(row[2], results)
    row[2].set(xlabel="points drawn, %", ylabel="RMS", title="RMS of every level; dotted: from the nearest")
    plot_against(row[3], metrics, "overdraw", "uncovered", factor=100)
    row[3].set(xlabel="overdraw: splats over a point", ylabel="uncovered points, %", title=f"Cover, {at}")
    for axes, (cost, quality, drawn) in zip(row[4:], pairs):
        plot_against(axes, metrics, cost, quality, more_is_better=True)
        axes.set(xlabel="frame, milliseconds", ylabel="PSNR, dB", title=f"Pictures of {drawn}")
    for axes in row:
        axes.grid(alpha=0.3)
        axes.title.set_fontsize(10)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", help="results.json of a study; - for standard input")
    parser.add_argument("-o", "--output", required=True, help="picture to write")
    parser.add_argument("--format", choices=("png", "pdf", "svg"), help="of the picture [as its name says]")
    arguments = parser.parse_args()
    try:
        with sys.stdin if arguments.results == "-" else open(arguments.results, encoding="utf-8") as file:
            study = json.load(file)
    except (OSError, json.JSONDecodeError) as error:
        sys.exit(f"plot_study.py: error: cannot read the results: {error}")
    if not isinstance(study, dict) or not {"study", "inputs", "settings", "results"} <= study.keys():
        sys.exit("plot_study.py: error: cannot read the results: these are none of a study")
    settings = [setting["name"] for setting in study["settings"]]
    pairs = picture_pairs(study["results"])
    columns, inputs = 4 + len(pairs), study["inputs"]
    below = 0.35 + 0.22 * -(-(len(settings) + 1) // 5)  # inches for the legend
    above = 3.0 * len(inputs) + 0.4
    figure = plt.figure(figsize=(4.4 * columns, above + below), layout="constrained")
    page, foot = figure.subfigures(2, 1, height_ratios=(above, below))
    axes = page.subplots(len(inputs), columns, squeeze=False)
    for row, given in zip(axes, inputs):
        results = [(settings.index(result["setting"]), result["metrics"], result["levels"])
                   for result in study["results"] if result["input"] == given["name"]]
        draw_row(row, given["name"], given["points"], results, study["at"], pairs)
    handles = [plt.Line2D([], [], ls="", ms=7, label=name, **style(i)) for i, name in enumerate(settings)]
    handles.append(plt.Line2D([], [], color=GREY, lw=1.2, label="none is better in both"))
    foot.legend(handles=handles, loc="center", ncol=5, fontsize=9, frameon=False)
    page.suptitle(f"{study['study']}: medians of {study['repetitions']} repetitions, {study['threads']} threads",
                  fontsize=13)
    figure.savefig(arguments.output, dpi=110, format=arguments.format)


if __name__ == "__main__":
    main()
