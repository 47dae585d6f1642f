//! Calls of `settings`: values and their syntax.

use crate::hostile::arguments::{NUMBERS, WIDE, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::Error;
use motorfit::identify::{IdentifySpec, Polish};
use motorfit::setting::Setting;
use motorfit::settings::parse::{
    auto_bounds, bounds, motor, named, named_ranges, noise, number, pair, parameters, ranges,
};
use motorfit::settings::{
    DEVICE, Given, PROBLEM, READING, SEARCH, Value, device, identify, method, problem, reading, with_intersample_of,
};

pub fn languages(calls: &mut Calls) {
    for word in texts() {
        let lists =
            [vec![], vec![word.clone()], vec![word.clone(), word.clone()], vec![format!("R={word}"), word.clone()]];
        ask!(calls, word;
            "settings::parse::motor" => motor(&word),
            "settings::parse::motor" => motor(&format!("m2,{word}")),
            "settings::parse::noise" => noise(&word),
            "settings::parse::noise" => noise(&format!("i={word},w={word}")),
        );
        for setting in [Setting::Bounds, Setting::Fix, Setting::Shard] {
            ask!(calls, (setting, &word);
                "settings::parse::pair" => pair(&word, setting, &word),
                "settings::parse::number" => number(&word, setting),
            );
            for items in &lists {
                ask!(calls, (setting, items);
                    "settings::parse::parameters" => parameters(items, setting),
                    "settings::parse::ranges" => ranges(items, setting),
                    "settings::parse::named_ranges" => named_ranges(items, setting),
                    "settings::parse::named" => named(items, setting),
                );
            }
        }
        for items in &lists {
            ask!(calls, items;
                "settings::parse::bounds" => bounds(items),
                "settings::parse::auto_bounds" => auto_bounds(items),
            );
            for name in ["auto", "sm", "ga", &word] {
                ask!(calls, (name, items); "settings::method" => method(name, items));
            }
        }
    }
}

/// Returns values of all kinds.
fn every_value() -> Vec<Value> {
    let mut all = vec![Value::Switch(true), Value::Switch(false), Value::List(Vec::new())];
    all.extend(NUMBERS.map(Value::Number));
    all.extend(WIDE.map(Value::Count));
    for word in texts() {
        all.push(Value::List(vec![word.clone(), word.clone()]));
        all.push(Value::Text(word));
    }
    all
}

pub fn given(calls: &mut Calls) {
    let all: Vec<Setting> = [&READING[..], &SEARCH, &PROBLEM, &DEVICE].concat();
    for (setting, value) in all.iter().flat_map(|s| every_value().into_iter().map(move |v| (*s, v))) {
        let mut given = Given::default();
        let with = (setting, &value);
        drive!(calls, with;
            "settings::Given::put" => given.put(setting, value.clone()),
            "settings::Given::has" => given.has(setting),
            "settings::Given::switch" => given.switch(setting),
            "settings::Given::number" => given.number(setting),
            "settings::Given::count" => given.count(setting),
            "settings::Given::text" => given.text(setting).map(str::len),
            "settings::Given::list" => given.list(setting).len(),
            "settings::with_intersample_of" => with_intersample_of(IdentifySpec::default(), &given, &[]),
            "settings::Given::and" => given.and(&given).and(&Given::default()).has(setting),
        );
        ask!(calls, with;
            "settings::Given::read" => given.read(setting, str::parse::<motorfit::study::sweep::Shard>).map_err(Error::from),
            "settings::Given::items" => given.items(setting, |items| named(items, setting)).map_err(Error::from),
            "settings::Given::choice" => given.choice::<Polish>(setting).map_err(Error::from),
            "settings::reading" => reading(&given).map_err(Error::from),
            "settings::device" => device(&given).map_err(Error::from),
            "settings::problem" => problem(&given).map_err(Error::from),
            "settings::identify" => identify(&given).map_err(Error::from),
        );
    }
    drive!(calls, ();
        "record::limits" => motorfit::record::limits(),
        "study::limits" => motorfit::study::limits(),
    );
}
