//! Generic terms as texts: names, units and bounds of what they add, and that the text of the result is the model.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::BuiltIn;

fn names(model: &Model) -> Vec<&str> {
    model.parameters().iter().map(|of| of.name.as_str()).collect()
}

#[test]
fn every_model_can_have_every_term_and_is_its_text() {
    for of in BuiltIn::ALL {
        let model = of.model().unwrap();
        let with = model.with_generic(&GenericTerm::ALL).unwrap();
        let again = Model::parse(with.text()).unwrap();
        assert_eq!((again.text(), again.digest()), (with.text(), with.digest()));
        let own = model.parameters().len();
        assert_eq!(names(&with)[..own], names(&model)[..], "{}", of.name());
        let added: Vec<&str> = with.terms()[model.terms().len()..].iter().map(|term| term.name.as_str()).collect();
        let expected: Vec<&str> =
            GenericTerm::ALL.into_iter().filter(|term| term.applies(&model)).map(GenericTerm::name).collect();
        assert_eq!(added, expected, "{}", of.name());
        // Without the terms the parameters added have their neutral values, and those of the model are free.
        let fixed = with.fixed_without(&[]).unwrap();
        assert!(fixed[..own].iter().all(Option::is_none) && fixed[own..].iter().all(Option::is_some));
        assert!(GenericTerm::ALL.into_iter().all(|term| !term.applies(&with)), "{}", of.name());
        assert_eq!(with.with_generic(&GenericTerm::ALL).unwrap().text(), with.text());
    }
}

#[test]
fn terms_act_on_what_lacks_them() {
    let motor = BuiltIn::DcMotor.model().unwrap().with_generic(&GenericTerm::ALL).unwrap();
    assert_eq!(
        names(&motor)[5..],
        ["dead_time", "latency", "sensor_filter", "average_i", "average_w", "offset_i", "offset_w", "load"]
    );
    let lines: Vec<&str> = motor.text().lines().collect();
    for line in [
        "v = { unit = \"V\", column = \"voltage\", description = \"Voltage at the terminals\", delay = \"dead_time\", latency = \"latency\" }",
        "TL = { unit = \"N*m\", column = \"load_torque\", default = 0, description = \"Load torque; zero without a column\", offset = \"load\" }",
        "w = { value = \"w\", unit = \"rad/s\", column = \"speed\", filter = \"sensor_filter\", average = \"average_w\", offset = \"offset_w\" }",
    ] {
        assert!(lines.contains(&line), "{line} in\n{}", motor.text());
    }
    let latency = motor.parameters().iter().find(|of| of.name == "latency").unwrap();
    assert!(latency.is_per_recording && latency.neutral == Some(0.0) && latency.unit.text == "s");
    // The drive of the extended motor has a dead time of its own, on which a latency can follow, and no input is used beside.
    let extended = BuiltIn::DcExtended.model().unwrap();
    assert!(!GenericTerm::DeadTime.applies(&extended) && GenericTerm::Latency.applies(&extended));
    let late = extended.with_generic(&[GenericTerm::DeadTime, GenericTerm::Latency]).unwrap();
    assert_eq!(late.terms().len(), 1);
    assert!(late.text().contains("delay = \"td\", latency = \"latency\""));
    assert!(!GenericTerm::Load.applies(&BuiltIn::Pmsm.model().unwrap().with_generic(&[GenericTerm::Load]).unwrap()));
}

#[test]
fn names_that_are_taken_get_a_number_and_bounds_are_in_the_unit_of_the_output() {
    let text = "format = 1\n[inputs]\nu = {}\n[constants]\nT = { value = 1, unit = \"s\" }\n[parameters]\n\
                offset_n_x = { min = 0, max = 1, neutral = 0, term = \"offset\" }\n[states]\nx = { d = \"(u + offset_n_x - x)/T\" }\n\
                t = { unit = \"K\", d = \"(x*a - t)/T\" }\n[let]\na = \"1*b\"\n[constants2]\n[outputs]\n\"n x\" = { value = \"x\" }\n\
                t = { value = \"t\", unit = \"degC\" }\nn = { value = \"x*w\", unit = \"rpm\" } # a comment\n";
    let text = text
        .replace("[constants2]\n", "")
        .replace("T = {", "b = { value = 1, unit = \"K\" }\nw = { value = 1, unit = \"rad/s\" }\nT = {");
    let model = Model::parse(&text).unwrap().with_generic(&[GenericTerm::Offset]).unwrap();
    assert_eq!(names(&model), ["offset_n_x", "offset_n_x_2", "offset_t", "offset_n"]);
    let terms: Vec<&str> = model.terms().iter().map(|term| term.name.as_str()).collect();
    assert_eq!(terms, ["offset", "offset-2"]);
    let [t, n] = [2, 3].map(|n| &model.parameters()[n]);
    assert_eq!((t.unit.text.as_str(), n.unit.text.as_str()), ("K", "rpm"));
    assert!((t.max - 10.0).abs() < 1e-12 && (n.max - 10.0 * 30.0 / std::f64::consts::PI).abs() < 1e-9);
    assert!(model.text().contains("\"n x\" = { value = \"x\", offset = \"offset_n_x_2\" }"));
}

#[test]
fn texts_are_written_as_they_are_read() {
    for text in ["a \"b\" \\ c", "é→", "line\nbreak\ttab \u{7f}"] {
        let line = format!("x = {}", quote(text));
        let table: toml::de::DeTable<'_> = toml::de::DeTable::parse(&line).unwrap().into_inner();
        assert_eq!(table.get("x").unwrap().get_ref().as_str().unwrap(), text);
    }
}
