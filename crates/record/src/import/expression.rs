//! Expressions of columns: `+ - * / ^ ( )`, numbers, `pi`, names and functions of one argument, parsed once and evaluated row
//! by row. Names are resolved by a function of the caller, which is called first wherever a name is allowed, so that names may
//! contain operators.

use super::parse::{number_length, parse_number};
use motorfit_core::expression::{self, Kind, Language, Operator, Problem, Start};
use motorfit_core::named::{Named as _, named};
use motorfit_core::text::{alternatives, quoted};

/// Length of the longest expression \[bytes\].
pub(super) const LENGTH_MAX: usize = 400;
/// Largest depth of nested parentheses, signs and powers.
pub(super) const DEPTH_MAX: usize = 32;
const ARITHMETIC: [Operator; 5] =
    [Operator::Add, Operator::Subtract, Operator::Multiply, Operator::Divide, Operator::Power];

named! {
    /// A function of one argument.
    pub(super) enum Function {
        /// The sine of an angle in rad.
        Sin = "sin",
        /// The cosine of an angle in rad.
        Cos = "cos",
        /// The absolute value.
        Abs = "abs",
        /// The signed value of an 8-bit integer stored as unsigned (two's complement); negative values are unchanged.
        Int8 = "int8",
        /// The signed value of a 16-bit integer stored as unsigned.
        Int16 = "int16",
        /// The signed value of a 32-bit integer stored as unsigned.
        Int32 = "int32",
        /// The cumulative sum over the rows.
        Cumsum = "cumsum",
    }
}

impl Function {
    /// Returns the value of the function at `x`; NaN outside its domain. The state of a cumulative sum is kept by [`at`].
    fn of(self, x: f64) -> f64 {
        match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Abs => x.abs(),
            Self::Int8 => signed(x, 8),
            Self::Int16 => signed(x, 16),
            Self::Int32 => signed(x, 32),
            Self::Cumsum => x,
        }
    }
}

/// Returns the signed value of the two's complement `x`; NaN if `x` is not an integer of that many bits, signed or unsigned.
fn signed(x: f64, bits: i32) -> f64 {
    let whole = 2f64.powi(bits);
    let half = whole / 2.0;
    match x.fract() == 0.0 && (-half..whole).contains(&x) {
        true if x >= half => x - whole,
        true => x,
        false => f64::NAN,
    }
}

/// A call of a function; the number is the index of a cumulative sum among the sums, and unused otherwise.
type Call = (Function, usize);
/// A node of the syntax tree; `V` is the type to which names are resolved.
type Node<V> = expression::Expression<V, Call>;

/// A parsed expression.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression<V> {
    root: Node<V>,
    sums: usize,
}

/// Syntax error of an expression.
#[derive(Debug, PartialEq)]
pub(super) enum Fault {
    /// An unknown name.
    Name(String),
    /// Any other error: the text found and the expectation.
    Found(String),
}

use Fault::Found;

impl<V: Copy> Expression<V> {
    /// Parses the expression at the start of a text; returns it and the remaining text. `name` is called with the text from a
    /// position at which a name is allowed; it returns the length \[bytes\] and the meaning of the name there, or `None`.
    ///
    /// # Errors
    /// Returns the first syntax error.
    pub(super) fn parse<'a>(
        text: &'a str,
        name: &dyn Fn(&str) -> Option<(usize, V)>,
    ) -> Result<(Self, &'a str), Fault> {
        let mut reader = Reader { text, rest: text.trim_start(), name, sums: 0 };
        let root = expression::parse(&mut reader)?;
        Ok((Self { root, sums: reader.sums }, reader.rest))
    }

    /// Evaluates the expression for each of `rows` rows; `value` returns the value of a name in a row.
    pub(super) fn values(&self, rows: usize, value: &dyn Fn(V, usize) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.sums];
        (0..rows).map(|row| at(&self.root, row, value, &mut sums)).collect()
    }

    /// Returns true if the expression has a cumulative sum.
    pub(super) fn has_sum(&self) -> bool {
        self.sums > 0
    }

    /// Returns the resolved names in the order of the text.
    pub(super) fn names(&self) -> Vec<V> {
        let mut found = Vec::new();
        self.root.names(&mut |name, _| found.push(*name));
        found
    }

    /// Returns the resolved names that are direct arguments of a sine or cosine.
    pub(super) fn angles(&self) -> Vec<V> {
        let mut found = Vec::new();
        self.root.visit(&mut |node| {
            if let Kind::Call((Function::Sin | Function::Cos, _), arguments) = &node.kind
                && let Kind::Name(value) = arguments[0].kind
            {
                found.push(value);
            }
        });
        found
    }
}

