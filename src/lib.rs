//! Identification of the parameters of DC motors from recordings of voltage, current and speed.
//!
//! The model is the linear motor `L di/dt = v − R i − K ω`, `J dω/dt = K i − B ω − T` (Eqs. 6 and 7), optionally with
//! extensions such as Coulomb friction, dead time and drive nonlinearities ([`motor::Extension`]). All quantities are in SI
//! units.
//!
//! # Five uses
//!
//! 1. **Identify one motor.** [`identify::identify`] takes one or more [`record::Record`]s and returns R, L, K, B, J and the
//!    parameters of extensions with standard errors, a comparison with a global search, and a level of trust.
//!    [`estimate`] has its estimators: Steiglitz–McBride and the output-error refinement with its covariance.
//! 2. **Identify many motors.** [`study::sweep`] runs a study, or the recordings of a production line, as one batch that can be
//!    interrupted and resumed. [`device::BatchSearchEvaluator`] evaluates any number of searches, each on its own recordings, in
//!    one batch.
//! 3. **Simulate populations.** [`evaluate::Evaluator`] simulates a batch of candidate motors and returns their costs, shape
//!    `[candidates]`: by SIMD on all cores ([`evaluate::Simd`]) or by WGSL compute shaders on a GPU (`evaluate::gpu::Gpu`).
//!    [`experiment`] simulates recordings.
//! 4. **Compare methods.** [`study::compare`] runs the Grey Wolf Optimizer, Jaya, a genetic algorithm, a particle swarm, random
//!    search and Steiglitz–McBride under equal budgets and compares them with statistics. [`study::throughput()`] measures the
//!    evaluation rates of CPU and GPU.
//! 5. **Write extensions.** [`optimize::Optimizer`] is the ask/tell interface for optimizers, [`optimize::minimize()`] drives
//!    them on any cost function ([`optimize::Evaluate`]), and [`evaluate::Evaluator`] can be implemented for other devices. New
//!    effects, criteria, file formats and rules are rows of tables (`docs/extending.md`).
//!
//! # Source
//!
//! The motor, the experiment and the methods are those of D. M. Munciño, E. A. Damian-Ramírez, M. Cruz-Fernández, L. A.
//! Montoya-Santiyanes and J. Rodríguez-Reséndiz, "Metaheuristic and Heuristic Algorithms-Based Identification Parameters of a
//! Direct Current Motor", *Algorithms* 17(5), 209, 2024, called "the paper" in these pages.
//!
//! # Modules
//!
//! Data flow one way: record → motor → model → criterion → optimize → experiment → evaluate → estimate → device → analysis →
//! identify → settings → study → report. A module uses only those before it. All may use the base modules: errors, limits, tables
//! of names, names of settings, texts, units, files, numerics, candidates and channels. [`model`] has the equations of other
//! machines than the DC motor.
//!
//! # Example
//!
//! ```
//! use motorfit::identify::{IdentifySpec, identify};
//! use motorfit::motor::{Discretization, Parameters};
//! use motorfit::experiment::{Excitation, simulated};
//!
//! let step = Excitation::step(10.5, 1.0, 3.0, 0.001)?;
//! let record = simulated(&Parameters::M2, &step, Discretization::Zoh)?;
//! let found = identify(&[record], &IdentifySpec::default())?;
//! assert!((found.parameters.r - Parameters::M2.r).abs() < 1e-6);
//! # Ok::<(), motorfit::Error>(())
//! ```

#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

pub use motorfit_core::{Error, ErrorKind, Result};
pub use motorfit_core::{candidates, channels, coordinate, error, file, limit, named, numeric, setting, text, units};
pub use motorfit_evaluate::{criterion, experiment};
pub use motorfit_record::warning;
pub use motorfit_study::settings;

pub mod record {
    //! Recordings of one motor: sampled voltage, load torque, current and speed in SI units.
    //!
    //! A [`Record`] is checked when it is created: at least two samples, finite values, increasing time.

    pub use motorfit_record::{
        BadRows, ChannelFacts, Column, ColumnPreview, ColumnRequest, ColumnUse, Excluded, FINDINGS, FORMATS,
        FilterKind, Finding, Format, Gaps, Lines, LowPass, Mask, NamedSignal, Offset, Preparation, Quantity,
        ReadOptions, Reading, Record, SAMPLES_MAX, Samples, Severity, SignalRequest, Source, Steps, TESTS,
        TIME_JITTER_UNIFORM, TablePreview, VALUE_MAX, can_cause_poor_fit, channels, diagnose, driver,
        is_driven_by_current, joined_columns, limits, parse_columns, parse_crop, parse_masks, parse_number,
        parse_offset, parse_signal_columns, preview, read, read_bytes, read_inputs, read_joined, read_recording,
        read_signal_inputs, step_lengths, test_of, write_csv,
    };
}

