//! The table of the settings that front ends share.

use motorfit_core::named::Named;
use motorfit_core::setting::{Setting, Text, text};
use motorfit_evaluate::Initial;
use motorfit_evaluate::criterion::{Norm, Scale};
use motorfit_identify::device::{EvaluatorSpec, PrecisionSpec};
use motorfit_identify::{Method, Polish};
use motorfit_motor::{Discretization, Extension, Parameter};
use motorfit_optimize::{Hyperparameter, SEARCHES, Search};
use motorfit_record::{BadRows, Gaps};

/// The type of a setting's value.
#[derive(Debug, Clone)]
pub enum Kind {
    /// On or off.
    Switch,
    /// A number.
    Number,
    /// A non-negative integer.
    Count,
    /// A text.
    Word,
    /// A list of texts separated by commas.
    List,
    /// One of the listed names, each with its description.
    Choice(Vec<(&'static str, &'static str)>),
}

/// One row of the table of settings.
#[derive(Debug, Clone)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// The type of its value.
    pub kind: Kind,
    /// The heading that help lists it under.
    pub topic: &'static str,
    /// The placeholder for its value in help.
    pub stands: &'static str,
    /// The default as a user would write it; `None` if it depends on other settings or on the recording.
    pub default: Option<&'static str>,
    /// A description, without a full stop.
    pub text: Text,
    /// An example of a value as a user would write it.
    pub example: &'static str,
}

/// Settings for reading and preparing recordings.
pub const READING: [Setting; 11] = [
    Setting::Columns,
    Setting::Rate,
    Setting::Sheet,
    Setting::BadRows,
    Setting::Gaps,
    Setting::DropRepeats,
    Setting::Crop,
    Setting::Offset,
    Setting::Mask,
    Setting::Decimate,
    Setting::Filter,
];
/// Settings of the search and the refinement.
pub const SEARCH: [Setting; 6] =
    [Setting::Method, Setting::Polish, Setting::Population, Setting::Generations, Setting::Seed, Setting::Set];
/// Settings of the problem: parameters, criterion and model.
pub const PROBLEM: [Setting; 10] = [
    Setting::Bounds,
    Setting::Fix,
    Setting::Criterion,
    Setting::Scale,
    Setting::Noise,
    Setting::TimeOrigin,
    Setting::With,
    Setting::PerRecording,
    Setting::Discretization,
    Setting::Initial,
];
/// Settings of the device that evaluates candidates.
pub const DEVICE: [Setting; 4] = [Setting::Device, Setting::Precision, Setting::Evaluator, Setting::Threads];

fn choice<T: Named>() -> Kind {
    Kind::Choice(T::all().iter().map(|row| (row.name(), row.text())).collect())
}

fn settings_of_methods() -> Text {
    let forms = |search: &Search| search.settings.iter().map(Hyperparameter::form).collect::<Vec<_>>().join(", ");
    let searches = SEARCHES.into_iter().filter(|search| !search.settings.is_empty());
    let searches: Vec<String> = searches.map(|search| format!("{} ({})", forms(search), search.name)).collect();
    format!("Settings of the method: {}", searches.join("; ")).into()
}

fn extensions() -> Text {
    let [names, symbols] =
        [Extension::ALL.map(Extension::name).join(", "), Parameter::EXTENSIONS.map(Parameter::symbol).join(", ")];
    text!(
        "Extensions of the linear motor: {names}; or auto, which selects them by forward selection. Their parameters {symbols} \
         can be given in " [Bounds] " and " [Fix] ". Of a model: its optional terms and generic ones, all (of its text), none, or auto"
    )
}

/// Defines the rows: type, topic, placeholder, default, example, text.
macro_rules! table {
    ($($setting:ident: $kind:expr, $topic:literal, $stands:literal [$($default:literal)?] $example:literal, $text:expr;)+) => {
        /// Returns the row of a setting; `None` for a setting that only one command has.
        #[must_use]
        pub fn row(setting: Setting) -> Option<Row> {
            let (kind, topic, stands, default, example, text): (Kind, _, _, Option<&'static str>, _, Text) = match setting {
                $(Setting::$setting => {
                    ($kind, $topic, $stands, None$(.or(Some($default)))?, $example, $text.into())
                })+
                _ => return None,
            };
            Some(Row { setting, kind, topic, stands, default, text, example })
        }
    };
}

