"""A dataset, open for reading."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._budget import cut_within
from ._errors import UsageError
from ._grid import Grid, as_box, meets
from ._lazy import lazy_property
from ._nodes import Node, Nodes
from ._points import Points, describe_column


Location = Union[str, bytes, "os.PathLike[str]"]
"""A path; where datasets are opened also an address."""


def path_bytes(path: Location) -> bytes:
    """A path as the system has it."""
    text = os.fsencode(path)
    if b"\0" in text:
        raise UsageError(f"a path holds no zero byte: found {os.fsdecode(path)!r}")
    return text


def cache_folder(web_cache: Location | bool) -> tuple[bytes, bool]:
    """Where fetched bytes are kept (empty: nowhere), and whether it is an error if they cannot be."""
    if isinstance(web_cache, bool):
        return _core.default_cache_folder() if web_cache else b"", False
    return path_bytes(web_cache), True


@dataclass(frozen=True)
class Attribute:
    """What every point has beside its position."""

    name: str
    dtype: np.dtype[Any]
    components: int
    rule: str
    """How the value of a coarser point follows from those it stands for: ``mean``, ``normal``, ``majority``,
    ``cover_radius``, or ``none``: only leaves have it."""
    estimated: bool
    """By the build: no scan brings it."""

    @property
    def on_inner_nodes(self) -> bool:
        return self.rule != "none"

    def __str__(self) -> str:
        return describe_column(self.name, self.dtype, self.components)


class Dataset:
    """An open dataset: the index in memory, points on demand. Made by `cairn.open`.

    Any number of threads may read at a time. It can be used in a ``with`` statement, be sent to other processes, which
    open it again, and be inherited by fork. Points that were read live on when it is closed.
    """

    source: str
    """The folder or address that it was opened from."""
    point_count: int
    """Points of the scans that it holds: those of all leaves together."""
    fanout: int
    """Children of an inner node."""
    node_points: int
    """Points of every inner node and of the largest leaf."""
    target_points: int
    """Points a node that were asked for."""
    level_count: int
    """Levels, the root's and the leaves' included."""
    node_count: int
    grid: Grid
    """The grid that positions lie on."""
    lossless: bool
    """Leaves hold the positions, normals and radii of the input exactly."""
    replaces: bool
    """Children stand for all that their parent stands for, and are drawn in its place (and not in addition to it)."""
    attributes: Mapping[str, Attribute]
    """By name, the splat radius last."""
    sections: tuple[str, ...]
    """What nodes are stored as: the columns of the field ``section_bytes``."""

    def __init__(self, location: Location, web_cache: Location | bool = True, web_cache_bytes: int = 1 << 30) -> None:
        self.source = os.fsdecode(location)
        self._web_cache = web_cache, web_cache_bytes
        self._reader = _core.Reader(path_bytes(location), *cache_folder(web_cache), web_cache_bytes)
        told = self._reader.describe()
        schema = [Attribute(*fields) for fields in told["schema"]]
        radius = Attribute("radius", np.dtype(np.float32), 1, "cover_radius", told["radius_estimated"])
        self.attributes = MappingProxyType({attribute.name: attribute for attribute in [*schema, radius]})
        self.sections = ("position", "representative", "weight", "radius", *(attribute.name for attribute in schema))
        grid: Any = tuple(map(tuple, told["grid"]))
        self.grid = Grid(*grid)
        self.lossless = told["lossless_leaves"]
        for name in ("point_count", "fanout", "node_points", "target_points", "level_count", "node_count", "replaces"):
            setattr(self, name, told[name])
        self._first_leaf = (self.node_count - 1) // self.fanout  # as many inner nodes as there are families

    # --- What it is -----------------------------------------------------------------------------

    @lazy_property
    def metadata(self) -> dict[str, Any]:
        """metadata.json, parsed: sources, levels, parameters of the build and more. What it says is not checked."""
        parsed: dict[str, Any] = json.loads(self._reader.metadata())
        return parsed

    @property
    def crs(self) -> str | None:
        """The coordinate reference system as WKT, if the scans or the build told one."""
        crs = self.metadata.get("crs")
        wkt = crs.get("wkt") if isinstance(crs, dict) else None
        return wkt if isinstance(wkt, str) else None

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Tight box of all points, world units: (2, 3), least corner first."""
        return self.root.box

    @lazy_property
    def _table(self) -> NDArray[np.void]:
        """A row a node; see `Nodes.table`."""
        columns = self._reader.node_columns()
        table = np.empty(self.node_count, [(name, column.dtype, column.shape[1:]) for name, column in columns.items()])
        for name, column in columns.items():
            table[name] = column
        table.flags.writeable = False
        return table

    def _field(self, name: str) -> NDArray[Any]:
        names = self._table.dtype.names or ()
        if name not in names:
            raise UsageError(f'no field "{name}" in the table of nodes: it has {", ".join(names)}')
        return self._table[name]

    # --- Nodes ----------------------------------------------------------------------------------

    @lazy_property
    def nodes(self) -> Nodes:
        """All nodes, coarse to fine."""
        return Nodes(self, np.arange(self.node_count))

    @property
    def root(self) -> Node:
        return Node(self, 0)

    def node(self, id: int) -> Node:
        """The node of this number."""
        number = operator.index(id)
        if not 0 <= number < self.node_count:
            raise UsageError(f"no node {number}: the dataset has 0 to {self.node_count - 1}")
        return Node(self, number)

    def level(self, level: int) -> Nodes:
        """All nodes of a level: 0 is the root's, -1 that of the leaves. Each level shows the whole dataset."""
        number = operator.index(level)
        if not -self.level_count <= number < self.level_count:
            raise UsageError(f"no level {number}: the dataset has 0 to {self.level_count - 1}")
        return Nodes(self, np.flatnonzero(self._table["level"] == number % self.level_count))

    def in_box(self, box: ArrayLike, level: int = -1) -> Nodes:
        """The nodes of a level (-1: the leaves) that meet a box: two corners of three coordinates, or of two: any height.

        They hold all points of the level that lie in the box, and others; see `read_box`.
        """
        nodes = self.level(level)
        return nodes[meets(nodes["box"], as_box(box))]

    def budget(self, points: int, *, by: str = "rms", box: ArrayLike | None = None) -> Nodes:
        """Nodes that show the whole dataset with at most so many points, in ascending order.

        They are a cut through the tree: every leaf is among them or lies below exactly one of them. From the root on, the
        worst node is replaced by all of its children while the budget has room for them, so that none of the cut could be
        refined within it: unless it is all leaves, less than ``(fanout - 1) * node_points`` points stay unused. That is
        greedy, there may be a better cut. ``cairn export --budget`` makes another one, block by block. The worst is

        by="rms": the one that adds most to the RMS error: the greatest sum of squared distances between input points and
            the points that stand for them;
        by="bound": the one with the greatest bound, so that the largest possible error is small.

        With a box only nodes that meet it are taken, and the budget is spent on them.

        Raises `UsageError` for a budget below the points of the root.
        """
        if not self.replaces:
            raise UsageError("a cut needs nodes that replace their parents; those of this dataset add to them")
        return Nodes(self, cut_within(self, operator.index(points), by, None if box is None else as_box(box)))

    def read_box(self, box: ArrayLike, level: int = -1, attributes: str | Iterable[str] | None = None, *,
                 weight: bool = True, representative: bool = False, threads: int | None = None) -> Points:
        """The points of a level (-1: all input points) in a box, sides included; see `Nodes.read`."""
        return self.in_box(box, level).read(attributes, box=box, weight=weight, representative=representative,
                                            threads=threads)

    # --- Open and closed ------------------------------------------------------------------------

    @property
    def closed(self) -> bool:
        return self._reader.closed

    def close(self) -> None:
        """Closes its files once nobody reads any more. Whatever would have to be read then raises `UsageError`."""
        self._reader.close()

    def __enter__(self) -> Dataset:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        return Dataset, (self.source, *self._web_cache)

    def __repr__(self) -> str:
        if self.closed:
            return f"<cairn.Dataset {self.source!r}, closed>"
        low, high = self.bounds
        lines = [f"<cairn.Dataset {self.source!r}",
                 f"  {self.point_count:,} points, fan-out {self.fanout}, {self.level_count} levels, "
                 f"{self.node_count:,} nodes of up to {self.node_points:,} points"]
        lines += [f"  {axis}  {a:.10g} to {b:.10g}" for axis, a, b in zip("xyz", low, high)]
        lines.append(f"  attributes  {', '.join(map(str, self.attributes.values()))}")
        if self.crs is not None:
            lines.append(f"  crs  {self.crs if len(self.crs) <= 80 else self.crs[:77] + '...'}")
        return "\n".join(lines) + ">"
