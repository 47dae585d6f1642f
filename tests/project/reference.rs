//! Proves: docs/reference.md and the choices in the Python package are generated from the tables of the library, defaults and
//! examples of the tables are valid, and the limits are those that errors name. `UPDATE_REFERENCE=1` writes the files.
//! Does not prove: the texts themselves.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

use motorfit::criterion::{Norm, Scale};
use motorfit::device::{EvaluatorSpec, PrecisionSpec};
use motorfit::evaluate::Initial;
use motorfit::identify::{IdentifySpec, Method, Polish, REASONS, TrustLevel};
use motorfit::limit::Limit;
use motorfit::motor::Extension;
use motorfit::motor::{DefaultBounds, Discretization, Parameter};
use motorfit::named::Named;
use motorfit::optimize::{ConfiguredSearch, Range, SEARCHES, Sample, Sampling, SearchSettings};
use motorfit::record::{BadRows, FINDINGS, FORMATS, Gaps, LowPass, ReadOptions, Reading};
use motorfit::setting::Setting;
use motorfit::settings::{self, DEVICE, Given, Kind, PROBLEM, READING, SEARCH, Value, row};
use motorfit::study::ThroughputSpec;
use motorfit::study::sweep::Shard;
use std::fmt::Write as _;
use std::path::Path;

/// Asserts that a file of the project has a text, or writes it.
fn hold(path: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    if std::env::var_os("UPDATE_REFERENCE").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    let first = there.lines().zip(text.lines()).find(|(there, text)| there != text);
    let at = first.map_or_else(String::new, |(there, text)| format!(": \"{there}\" is to be \"{text}\""));
    assert!(there == text, "{} is not of the tables{at}; run with UPDATE_REFERENCE=1", path.display());
}

fn table<const N: usize>(title: &str, heads: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace("|measured|", "\\|measured\\|"));
    let mut text = format!("\n## {title}\n\n{}", line(&heads.map(str::to_owned)));
    text.push_str(&format!("{}\n", "|---".repeat(N) + "|"));
    rows.into_iter().for_each(|row| text.push_str(&line(&row)));
    text
}

fn named<T: Named + Default>(title: &str) -> String {
    let mark = |row: &T| if *row == T::default() { " (default)" } else { "" };
    let rows = T::all().into_iter().map(|row| [format!("`{}`{}", row.name(), mark(&row)), format!("{}.", row.text())]);
    table(title, ["name", "meaning"], rows)
}

fn settings_of_searches() -> String {
    let rows = SEARCHES.into_iter().flat_map(|search| {
        let usual = ConfiguredSearch::from(search);
        search.settings.iter().enumerate().map(move |(place, setting)| {
            let range = match setting.range {
                Range::Number(min, max, above) => {
                    let end = if max.is_finite() { format!("{max}]") } else { "∞)".to_owned() };
                    format!("{}{min}, {end}", if above { "(" } else { "[" })
                }
                Range::Count(u32::MAX) => "a count".to_owned(),
                Range::Count(most) => format!("0 to {most}"),
                Range::Choice(words) => words.join(", "),
            };
            let text = setting.text.replace('|', "\\|");
            [search.name.to_owned(), format!("`{}`", setting.name), range, usual.shown(place), text]
        })
    });
    table("Settings of methods", ["method", "name", "range", "default", "meaning"], rows)
}

