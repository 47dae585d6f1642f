//! Calls of the base modules: texts, numbers, settings, errors, candidates, criteria.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, WIDE, signals, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::candidates::Candidates;
use motorfit::channels::by_name;
use motorfit::criterion::{Criterion, Noise, Norm, Scale};
use motorfit::named::Named;
use motorfit::report::command_line;
use motorfit::setting::{Form, Reference, Setting, Text};
use motorfit::warning::Warning;
use motorfit::{Error, ErrorKind, numeric, text};
use std::path::Path;

pub fn texts_of_all_kinds(calls: &mut Calls) {
    let all = texts();
    for word in &all {
        drive!(calls, word;
            "text::printable" => text::printable(word),
            "text::excerpt" => text::excerpt(word),
            "text::shell_quoted" => text::shell_quoted(word),
            "text::quoted" => text::quoted(word),
            "text::counted" => text::counted(usize::MAX, word),
            "text::hexadecimal" => text::hexadecimal(word.as_bytes()),
            "text::printable_json" => text::printable_json(word),
            "text::is_unsafe" => word.chars().filter(|c| text::is_unsafe(*c)).count(),
            "text::alternatives" => text::alternatives(&[word, "", word]),
            "text::listed" => text::listed(&[word], word),
            "text::nearest" => text::nearest(word, &["", word, "resistance"]),
        );
    }
    let words: Vec<&str> = all.iter().map(String::as_str).collect();
    for word in ["", "a", "R"] {
        drive!(calls, word; "text::nearest" => text::nearest(word, &words), "text::alternatives" => text::alternatives(&[]));
    }
    for digits in COUNTS {
        for value in NUMBERS {
            drive!(calls, (value, digits);
                "text::significant" => text::significant(value, digits),
                "text::engineering" => text::engineering(value, "\0", digits),
                "text::decimals" => text::decimals(value, digits),
                "text::SuitableUnit::of" => text::SuitableUnit::of(value, "kg"),
                "text::SuitableUnit::scale" => text::SuitableUnit::of(1e-5, "H").scale(value),
                "text::in_suitable_unit" => ["", "kg*m^2", "1", "\0"]
                    .map(|unit| text::in_suitable_unit(value, Some(value), unit)),
            );
        }
    }
}

pub fn numbers(calls: &mut Calls) {
    for value in NUMBERS {
        drive!(calls, value;
            "numeric::whole" => numeric::whole(value),
            "numeric::whole_u64" => numeric::whole_u64(value),
            "numeric::single" => numeric::single(value),
        );
    }
    for (n, wide) in COUNTS.into_iter().zip(WIDE) {
        drive!(calls, (n, wide);
            "numeric::count" => numeric::count(n),
            "numeric::count_u64" => numeric::count_u64(wide),
            "numeric::index" => numeric::index(wide),
            "numeric::real" => numeric::real(wide.cast_signed()),
            "numeric::wide" => numeric::wide(i128::from(wide) * i128::from(wide.cast_signed())),
            "numeric::chi_square_limit" => numeric::chi_square_limit(n),
        );
    }
    for signal in &signals() {
        drive!(calls, signal;
            "numeric::mean" => numeric::mean(signal),
            "numeric::rms" => numeric::rms(signal),
            "numeric::standard_deviation" => numeric::standard_deviation(signal),
            "numeric::sample_deviation" => numeric::sample_deviation(signal),
            "numeric::peak" => numeric::peak(signal),
            "numeric::extremes" => numeric::extremes(signal),
            "numeric::sum" => numeric::sum(signal),
            "numeric::dot" => numeric::dot(signal, &[1.0; 40]),
            "numeric::sorted" => numeric::sorted(signal),
            "numeric::median" => numeric::median(signal),
            "numeric::upper_median" => numeric::upper_median(&mut signal.clone()),
            "numeric::noise_sigma" => numeric::noise_sigma(signal),
            "numeric::differences" => numeric::differences(signal),
            "numeric::running_sums" => numeric::running_sums(signal.iter().copied()),
            "numeric::slope" => numeric::slope(&signal.iter().map(|v| (*v, *v)).collect::<Vec<_>>()),
            "numeric::runs" => numeric::runs(signal.len(), |n| signal[n] > 0.0),
        );
        for number in NUMBERS {
            drive!(calls, (number, signal);
                "numeric::squares_about" => numeric::squares_about(number, signal),
                "numeric::quantile" => numeric::quantile(signal, number),
                "numeric::order_statistic" => numeric::order_statistic(&mut signal.clone(), number),
            );
        }
        for order in COUNTS {
            // The run time is proportional to the order, so long signals are shortened for large orders.
            let signal = if order > 1000 { &signal[..signal.len().min(100)] } else { signal };
            let signal = if order == 1000 { &signal[..signal.len().min(2000)] } else { signal };
            for penalty in FEW {
                drive!(calls, (order, penalty, signal);
                    "numeric::autoregression" => numeric::autoregression(signal, order, penalty));
            }
        }
    }
}

fn shouted(reference: &Reference) -> String {
    format!("{reference:?}").to_uppercase()
}

