"""What goes wrong: each class is a kind of fault, as the exit codes of the command line are."""


class MotorfitError(Exception):
    """A fault with its place and its remedy."""

    def __init__(self, message: str, remedy: str = "") -> None:
        super().__init__(message, remedy)
        #: What happened, and where.
        self.message = message
        #: What to do about it.
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.message}\n{self.remedy}" if self.remedy else self.message


class UsageError(MotorfitError, ValueError):
    """A setting is wrong (exit code 2)."""


class DataError(MotorfitError, ValueError):
    """A file or a signal cannot be read, trusted or written (exit code 3)."""


class NotIdentifiedError(MotorfitError):
    """The data do not determine what was asked for (exit code 4)."""


class DeviceError(MotorfitError, RuntimeError):
    """The device that was asked for is not there (exit code 5)."""
