"""What goes wrong, as exceptions. ``str(error)`` is the one line that the program ``cairn`` tells."""

from __future__ import annotations


class Error(Exception):
    """Whatever Cairn refuses or cannot do: the base of all exceptions of this package.

    ``path``, ``offset`` (a byte in that file), ``found`` and ``expected`` repeat parts of the message; each is None
    where it has no meaning.
    """

    path: str | None = None
    offset: int | None = None
    found: str | None = None
    expected: str | None = None


class UsageError(Error, ValueError):
    """An argument that has no meaning here: an unknown attribute, a node that is not there, too small a budget."""


class InputError(Error):
    """Bytes that are no dataset, or a damaged one."""


class AccessError(Error, OSError):
    """What the system or a server does not give: a missing file, no permission, a failing disk.

    ``errno`` is that of the call that failed (0 if there is none), ``filename`` is ``path``.
    """

    def __str__(self) -> str:
        return str(self.strerror)


class InvariantError(Error):
    """A promise that does not hold: an error in Cairn itself."""


_TYPES: dict[int, type[Error]] = {2: UsageError, 3: InputError, 4: AccessError, 5: InvariantError}


def exception_of(kind: int, message: str, path: str | None, offset: int | None, found: str | None,
                 expected: str | None, number: int) -> Error:
    """The exception for an error of the reader; `kind` is the exit code that the program would have."""
    error = AccessError(number, message) if kind == 4 else _TYPES.get(kind, InvariantError)(message)
    if isinstance(error, AccessError) and path is not None:
        error.filename = path
    error.path, error.offset, error.found, error.expected = path, offset, found, expected
    return error