pub mod motor {
    //! The DC motor: parameters with units, search space, one-step maps, simulation, step-response metrics.
    //!
    //! Model (Eqs. 6 and 7), state `[i, ω]`: `di/dt = (v − R i − K ω)/L`, `dω/dt = (K i − B ω − T)/J`, with voltage v \[V\] and
    //! load torque T \[N·m\].
    //!
    //! Each effect of an extension (`drive`, `delay`, `friction`, `sensor`) has one file, which the scalar oracle, its
    //! derivatives and the SIMD kernel share, and a WGSL file of the same name in `shaders/` with the same order of operations.
    //! A delay has two: `delay` for any clock, and `delay_taps` for regular clocks, whose operations `shaders/delay.wgsl` follows.

    pub use motorfit_motor::{
        Axis, DefaultBounds, Discretization, Dual, Extended, ExtendedWalk, Extension, Input, InputHistory, Matrix2,
        Method, ModelFeatures, Needs, Number, PER_RECORDING_MAX, Parameter, Parameters, RECORDING_MAX, Scope,
        SimulationInput, SimulationSettings, Space, StepMap, StepMaps, StepResponse, With, inverse, matrix_logarithm,
        product, response, simulate, step_maps, times, walk,
    };
}

pub mod model {
    //! Models of users: the differential equations of a machine as text.

    pub use motorfit_model::{
        BuiltIn, Equation, Formula, FormulaKind, Function, GenericTerm, InitialState, IntegrationMethod, LIMITS, Model,
        ModelConstant, ModelInput, ModelOutput, ModelParameter, ModelState, ModelTerm, NodeId, Role, ShaderPrecision,
        WrittenUnit,
    };
}

pub mod optimize {
    //! Population searches over a box, independent of the motor.
    //!
    //! The interface is ask/tell: `ask` returns the next population, `tell` takes its costs. [`minimize`] drives any number of
    //! runs in lock step and evaluates all their candidates in one call. The random numbers of a run depend on (seed, run)
    //! alone. A new search is a file with a rule, of which `gwo` is an example, and a row of [`SEARCHES`].

    pub use motorfit_optimize::{
        BeeColonyOptions, Best, Budget, CmaEsOptions, ConfiguredSearch, Coordinates, CuckooOptions,
        DifferentialEvolutionOptions, Evaluate, GeneticOptions, GwoOptions, Hyperparameter, JayaOptions, LIMITS,
        LocalOptimum, LocalSearch, LocalSearches, LshadeOptions, MultistartOptions, Observe, Optimizer, POINTS_MAX,
        Progress, PsoOptions, Range, Restarts, Run, SEARCHES, SOBOL_AXES_MAX, Sample, Sampling, Search, SearchOptions,
        SearchSettings, Sharing, Stop, Values, Wall, minimize,
    };
}

pub mod evaluate {
    //! Evaluation of batches of candidates: each candidate motor is simulated on the recordings of a problem, and its cost is
    //! computed from the errors.
    //!
    //! The unit of work is (candidate, recording). Kernels return one weighted sum of errors per channel, and the cost is computed
    //! from the sums by the same code for every evaluator. A batch has groups, each with its own problem, so that many runs on many
    //! recordings are evaluated in one call.

    pub use motorfit_evaluate::{
        Batch, CandidateValue, Evaluator, Group, Initial, Level, Model, Pending, PoleTables, Problem, Run, Scalar,
        SearchProblem, Signals, Simd, cpu_name, fma_loop, model,
    };
    /// Evaluation by compute shaders.
    #[cfg(feature = "shaders")]
    pub mod gpu {
        #[cfg(feature = "gpu")]
        pub use motorfit_gpu::{AdapterFacts, Gpu, Selector, list};
        pub use motorfit_gpu::{
            BufferBinding, BufferKind, Fetch, LANES, Precision, ShaderFeatures, Submission, UNIFORM_BYTES, Variant,
            assemble,
        };
    }
}

pub mod estimate {
    //! Estimation in f64 on the CPU. The model of the measurements is an output error: the simulated current and speed plus white
    //! Gaussian noise with one unknown σ for each recording and channel.
    //!
    //! [`steiglitz_mcbride()`] estimates the linear motor without a start. [`refine()`] computes the maximum-likelihood estimate
    //! from a start by Levenberg–Marquardt, with its [`Uncertainty`]; [`robust_uncertainty`] widens the standard errors for
    //! correlated residuals. [`global_reference`] searches the complete box for the lowest weighted sum of squares. Many
    //! refinements of the same recordings share a problem made by [`fit_problem`].