pub fn settings_and_errors(calls: &mut Calls) {
    for word in texts() {
        let word = word.as_str();
        for setting in [Setting::Columns, Setting::Sheet] {
            drive!(calls, word;
                "setting::Setting::new" => Setting::new("lock", Form::Word),
                "setting::Setting::to" => setting.to(word),
                "setting::Setting::name" => setting.name(),
                "setting::Setting::form" => setting.form(),
                "setting::Text::from" => Text::from(setting.to(word)),
                "setting::Text::and" => Text::from(word).and(setting.to(word)),
                "setting::Text::push" => Text::default().push(word),
                "setting::Text::is_empty" => Text::from(word).is_empty(),
                "setting::Text::steps" => Text::from(setting.to(word)).steps().count(),
                "setting::Text::spelled" => Text::from(setting.to(word)).spelled(shouted),
                "setting::Text::respelled" => Text::from(setting.to(word)).respelled(|_| Some(String::new())),
            );
        }
        let make = |of: ErrorKind| Error::new(of, word, word).in_file(Path::new(word)).in_part(word).at_line(u64::MAX);
        let error = make(ErrorKind::Data).in_column(word);
        drive!(calls, word;
            "Error::new" => make(ErrorKind::Device),
            "Error::usage" => Error::usage(word, word),
            "Error::data" => Error::data(word, ""),
            "Error::not_identified" => Error::not_identified("", word),
            "Error::in_file" => make(ErrorKind::Data).in_file(Path::new("")),
            "Error::in_part" => make(ErrorKind::Data).in_part(""),
            "Error::at_line" => make(ErrorKind::Data).at_line(None),
            "Error::in_column" => make(ErrorKind::Data).in_column(""),
            "Error::kind" => error.kind(),
            "ErrorKind::name" => error.kind().name(),
            "report::error_document" => motorfit::report::error_document(&error, command_line),
            "Error::path" => error.path(),
            "Error::part" => error.part(),
            "Error::line" => error.line(),
            "Error::column" => error.column(),
            "Error::message" => error.message(),
            "Error::hint" => error.hint(),
            "Error::text" => error.text(),
            "Error::spelled" => error.spelled(shouted),
            "Error::from" => Error::from(motorfit::settings::Fault { setting: Setting::Rate, error: error.clone() }),
            "warning::Warning::new" => Warning::new("", word),
            "warning::Warning::can_cause_poor_fit" => Warning::new("unknown", word).can_cause_poor_fit(),
            "warning::Warning::spelled" => Warning::new("unknown", word).spelled(shouted),
        );
    }
}

pub fn candidates(calls: &mut Calls) {
    let values = [f64::NAN; 6];
    for width in COUNTS {
        for size in 0..values.len() {
            let made = calls.may_panic("candidates::Candidates::new", || Candidates::new(&values[..size], width));
            let Some(made) = made else { continue };
            drive!(calls, (width, size);
                "candidates::Candidates::count" => made.count(),
                "candidates::Candidates::width" => made.width(),
                "candidates::Candidates::values" => made.values().len(),
                "candidates::Candidates::cutoffs" => made.cutoffs().len(),
            );
            for (from, to) in COUNTS.into_iter().zip(COUNTS.into_iter().rev()) {
                calls.may_panic("candidates::Candidates::row", || made.row(from).len());
                calls.may_panic("candidates::Candidates::rows", || made.rows(from, to).count());
                calls.may_panic("candidates::Candidates::with_cutoffs", || {
                    made.with_cutoffs(&values[..from.min(size)]).count()
                });
            }
            drive!(calls, (width, size); "candidates::Candidates::rows" => made.rows(0, made.count()));
            drive!(calls, (width, size); "candidates::Candidates::with_cutoffs" => made.with_cutoffs(&values[..made.count()]));
        }
    }
    drive!(calls, "NaN";
        "channels::by_name" => by_name(&[f64::NAN, f64::INFINITY], serde_json::value::Serializer).is_ok(),
    );
}

pub fn criteria(calls: &mut Calls) {
    for word in texts() {
        ask!(calls, word;
            "criterion::Criterion::from_str" => word.parse::<Criterion>(),
            "named::Named::named" => <Norm as Named>::named(&word, &word),
            "criterion::Norm::named" => <Norm as Named>::named("norm", &word),
            "criterion::Scale::named" => <Scale as Named>::named("scale", &word),
        );
    }
    drive!(calls, ();
        "named::Named::all" => <Norm as Named>::all(),
        "named::Named::names" => <Norm as Named>::names(),
        "named::Named::name" => Named::name(&Norm::Ise),
        "named::Named::text" => Named::text(&Norm::Ise),
    );
    let mut noises = vec![Noise::Estimated];
    noises.extend(NUMBERS.map(Noise::Decibels));
    noises.extend(NUMBERS.map(|sigma| Noise::Sigma([Some(sigma), None])));
    for norm in Norm::ALL {
        drive!(calls, norm;
            "criterion::Norm::name" => norm.name(),
            "criterion::Norm::is_time_weighted" => norm.is_time_weighted(),
        );
        for scale in Scale::ALL {
            for (noise, origin) in noises.iter().zip(NUMBERS.iter().cycle()) {
                let criterion = Criterion { norm, scale, time_origin_s: Some(*origin), noise: *noise };
                drive!(calls, criterion;
                    "criterion::Scale::name" => scale.name(),
                    "criterion::Criterion::is_absolute" => criterion.is_absolute(),
                    "criterion::Criterion::is_integral" => criterion.is_integral(),
                    "criterion::Criterion::weight" => criterion.weight(*origin, *origin),
                    "criterion::Criterion::factor" => criterion.factor(*origin),
                    "criterion::Criterion::cost" => COUNTS.map(|samples| criterion.cost(*origin, samples)),
                    "criterion::Criterion::divisor" => COUNTS.map(|channel| criterion.divisor(channel, &NUMBERS)),
                    "criterion::Noise::sigma" => COUNTS.map(|channel| noise.sigma(channel, &NUMBERS[..5])),
                );
            }
        }
    }
}
