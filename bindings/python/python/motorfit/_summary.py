"""The summary of a sweep."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ._frames import frame

WORDS = ("motor", "outside", "trust", "error")


class SweepSummary(dict[str, Any]):
    """Summary of a sweep: a dict as ``motorfit sweep merge --json`` prints it, which notebooks show as tables and a figure.

    ``summary()`` returns the tables as text, ``to_frame()`` a row for each motor. It can be pickled.
    """

    def __init__(self, document: Mapping[str, Any], text: str, html: str, motors: str) -> None:
        super().__init__(document)
        self._text = text
        self._html = html
        self._motors = motors

    def summary(self) -> str:
        """Returns the answer, the warnings and the tables of the sweep as text."""
        return self._text

    def to_columns(self) -> dict[str, Any]:
        """Returns columns of equal length with a row for each motor, as ``motorfit sweep merge --csv`` writes them.

        "motor", parameters in SI units with "_std_error", "_ci95_low" and "_ci95_high", the parameters "outside" the limits, fit, cost,
        "trust" and "error" of a motor without a result. Numbers are arrays, nan where there is none, and words are lists.
        """
        reader = csv.DictReader(io.StringIO(self._motors))
        heads, rows = list(reader.fieldnames or ()), list(reader)
        numbers = {head: np.array([float(row[head] or "nan") for row in rows]) for head in heads if head not in WORDS}
        return {head: numbers.get(head, [row[head] for row in rows]) for head in heads}

    def to_frame(self, library: Literal["pandas", "polars"] | None = None) -> Any:
        """Returns the motors as a pandas or polars frame, with the columns of ``to_columns``."""
        return frame(self.to_columns(), library)

    def _repr_html_(self) -> str:
        return self._html

    def __reduce__(self) -> tuple[type[SweepSummary], tuple[dict[str, Any], str, str, str]]:
        return type(self), (dict(self), self._text, self._html, self._motors)