    pub use motorfit_estimate::{
        Block, Estimate, Fitted, Place, Point, Reference, ReferenceKind, RefineOptions, Refined, Separate, SmFailure,
        Uncertainty, Whiteness, descend, describe_direction, fit_problem, global_reference, initial_states, model,
        refine, refine_coarse, refine_on, residual_squares, robust_uncertainty, separate_fits, signal_deviations,
        steiglitz_mcbride, steiglitz_mcbride_on,
    };
}

pub mod device {
    //! Devices: selection of the CPU or a GPU for a search, measured throughput, and evaluation of searches batch by batch.

    pub use motorfit_identify::device::{
        AdapterThroughput, BatchSearchEvaluator, DeviceSettings, DeviceSpec, DeviceUsed, EvaluatorSpec, LIMITS, OnLoss,
        PrecisionSpec, THREADS_MAX, ThroughputCurve, ThroughputProfile, Work, check_threads, with_threads,
    };
}

pub mod analysis {
    //! Analysis of a finished fit: residual tests, the noise floor, intersample behaviour, characteristics, homogeneity,
    //! validation.

    pub use motorfit_identify::analysis::{
        CONTROLLERS, Characteristic, Characteristics, Controller, Covariance, FeedbackGains, FeedbackWeights,
        FittedMotor, HeldOut, Intersample, Named, NoiseFloor, Regression, Regressors, ResidualCorrelation,
        ResidualInputTest, ResidualTest, ResidualTests, Residuals, TransferFunctions, Validation, characteristics,
        detect_intersample, noise_floor, position_feedback, record_warnings, regression, regressions,
        residual_input_test, split, suspicions, velocity_feedback, warnings_of_records,
    };
}

pub mod identify {
    //! Identification of R, L, K, B and J with their standard errors from recordings of one motor.
    //!
    //! [`identify()`] is the entry point. A method finds a first optimum: Steiglitz–McBride (1965), or a population search that
    //! minimizes the criterion over the search space, one batch per generation. The polish, Levenberg–Marquardt, refines it to the
    //! maximum-likelihood estimate of the output-error model ([`crate::estimate`]) with its standard errors. If the extensions are
    //! not given, forward selection by BIC chooses them. The refined fit is compared with a global search, its residuals are
    //! tested ([`crate::analysis`]), and the result gets a level of trust ([`Trust`]).
    //!
    //! `pipeline.rs` calls the stages in their order: prepare, start, select, refine, verify, analyse, result.

    pub use motorfit_identify::{
        Alternative, BatchCosts, Combination, DcMotor, Diagnosed, Identifiability, Identification, IdentifySpec,
        Inspection, Keys, LeftOut, LikelihoodPoint, LikelihoodProfile, Machine, Method, Output, ParameterEstimate,
        Polish, PreparedSearch, REASONS, SearchOutcome, SearchRun, SelectionStep, Status, Trust, TrustLevel,
        TrustReason, Verification, fit_on, has_all_channels, hold_out, identify, identify_with, likelihood_profiles,
        mechanism, model, needs_voltage, search_problem, validate, verify_at, with_cost_on,
    };
}

pub mod study {
    //! Studies of many runs: comparisons of methods, sweeps, cost maps, and the throughput of evaluators.

    pub use motorfit_study::{
        Contender, Contenders, Control, CostMap, Crossover, MapParameter, Measurement, Throughput, ThroughputSpec,
        compare, contenders, cost_map, limits, model_contenders, model_cost_map, suite, sweep, throughput,
    };
}

pub mod report {
    //! Presentation of results: JSON documents, tables, figures, HTML pages, and the command-line spelling of settings.

    #[cfg(feature = "report")]
    pub use motorfit_report::{
        AxisScale, Band, Card, Chart, Figure, Form, Item, Map, Mark, Page, Panel, Part, Reproduced, ResidualRow,
        Section, Series, Table, Trust, compare, compare_page, compare_parts, figures, folded, heat_map, html_fragment,
        identify_page, identify_parts, inspect_page, likelihood_chart, mechanism_page, model_check_page,
        model_inspect_page, plain_text, record_figure, residual_panels, selection_table, selection_text, suite, sweep,
    };
    pub use motorfit_report::{
        EstimateRow, EvaluateDocument, ExportFormat, Exported, ExportedParameter, FeedbackDesign, MechanismLine,
        ModelInspection, ModelSignalFacts, Recorded, RecordedInput, RecordedOutput, Requested, Shown, SignalFacts,
        SignalStatistics, bench_document, characteristics_lines, columns_csv, command_line, curves_csv,
        devices_document, error_document, estimate_rows, exported_model, exported_motor, identify_document,
        inspect_document, json, likelihood_document, mechanism_code, mechanism_document, mechanism_lines,
        mechanism_selection, model_check_document, model_inspect_document, noise_floor_text, signals_csv, verdict,
        verdicts,
    };
}
