"""The reader, in C++ (formats/python/module.cpp). Use the package."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

version: str

class Reader:
    def __init__(self, location: bytes, cache_folder: bytes, must_cache: bool, cache_bytes: int) -> None: ...
    @property
    def closed(self) -> bool: ...
    def close(self) -> None: ...
    def describe(self) -> dict[str, Any]: ...
    def metadata(self) -> bytes: ...
    def node_columns(self) -> dict[str, NDArray[Any]]: ...
    def block_starts(self, id: int) -> list[int]: ...
    def reading(
        self, ids: Sequence[int], attributes: list[int], radius: bool, weight: bool, representative: bool
    ) -> Reading: ...

class Reading:
    def node(
        self, place: int
    ) -> tuple[
        NDArray[np.int32],
        list[NDArray[Any]],
        NDArray[np.float32],
        NDArray[np.uint64] | None,
        NDArray[np.uint32] | None,
    ]: ...
    def stop(self) -> None: ...

def default_cache_folder() -> bytes: ...
def to_world(
    steps: NDArray[np.int32],
    step: tuple[float, float, float],
    offset: tuple[float, float, float],
    shift: tuple[int, int, int],
) -> NDArray[np.float64]: ...
