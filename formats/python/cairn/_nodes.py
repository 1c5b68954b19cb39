"""Nodes of a dataset: one, and any number of them together."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._points import Points, Selector
from ._read import read_nodes

if TYPE_CHECKING:
    from ._dataset import Dataset


class Node:
    """One node of the tree: what the index says of it, and its points on demand."""

    __slots__ = ("dataset", "id")

    dataset: Dataset
    id: int
    """Number of the node: level by level from the root, which is 0."""

    def __init__(self, dataset: Dataset, id: int) -> None:
        self.dataset = dataset
        self.id = id

    def __getitem__(self, field: str) -> Any:
        """A field of the node's row in the table ``dataset.nodes.table``."""
        return self.dataset._field(field)[self.id]

    @property
    def level(self) -> int:
        """0 is the root, the coarsest; all leaves are on the same level."""
        return int(self["level"])

    @property
    def is_leaf(self) -> bool:
        return int(self["first_child"]) < 0

    @property
    def parent(self) -> Node | None:
        """None of the root."""
        parent = int(self["parent"])
        return None if parent < 0 else Node(self.dataset, parent)

    @property
    def children(self) -> Nodes:
        """As many as the dataset's fan-out; none of a leaf."""
        first = int(self["first_child"])
        return Nodes(self.dataset, range(first, first + self.dataset.fanout) if first >= 0 else [])

    @property
    def box(self) -> NDArray[np.float64]:
        """Tight box of its points and of all below, world units: (2, 3), least corner first, both ends included."""
        return np.array(self["box"])

    @property
    def point_count(self) -> int:
        """Points that it stores."""
        return int(self["point_count"])

    @property
    def weight(self) -> int:
        """Input points that they stand for."""
        return int(self["weight"])

    @property
    def rms(self) -> float:
        """RMS distance of these input points to the points that stand for them here, world units."""
        return float(self["rms"])

    @property
    def bound(self) -> float:
        """No input point is farther than this from the point that stands for it here, world units."""
        return float(self["bound"])

    @property
    def bytes(self) -> int:
        """Bytes of the node in nodes.bin."""
        return int(self["bytes"])

    @property
    def blocks(self) -> tuple[slice, ...]:
        """Where, among its points, those stand that stand for each child. A leaf is one block."""
        starts = self.dataset._reader.block_starts(self.id)
        return tuple(slice(*ends) for ends in zip(starts, starts[1:]))[:1 if self.is_leaf else None]

    def read(self, attributes: str | Iterable[str] | None = None, *, weight: bool = True,
             representative: bool = False) -> Points:
        """Its points. The arrays are the memory that they were decoded into, without a copy; see `Nodes.read`."""
        return read_nodes(self.dataset, [self.id], attributes, weight=weight, representative=representative)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Node) and self.dataset is other.dataset and self.id == other.id

    def __hash__(self) -> int:
        return hash((id(self.dataset), self.id))

    def __repr__(self) -> str:
        kind = "leaf" if self.is_leaf else f"{self.dataset.fanout} children"
        return (f"<cairn.Node {self.id}: level {self.level}, {kind}, {self.point_count:,} points for {self.weight:,}, "
                f"rms {self.rms:.4g}, bound {self.bound:.4g}>")


class Nodes(Sequence[Node]):
    """Some nodes of a dataset, in an order: a level, a cut, those that meet a box.

    ``nodes[i]`` is a `Node`; a slice, a mask or indices give `Nodes`; the name of a field gives its column:

    >>> level = dataset.level(2)
    >>> level["rms"].max(), level.point_count
    >>> worst = level[level["bound"] > 0.5]
    >>> points = worst.read(["color"])
    """

    def __init__(self, dataset: Dataset, ids: ArrayLike) -> None:
        self.dataset = dataset
        self.ids: NDArray[np.int64] = np.asarray(ids, dtype=np.int64)
        """Numbers of the nodes, (n,)."""

    @property
    def table(self) -> NDArray[np.void]:
        """All that the index says of them, a row a node: a copy.

        Fields: ``id``, ``level``, ``parent`` and ``first_child`` (-1: none), ``point_count``, ``weight``, ``box`` (2, 3)
        in world units and ``grid_box`` in steps, ``rms``, ``bound``; ``theta`` and ``grid``: the normal threshold in
        degrees and the cells along the longest axis that merging came to; ``radius_min``, ``radius_max``, ``cover_factor``
        (by it the splats cover what they stand for); ``cone_axis`` (3), ``cone_cosine``: the cone of the normals;
        ``position_bits``; ``offset``, ``bytes``: where nodes.bin has it; ``section_bytes``, a column for each of
        ``dataset.sections``.
        """
        return self.dataset._table[self.ids]

    @property
    def point_count(self) -> int:
        """Points that they store, together."""
        return int(self["point_count"].sum(dtype=np.uint64))

    @property
    def weight(self) -> int:
        """Input points that these stand for, together."""
        return int(self["weight"].sum(dtype=np.uint64))

    @property
    def rms(self) -> float:
        """RMS distance of these input points to the points that stand for them, world units. NaN of no nodes."""
        weight = self["weight"].astype(np.float64)
        return float(np.sqrt((weight * self["rms"] ** 2).sum() / weight.sum())) if len(self) else float("nan")

    @property
    def bound(self) -> float:
        """No input point is farther than this from the point that stands for it, world units. NaN of no nodes."""
        return float(self["bound"].max()) if len(self) else float("nan")

    def read(self, attributes: str | Iterable[str] | None = None, *, box: ArrayLike | None = None, weight: bool = True,
             representative: bool = False, threads: int | None = None) -> Points:
        """The points of all of them, node after node in this order, whatever the number of threads.

        attributes: names from ``dataset.attributes``. None takes all that all of these nodes have (attributes of the rule
            ``none`` are kept in the leaves only).
        box: takes only the points inside, sides included: two corners of three coordinates, or of two: any height.
        weight, representative: whether to read these, see `Points`. A root has no representatives.
        threads: at most so many read side by side; None: as many as there are processors.

        Raises `UsageError` for an attribute that is not there, `InputError` for damaged bytes, `AccessError` where reading
        fails.
        """
        return read_nodes(self.dataset, self.ids.tolist(), attributes, box=box, weight=weight,
                          representative=representative, threads=threads)

    def __len__(self) -> int:
        return len(self.ids)

    @overload
    def __getitem__(self, key: str) -> NDArray[Any]: ...
    @overload
    def __getitem__(self, key: int) -> Node: ...
    @overload
    def __getitem__(self, key: Selector) -> Nodes: ...

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            return self.dataset._field(key)[self.ids]
        if isinstance(key, slice):
            return Nodes(self.dataset, self.ids[key])
        if np.ndim(key) == 0:
            return Node(self.dataset, int(self.ids[operator.index(key)]))
        key = np.asarray(key)
        return Nodes(self.dataset, self.ids[key if key.size else key.astype(np.intp)])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self.table if dtype is None else self.table.astype(dtype)

    def __repr__(self) -> str:
        if not len(self):
            return "<cairn.Nodes: none>"
        levels = self["level"]
        low, high = int(levels.min()), int(levels.max())
        where = f"level {low}" if low == high else f"levels {low} to {high}"
        return (f"<cairn.Nodes: {len(self):,} of {where}, {self.point_count:,} points for {self.weight:,}, "
                f"rms {self.rms:.4g}, bound {self.bound:.4g}>")
