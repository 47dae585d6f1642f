//! The table of the settings that front ends share.

use crate::criterion::{Norm, Scale};
use crate::device::PrecisionSpec;
use crate::evaluate::Initial;
use crate::identify::{Method, Polish};
use crate::motor::{Discretization, Extension, Parameter};
use crate::named::Named;
use crate::optimize::{Hyperparameter, SEARCHES, Search};
use crate::record::{BadRows, Gaps};
use crate::setting::{Setting, Text, text};

/// The form of a setting's value.
#[derive(Debug, Clone)]
pub enum Kind {
    /// On or off.
    Switch,
    /// A number.
    Number,
    /// A whole number, 0 or more.
    Count,
    /// A text.
    Word,
    /// Texts separated by commas.
    List,
    /// One of these names, each with its text.
    Choice(Vec<(&'static str, &'static str)>),
}

/// The row of a setting.
#[derive(Debug, Clone)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// The form of its value.
    pub kind: Kind,
    /// The topic.
    pub topic: &'static str,
    /// A word that stands for its value.
    pub stands: &'static str,
    /// The value that it has where none is given, as it is written.
    pub default: Option<&'static str>,
    /// A description, without a full stop.
    pub text: Text,
    /// A value, as it is written.
    pub example: &'static str,
}

/// Settings of reading and preparing recordings.
pub const READING: [Setting; 11] = {
    use Setting::{BadRows, Columns, Crop, Decimate, DropRepeats, Filter, Gaps, Mask, Offset, Rate, Sheet};
    [Columns, Rate, Sheet, BadRows, Gaps, DropRepeats, Crop, Offset, Mask, Decimate, Filter]
};
/// Settings of the search and the refinement.
pub const SEARCH: [Setting; 6] =
    [Setting::Method, Setting::Polish, Setting::Population, Setting::Generations, Setting::Seed, Setting::Set];
/// Settings of the problem.
pub const PROBLEM: [Setting; 10] = {
    use Setting::{Bounds, Criterion, Discretization, Fix, Initial, Noise, PerRecording, Scale, TimeOrigin, With};
    [Bounds, Fix, Criterion, Scale, Noise, TimeOrigin, With, PerRecording, Discretization, Initial]
};
/// The device that evaluates candidates.
pub const DEVICE: [Setting; 3] = [Setting::Device, Setting::Precision, Setting::Threads];

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
        "What the motor has beyond the linear one: {names}; or auto, which chooses. Their parameters {symbols} take "
        [Bounds] " and " [Fix] " too"
    )
}

