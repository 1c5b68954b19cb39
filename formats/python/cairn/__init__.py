"""Cairn's datasets in Python: laser scans of any size as NumPy arrays, at any level of detail.

    import cairn

    site = cairn.open("site.cairn")
    site                                            # what it holds
    points = site.budget(1_000_000).read(["color"]) # the whole site in at most a million points
    points.xyz, points["color"]                     # float64 (n, 3), uint16 (n, 3)

A dataset is a tree of nodes. Every level of it shows all of the scans, coarser towards the root (level 0); the leaves hold
the input points themselves. A point of a coarser node stands for `weight` input points, and each node tells how far these
are from their representatives: `rms`, and a `bound` that none exceeds.

==============================================  =======================================================
``site.nodes``                                  all nodes; ``site.nodes.table`` is one structured array
``site.level(2)``                               the nodes of a level, -1: the leaves
``site.in_box(box)``                            the leaves, or the nodes of a level, that meet a box
``site.budget(n)``                              a cut of at most n points, finest where the error is large
``nodes["rms"]``, ``nodes.rms``                 a column of their table; the error of all together
``nodes.read(attributes)``                      their `Points`, read by several threads
``site.read_box(box)``                          the points inside a box
``site.node(5)``, ``nodes[0]``                  one `Node`: `parent`, `children`, `box`, `rms`, `read()`
``site.attributes``, ``.grid``, ``.crs``        what all nodes share
``site.metadata``                               where the points come from
==============================================  =======================================================

What fails raises a subclass of `cairn.Error`: `UsageError` (a ValueError), `InputError` (a damaged dataset) or
`AccessError` (an OSError). Its text is one line that says what, where, found and expected.
"""

from __future__ import annotations

from ._core import version as __version__
from ._dataset import Attribute, Dataset, Location
from ._errors import AccessError, Error, InputError, InvariantError, UsageError
from ._grid import Grid
from ._nodes import Node, Nodes
from ._points import Points

__all__ = ["AccessError", "Attribute", "Dataset", "Error", "Grid", "InputError", "InvariantError", "Node", "Nodes",
           "Points", "UsageError", "open"]


def open(location: Location, *, web_cache: Location | bool = True, web_cache_bytes: int = 1 << 30) -> Dataset:
    """Opens the dataset in a folder, or on a server: at an address http(s)://HOST/NAME.cairn.

    The index is read and checked as a whole; of nodes only what is asked for, each section against its checksum. While
    several nodes of a dataset on a server are read the next ones are fetched; Ctrl-C ends waiting for a server, and the
    dataset can be read again.

    >>> with cairn.open("site.cairn") as site:
    ...     overview = site.level(0).read()

    web_cache: where what is fetched from a server is kept for later: a folder, True for that of the program ``cairn``
        (``cairn`` in ``$XDG_CACHE_HOME`` or ``~/.cache``), False for nowhere.
    web_cache_bytes: of that folder, at most.

    Raises `AccessError` where files cannot be opened or read or a server does not give them, `InputError` where they are
    damaged.
    """
    return Dataset(location, web_cache, web_cache_bytes)
