//! Equations as MathML, which browsers typeset without a script.

use motorfit_model::{Equation, Formula, FormulaKind};

/// Returns an equation; the left side of a state is its derivative.
pub(super) fn equation(of: &Equation) -> String {
    let left = name(&of.name);
    let left = match of.section {
        "states" => format!(
            "<mfrac><mrow><mi mathvariant=\"normal\">d</mi>{left}</mrow><mrow><mi mathvariant=\"normal\">d</mi><mi>t</mi></mrow></mfrac>"
        ),
        _ => left,
    };
    let right = of.formula().map_or_else(|| text(&of.text), |formula| row(&formula, 0));
    format!("<math display=\"block\"><mrow>{left}<mo>=</mo>{right}</mrow></math>")
}

/// Returns a name: the first letter, or a Greek one, with the other letters as an index.
fn name(name: &str) -> String {
    const GREEK: [(&str, &str); 12] = [
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("delta", "δ"),
        ("theta", "θ"),
        ("lambda", "λ"),
        ("mu", "μ"),
        ("phi", "φ"),
        ("psi", "ψ"),
        ("tau", "τ"),
        ("omega", "ω"),
        ("pi", "π"),
    ];
    let greek = GREEK.iter().find_map(|(word, letter)| Some((*letter, name.strip_prefix(word)?)));
    let whole = name.chars().count() > 4 || name.contains('_');
    let (first, rest) = match greek {
        Some((letter, rest)) => (letter.to_owned(), rest.to_owned()),
        None if whole && !name.contains('_') => (name.to_owned(), String::new()),
        None => {
            let mut letters = name.chars();
            (letters.next().map(String::from).unwrap_or_default(), letters.collect())
        }
    };
    let rest = rest.trim_start_matches('_').replace('_', " ");
    match rest.is_empty() {
        true => format!("<mi>{}</mi>", escaped(&first)),
        false => format!("<msub><mi>{}</mi><mi mathvariant=\"normal\">{}</mi></msub>", escaped(&first), escaped(&rest)),
    }
}

fn text(of: &str) -> String {
    format!("<mtext>{}</mtext>", escaped(of))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn operator(sign: &str) -> String {
    format!("<mo>{}</mo>", escaped(sign))
}

fn bracketed(inner: &str) -> String {
    format!("<mrow><mo>(</mo>{inner}<mo>)</mo></mrow>")
}

/// Returns a formula, in brackets if it binds less than `least`.
fn row(formula: &Formula, least: u8) -> String {
    let (own, text) = match formula.kind() {
        FormulaKind::Number(value) => (9, format!("<mn>{}</mn>", escaped(&value.to_string()))),
        FormulaKind::Name(of) => (9, name(of)),
        FormulaKind::Negative(inner) => (5, format!("<mo>−</mo>{}", row(&inner, 6))),
        FormulaKind::Not(inner) => (5, format!("<mo>¬</mo>{}", row(&inner, 6))),
        FormulaKind::Fraction(above, below) => {
            (9, format!("<mfrac><mrow>{}</mrow><mrow>{}</mrow></mfrac>", row(&above, 0), row(&below, 0)))
        }
        FormulaKind::Power(base, exponent) => {
            (8, format!("<msup><mrow>{}</mrow><mrow>{}</mrow></msup>", row(&base, 9), row(&exponent, 0)))
        }
        FormulaKind::Binary(sign, precedence, left, right) => {
            let shown = match sign {
                "*" => "<mo>&#x2062;</mo>".to_owned(),
                "-" => operator("−"),
                "<=" => operator("≤"),
                ">=" => operator("≥"),
                "&&" => operator("∧"),
                "||" => operator("∨"),
                sign => operator(sign),
            };
            (precedence, format!("{}{shown}{}", row(&left, precedence), row(&right, precedence + 1)))
        }
        FormulaKind::Call("sqrt", arguments) => (9, format!("<msqrt>{}</msqrt>", list(&arguments))),
        FormulaKind::Call("abs", arguments) => (9, format!("<mrow><mo>|</mo>{}<mo>|</mo></mrow>", list(&arguments))),
        FormulaKind::Call("select", arguments) => (9, cases(&arguments)),
        FormulaKind::Call(function, arguments) => {
            (9, format!("<mi mathvariant=\"normal\">{function}</mi><mo>&#x2061;</mo>{}", bracketed(&list(&arguments))))
        }
    };
    if own < least { bracketed(&text) } else { format!("<mrow>{text}</mrow>") }
}

fn list(arguments: &[Formula]) -> String {
    arguments.iter().map(|argument| row(argument, 0)).collect::<Vec<_>>().join("<mo>,</mo>")
}

fn cases(arguments: &[Formula]) -> String {
    let [condition, then, otherwise] = arguments else { return list(arguments) };
    let line = |value: &Formula, when: String| format!("<mtr><mtd>{}</mtd><mtd>{when}</mtd></mtr>", row(value, 0));
    let first = line(then, format!("<mtext>if </mtext>{}", row(condition, 0)));
    let second = line(otherwise, "<mtext>otherwise</mtext>".to_owned());
    format!("<mrow><mo>{{</mo><mtable columnalign=\"left\">{first}{second}</mtable></mrow>")
}