/// Defines the rows: form, topic, word for the value, default, example, text.
macro_rules! table {
    ($($setting:ident: $kind:expr, $topic:literal, $stands:literal [$($default:literal)?] $example:literal, $text:expr;)+) => {
        /// Returns the row of a setting; none for one that a single command has.
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
        "What columns hold, as QUANTITY=HEADING,…; quantities: time, voltage, current, speed, load_torque, position. Behind a \
         heading (or its number, #2) may stand operations (from left to right), a unit, or the two voltages of a flag: \
         current=I:mA, time=tick:8kHz (time=- for none), voltage=PWM*12/255:V, voltage=step:0..12, position=count/4096:turns. \
         Or an expression of several columns, with + - * / ^ ( ), pi, sin, cos, abs, int8, int16, int32 (unsigned two's \
         complement), cumsum (running sum), constants of a JSON file and other quantities named in the list, in SI units; \
         headings with signs in quotation marks: time=cumsum(dt):ms, voltage=int16(load)/885*\"supply (V)\", \
         load_torque=0.5*9.81*0.1*sin(position)";
    Rate: Number, "Recording", "HZ" [] "1000",
        "Samples per second: of a recording without a time column; any other is brought to it, behind an anti-alias filter \
         where it is faster";
    Sheet: Word, "Recording", "NAME" [] "Sheet1", "The sheet of a workbook [default: the first with numbers], or the list of a JSON file";
    BadRows: choice::<BadRows>(), "Recording", "HOW" ["error"] "skip",
        "What becomes of rows that cannot be read, such as notices of a logger: bad data, or left out and counted";
    Gaps: choice::<Gaps>(), "Recording", "HOW" ["error"] "keep",
        "What becomes of gaps in time: bad data, a long step, or a recording for each stretch, also where time starts again";
    DropRepeats: Switch, "Recording", "" [] "true", "Leave out rows whose time repeats that of the row before";
    Crop: Word, "Recording", "FROM:TO" [] "0.2:1.5", "Use the time FROM:TO only, in seconds; either may be left out";
    Offset: Word, "Recording", "OFFSETS" [] "auto",
        "Offsets of sensors that are subtracted: auto (the means while at rest before the voltage changes), or \
         current=0.02,speed=…,voltage=… in SI units";
    Mask: List, "Recording", "MASK" [] "auto",
        "What does not count: auto (outliers, saturated current, an undersampled voltage, an input reset at the end, stretches with \
         the drive disabled), or FROM:TO, current@FROM:TO, speed@FROM:TO in seconds; repeatable";
    Decimate: Count, "Recording", "N" [] "2", "Keep every Nth sample, behind an anti-alias filter";
    Filter: Word, "Recording", "FILTER" [] "butterworth:100",
        "A low-pass on all signals alike: butterworth:HZ[:ORDER] or chebyshev:HZ[:ORDER[:RIPPLE_DB]]";
    Method: choice::<Method>(), "Search", "METHOD" ["auto"] "sm",
        "How the optimum is found; auto: Steiglitz–McBride, a population search where that cannot serve";
    Polish: choice::<Polish>(), "Search", "POLISH" ["lm"] "lm", "How what was found is refined; lm gives the standard errors";
    Population: Count, "Search", "N" ["100"] "100", "Agents";
    Generations: Count, "Search", "N" ["100"] "100", "Generations, the first population included";
    Seed: Count, "Search", "N" ["1"] "1", "Seed of the random numbers";
    Set: List, "Search", "KEY=VALUE" [] "ga.mutation=0.1", settings_of_methods();
    Bounds: List, "Search", "BOUNDS" ["auto"] "R=0.1:1",
        "Bounds: table2 (the paper's), PARAMETER=MIN:MAX,… in SI units, or auto: a decade to each side of the \
         Steiglitz–McBride estimate, table2 where there is none; repeatable";
    Fix: List, "Search", "VALUES" [] "R=0.92", "Parameters that are held, as R=0.92,…; repeatable";
    Criterion: choice::<Norm>(), "Criterion", "CRITERION" ["nrmse"] "nrmse", "What is minimized";
    Scale: choice::<Scale>(), "Criterion", "SCALE" ["std"] "std", "What the error of each channel is divided by";
    Noise: Word, "Criterion", "NOISE" [] "40dB",
        text!("Noise for " [Scale = "noise"] ", as 40dB or i=0.05,w=0.5 [A, rad/s]; estimated from the recording otherwise");
    TimeOrigin: Number, "Criterion", "S" [] "0.5",
        "From when time counts in itse and itae, in seconds from the start of the recording";
    With: List, "Model", "LIST" [] "coulomb", extensions();
    PerRecording: List, "Model", "LIST" [] "TL",
        "Parameters that each recording of a joint fit has for itself, as TL,K (a start latency always is one)";
    Discretization: choice::<Discretization>(), "Model", "DISCRETIZATION" [] "zoh",
        "One-step method: input held (zoh), a line between samples (foh), Runge–Kutta, Euler [default: zoh, which \
         extensions by auto may leave for foh; foh where no voltage was recorded and the measured current is the input]";
    Initial: choice::<Initial>(), "Model", "INITIAL" ["auto"] "zero",
        "State at the first sample; auto: zero if the recording starts at rest, else free (a search takes it as measured)";
    Device: Word, "Device", "DEVICE" ["auto"] "cpu", "What evaluates: auto, cpu, gpu, gpu:INDEX or gpu:NAME";
    Precision: choice::<PrecisionSpec>(), "Device", "PRECISION" ["auto"] "f64", "Numbers of the evaluation";
    Threads: Count, "Device", "N" [] "4", "Threads [default: all]";
}