/// Returns the value of a node in a row; `sums` holds the cumulative sums up to the row before.
fn at<V: Copy>(node: &Node<V>, row: usize, value: &dyn Fn(V, usize) -> f64, sums: &mut [f64]) -> f64 {
    match &node.kind {
        Kind::Number(number) => *number,
        Kind::Name(name) => value(*name, row),
        Kind::Negative(inner) => -at(inner, row, value, sums),
        Kind::Call((Function::Cumsum, index), arguments) => {
            let term = at(&arguments[0], row, value, sums);
            sums[*index] += term;
            sums[*index]
        }
        Kind::Call((function, _), arguments) => function.of(at(&arguments[0], row, value, sums)),
        Kind::Binary(operator, left, right) => {
            let (left, right) = (at(left, row, value, sums), at(right, row, value, sums));
            match operator {
                Operator::Add => left + right,
                Operator::Subtract => left - right,
                Operator::Multiply => left * right,
                Operator::Divide => left / right,
                Operator::Power => left.powf(right),
                // The language has no conditions.
                _ => f64::NAN,
            }
        }
        Kind::Not(_) => f64::NAN,
    }
}

/// The text of an expression and the rest of it, which does not begin with a blank.
struct Reader<'a, 'n, V> {
    text: &'a str,
    rest: &'a str,
    name: &'n dyn Fn(&str) -> Option<(usize, V)>,
    sums: usize,
}

impl<V: Copy> Reader<'_, '_, V> {
    /// Returns the byte of the next token.
    fn at(&self) -> usize {
        self.text.len() - self.rest.len()
    }

    /// Takes a token of some bytes and the blanks after it.
    fn skip(&mut self, bytes: usize) {
        self.rest = self.rest.get(bytes..).unwrap_or_default().trim_start();
    }

    /// Takes a number, a name or an opening bracket.
    fn value(&mut self) -> Result<Start<V, Call>, Fault> {
        let word: String = self.rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let is_called = self.rest[word.len()..].trim_start().starts_with('(');
        let function = Function::ALL.into_iter().find(|function| function.name() == word && is_called);
        // A heading such as `abs(x)` takes precedence over the function, as it is longer than the function's name.
        if let Some((length, value)) =
            (self.name)(self.rest).filter(|(length, _)| function.is_none() || *length > word.len())
        {
            self.skip(length);
            return Ok(Start::Name(value));
        }
        if let Some(function) = function {
            self.skip(word.len());
            let open = self.at();
            self.skip(1);
            let index = self.sums;
            self.sums += usize::from(function == Function::Cumsum);
            return Ok(Start::Call((function, index), open));
        }
        if self.rest.starts_with('(') {
            self.skip(1);
            return Ok(Start::Bracket);
        }
        let length = number_length(self.rest);
        if let Ok(number) = parse_number(&self.rest[..length], false) {
            self.skip(length);
            return Ok(Start::Number(number));
        }
        match word.as_str() {
            "pi" => {
                self.skip(word.len());
                Ok(Start::Number(std::f64::consts::PI))
            }
            "" => Err(Found(format!("{}, expected a name or a number", shown(self.rest)))),
            _ if is_called => {
                let functions = alternatives(&Function::names());
                Err(Found(format!("{}, expected one of the functions {functions}", quoted(&word))))
            }
            _ => Err(Fault::Name(word)),
        }
    }
}

impl<V: Copy> Language for Reader<'_, '_, V> {
    type Name = V;
    type Function = Call;
    type Fault = Fault;

    const LEVELS_MAX: usize = DEPTH_MAX + 1;
    const COUNTS_OPERANDS: bool = false;
    const HAS_LISTS: bool = false;

    fn start(&mut self) -> Result<(usize, Start<V, Call>), Fault> {
        let at = self.at();
        let start = match self.rest.as_bytes().first() {
            Some(b'-') => Start::Negative,
            Some(b'+') => Start::Positive,
            _ => return Ok((at, self.value()?)),
        };
        self.skip(1);
        Ok((at, start))
    }

    fn operator(&self) -> Option<(usize, Operator)> {
        let is_next = |operator: &Operator| self.rest.starts_with(operator.name());
        ARITHMETIC.into_iter().find(is_next).map(|operator| (self.at(), operator))
    }

