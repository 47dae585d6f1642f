"""Exceptions, whose classes correspond to the exit codes of the command line program, and the category of warnings."""

from __future__ import annotations

import errno


class MotorfitError(Exception):
    """Base class of the errors of motorfit: a message and a remedy."""

    def __init__(self, message: str, remedy: str = "") -> None:
        super().__init__(message, remedy)
        #: Description of the error, with its place in a file.
        self.message = message
        #: Advice on how to correct it; may be empty.
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.message}\n{self.remedy}" if self.remedy else self.message


class UsageError(MotorfitError, ValueError):
    """A setting is wrong (exit code 2)."""


class DataError(MotorfitError, ValueError):
    """A file or a signal cannot be read, trusted or written (exit code 3)."""


class MissingFileError(DataError, FileNotFoundError):
    """A file does not exist (exit code 3)."""

    def __init__(self, message: str, remedy: str = "", path: str | None = None) -> None:
        super().__init__(message, remedy)
        self.errno = errno.ENOENT
        #: Path of the file.
        self.filename = path

    def __reduce__(self) -> tuple[type[MissingFileError], tuple[str, str, str | None]]:
        return type(self), (self.message, self.remedy, self.filename)


class NotIdentifiedError(MotorfitError):
    """The recordings do not determine the parameters (exit code 4)."""


class DeviceError(MotorfitError, RuntimeError):
    """The requested device is not available (exit code 5)."""


class MotorfitWarning(UserWarning):
    """A finding about a recording or a result; ``code`` is its stable short name, ``str(warning)`` its text.

    ``warnings.filterwarnings("error", category=motorfit.MotorfitWarning)`` makes each of them an exception.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message, code)
        #: Description, with its place in a recording and a remedy.
        self.message = message
        #: Stable short name, for programs.
        self.code = code

    def __str__(self) -> str:
        return f"[{self.code}] {self.message}"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.args == getattr(other, "args", None)

    def __hash__(self) -> int:
        return hash(self.args)
