"""A sweep on this machine in one call."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ._motorfit import Sweep, SweepProgress

Limits = str | Sequence[str] | Mapping[str, tuple[float, float]]


def folder_of(study: str | os.PathLike[str], out: str | os.PathLike[str] | None) -> pathlib.Path:
    """The folder of a sweep: as given, or the study's name with the ending .sweep beside it."""
    return pathlib.Path(out) if out is not None else pathlib.Path(study).with_suffix(".sweep")


def sweep(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[SweepProgress], object] | None = None,
    limits: Limits | None = None,
) -> dict[str, Any]:
    """Runs a study (TOML) in a folder and merges its results: ``motorfit sweep STUDY --out DIR``.

    ``out`` is a new folder, or one that this study was planned in; without it STUDY.sweep beside the study. What is
    finished is kept at once: after Ctrl-C, a kill or an exception of the callback the same call goes on where it was.

    ``progress`` is called with a :class:`motorfit.SweepProgress` up to ten times a second; its answer ``False`` ends
    the sweep, and what is finished is merged. ``limits`` are those that parameters of a motor must keep, in SI units, as
    ``{"R": (0.8, 1.0)}``. ``threads``: all by default.

    Gives what ``motorfit sweep merge --json`` prints, with the path of results.jsonl as "results"; "missing" and
    "failed" count runs that are not finished and runs without a result, "trust" the results by their level of trust ("good",
    "check", "poor") with the codes of the reasons; each line of results.jsonl has its own. The bytes of results.jsonl are
    the command line's.
    """
    Sweep._check_limits(limits)
    plan = Sweep.plan(study, folder_of(study, out))
    plan.run(threads=threads, progress=progress)
    return plan.merge(limits=limits)
