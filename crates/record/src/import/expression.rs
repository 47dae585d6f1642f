//! Expressions: `+ - * / ^ ( )`, numbers, `pi`, names and functions of one argument, parsed once and evaluated row by row.
//!
//! Precedence from high to low: `^` (right-associative), sign, `*` and `/`, `+` and `-`. Names are resolved by a function of
//! the caller, which is called first wherever a name is allowed, so that names may contain operators.

use super::parse::{number_length, parse_number};
use motorfit_core::named::{Named as _, named};
use motorfit_core::text::{alternatives, quoted};

/// Length of the longest expression \[bytes\].
pub(super) const LENGTH_MAX: usize = 400;
/// Largest depth of nested parentheses, signs and powers.
pub(super) const DEPTH_MAX: usize = 32;

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

/// A node of the syntax tree; `V` is the type to which names are resolved.
#[derive(Debug, Clone, PartialEq)]
enum Node<V> {
    Number(f64),
    Value(V),
    Negative(Box<Self>),
    /// A function; the number is the index of a cumulative sum among the sums, and unused otherwise.
    Function(Function, usize, Box<Self>),
    Operation(u8, Box<Self>, Box<Self>),
}

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
        let mut parser = Parser { rest: text, name, sums: 0 };
        let root = parser.sum(0)?;
        Ok((Self { root, sums: parser.sums }, parser.rest.trim_start()))
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
        visit(&self.root, &mut |node| found.extend(if let Node::Value(value) = node { Some(*value) } else { None }));
        found
    }

    /// Returns the resolved names that are direct arguments of a sine or cosine.
    pub(super) fn angles(&self) -> Vec<V> {
        let mut found = Vec::new();
        visit(&self.root, &mut |node| {
            if let Node::Function(Function::Sin | Function::Cos, _, inner) = node
                && let Node::Value(value) = **inner
            {
                found.push(value);
            }
        });
        found
    }
}

/// Calls `see` for each node of a tree, parents first.
fn visit<V>(node: &Node<V>, see: &mut dyn FnMut(&Node<V>)) {
    see(node);
    match node {
        Node::Number(_) | Node::Value(_) => {}
        Node::Negative(inner) | Node::Function(_, _, inner) => visit(inner, see),
        Node::Operation(_, left, right) => {
            visit(left, see);
            visit(right, see);
        }
    }
}

/// Returns the value of a node in a row; `sums` holds the cumulative sums up to the row before.
fn at<V: Copy>(node: &Node<V>, row: usize, value: &dyn Fn(V, usize) -> f64, sums: &mut [f64]) -> f64 {
    match node {
        Node::Number(number) => *number,
        Node::Value(name) => value(*name, row),
        Node::Negative(inner) => -at(inner, row, value, sums),
        Node::Function(Function::Cumsum, index, inner) => {
            let term = at(inner, row, value, sums);
            sums[*index] += term;
            sums[*index]
        }
        Node::Function(function, _, inner) => function.of(at(inner, row, value, sums)),
        Node::Operation(sign, left, right) => {
            let (left, right) = (at(left, row, value, sums), at(right, row, value, sums));
            match sign {
                b'+' => left + right,
                b'-' => left - right,
                b'*' => left * right,
                b'/' => left / right,
                _ => left.powf(right),
            }
        }
    }
}

/// A recursive-descent parser with a method for each level of precedence.
struct Parser<'a, 'n, V> {
    rest: &'a str,
    name: &'n dyn Fn(&str) -> Option<(usize, V)>,
    sums: usize,
}

impl<V: Copy> Parser<'_, '_, V> {
    /// Consumes the next character if it is one of `signs`.
    fn sign(&mut self, signs: &[u8]) -> Option<u8> {
        let rest = self.rest.trim_start();
        let sign = *rest.as_bytes().first().filter(|sign| signs.contains(sign))?;
        self.rest = &rest[1..];
        Some(sign)
    }

    fn sum(&mut self, depth: usize) -> Result<Node<V>, Fault> {
        let mut left = self.product(depth)?;
        while let Some(sign) = self.sign(b"+-") {
            left = Node::Operation(sign, Box::new(left), Box::new(self.product(depth)?));
        }
        Ok(left)
    }

    fn product(&mut self, depth: usize) -> Result<Node<V>, Fault> {
        let mut left = self.signed(depth)?;
        while let Some(sign) = self.sign(b"*/") {
            left = Node::Operation(sign, Box::new(left), Box::new(self.signed(depth)?));
        }
        Ok(left)
    }

    fn signed(&mut self, depth: usize) -> Result<Node<V>, Fault> {
        if depth > DEPTH_MAX {
            return Err(Found(format!("more than {DEPTH_MAX} levels of parentheses, signs and powers")));
        }
        match self.sign(b"+-") {
            Some(b'-') => Ok(Node::Negative(Box::new(self.signed(depth + 1)?))),
            Some(_) => self.signed(depth + 1),
            None => {
                let base = self.primary(depth)?;
                match self.sign(b"^") {
                    None => Ok(base),
                    Some(sign) => Ok(Node::Operation(sign, Box::new(base), Box::new(self.signed(depth + 1)?))),
                }
            }
        }
    }

    fn primary(&mut self, depth: usize) -> Result<Node<V>, Fault> {
        self.rest = self.rest.trim_start();
        let word: String = self.rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let following = self.rest[word.len()..].trim_start();
        let function = Function::ALL.into_iter().find(|function| function.name() == word && following.starts_with('('));
        // A heading such as `abs(x)` takes precedence over the function, as it is longer than the function's name.
        if let Some((length, value)) =
            (self.name)(self.rest).filter(|(length, _)| function.is_none() || *length > word.len())
        {
            self.rest = self.rest.get(length..).unwrap_or_default();
            return Ok(Node::Value(value));
        }
        if let Some(function) = function {
            self.rest = &following[1..];
            let inner = Box::new(self.closed(depth)?);
            let index = self.sums;
            self.sums += usize::from(function == Function::Cumsum);
            return Ok(Node::Function(function, index, inner));
        }
        if self.sign(b"(").is_some() {
            return self.closed(depth);
        }
        let length = number_length(self.rest);
        if let Ok(number) = parse_number(&self.rest[..length], false) {
            self.rest = &self.rest[length..];
            return Ok(Node::Number(number));
        }
        match word.as_str() {
            "pi" => {
                self.rest = &self.rest[word.len()..];
                Ok(Node::Number(std::f64::consts::PI))
            }
            "" if self.rest.is_empty() => Err(Found("the end, expected a name or a number".to_owned())),
            "" => Err(Found(format!("{}, expected a name or a number", quoted(self.rest)))),
            _ if following.starts_with('(') => {
                let functions = alternatives(&Function::names());
                Err(Found(format!("{}, expected one of the functions {functions}", quoted(&word))))
            }
            _ => Err(Fault::Name(word)),
        }
    }

    /// Parses a sum and the closing parenthesis after it.
    fn closed(&mut self, depth: usize) -> Result<Node<V>, Fault> {
        let inner = self.sum(depth + 1)?;
        if self.sign(b")").is_none() {
            let found = self.rest.trim_start();
            let found = if found.is_empty() { "the end".to_owned() } else { quoted(found) };
            return Err(Found(format!("{found}, expected an operation or a closing parenthesis")));
        }
        Ok(inner)
    }
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
    fn syntax_errors_are_named() {
        for (text, part) in [
            ("x+", "the end"),
            ("x+*2", "*2"),
            ("(x", "closing"),
            ("tan(x)", "sin, cos, abs"),
            ("q", "Name(\"q\")"),
            ("x)", ")"),
            ("x y", "y"),
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
