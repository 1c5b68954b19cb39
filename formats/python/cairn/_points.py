"""Points that were read, as NumPy columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Union, overload

import numpy as np
from numpy.typing import NDArray

from ._errors import UsageError
from ._grid import Grid
from ._lazy import lazy_property

Selector = Union[slice, NDArray[Any], Sequence[int], Sequence[bool]]
"""What selects some of many: a slice, a mask, or indices."""


def describe_column(name: str, dtype: np.dtype[Any], components: int) -> str:
    return f"{name} {dtype}" + (f" x {components}" if components > 1 else "")


class Points:
    """Points of one or several nodes: positions and attributes, a column each.

    The arrays are yours: nobody else sees them, they can be changed, and they live on when the dataset is closed. Those
    of a single node are the memory into which it was decoded, without a copy.

    >>> points = dataset.budget(1_000_000).read(["color"])
    >>> points.xyz.mean(axis=0), points["color"][:10]
    >>> ground = points[points.xyz[:, 2] < 420]        # a mask, a slice or indices select points
    """

    steps: NDArray[np.int32]
    """Positions on the dataset's grid, (n, 3)."""
    grid: Grid
    columns: Mapping[str, NDArray[Any]]
    """All attributes that were read, by name: (n,), or (n, components) of several components."""

    def __init__(self, steps: NDArray[np.int32], grid: Grid, columns: Mapping[str, NDArray[Any]],
                 weight: NDArray[np.uint64] | int | None = None,
                 representative: NDArray[np.uint32] | None = None) -> None:
        self.steps = steps
        self.grid = grid
        self.columns = MappingProxyType(dict(columns))
        self._weight = weight
        self._representative = representative

    @lazy_property
    def xyz(self) -> NDArray[np.float64]:
        """World coordinates, (n, 3). Computed from `steps` when first asked for, then kept."""
        return self.grid.world(self.steps)

    @property
    def weight(self) -> NDArray[np.uint64]:
        """How many input points each stands for, (n,). In leaves 1 each: an array that takes no memory, not writable."""
        if self._weight is None:
            raise UsageError("weights were not read: weight=False was asked for")
        if isinstance(self._weight, int):
            return np.broadcast_to(np.uint64(self._weight), (len(self),))
        return self._weight

    @property
    def representative(self) -> NDArray[np.uint32]:
        """For each point the index, among the points of its node's parent, of the one that stands for it, (n,)."""
        if self._representative is None:
            raise UsageError("representatives were not read: ask for them by representative=True")
        return self._representative

    @property
    def radius(self) -> NDArray[np.float32]:
        """Splat radii in world units, (n,); the same as ``points["radius"]``."""
        return self["radius"]

    @property
    def normal(self) -> NDArray[Any]:
        """Unit normals, (n, 3), zero where there is none; the same as ``points["normal"]``."""
        return self["normal"]

    def __len__(self) -> int:
        return len(self.steps)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    __iter__: None = None  # neither names nor rows: take `columns`, or the rows of to_structured()

    @overload
    def __getitem__(self, key: str) -> NDArray[Any]: ...
    @overload
    def __getitem__(self, key: Selector) -> Points: ...

    def __getitem__(self, key: Any) -> Any:
        """The column of a name; or, for a slice, a mask or indices, these points."""
        if isinstance(key, str):
            if key not in self.columns:
                raise UsageError(f'"{key}" was not read: there are {", ".join(self.columns) or "positions alone"}')
            return self.columns[key]
        if not isinstance(key, slice):
            key = np.asarray(key)
            if key.ndim != 1:
                raise UsageError("points are selected by a slice, a mask or a list of indices")
            if key.size == 0 and key.dtype != np.bool_:
                key = key.astype(np.intp)
        return self._select(key)

    def _select(self, key: slice | NDArray[Any]) -> Points:
        def of(column: Any) -> Any:
            return column[key] if isinstance(column, np.ndarray) else column

        chosen = Points(self.steps[key], self.grid, {name: of(column) for name, column in self.columns.items()},
                        of(self._weight), of(self._representative))
        if "xyz" in self.__dict__:
            chosen.__dict__["xyz"] = self.xyz[key]
        return chosen

    def to_structured(self) -> NDArray[np.void]:
        """A copy as one structured array: float64 ``x``, ``y``, ``z``, then a field for each column.

        An attribute that is itself called x, y or z gets a field with an underscore behind its name.
        """
        fields: list[tuple[Any, ...]] = [(axis, np.float64) for axis in "xyz"]
        taken = {"x", "y", "z"}
        names = {}
        for name, column in self.columns.items():
            field = name
            while field in taken or (field != name and field in self.columns):
                field += "_"
            taken.add(field)
            names[field] = name
            fields.append((field, column.dtype, column.shape[1:]))
        records = np.empty(len(self), dtype=fields)
        for axis, name in enumerate("xyz"):
            records[name] = self.xyz[:, axis]
        for field, name in names.items():
            records[field] = self.columns[name]
        return records

    def __repr__(self) -> str:
        columns = [describe_column(name, column.dtype, int(np.prod(column.shape[1:])))
                   for name, column in self.columns.items()]
        return f"<cairn.Points: {len(self):,} points" + (f" with {', '.join(columns)}" if columns else "") + ">"

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "columns": dict(self.columns)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, columns=MappingProxyType(state["columns"]))


def concatenate(parts: list[Points]) -> Points:
    """All points of some that have the same columns, in their order. Requires at least one."""
    first = parts[0]

    def joined(pick: Any) -> Any:
        columns = [pick(part) for part in parts]
        return np.concatenate(columns) if isinstance(columns[0], np.ndarray) else columns[0]

    return Points(joined(lambda part: part.steps), first.grid,
                  {name: joined(lambda part, name=name: part.columns[name]) for name in first.columns},
                  joined(lambda part: part._weight), joined(lambda part: part._representative))