    fn is_next(&self, sign: &str) -> bool {
        self.rest.starts_with(sign)
    }

    fn take(&mut self, sign: &str) {
        self.skip(sign.len());
    }

    fn arguments(_: &Call) -> usize {
        1
    }

    fn fault(&self, problem: Problem<Call>) -> Fault {
        Found(match problem {
            Problem::Levels => format!("more than {DEPTH_MAX} levels of parentheses, signs and powers"),
            _ => format!("{}, expected an operation or a closing parenthesis", shown(self.rest)),
        })
    }
}

/// Returns the rest of an expression as it is named in messages.
fn shown(rest: &str) -> String {
    if rest.is_empty() { "the end".to_owned() } else { quoted(rest) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates an expression for rows of `x`, with `y = 2x`.
    fn values(text: &str, x: &[f64]) -> Result<Vec<f64>, String> {
        let name = |text: &str| {
            ["x", "y", "a-b", "abs(x)z"]
                .into_iter()
                .enumerate()
                .rev()
                .find_map(|(n, name)| text.starts_with(name).then_some((name.len(), n)))
        };
        let (expression, rest) = Expression::parse(text, &name).map_err(|fault| format!("{fault:?}"))?;
        if !rest.is_empty() {
            return Err(rest.to_owned());
        }
        Ok(expression.values(x.len(), &|name, row| x[row] * [1.0, 2.0, 10.0, 100.0][name]))
    }

    fn value(text: &str) -> f64 {
        values(text, &[3.0]).unwrap_or_else(|e| panic!("{text}: {e}"))[0]
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "whole numbers")]
    fn precedence_is_the_usual_one() {
        for (text, expected) in [
            ("x", 3.0),
            ("1+x*2", 7.0),
            ("(1+x)*2", 8.0),
            ("2^x^2", 512.0),
            ("-x^2", -9.0),
            ("2^-x*8", 1.0),
            ("- -x", 3.0),
            ("x-y-1", -4.0),
            ("12/x/2", 2.0),
            (" y * 1e-1 - +x ", -2.4),
            ("x*-2", -6.0),
            ("a-b/10", 3.0),
            ("abs(-x)+abs(x)z", 303.0),
            ("int8(x+125)", -128.0),
            ("int8(-x)", -3.0),
            ("int16(65535)", -1.0),
            ("int32(2^32-2)", -2.0),
        ] {
            assert!((value(text) - expected).abs() < 1e-12, "{text}: {}", value(text));
        }
        assert!((value("sin(pi/6)+cos(0)") - 1.5).abs() < 1e-15);
        for none in ["int8(256)", "int8(0.5)", "int16(-40000)", "0/0"] {
            assert!(value(none).is_nan(), "{none}");
        }
    }

    #[test]
    fn sums_run_over_the_rows() {
        assert_eq!(values("cumsum(x)/2+cumsum(1)", &[1.0, 2.0, 4.0]), Ok(vec![1.5, 3.5, 6.5]));
        assert_eq!(values("cumsum(cumsum(x))", &[1.0, 2.0, 4.0]), Ok(vec![1.0, 4.0, 11.0]));
    }

    #[test]
    fn levels_are_those_of_parentheses_signs_and_powers() {
        let nested = |levels: usize| format!("1-{}x{}", "2*(".repeat(levels), ")".repeat(levels));
        assert!(values(&nested(DEPTH_MAX), &[1.0]).is_ok());
        assert!(values(&nested(DEPTH_MAX + 1), &[1.0]).is_err_and(|error| error.contains("32 levels")));
    }

    #[test]
    fn syntax_errors_are_named() {
        for (text, part) in [
            ("x+", "the end"),
            ("x+*2", "*2"),
            ("(x", "closing"),
            ("tan(x)", "sin, cos, abs"),
            ("q", "Name(\"q\")"),
            ("x)", ")"),
            ("x y", "y"),
            ("x<y", "<y"),
            ("sin()", "Found(\"\\\")\\\", expected a name or a number\")"),
            ("sin(x, y)", "Found(\"\\\", y)\\\", expected an operation or a closing parenthesis\")"),
            ("", "the end"),
            (&"(".repeat(1000), "32 levels"),
            (&"-".repeat(1000), "32 levels"),
            (&format!("x{}", "^x".repeat(1000)), "32 levels"),
        ] {
            let error = values(text, &[1.0]).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