fn parameters() -> String {
    let row = |parameter: Parameter| {
        let bounds = match parameter.default_bounds() {
            DefaultBounds::Fixed(min, max) => format!("{min} to {max}"),
            DefaultBounds::OfTorque(min, max) => format!("{min} to {max} of the stall torque"),
            DefaultBounds::OfInput(min, max) => format!("{min} to {max} of the largest input"),
            DefaultBounds::Late(early, periods, constants) => {
                let from = if early < 0.0 { format!("{early} period") } else { "0".to_owned() };
                format!("{from} to {periods} periods or {constants} time constants")
            }
            DefaultBounds::Samples => "1 to a quarter of the recording, 300 at most".to_owned(),
        };
        let extension = Extension::of(parameter).map_or("", Extension::name).to_owned();
        let cells = [parameter.symbol(), parameter.unit(), parameter.domain(), parameter.text()].map(str::to_owned);
        let [symbol, unit, domain, text] = cells;
        [format!("`{symbol}`"), unit, domain, bounds, extension, text]
    };
    let heads = ["symbol", "unit", "values", "bounds where none are given", "extension", "meaning"];
    table("Parameters", heads, Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS).map(row))
}

fn settings() -> String {
    let all = [&READING[..], &SEARCH, &PROBLEM, &DEVICE].concat();
    let rows = all.into_iter().filter_map(row).map(|row| {
        let form = match &row.kind {
            Kind::Switch => "a switch".to_owned(),
            Kind::Number => "a number".to_owned(),
            Kind::Count => "a count".to_owned(),
            Kind::Word => "a text".to_owned(),
            Kind::List => "a list".to_owned(),
            Kind::Choice(rows) => rows.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "),
        };
        let default = row.default.map_or(String::new(), |default| format!("`{default}`"));
        [format!("`{}`", row.setting.name()), form, default, format!("{}.", row.text).replace('|', "\\|")]
    });
    table("Settings", ["name", "form", "default", "meaning"], rows)
}

/// Returns the value of a default as a front end would create it.
fn value(kind: &Kind, text: &str) -> Value {
    match kind {
        Kind::Switch => Value::Switch(text == "true"),
        Kind::Number => Value::Number(text.parse().unwrap()),
        Kind::Count => Value::Count(text.parse().unwrap()),
        Kind::List => Value::List(vec![text.to_owned()]),
        Kind::Word | Kind::Choice(_) => Value::Text(text.to_owned()),
    }
}

#[test]
fn defaults_of_the_table_are_those_of_the_library_and_examples_can_be_read() {
    let mut defaults = Given::default();
    for row in [&READING[..], &SEARCH, &PROBLEM, &DEVICE].concat().into_iter().filter_map(row) {
        row.default.iter().for_each(|text| defaults.put(row.setting, value(&row.kind, text)));
        let mut example = Given::default();
        example.put(row.setting, value(&row.kind, row.example));
        if row.setting == Setting::Set {
            example.put(Setting::Method, Value::Text("ga".to_owned()));
        }
        assert!(settings::identify(&example).is_ok() && settings::reading(&example).is_ok(), "{:?}", row.setting);
    }
    for given in [Given::default(), defaults] {
        assert_eq!(settings::identify(&given).unwrap(), IdentifySpec::default());
        assert_eq!(settings::reading(&given).unwrap(), Reading::default());
    }
}

