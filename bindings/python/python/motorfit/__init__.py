"""Identification of DC motor parameters from recordings of voltage, current and speed.

>>> import motorfit
>>> record = motorfit.Record.from_file("m2-step.csv")          # doctest: +SKIP
>>> found = motorfit.identify(record)                          # doctest: +SKIP
>>> found.parameters, found.std_errors                         # doctest: +SKIP

All quantities are in SI units: s, V, A, rad/s, N·m; R in ohm, L in H, K in V·s/rad, B in N·m·s/rad, J in kg·m².
"""

from ._errors import (
    DataError,
    DeviceError,
    MissingFileError,
    MotorfitError,
    MotorfitWarning,
    NotIdentifiedError,
    UsageError,
)
from ._motorfit import (
    Comparison,
    ComparisonBlock,
    Evaluator,
    Identification,
    Model,
    Optimizer,
    Progress,
    Record,
    Svg,
    Sweep,
    SweepProgress,
    __version__,
    compare,
    devices,
    identify,
    read,
    refine,
    simulate,
    steiglitz_mcbride,
)
from ._summary import SweepSummary
from ._sweep import sweep

ModelIdentification = Identification
"""Name of `Identification` where it is the result of a model."""

__all__ = [
    "Comparison",
    "ComparisonBlock",
    "DataError",
    "DeviceError",
    "Evaluator",
    "Identification",
    "MissingFileError",
    "Model",
    "ModelIdentification",
    "MotorfitError",
    "MotorfitWarning",
    "NotIdentifiedError",
    "Optimizer",
    "Progress",
    "Record",
    "Svg",
    "Sweep",
    "SweepProgress",
    "SweepSummary",
    "UsageError",
    "__version__",
    "compare",
    "devices",
    "identify",
    "read",
    "refine",
    "simulate",
    "steiglitz_mcbride",
    "sweep",
]
