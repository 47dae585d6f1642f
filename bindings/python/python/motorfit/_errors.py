"""Exceptions. Each class corresponds to an exit code of the command line program."""


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


class NotIdentifiedError(MotorfitError):
    """The recordings do not determine the parameters (exit code 4)."""


class DeviceError(MotorfitError, RuntimeError):
    """The requested device is not available (exit code 5)."""