#[test]
fn the_reference_is_generated_from_the_tables() {
    let mut text = String::from(
        "# Reference\n\nMade from the tables of the library by `UPDATE_REFERENCE=1 cargo test --test project reference`; the same \
         names serve the command line, studies and Python.\n",
    );
    text += &self::settings();
    text += &named::<Method>("Methods");
    text += &settings_of_searches();
    text += &named::<Polish>("Polish");
    text += &named::<Norm>("Criteria");
    text += &named::<Scale>("Scales");
    text += &named::<Discretization>("Discretizations");
    text += &named::<Initial>("Initial states");
    text += &named::<PrecisionSpec>("Precision");
    text += &named::<BadRows>("Rows that cannot be read");
    text += &named::<Gaps>("Gaps in time");
    text += &parameters();
    let yes = |is: bool| if is { "yes" } else { "no" }.to_owned();
    let extension = |e: Extension| {
        let symbols: Vec<&str> = e.parameters().iter().map(|p| p.symbol()).collect();
        [format!("`{}`", e.name()), symbols.join(", "), yes(e.acts_on_current()), format!("{}.", Named::text(&e))]
    };
    let heads = ["name", "parameters", "where the current is the input", "meaning"];
    text += &table("Extensions", heads, Extension::ALL.map(extension));
    let csv = [
        "CSV".to_owned(),
        "Any text of columns with a heading; also any file that is none of the other formats.".to_owned(),
    ];
    let formats = FORMATS.iter().map(|format| [format.name.to_owned(), format.text.to_owned()]);
    text += &table("Files", ["format", "meaning"], std::iter::once(csv).chain(formats));
    let findings = FINDINGS.iter().map(|(code, text)| [format!("`{code}`"), (*text).to_owned()]);
    text += &table("Findings about recordings", ["code", "meaning"], findings);
    text += &named::<TrustLevel>("Levels of trust").replace(" (default)", "");
    let reasons = REASONS.iter().map(|(code, text)| [format!("`{code}`"), (*text).to_owned()]);
    text += &table("Reasons of a level of trust", ["code", "meaning"], reasons);
    let rows =
        limits().into_iter().map(|limit| [limit.of.to_owned(), limit.most.to_string(), format!("{}.", limit.beyond)]);
    text += &table("Limits", ["size", "at most", "beyond"], rows);
    hold("docs/reference.md", &text);
}

fn limits() -> Vec<Limit> {
    let records = motorfit::record::limits();
    [
        records,
        motorfit::optimize::LIMITS.to_vec(),
        motorfit::device::LIMITS.to_vec(),
        motorfit::study::limits(),
        motorfit::model::LIMITS.to_vec(),
    ]
    .concat()
}

/// A value at each limit is accepted, and the next one gives an error with the number of the table.
#[test]
fn limits_are_those_that_errors_name() {
    let most = |of: &str| limits().into_iter().find(|limit| limit.of.starts_with(of)).unwrap().most;
    let mut seen = 0;
    let mut refused = |of: &str, try_it: &dyn Fn(u64) -> motorfit::Result<()>| {
        let most = most(of);
        try_it(most).unwrap_or_else(|error| panic!("{of} of {most}: {error}"));
        let error = try_it(most + 1).expect_err(of);
        let said = format!("{error} {}", error.hint());
        assert!(said.contains(&most.to_string()), "{of}: {said}");
        seen += 1;
    };
    let count = |n: u64| usize::try_from(n).unwrap();
    let read = |text: String| motorfit::record::read_bytes(text.as_bytes(), None, &ReadOptions::default()).map(|_| ());
    let head = "time_s,voltage_V,current_A,speed_rad_s";
    let rows: String = (0..9).map(|n| format!("0.00{n},{},{},{}\n", n % 2, n % 3, n % 4)).collect();
    let wide = |more: &str| rows.replace('\n', &format!("{more}\n"));
    let long = |n: u64| "x".repeat(count(n) - head.len() - 1);
    refused("bytes of a line", &|n| read(format!("{head},{}\n{}", long(n), wide(",0"))));
    let more = |n: u64, cell: &str| cell.repeat(count(n) - 4);
    refused("columns of a CSV", &|n| read(format!("{head}{}\n{}", more(n, ",x"), wide(&more(n, ",0")))));
    refused("bytes of a request for columns", &|n| {
        motorfit::record::parse_columns(&format!("voltage={}", "x".repeat(count(n) - 8))).map(|_| ())
    });
    refused("order of a low-pass", &|n| format!("butterworth:10:{n}").parse::<LowPass>().map(|_| ()));
    refused("points of a sample", &|n| Sample::new(Sampling::Uniform, n, vec![(0.0, 1.0)], 1).map(|_| ()));
    refused("threads", &|n| motorfit::device::check_threads(Some(count(n))));
    refused("shards", &|n| format!("1/{n}").parse::<Shard>().map(|_| ()));
    refused("samples of a benchmark", &|n| {
        ThroughputSpec { populations: vec![1], samples: vec![count(n)], budget_s: 1.0 }.checked().map(|_| ())
    });
    refused("candidates of a population of a benchmark", &|n| {
        ThroughputSpec { populations: vec![count(n)], samples: vec![2], budget_s: 1.0 }.checked().map(|_| ())
    });
    refused("values of a population", &|n| {
        let search = SearchSettings {
            bounds: vec![(0.0, 1.0)],
            population: count(n),
            generations: 1,
            seed: 1,
            ..SearchSettings::default()
        };
        search.check()
    });
    assert_eq!(seen, 10);
    // All other limits have a number and a text, and are unique.
    let mut names: Vec<_> = limits().iter().map(|limit| limit.of).collect();
    assert!(limits().iter().all(|limit| limit.most > 0 && !limit.beyond.is_empty()));
    names.sort_unstable();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    assert!(names.len() > 25, "{}", names.len());
}

