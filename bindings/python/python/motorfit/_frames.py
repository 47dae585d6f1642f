"""Frames of results: pandas or polars, which are optional."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

LIBRARIES = ("pandas", "polars")


def frame(columns: Mapping[str, Any], library: str | None = None) -> Any:
    """Returns a frame of columns, of the given library or of the first that is installed."""
    if library is not None and library not in LIBRARIES:
        raise ValueError(f"library is {library!r}; give one of {', '.join(map(repr, LIBRARIES))}")
    wanted = LIBRARIES if library is None else (library,)
    for name in wanted:
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        return module.DataFrame(dict(columns))
    names = " or ".join(wanted)
    raise ImportError(f"a frame needs {names}: pip install {wanted[0]}; to_columns() needs neither")
