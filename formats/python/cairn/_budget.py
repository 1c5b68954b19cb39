"""Which nodes show a whole dataset with at most so many points, wherever the eye is.

The viewer's cut (viewer/lod_selection.h) depends on a view. This one goes by the errors that the index records alone:
from the root on, the node that is worst is replaced by its children as long as the budget has room for them. Unlike those, and
unlike the cut of `cairn export` (viewer/error_cut.h), it is made of whole nodes: what it gives is what a table of nodes can hold.
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._errors import UsageError
from ._grid import meets

if TYPE_CHECKING:
    from ._dataset import Dataset


class Cut:
    """A cut that grows finer. Children that do not meet the box are left out where their parent is replaced."""

    def __init__(self, dataset: Dataset, by: str, box: NDArray[np.float64] | None) -> None:
        table = dataset._table
        if by == "rms":
            self.badness = table["weight"] * table["rms"] ** 2
        elif by == "bound":
            self.badness = table["bound"]
        else:
            raise UsageError(f'a cut is made by "rms" or "bound": found "{by}"')
        self.counts = table["point_count"].astype(np.int64)
        self.first_child = table["first_child"]
        self.shown = np.ones(len(table), np.bool_) if box is None else meets(table["box"], box)
        self.fanout = dataset.fanout
        self.points = 0
        self.open: list[tuple[float, int]] = []  # the worst first; of equals the first
        self.settled: list[int] = []  # leaves, and what the budget had no room to refine
        if self.shown[0]:
            self.add(0)

    def add(self, node: int) -> None:
        self.points += int(self.counts[node])
        heapq.heappush(self.open, (-float(self.badness[node]), node))

    def children(self, node: int) -> list[int]:
        first = int(self.first_child[node])
        return [] if first < 0 else [child for child in range(first, first + self.fanout) if self.shown[child]]

    def refine(self, budget: int) -> None:
        """Refines what there is room for, until no node is left that could be."""
        while self.open:
            _, node = heapq.heappop(self.open)
            children = self.children(node)
            growth = int(self.counts[children].sum()) - int(self.counts[node])
            if self.first_child[node] < 0 or self.points + growth > budget:
                self.settled.append(node)
                continue
            self.points -= int(self.counts[node])
            for child in children:
                self.add(child)
            if growth < 0:  # where a box cuts children off: others may fit now
                self.reopen()

    def reopen(self) -> None:
        self.open += [(-float(self.badness[node]), node) for node in self.settled]
        self.settled.clear()
        heapq.heapify(self.open)


def cut_within(dataset: Dataset, budget: int, by: str, box: NDArray[np.float64] | None) -> list[int]:
    """The nodes of the cut, in ascending order; see `Dataset.budget`."""
    cut = Cut(dataset, by, box)
    if cut.points > budget:
        raise UsageError(f"a budget of {budget:,} points is below those of the root, the least that shows all: "
                         f"{cut.points:,}")
    cut.refine(budget)
    return sorted(cut.settled)