/// Returns quoted names, the default first.
fn quoted(names: &[&str], default: Option<&str>) -> String {
    let mut names = names.to_vec();
    names.sort_by_key(|name| Some(*name) != default);
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}

fn choices<T: Named + Default>() -> (Vec<&'static str>, &'static str) {
    (T::names(), T::default().name())
}

#[test]
fn python_lists_the_choices_of_the_tables() {
    // A multistart needs residuals, which Python's Optimizer has not.
    let searches = || SEARCHES.iter().map(|search| search.name);
    let asked: Vec<&str> = searches().filter(|name| *name != "multistart").collect();
    let searches: Vec<&str> = searches().collect();
    let all = [
        ("criterion", "_Criterion", choices::<Norm>()),
        ("scale", "_Scale", choices::<Scale>()),
        ("discretization", "_Discretization", choices::<Discretization>()),
        ("initial", "_Initial", choices::<Initial>()),
        ("precision", "_Precision", choices::<PrecisionSpec>()),
        ("evaluator", "_Evaluator", choices::<EvaluatorSpec>()),
        ("polish", "_Polish", choices::<Polish>()),
        ("bad_rows", "_BadRows", choices::<BadRows>()),
        ("gaps", "_Gaps", choices::<Gaps>()),
        ("method", "_Method", choices::<Method>()),
        ("", "_Search", (asked.clone(), "")),
    ];
    let folder = "bindings/python";
    let read = |path: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
    let stubs = format!("{folder}/python/motorfit/_motorfit.pyi");
    let alias = |line: &str| {
        let (_, alias, (names, _)) = all.iter().find(|(_, alias, _)| line.starts_with(&format!("{alias} = ")))?;
        Some(format!("{alias} = Literal[{}]", quoted(names, None)))
    };
    let text: String = read(&stubs).lines().map(|line| alias(line).unwrap_or_else(|| line.to_owned()) + "\n").collect();
    for (_, alias, _) in &all {
        assert!(text.contains(&format!("\n{alias} = ")), "{alias} is in the stubs");
    }
    hold(&stubs, &text);
    let choice = |line: &str| {
        let (key, _, (names, default)) = all.iter().find(|(key, ..)| line.starts_with(&format!("{key} : {{")))?;
        Some(format!("{key} : {{{}}}", quoted(names, Some(default))))
    };
    for name in ["problem", "identify"] {
        let path = format!("{folder}/src/docs/{name}.txt");
        hold(
            &path,
            &read(&path).lines().map(|line| choice(line).unwrap_or_else(|| line.to_owned()) + "\n").collect::<String>(),
        );
    }
    let mut with = String::from("with_ : str or sequence\n");
    let extensions = Extension::ALL.map(|e| format!("    {}: {}\n", e.name(), Named::text(&e)));
    let _ = write!(
        with,
        "    Extensions of the linear motor, or \"auto\", which selects them by forward selection:\n{}",
        extensions.concat()
    );
    let symbols = Parameter::EXTENSIONS.map(Parameter::symbol).join(", ");
    let _ = writeln!(with, "    Their parameters {symbols} can be given in bounds and fix.");
    hold(&format!("{folder}/src/docs/with.txt"), &with);
    hold(&format!("{folder}/src/docs/search.txt"), &format!("method : {{{}}}\n", quoted(&asked, None)));
    let methods = format!(
        "methods : str or sequence, default \"gwo,jaya,ga,sm\"\n    Searches among {}; and sm, the Steiglitz-McBride estimate.\n",
        searches.join(", ")
    );
    hold(&format!("{folder}/src/docs/methods.txt"), &methods);
}

