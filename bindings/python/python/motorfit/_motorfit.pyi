"""Types of the compiled part of the package. Returned arrays are float64 in C order; all quantities are in SI units."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Protocol, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import MotorfitWarning
from ._summary import SweepSummary

__version__: str

_Floats = NDArray[np.float64]
_Library = Literal["pandas", "polars"]
_Items = str | Sequence[str]
_Named = _Items | Mapping[str, str]
_Numbers = _Items | Mapping[str, float]
_Bounds = _Items | Mapping[str, Sequence[float] | _Floats]
_Settings = _Items | Mapping[str, float | str]
_Criterion = Literal["euclidean", "ise", "iae", "itse", "itae", "mse", "nrmse"]
_Scale = Literal["none", "peak", "std", "noise"]
_Discretization = Literal["zoh", "foh", "rk4", "euler"]
_Initial = Literal["auto", "zero", "measured", "free"]
_Precision = Literal["auto", "f32", "f64"]
_Evaluator = Literal["auto", "kernel", "tables"]
_Polish = Literal["lm", "none"]
_BadRows = Literal["error", "skip"]
_Gaps = Literal["error", "keep", "split"]
_Method = Literal["auto", "sm", "gwo", "jaya", "ga", "pso", "de", "lshade", "cmaes", "abc", "cuckoo", "multistart", "random"]
_Search = Literal["gwo", "jaya", "ga", "pso", "de", "lshade", "cmaes", "abc", "cuckoo", "random"]

class _Readable(Protocol):
    """Open file of text or bytes."""

    def read(self) -> str | bytes: ...

class _Frame(Protocol):
    """Frame of pandas, polars or a library like them."""

    @property
    def columns(self) -> Any: ...
    def __getitem__(self, label: Any, /) -> Any: ...

_File = str | PathLike[str] | _Readable
_Columns = _Frame | Mapping[str, ArrayLike] | NDArray[np.void]
_Source = Record | _File | _Columns
_Records = _Source | Sequence[_Source]

@final
class Record:
    """Validated recording of one motor: time [s], voltage [V], current [A], speed [rad/s], load torque [N·m]."""

    def __new__(
        cls,
        time: ArrayLike,
        *,
        voltage: ArrayLike | None = None,
        current: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        load_torque: ArrayLike | None = None,
    ) -> Record: ...
    @staticmethod
    def from_file(
        path: _File,
        *,
        # Settings: reading.
        columns: _Named | None = None,
        rate: float | None = None,
        sheet: str | None = None,
        bad_rows: _BadRows = "error",
        gaps: _Gaps = "error",
        drop_repeats: bool = False,
        crop: str | None = None,
        offset: str | None = None,
        mask: _Items | None = None,
        decimate: int | None = None,
        filter: str | None = None,
        discretization: _Discretization | None = None,
    ) -> Record: ...
    @staticmethod
    def from_columns(
        frame: _Columns,
        *,
        # Settings: reading.
        columns: _Named | None = None,
        rate: float | None = None,
        sheet: str | None = None,
        bad_rows: _BadRows = "error",
        gaps: _Gaps = "error",
        drop_repeats: bool = False,
        crop: str | None = None,
        offset: str | None = None,
        mask: _Items | None = None,
        decimate: int | None = None,
        filter: str | None = None,
        discretization: _Discretization | None = None,
    ) -> Record: ...
    @property
    def time(self) -> _Floats: ...
    @property
    def voltage(self) -> _Floats | None: ...
    @property
    def current(self) -> _Floats | None: ...
    @property
    def speed(self) -> _Floats | None: ...
    @property
    def load_torque(self) -> _Floats | None: ...
    @property
    def period(self) -> float: ...
    @property
    def path(self) -> PathLike[str] | None: ...
    @property
    def sha256(self) -> str | None: ...
    @property
    def notes(self) -> list[str]: ...
    def split(self, fraction: float) -> tuple[Record, Record]: ...
    def to_columns(self) -> dict[str, _Floats]: ...
    def to_frame(self, library: _Library | None = None) -> Any: ...
    def to_csv(self) -> str: ...
    def findings(self) -> list[MotorfitWarning]: ...
    def plot(self) -> Svg: ...
    def _repr_html_(self) -> str: ...
    def __getitem__(self, samples: slice, /) -> Record: ...
    def __len__(self) -> int: ...
    def __copy__(self) -> Record: ...
    def __deepcopy__(self, _memo: object, /) -> Record: ...

@final
class Svg:
    """Figure as SVG: str(figure) is the SVG text; notebooks display it. It can be pickled."""

    @property
    def caption(self) -> str: ...
    def save(self, path: str | PathLike[str]) -> None: ...
    def _repr_svg_(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def __copy__(self) -> Svg: ...
    def __deepcopy__(self, _memo: object, /) -> Svg: ...

@final
class Progress:
    """Progress of a population search."""

    @property
    def generation(self) -> int: ...
    @property
    def generations(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def cost(self) -> float: ...

@final
class Identification:
    """Result of an identification, in SI units. It can be pickled."""

    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def std_errors(self) -> dict[str, float]: ...
    @property
    def ci95(self) -> dict[str, tuple[float, float]]: ...
    @property
    def units(self) -> dict[str, str]: ...
    @property
    def free(self) -> list[str]: ...
    @property
    def correlation(self) -> _Floats | None: ...
    @property
    def covariance(self) -> _Floats | None: ...
    @property
    def unidentifiable(self) -> list[str]: ...
    @property
    def combinations(self) -> dict[str, tuple[float, float, float, float]]: ...
    @property
    def history(self) -> _Floats: ...
    @property
    def cost(self) -> float: ...
    @property
    def fit_percent(self) -> dict[str, float]: ...
    @property
    def trust(self) -> Literal["good", "check", "poor"]: ...
    @property
    def warnings(self) -> list[MotorfitWarning]: ...
    @property
    def remarks(self) -> list[MotorfitWarning]: ...
    @property
    def model(self) -> Model | None: ...
    @property
    def exports(self) -> dict[str, str]: ...
    @property
    def records(self) -> list[Record]: ...
    @property
    def trust_of(self) -> list[str]: ...
    @property
    def trust_reasons(self) -> list[MotorfitWarning]: ...
    @property
    def next_step(self) -> str | None: ...
    @property
    def version(self) -> str: ...
    @property
    def method(self) -> str: ...
    @property
    def polish(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def population(self) -> int: ...
    @property
    def generations(self) -> int: ...
    @property
    def criterion(self) -> _Criterion: ...
    @property
    def scale(self) -> _Scale: ...
    @property
    def integration(self) -> dict[str, Any] | None: ...
    @property
    def input(self) -> Literal["voltage", "current"] | None: ...
    @property
    def discretization(self) -> _Discretization: ...
    @property
    def initial(self) -> _Initial: ...
    @property
    def left_out(self) -> list[dict[str, Any]]: ...
    @property
    def bounds(self) -> dict[str, list[float]]: ...
    @property
    def device(self) -> dict[str, str]: ...
    @property
    def extensions(self) -> list[str]: ...
    @property
    def model_selection(self) -> list[dict[str, Any]] | None: ...
    @property
    def alternatives(self) -> list[Any]: ...
    @property
    def searched(self) -> dict[str, Any]: ...
    @property
    def fit_percent_by_recording(self) -> list[dict[str, float | None]]: ...
    @property
    def residual_sigma(self) -> dict[str, float | None]: ...
    @property
    def initial_state(self) -> list[dict[str, float | None]]: ...
    @property
    def rank(self) -> int | None: ...
    @property
    def condition(self) -> float | None: ...
    @property
    def errors_widened_by(self) -> float | None: ...
    @property
    def residual_tests(self) -> dict[str, Any] | None: ...
    @property
    def characteristics(self) -> dict[str, Any] | None: ...
    @property
    def noise_floor(self) -> dict[str, Any] | None: ...
    @property
    def verification(self) -> dict[str, Any]: ...
    @property
    def validation(self) -> dict[str, Any] | None: ...
    @property
    def stop(self) -> str: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    def modelled(self) -> list[dict[str, _Floats]]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def to_columns(self) -> dict[str, Any]: ...
    def to_frame(self, library: _Library | None = None) -> Any: ...
    def summary(self) -> str: ...
    def plot_response(self, recording: int = 0) -> Svg: ...
    def plot_correlation(self) -> Svg | None: ...
    def plot_history(self) -> Svg | None: ...
    def _repr_html_(self) -> str: ...
    def __copy__(self) -> Identification: ...
    def __deepcopy__(self, _memo: object, /) -> Identification: ...

@final
class Model:
    """Differential equations of a machine, from a text in TOML, a file, the name of a built-in model, or nested mappings."""

    def __new__(cls, source: str | PathLike[str] | Mapping[str, Any]) -> Model: ...
    @staticmethod
    def built_in() -> list[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def text(self) -> str: ...
    @property
    def parameters(self) -> list[str]: ...
    @property
    def bounds(self) -> dict[str, tuple[float, float]]: ...
    @property
    def units(self) -> dict[str, str]: ...
    @property
    def inputs(self) -> list[str]: ...
    @property
    def states(self) -> list[str]: ...
    @property
    def outputs(self) -> list[str]: ...
    def read(
        self,
        source: _File | _Columns,
        *,
        # Settings: reading.
        columns: _Named | None = None,
        rate: float | None = None,
        sheet: str | None = None,
        bad_rows: _BadRows = "error",
        gaps: _Gaps = "error",
        drop_repeats: bool = False,
        crop: str | None = None,
        offset: str | None = None,
        mask: _Items | None = None,
        decimate: int | None = None,
        filter: str | None = None,
        discretization: _Discretization | None = None,
    ) -> list[Record]:
        """Reads recordings with the signals of the model."""
    def simulate(
        self,
        parameters: Mapping[str, float],
        inputs: Mapping[str, ArrayLike],
        *,
        time: ArrayLike,
        initial: Mapping[str, float] | None = None,
    ) -> dict[str, _Floats]:
        """Returns the outputs, arrays of shape (n,), with inputs that are constant between the samples."""
    def identify(
        self,
        records: _Records,
        *,
        validate: _Records | None = None,
        progress: Callable[[Progress], object] | None = None,
        start: _Numbers | Sequence[str | Mapping[str, float]] | None = None,
        # Settings: search.
        method: _Method = "auto",
        polish: _Polish = "lm",
        population: int = 100,
        generations: int = 100,
        seed: int = 1,
        set: _Settings | None = None,
        # Settings: problem.
        bounds: _Bounds = "auto",
        fix: _Numbers | None = None,
        criterion: _Criterion = "nrmse",
        scale: _Scale = "std",
        noise: _Numbers | None = None,
        time_origin: float | None = None,
        with_: _Items | None = None,
        per_recording: _Items | None = None,
        discretization: _Discretization | None = None,
        initial: _Initial = "auto",
        device: str = "auto",
        precision: _Precision = "auto",
        evaluator: _Evaluator = "auto",
        threads: int | None = None,
    ) -> Identification:
        """Identifies the parameters of the machine from a recording, or from several recordings by a joint fit."""
    def compare(
        self,
        records: _Records,
        *,
        progress: Callable[[Progress], object] | None = None,
        methods: _Items = "gwo,jaya,ga",
        runs: int = 50,
        criteria: _Items = "nrmse:std",
        population: int | Sequence[int] = 100,
        generations: int | Sequence[int] = 100,
        set: _Settings | None = None,
        transform: _Items | None = None,
        seed: int = 1,
        target: float | None = None,
        bounds: _Bounds | None = None,
        fix: _Numbers | None = None,
        discretization: _Discretization | None = None,
        device: str = "auto",
        precision: _Precision = "auto",
        threads: int | None = None,
    ) -> Comparison:
        """Compares searches on recordings of the machine under equal budgets."""
    def wgsl(self, precision: Literal["f32", "f64"] = "f64") -> str:
        """Returns the WGSL compute shader of the model."""
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Evaluator:
    """Evaluates the cost of candidates on a recording, or on several recordings jointly."""

    def __new__(
        cls,
        records: _Records,
        *,
        model: Model | None = None,
        population: int = 100_000,
        # Settings: problem.
        bounds: _Bounds = "auto",
        fix: _Numbers | None = None,
        criterion: _Criterion = "nrmse",
        scale: _Scale = "std",
        noise: _Numbers | None = None,
        time_origin: float | None = None,
        with_: _Items | None = None,
        per_recording: _Items | None = None,
        discretization: _Discretization | None = None,
        initial: _Initial = "auto",
        device: str = "auto",
        precision: _Precision = "auto",
        evaluator: _Evaluator = "auto",
        threads: int | None = None,
    ) -> Evaluator: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def bounds(self) -> list[tuple[float, float]]: ...
    @property
    def device(self) -> tuple[str, str, str]: ...
    @property
    def evaluator(self) -> str: ...
    def __call__(self, candidates: Any) -> _Floats:
        """Returns the costs, shape (n,), of candidates of shape (n, p) or a frame with the columns names; inf if diverged."""

@final
class Optimizer:
    """Population search in a box with an ask/tell interface."""

    def __new__(
        cls,
        method: _Search,
        bounds: ArrayLike,
        *,
        population: int = 100,
        generations: int = 100,
        seed: int = 1,
        run: int = 0,
        set: _Settings | None = None,
    ) -> Optimizer: ...
    @property
    def method(self) -> str: ...
    def ask(self) -> _Floats:
        """Returns the candidates to evaluate next, shape (n, p); the same ones until tell."""
    def tell(self, costs: ArrayLike) -> None:
        """Takes the costs of the candidates of the last ask, shape (n,)."""
    def best(self) -> tuple[_Floats, float] | None:
        """Returns the best candidate, shape (p,), and its cost; None before the first finite cost."""

@final
class Comparison:
    """Result of a comparison of methods, with one block for each setting. It can be pickled."""

    @property
    def blocks(self) -> list[ComparisonBlock]: ...
    @property
    def expected(self) -> dict[str, float] | None: ...
    @property
    def steiglitz_mcbride(self) -> dict[str, float] | None: ...
    @property
    def device(self) -> tuple[str, str, str]: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def interrupted(self) -> bool: ...
    @property
    def warnings(self) -> list[MotorfitWarning]: ...
    @property
    def remarks(self) -> list[MotorfitWarning]: ...
    @property
    def version(self) -> str: ...
    @property
    def records(self) -> list[dict[str, Any]]: ...
    @property
    def truth(self) -> dict[str, float] | None: ...
    @property
    def paper(self) -> Any: ...
    @property
    def discretization(self) -> _Discretization: ...
    @property
    def fixed(self) -> dict[str, float]: ...
    @property
    def target(self) -> float | None: ...
    @property
    def noise_db(self) -> float | None: ...
    @property
    def runs(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def bounds(self) -> dict[str, list[float]]: ...
    @property
    def invariance(self) -> list[dict[str, Any]]: ...
    @property
    def refined(self) -> dict[str, float] | None: ...
    @property
    def refined_trust(self) -> dict[str, Any] | None: ...
    @property
    def refined_failure(self) -> str | None: ...
    @property
    def stop(self) -> str: ...
    def to_dict(self) -> dict[str, Any]: ...
    def to_json(self) -> str: ...
    def to_columns(self) -> dict[str, Any]: ...
    def to_frame(self, library: _Library | None = None) -> Any: ...
    def summary(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def __copy__(self) -> Comparison: ...
    def __deepcopy__(self, _memo: object, /) -> Comparison: ...

@final
class ComparisonBlock:
    """Runs of all methods under one setting; mappings have the names of the methods as keys. It can be pickled."""

    @property
    def setting(self) -> str: ...
    @property
    def methods(self) -> list[str]: ...
    @property
    def ranking(self) -> list[str]:
        """Names of the methods, by increasing median of the final cost."""
    @property
    def costs(self) -> dict[str, _Floats]:
        """Final cost of each run, shape (runs,); inf if every candidate diverged."""
    @property
    def parameters(self) -> dict[str, _Floats]:
        """Estimates of each run, shape (runs, 5): R in ohm, L in H, K in V·s/rad, B in N·m·s/rad, J in kg·m²."""
    @property
    def histories(self) -> dict[str, _Floats]:
        """Lowest cost after each generation of each run, shape (runs, generations); nan after an early end."""
    @property
    def evaluations(self) -> dict[str, NDArray[np.uint64]]: ...
    @property
    def seconds(self) -> dict[str, float | None]: ...
    def plot_convergence(self) -> Svg: ...
    def plot_errors(self) -> Svg | None: ...
    def plot_distributions(self) -> Svg: ...
    def plot_waterfall(self) -> Svg: ...
    def __copy__(self) -> ComparisonBlock: ...
    def __deepcopy__(self, _memo: object, /) -> ComparisonBlock: ...

@final
class SweepProgress:
    """Progress of a shard of a sweep."""

    @property
    def done(self) -> int: ...
    @property
    def total(self) -> int: ...
    @property
    def before(self) -> int: ...
    @property
    def failed(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def rate(self) -> float | None: ...
    @property
    def remaining(self) -> float | None: ...

@final
class Sweep:
    """Planned sweep: a folder with the manifest of a study, results files of its shards, and their merge."""

    @staticmethod
    def plan(study: str | PathLike[str], out: str | PathLike[str]) -> Sweep: ...
    @staticmethod
    def open(folder: str | PathLike[str]) -> Sweep: ...
    @property
    def name(self) -> str: ...
    @property
    def runs(self) -> int: ...
    @property
    def motors(self) -> list[str]: ...
    @property
    def folder(self) -> Path: ...
    @property
    def origin(self) -> Path: ...
    @property
    def digest(self) -> str: ...
    def run(
        self,
        *,
        shard: tuple[int, int] = (1, 1),
        threads: int | None = None,
        progress: Callable[[SweepProgress], object] | None = None,
        recordings: str | PathLike[str] | None = None,
    ) -> dict[str, Any]:
        """Runs the unfinished runs of shard (I, N), I from 1 to N; each finished run is stored at once. Times in s."""
    def status(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    def merge(self, *, limits: _Bounds | None = None) -> SweepSummary:
        """Merges the results of all shards into results.jsonl and summarizes them; limits in SI units."""
    @staticmethod
    def _check_limits(limits: _Bounds | None) -> None: ...
    def left(self, count: int) -> list[int]: ...
    def recordings(self, shard: tuple[int, int]) -> list[str]: ...
    def finished(self, shard: tuple[int, int]) -> dict[str, bytes]: ...
    def take(self, shard: tuple[int, int], results: bytes) -> int: ...

def read(
    path: _File,
    *,
    # Settings: reading.
    columns: _Named | None = None,
    rate: float | None = None,
    sheet: str | None = None,
    bad_rows: _BadRows = "error",
    gaps: _Gaps = "error",
    drop_repeats: bool = False,
    crop: str | None = None,
    offset: str | None = None,
    mask: _Items | None = None,
    decimate: int | None = None,
    filter: str | None = None,
    discretization: _Discretization | None = None,
) -> list[Record]: ...
def identify(
    records: _Records,
    *,
    model: Model | str | PathLike[str] | Mapping[str, Any] | None = None,
    validate: _Records | None = None,
    progress: Callable[[Progress], object] | None = None,
    # Settings: search.
    method: _Method = "auto",
    polish: _Polish = "lm",
    population: int = 100,
    generations: int = 100,
    seed: int = 1,
    set: _Settings | None = None,
    # Settings: problem.
    bounds: _Bounds = "auto",
    fix: _Numbers | None = None,
    criterion: _Criterion = "nrmse",
    scale: _Scale = "std",
    noise: _Numbers | None = None,
    time_origin: float | None = None,
    with_: _Items | None = None,
    per_recording: _Items | None = None,
    discretization: _Discretization | None = None,
    initial: _Initial = "auto",
    device: str = "auto",
    precision: _Precision = "auto",
    evaluator: _Evaluator = "auto",
    threads: int | None = None,
) -> Identification: ...
def compare(
    records: _Records | None = None,
    *,
    progress: Callable[[Progress], object] | None = None,
    preset: Literal["paper"] | None = None,
    methods: _Items = "gwo,jaya,ga,sm",
    runs: int = 50,
    criteria: _Items = "nrmse:std",
    population: int | Sequence[int] = 100,
    generations: int | Sequence[int] = 100,
    set: _Settings | None = None,
    transform: _Items | None = None,
    seed: int = 1,
    noise_records: int = 200,
    target: float | None = None,
    bounds: _Bounds | None = None,
    fix: _Numbers | None = None,
    discretization: _Discretization | None = None,
    device: str = "auto",
    precision: _Precision = "auto",
    evaluator: _Evaluator = "auto",
    threads: int | None = None,
) -> Comparison: ...
def steiglitz_mcbride(record: _Source, *, discretization: _Discretization = "zoh") -> dict[str, float]: ...
def refine(
    records: _Records,
    start: Mapping[str, float],
    *,
    bounds: _Bounds = "auto",
    fix: _Numbers | None = None,
    discretization: _Discretization | None = None,
    initial: _Initial = "auto",
) -> dict[str, Any]: ...
def simulate(
    parameters: Identification | str | Mapping[str, float],
    time: ArrayLike | Record | None = None,
    voltage: ArrayLike | None = None,
    *,
    load_torque: ArrayLike | None = None,
    noise: _Numbers | None = None,
    seed: int = 1,
) -> Record: ...
def devices() -> dict[str, Any]: ...
