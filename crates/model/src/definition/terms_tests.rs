//! Optional terms: what is free with which terms, and errors with their places.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::Model;

/// Returns the text of a model with more lines of parameters, for the equation `x' = b u + more - x`.
fn text(parameters: &str, more: &str) -> String {
    format!(
        "format = 1\n[inputs]\nu = {{ unit = \"1\" }}\n[constants]\nT = {{ value = 1, unit = \"s\" }}\n[parameters]\nb = {{ min = 0, max = 1 }}\n\
         {parameters}\n[states]\nx = {{ unit = \"1\", d = \"(b*u + {more} - x)/T\" }}\n[outputs]\nx = {{ value = \"x\" }}\n"
    )
}

const STRIBECK: &str = "Ts = { min = 0, max = 1, neutral = 0, term = [\"stribeck\", \"load-stribeck\"] }\n\
                        ws = { min = 0.01, max = 1, log = true, term = [\"stribeck\", \"load-stribeck\"] }\n\
                        wv = { min = 1, max = 3, value = 1.5, term = \"load-stribeck\" }\n\
                        mu = { min = 0.1, max = 2, log = true, neutral = 0, term = \"load-stribeck\" }\n\
                        c = { min = 0, max = 1, neutral = 0.25 }";

#[test]
fn parameters_are_free_with_the_terms_that_are_taken() {
    let model = Model::parse(&text(STRIBECK, "Ts*exp(-x^2/ws) + mu*wv + c")).unwrap();
    let terms: Vec<(&str, &[usize])> = model.terms().iter().map(|of| (&*of.name, &*of.parameters)).collect();
    assert_eq!(terms, [("stribeck", &[1, 2][..]), ("load-stribeck", &[1, 2, 3, 4]), ("c", &[5])]);
    // Of b, Ts, ws (whose middle is that of its logarithm), wv (whose usual value is given), mu and c.
    let [ts, ws, wv, mu, c] = [Some(0.0), Some(0.1), Some(1.5), Some(0.0), Some(0.25)];
    for (taken, expected) in [
        (&[][..], [None, ts, ws, wv, mu, c]),
        (&["stribeck"], [None, None, None, wv, mu, c]),
        (&["load-stribeck"], [None, None, None, None, None, c]),
        (&["c"], [None, ts, ws, wv, mu, None]),
        (&["stribeck", "load-stribeck", "c"], [None; 6]),
    ] {
        let found = model.fixed_without(taken).unwrap();
        let is_same = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-12,
            (a, b) => a.is_none() && b.is_none(),
        };
        assert!(found.iter().zip(&expected).all(is_same), "{taken:?}: {found:?}");
    }
    let error = model.fixed_without(&["stribek"]).unwrap_err();
    assert_eq!(error.hint().to_string(), "Did you mean \"stribeck\"?");
    let none = Model::parse(&text("", "0")).unwrap();
    assert!(
        none.terms().is_empty() && none.fixed_without(&[]).unwrap() == [None] && none.fixed_without(&["b"]).is_err()
    );
}

#[test]
fn wrong_terms_are_named_with_their_place() {
    for (parameters, more, column, message) in [
        ("c = { min = 0, max = 1, term = \"c\" }", "c", 33, "no parameter of the term \"c\" has a neutral value"),
        ("c = { min = 0, max = 1, neutral = 0, term = \"\" }", "c", 46, "\"\" cannot be the name of a term"),
        ("c = { min = 0, max = 1, neutral = 0, term = \"a,b\" }", "c", 46, "\"a,b\" cannot be the name of a term"),
        ("c = { min = 0, max = 1, neutral = 0, term = \"auto\" }", "c", 46, "\"auto\" cannot be the name of a term"),
        ("c = { min = 0, max = 1, neutral = 0, term = [] }", "c", 45, "the list of terms is empty"),
        ("c = { min = 0, max = 1, neutral = 0, term = [\"a\", \"a\"] }", "c", 52, "the term \"a\" is there twice"),
        ("c = { min = 0, max = 1, neutral = 0, term = [\"a\", 2] }", "c", 51, "\"term\" is not a text"),
        ("c = { min = 0, max = 1, neutral = \"0\" }", "c", 35, "neutral is not a finite number"),
        ("c = { min = 0, max = 1, neutral = 1e31 }", "c", 35, "the neutral value 1e31 is too large"),
        ("c = { min = 1, max = 2, neutral = 0 }", "x/c", 1, "the equations are not defined where c = 0"),
        (
            "c = { min = 1, max = 2, neutral = 0 }\ne = { min = 1, max = 2, neutral = 0 }",
            "x/(c + e)",
            1,
            "the equations are not defined where all terms are neutral",
        ),
    ] {
        let error = Model::parse(&text(parameters, more)).unwrap_err();
        assert_eq!(error.message().to_string(), message, "{parameters}");
        assert_eq!((error.line(), error.column()), (Some(8), Some(column.to_string().as_str())), "{parameters}");
        assert!(!error.hint().to_string().is_empty());
    }
}