/// Returns the keyword argument of a setting, its type in the stubs, and its default as Python writes it.
fn python_keyword(setting: Setting) -> [String; 3] {
    let row = row(setting).unwrap();
    let name = if setting == Setting::With { "with_" } else { setting.name() };
    let alias = |name: &str| format!("_{}", name.split('_').map(capital).collect::<String>());
    let kind = match (setting, &row.kind) {
        (Setting::Columns, _) => "_Named".to_owned(),
        (Setting::Fix | Setting::Noise, _) => "_Numbers".to_owned(),
        (Setting::Bounds, _) => "_Bounds".to_owned(),
        (Setting::Set, _) => "_Settings".to_owned(),
        (_, Kind::Switch) => "bool".to_owned(),
        (_, Kind::Number) => "float".to_owned(),
        (_, Kind::Count) => "int".to_owned(),
        (_, Kind::Word) => "str".to_owned(),
        (_, Kind::List) => "_Items".to_owned(),
        (_, Kind::Choice(_)) => alias(name),
    };
    match (&row.kind, row.default) {
        (Kind::Switch, _) => [name.to_owned(), kind, "False".to_owned()],
        (Kind::Count | Kind::Number, Some(default)) => [name.to_owned(), kind, default.to_owned()],
        (_, Some(default)) => [name.to_owned(), kind, format!("\"{default}\"")],
        (_, None) => [name.to_owned(), format!("{kind} | None"), "None".to_owned()],
    }
}

fn capital(word: &str) -> String {
    let (first, rest) = word.split_at(1);
    first.to_uppercase() + rest
}

#[test]
fn python_has_the_keywords_of_the_tables() {
    let reading = [&READING[..], &[Setting::Discretization]].concat();
    let groups = [("reading", reading), ("search", SEARCH.to_vec()), ("problem", [&PROBLEM[..], &DEVICE].concat())];
    let keywords = |settings: &[Setting]| settings.iter().copied().map(python_keyword).collect::<Vec<_>>();
    for (group, settings) in &groups {
        let list: Vec<String> =
            keywords(settings).iter().map(|[name, _, default]| format!("{name}={default}")).collect();
        hold(&format!("bindings/python/src/signatures/{group}.txt"), &(list.join(", ") + "\n"));
    }
    // In the stubs a comment begins the keywords of a group, and a line that is not a keyword ends them.
    let stubs = "bindings/python/python/motorfit/_motorfit.pyi";
    let there = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(stubs)).unwrap();
    let (mut text, mut inside) = (String::new(), false);
    for line in there.lines() {
        let indent = &line[..line.len() - line.trim_start().len()];
        inside = inside && !line.trim_start().starts_with([')', '#']);
        if !inside {
            text += &format!("{line}\n");
        }
        if let Some((_, settings)) = groups.iter().find(|(group, _)| line.trim() == format!("# Settings: {group}.")) {
            inside = true;
            for [name, kind, default] in keywords(settings) {
                text += &format!("{indent}{name}: {kind} = {default},\n");
            }
        }
    }
    assert_eq!(
        text.matches("# Settings: ").count(),
        9,
        "identify (2), Model.identify (2), Model.read, Evaluator, read, Record.from_file, Record.from_columns"
    );
    hold(stubs, &text);
}
