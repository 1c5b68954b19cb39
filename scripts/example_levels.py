#!/usr/bin/env python3
"""An example of the Python package: how a dataset's nodes and errors go from level to level, and what a budget buys.

    PYTHONPATH=build/release/python scripts/example_levels.py site.cairn -o levels.png

Cells begin with `# %%`: Jupyter, Spyder and Visual Studio Code run them one by one; what they look at is then told in the first.
Needs Python 3 with NumPy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""

# %% What to look at. Run as a script, its arguments tell instead.
dataset = "site.cairn"  # a folder, or an address http(s)://HOST/NAME.cairn
output = None  # a picture to write
budget = 600_000  # points of the map

# %% Open it. The index is read now; points only when asked for.
import argparse
import sys
from pathlib import Path

try:
    import numpy as np
    import matplotlib.pyplot as plt
    import cairn
except ImportError as error:
    sys.exit(f"example_levels.py: error: {error}; see the head of this script")

if Path(sys.argv[0]).name == "example_levels.py":  # and not the kernel that runs these cells
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", help="a folder NAME.cairn, or the address of one")
    parser.add_argument("-o", "--output", help="picture to write: .png, .pdf or .svg; without it a window is opened")
    parser.add_argument("--budget", type=int, default=budget, help="points of the map")
    arguments = parser.parse_args()
    dataset, output, budget = arguments.dataset, arguments.output, arguments.budget

try:
    site = cairn.open(dataset)
except cairn.Error as error:
    sys.exit(f"example_levels.py: error: {error}")
print(site)

# %% The table of all nodes is a structured array: whatever is asked of nodes is a line of NumPy.
levels = [site.level(level) for level in range(site.level_count)]
print(f"{'level':>5} {'nodes':>9} {'points':>13} {'least':>9} {'most':>9} {'rms':>10} {'bound':>10}")
for level, nodes in enumerate(levels):
    sizes = nodes["point_count"]
    print(f"{level:5} {len(nodes):9,} {nodes.point_count:13,} {sizes.min():9,} {sizes.max():9,} {nodes.rms:10.4g} {nodes.bound:10.4g}")

BLUE, ORANGE, GREEN, GREY = "#31688e", "#e08214", "#35b779", "#9a9a9a"
figure, ((sizes_axes, errors_axes), (map_axes, budget_axes)) = plt.subplots(2, 2, figsize=(13, 10), layout="constrained")
LEVEL_COLORS = plt.get_cmap("plasma")(np.linspace(0, 0.9, site.level_count))


def spread_out(count):
    """Offsets that keep marks of a level from hiding each other, in the order of the nodes."""
    return np.linspace(-0.3, 0.3, count) if count > 1 else np.zeros(1)


# %% Node sizes. Inner nodes are all equally full, leaves differ by at most one point.
for level, nodes in enumerate(levels):
    sizes = nodes["point_count"]
    sizes_axes.scatter(level + spread_out(len(nodes)), sizes, s=14, color=BLUE, alpha=0.6, linewidths=0)
    low, high = int(sizes.min()), int(sizes.max())
    noun = "node" if len(nodes) == 1 else "nodes"
    text = f"{low:,}" + ("" if low == high else f" to {high:,}") + f"\n{len(nodes):,} {noun}"
    sizes_axes.annotate(text, (level, low), xytext=(0, -10), textcoords="offset points", ha="center", va="top", fontsize=8)
sizes_axes.axhline(site.target_points, color=GREY, lw=1, ls=":", label=f"asked for {site.target_points:,}")
sizes_axes.set_ylim(0, 1.2 * max(site.node_points, site.target_points))
sizes_axes.set(title="Points a node, each a dot", xlabel="level", ylabel="points")
sizes_axes.legend(fontsize=8, loc="lower right")

# %% Errors: how far input points lie from the points that stand for them. Exact leaves have no place on a logarithmic axis.
exact = [level for level, nodes in enumerate(levels) if nodes.bound == 0]
shown = [level for level in range(site.level_count) if level not in exact]
for level in shown:
    offsets = spread_out(len(levels[level]))
    for field, color in (("rms", BLUE), ("bound", ORANGE)):
        errors_axes.scatter(level + offsets, levels[level][field], s=9, color=color, alpha=0.35, linewidths=0)
rms = [levels[level].rms or np.nan for level in shown]
errors_axes.plot(shown, [levels[level].bound for level in shown], "s-", color=ORANGE, ms=5, label="bound: no point is farther")
errors_axes.plot(shown, rms, "o-", color=BLUE, ms=5, label="rms of all input points")
errors_axes.set(title="Error by level, dots: of each node", xlabel="level", ylabel="distance, units of the scans")
if shown:
    errors_axes.set_yscale("log")
    errors_axes.legend(fontsize=8)
if exact:
    errors_axes.annotate(f"level {', '.join(map(str, exact))}: exact", (0.98, 0.04), xycoords="axes fraction", ha="right",
                         fontsize=8, color="#444444")
for axes in (sizes_axes, errors_axes):
    axes.set_xticks(range(site.level_count))
    axes.set_xlim(-0.5, site.level_count - 0.5)

# %% A cut on a budget: nodes that show all of the site, fine where the error is large and coarse where that costs little. They
# are read by as many threads as there are processors.
cut = site.budget(max(budget, site.root.point_count))
points = cut.read([name for name in ("color", "intensity") if name in site.attributes
                   and site.attributes[name].on_inner_nodes])
centre = site.bounds.mean(axis=0)
x, y, height = (points.xyz - centre).T
order = np.argsort(height, kind="stable")  # what is higher is drawn over what is below
if "color" in points:
    brightest = np.quantile(points["color"], 0.99) or 1
    shade = {"c": np.clip(points["color"] / brightest, 0, 1)[order]}
else:
    shade = {"c": (points["intensity"] if "intensity" in points else height)[order], "cmap": "viridis"}
map_axes.scatter(x[order], y[order], s=1.2, marker="s", linewidths=0, rasterized=True, **shade)
for level in np.unique(cut["level"]):
    for low, high in cut[cut["level"] == level]["box"] - centre:
        map_axes.add_patch(plt.Rectangle(low[:2], *(high - low)[:2], fill=False, lw=1.2, ec=LEVEL_COLORS[level],
                                         label=f"nodes of level {level}"))
handles = dict(zip(*map_axes.get_legend_handles_labels()[::-1]))  # one of each level
map_axes.legend(handles.values(), handles, fontsize=8, loc="upper right", bbox_to_anchor=(1.3, 1))
map_axes.set_aspect("equal")
map_axes.set(title=f"{len(points):,} points of {len(cut)} nodes, at most {budget:,} asked for", xlabel=f"x - {centre[0]:,.1f}", ylabel=f"y - {centre[1]:,.1f}")

# %% What a budget buys: the error of cuts of at most so many points, beside whole levels.
sizes = np.unique(np.geomspace(site.root.point_count, site.point_count, 60).astype(np.int64))
cuts = [site.budget(int(size)) for size in sizes]
budget_axes.plot([c.point_count for c in cuts], [c.rms or np.nan for c in cuts], ".-", color=GREEN, ms=4, lw=1,
                 label="cuts on a budget, site.budget(n)")
budget_axes.plot([levels[level].point_count for level in shown], rms, "o", color=BLUE, label="whole levels")
budget_axes.plot(cut.point_count, cut.rms or np.nan, "*", color=ORANGE, ms=13, label="the map on the left")
budget_axes.set_xscale("log")
if shown and any(value > 0 for value in rms):
    budget_axes.set_yscale("log")
budget_axes.xaxis.set_major_formatter(plt.matplotlib.ticker.EngFormatter())
budget_axes.set(title="Error of a cut against its points", xlabel="points", ylabel="rms, units of the scans")
budget_axes.legend(fontsize=8)

# %% Show or keep it.
for axes in figure.axes:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.25)
figure.suptitle(f"{site.source}: {site.point_count:,} points, fan-out {site.fanout}, {site.node_count:,} nodes")
if output:
    figure.savefig(output, dpi=110)
else:
    plt.show()