use Kind::{Count, List, Number, Switch, Word};
table! {
    Columns: Word, "Recording", "LIST" [] "current=I:mA",
        "Columns of the recording, as QUANTITY=HEADING,…; quantities: time, voltage, current, speed, load_torque, position. A \
         heading (or column number, #2) may be followed by operations (applied from left to right), a unit, or the voltages of \
         a two-valued column: current=I:mA, time=tick:8kHz (time=- for none), voltage=PWM*12/255:V, voltage=step:0..12, \
         position=count/4096:turns. An expression combines several columns by + - * / ^ ( ), pi, sin, cos, abs, int8, int16, \
         int32 (signed value of a two's complement), cumsum (running sum), constants of a JSON file, and other quantities of \
         the list in SI units; headings that contain operators go in quotation marks: time=cumsum(dt):ms, \
         voltage=int16(load)/885*\"supply (V)\", load_torque=0.5*9.81*0.1*sin(position)";
    Rate: Number, "Recording", "HZ" [] "1000",
        "Sampling rate in Hz of a recording without a time column; a recording with one is resampled to this rate, after an \
         anti-alias filter if it was faster";
    Sheet: Word, "Recording", "NAME" [] "Sheet1",
        "Sheet of a workbook [default: the first with numbers], or list of a JSON file";
    BadRows: choice::<BadRows>(), "Recording", "HOW" ["error"] "skip",
        "Treatment of rows that cannot be read, such as messages of a logger: reported as bad data, or left out and counted";
    Gaps: choice::<Gaps>(), "Recording", "HOW" ["error"] "keep",
        "Treatment of gaps in time: reported as bad data, kept as one long step, or split into one recording per segment, also \
         where time starts again";
    DropRepeats: Switch, "Recording", "" [] "true", "Leave out rows with the same time as the row before";
    Crop: Word, "Recording", "FROM:TO" [] "0.2:1.5", "Use only the samples from FROM to TO, in seconds; either may be left out";
    Offset: Word, "Recording", "OFFSETS" [] "auto",
        "Sensor offsets to subtract: auto (the means at rest before the voltage changes), or current=0.02,speed=…,voltage=… in \
         SI units";
    Mask: List, "Recording", "MASK" [] "auto",
        "Samples excluded from the fit: auto (outliers, saturated current, an undersampled voltage, an input reset at the end, \
         segments with the drive disabled), or FROM:TO, current@FROM:TO, speed@FROM:TO in seconds; repeatable";
    Decimate: Count, "Recording", "N" [] "2", "Keep every Nth sample, after an anti-alias filter";
    Filter: Word, "Recording", "FILTER" [] "butterworth:100",
        "Low-pass filter on all signals alike: butterworth:HZ[:ORDER] or chebyshev:HZ[:ORDER[:RIPPLE_DB]]";
    Method: choice::<Method>(), "Search", "METHOD" ["auto"] "sm",
        "Method that finds the optimum; auto: Steiglitz–McBride, or a population search where that is not applicable";
    Polish: choice::<Polish>(), "Search", "POLISH" ["lm"] "lm", "Refinement of the optimum; lm gives the standard errors";
    Population: Count, "Search", "N" ["100"] "100", "Candidates in each generation of a population search";
    Generations: Count, "Search", "N" ["100"] "100", "Generations of a population search, the initial population included";
    Seed: Count, "Search", "N" ["1"] "1", "Seed of the random numbers";
    Set: List, "Search", "KEY=VALUE" [] "ga.mutation=0.1", settings_of_methods();
    Bounds: List, "Search", "BOUNDS" ["auto"] "R=0.1:1",
        "Bounds of the search: table2 (those of the paper), PARAMETER=MIN:MAX,… in SI units, or auto: a decade to each side of \
         the Steiglitz–McBride estimate, table2 where there is none; repeatable";
    Fix: List, "Search", "VALUES" [] "R=0.92", "Parameters fixed at known values, as R=0.92,… in SI units; repeatable";
    Criterion: choice::<Norm>(), "Criterion", "CRITERION" ["nrmse"] "nrmse", "Criterion that a population search minimizes";
    Scale: choice::<Scale>(), "Criterion", "SCALE" ["std"] "std", "Divisor of each channel's error in the criterion";
    Noise: Word, "Criterion", "NOISE" [] "40dB",
        text!(
            "Sensor noise for " [Scale = "noise"] ", as 40dB (below the rms value of each signal) or i=0.05,w=0.5 [A, rad/s]; \
             estimated from the recording if not given"
        );
    TimeOrigin: Number, "Criterion", "S" [] "0.5",
        "Origin of the time weights of itse and itae, in seconds from the start of the recording [default: 0]";
    With: List, "Model", "LIST" [] "coulomb", extensions();
    PerRecording: List, "Model", "LIST" [] "TL",
        "Parameters that a joint fit estimates for each recording separately, as TL,K (always so for a start latency)";
    Discretization: choice::<Discretization>(), "Model", "DISCRETIZATION" [] "zoh",
        text!(
            "Discretization: exact for a zero-order hold (zoh) or first-order hold (foh) of the input, Runge–Kutta, or Euler \
             [default: zoh; " [With = "auto"] " may select foh for a voltage that changes at many samples; foh if no voltage \
             was recorded and the measured current is the input]"
        );
    Initial: choice::<Initial>(), "Model", "INITIAL" ["auto"] "zero",
        "State at the first sample; auto: zero if the recording starts at rest, else free (estimated by the refinement; a \
         population search uses the first measured sample)";
    Device: Word, "Device", "DEVICE" ["auto"] "cpu", "Device that evaluates candidates: auto, cpu, gpu, gpu:INDEX or gpu:NAME";
    Precision: choice::<PrecisionSpec>(), "Device", "PRECISION" ["auto"] "f64", "Floating-point precision of the evaluation";
    Evaluator: choice::<EvaluatorSpec>(), "Device", "EVALUATOR" ["auto"] "kernel",
        "Evaluation of costs on the CPU: the kernel simulates every candidate; tables of poles take the same time whatever the \
         length of the recording; auto: the faster for the candidates to come";
    Threads: Count, "Device", "N" [] "4", "Number of CPU threads [default: all]";
}
