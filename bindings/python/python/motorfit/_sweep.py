"""`sweep`: a study on this machine in one call."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Mapping, Sequence

from ._motorfit import Sweep, SweepProgress
from ._summary import SweepSummary

Limits = str | Sequence[str] | Mapping[str, tuple[float, float]]


def folder_of(study: str | os.PathLike[str], out: str | os.PathLike[str] | None) -> pathlib.Path:
    """Returns the folder of a sweep: ``out``, or by default STUDY.sweep beside the study."""
    return pathlib.Path(out) if out is not None else pathlib.Path(study).with_suffix(".sweep")


def sweep(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[SweepProgress], object] | None = None,
    limits: Limits | None = None,
) -> SweepSummary:
    """Runs a study and merges its results, as ``motorfit sweep STUDY --out DIR`` does.

    Each finished run is stored at once: after Ctrl-C, a kill or an exception in the callback, the same call resumes the
    sweep. The file results.jsonl is identical to that of the command line program.

    Parameters
    ----------
    study : str or PathLike
        Study file (TOML).
    out : str or PathLike, optional
        New folder, or the folder of the same study; by default STUDY.sweep beside the study.
    threads : int, optional
        Number of threads; all by default.
    progress : callable, optional
        Called with a :class:`motorfit.SweepProgress` up to ten times a second. If it returns ``False`` the sweep ends, and
        the finished runs are merged.
    limits : str, sequence or mapping, optional
        Tolerance limits of the parameters in SI units, ``{"R": (0.8, 1.0)}``, by default those of the study;
        motors outside of them are listed.

    Returns
    -------
    SweepSummary
        A dict as ``motorfit sweep merge --json`` prints it, and the path of results.jsonl as "results". "missing" counts
        unfinished runs, "failed" runs without a result, "trust" the results by level of trust ("good", "check", "poor")
        with the codes of the reasons.

    Raises
    ------
    UsageError, DataError, DeviceError
        If the study or an argument is wrong, a file cannot be read or written, or the device is not available.
    """
    Sweep._check_limits(limits)
    plan = Sweep.plan(study, folder_of(study, out))
    plan.run(threads=threads, progress=progress)
    return plan.merge(limits=limits)
