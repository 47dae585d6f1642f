"""The summary of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class SweepSummary(dict[str, Any]):
    """Summary of a sweep: a dict as ``motorfit sweep merge --json`` prints it, which notebooks show as tables and a figure.

    ``summary()`` returns the tables as text. It can be pickled.
    """

    def __init__(self, document: Mapping[str, Any], text: str, html: str) -> None:
        super().__init__(document)
        self._text = text
        self._html = html

    def summary(self) -> str:
        """Returns the answer, the warnings and the tables of the sweep as text."""
        return self._text

    def _repr_html_(self) -> str:
        return self._html

    def __reduce__(self) -> tuple[type[SweepSummary], tuple[dict[str, Any], str, str]]:
        return type(self), (dict(self), self._text, self._html)
