"""Reading the points of nodes, several side by side: the C++ reader works without the interpreter's lock.

Of a dataset on a server it fetches the next nodes meanwhile.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import UsageError
from ._grid import as_box, holds, inside
from ._points import Points, concatenate

if TYPE_CHECKING:
    from ._dataset import Dataset

Result = TypeVar("Result")


class Wanted(NamedTuple):
    """What to read of a node. The radius is in no schema, but told like the attributes."""

    names: list[str]  # in the order of the columns
    schema: list[int]  # of these names, without the radius
    weight: bool
    representative: bool

    @property
    def radius(self) -> bool:
        return "radius" in self.names


def wanted_of(dataset: Dataset, ids: Sequence[int], attributes: str | Iterable[str] | None, weight: bool,
              representative: bool) -> Wanted:
    """Refuses what some of the nodes do not have."""
    inner = next((id for id in ids if id < dataset._first_leaf), None)
    if attributes is None:
        names = [name for name, attribute in dataset.attributes.items() if inner is None or attribute.on_inner_nodes]
    else:
        names = list(dict.fromkeys([attributes] if isinstance(attributes, str) else attributes))
    for name in names:
        if name not in dataset.attributes:
            raise UsageError(f'no attribute "{name}": the dataset has {", ".join(dataset.attributes)}')
        if inner is not None and not dataset.attributes[name].on_inner_nodes:
            raise UsageError(f'"{name}" is kept in the leaves only, which node {inner} is not')
    if representative and 0 in ids:
        raise UsageError("the root has no representatives")
    order = list(dataset.attributes)
    return Wanted(names, [order.index(name) for name in names if name != "radius"], weight, representative)


def each_node(dataset: Dataset, ids: Sequence[int], wanted: Wanted, take: Callable[[int, Points], Result],
              threads: int | None = 1) -> list[Result]:
    """take(0, points of the first node), take(1, ...), ... in order, at most `threads` at a time.

    The points are the memory that they were decoded into. The first exception, Ctrl-C's too, ends it.
    """
    if threads is None:
        threads = len(os.sched_getaffinity(0))
    if threads < 1:
        raise UsageError(f"{threads} threads cannot read")
    reading = dataset._reader.reading(ids, wanted.schema, wanted.radius, wanted.weight, wanted.representative)

    def task(place: int) -> Result:
        steps, found, radius, weight, representative = reading.node(place)
        columns = dict(zip((name for name in wanted.names if name != "radius"), found))
        if wanted.radius:
            columns["radius"] = radius
        ones = wanted.weight and ids[place] >= dataset._first_leaf
        return take(place, Points(steps, dataset.grid, {name: columns[name] for name in wanted.names},
                                  1 if ones else weight, representative))

    count = min(threads, len(ids))
    with ThreadPoolExecutor(count, thread_name_prefix="cairn") if count > 1 else nullcontext() as pool:
        try:
            return list((pool.map if pool else map)(task, range(len(ids))))
        finally:
            reading.stop()  # or the pool would wait for threads that wait for a server


def empty_points(dataset: Dataset, wanted: Wanted, count: int, leaves: bool) -> Points:
    """Room for points; weights of leaves take none."""
    columns = {}
    for name in wanted.names:
        attribute = dataset.attributes[name]
        columns[name] = np.empty((count, attribute.components) if attribute.components > 1 else count, attribute.dtype)
    weight: NDArray[np.uint64] | int | None = None
    if wanted.weight:
        weight = 1 if leaves else np.empty(count, np.uint64)
    return Points(np.empty((count, 3), np.int32), dataset.grid, columns, weight,
                  np.empty(count, np.uint32) if wanted.representative else None)


def read_whole(dataset: Dataset, ids: Sequence[int], wanted: Wanted, threads: int | None) -> Points:
    """Every point of the nodes. Each is decoded and moved to its place, so that no point is there twice for long."""
    counts = dataset._table["point_count"][np.asarray(ids, np.int64)]
    starts = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).tolist()
    points = empty_points(dataset, wanted, starts[-1], leaves=all(id >= dataset._first_leaf for id in ids))

    def place(i: int, node: Points) -> None:
        here = slice(starts[i], starts[i + 1])
        points.steps[here] = node.steps
        for name, column in node.columns.items():
            points.columns[name][here] = column
        if isinstance(points._weight, np.ndarray):
            points._weight[here] = node._weight
        if wanted.representative:
            points.representative[here] = node.representative

    each_node(dataset, ids, wanted, place, threads)
    return points


def read_inside(dataset: Dataset, ids: Sequence[int], wanted: Wanted, box: NDArray[np.float64],
                threads: int | None) -> Points:
    """The points inside a box. Of each node only these are kept."""
    whole = holds(box, dataset._table["box"][np.asarray(ids, np.int64)])
    leaves = all(id >= dataset._first_leaf for id in ids)

    def choose(i: int, points: Points) -> Points:
        if not leaves and isinstance(points._weight, int):
            points._weight = np.ones(len(points), np.uint64)
        return points if whole[i] else points[inside(box, points.xyz)]

    return concatenate([empty_points(dataset, wanted, 0, leaves), *each_node(dataset, ids, wanted, choose, threads)])


def read_nodes(dataset: Dataset, ids: Sequence[int], attributes: str | Iterable[str] | None, *,
               box: ArrayLike | None = None, weight: bool = True, representative: bool = False,
               threads: int | None = None) -> Points:
    """See `Nodes.read`."""
    wanted = wanted_of(dataset, ids, attributes, weight, representative)
    if box is not None:
        return read_inside(dataset, ids, wanted, as_box(box), threads)
    if len(ids) == 1:
        return each_node(dataset, ids, wanted, lambda _, points: points)[0]
    return read_whole(dataset, ids, wanted, threads)
