//! Parser by operator precedence (V. R. Pratt, Top Down Operator Precedence, 1973).

use super::functions::Function;
use super::lexer::{Token, tokens};
use super::{Expression, Fault, Kind, Operator};
use motorfit_core::text::{counted, nearest, quoted};

/// Largest depth of nested brackets and operators.
pub(crate) const DEPTH_MAX: usize = 100;
/// Largest number of operators in a row, together with the depth at which they are.
const CHAIN_MAX: usize = 300;
/// Precedence of a unary sign: tighter than a product, looser than a power.
const UNARY: u8 = 6;

/// Returns operator and precedence of a sign.
fn binary(sign: &str) -> Option<(Operator, u8)> {
    Some(match sign {
        "||" => (Operator::Or, 1),
        "&&" => (Operator::And, 2),
        "<" => (Operator::Less, 3),
        "<=" => (Operator::LessEqual, 3),
        ">" => (Operator::Greater, 3),
        ">=" => (Operator::GreaterEqual, 3),
        "+" => (Operator::Add, 4),
        "-" => (Operator::Subtract, 4),
        "*" => (Operator::Multiply, 5),
        "/" => (Operator::Divide, 5),
        "^" => (Operator::Power, 7),
        _ => return None,
    })
}

/// Parses an expression.
pub(crate) fn parse(text: &str) -> Result<Expression, Fault> {
    let mut parser = Parser { tokens: tokens(text)?, next: 0, depth: 0 };
    let expression = parser.expression(0)?;
    match parser.peek() {
        (_, Token::End) => Ok(expression),
        (at, token) => {
            let hint = match token {
                Token::Sign(")") => "Remove it, or add the bracket that it closes.",
                Token::Sign(",") => {
                    "Only the arguments of a function are separated by commas; write decimals with a point."
                }
                _ => "Write an operator between two values.",
            };
            Err(Fault::new(*at, format!("{} is not expected here", token.shown()), hint))
        }
    }
}

struct Parser {
    tokens: Vec<(usize, Token)>,
    next: usize,
    depth: usize,
}

impl Parser {
    /// Returns the next token; the last one, the end, stays.
    fn peek(&self) -> &(usize, Token) {
        &self.tokens[self.next.min(self.tokens.len() - 1)]
    }

    fn take(&mut self) -> (usize, Token) {
        let token = self.peek().clone();
        self.next += 1;
        token
    }

    /// Parses operators of at least a precedence.
    fn expression(&mut self, least: u8) -> Result<Expression, Fault> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            let hint = "Name parts of the expression in [let].";
            return Err(Fault::new(self.peek().0, format!("nested deeper than {DEPTH_MAX} levels"), hint));
        }
        let mut left = self.operand()?;
        // A chain of operators makes the tree as deep as it is long; later stages walk the tree by recursion.
        let mut chain = self.depth;
        while let (at, Token::Sign(sign)) = *self.peek()
            && let Some((operator, precedence)) = binary(sign)
            && precedence >= least
        {
            self.next += 1;
            chain += 1;
            if chain > CHAIN_MAX {
                let message = format!("more than {CHAIN_MAX} operators in a row");
                return Err(Fault::new(at, message, "Name parts of the expression in [let]."));
            }
            // A power is right-associative.
            let right = self.expression(if operator == Operator::Power { precedence } else { precedence + 1 })?;
            if precedence == 3 && matches!(self.peek().1, Token::Sign("<" | "<=" | ">" | ">=")) {
                let hint = "Join two comparisons by &&: a < b && b < c.";
                return Err(Fault::new(self.peek().0, "comparisons cannot be chained", hint));
            }
            left = Expression { at, kind: Kind::Binary(operator, Box::new(left), Box::new(right)) };
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operand(&mut self) -> Result<Expression, Fault> {
        let (at, token) = self.take();
        let kind = match token {
            Token::Number(value) => Kind::Number(value),
            Token::Sign("-") => Kind::Negative(Box::new(self.expression(UNARY)?)),
            Token::Sign("+") => return self.expression(UNARY),
            Token::Sign("!") => Kind::Not(Box::new(self.expression(UNARY)?)),
            Token::Sign("(") => {
                let inner = self.expression(0)?;
                self.close(at)?;
                return Ok(inner);
            }
            Token::Name(name) if self.peek().1 == Token::Sign("(") => self.call(&name, at)?,
            Token::Name(name) => Kind::Name(name),
            Token::End => {
                return Err(Fault::new(at, "a value is missing at the end", "Complete the expression."));
            }
            Token::Sign(sign) => {
                return Err(Fault::new(
                    at,
                    format!("a value is missing before \"{sign}\""),
                    "Complete the expression.",
                ));
            }
        };
        Ok(Expression { at, kind })
    }

    /// Takes the bracket that closes the one at `open`.
    fn close(&mut self, open: usize) -> Result<(), Fault> {
        let (at, token) = self.take();
        if token == Token::Sign(")") {
            return Ok(());
        }
        let message = format!("\")\" is missing before {}", token.shown());
        Err(Fault::new(at, message, format!("Close the bracket at character {} of the expression.", open + 1)))
    }

    fn call(&mut self, name: &str, at: usize) -> Result<Kind, Fault> {
        let named = Function::ALL.into_iter().find(|function| function.name() == name);
        let Some(function) = named else {
            let names: Vec<&str> = Function::ALL.iter().map(|function| function.name()).collect();
            let hint = match (name, nearest(name, &names)) {
                ("ln", _) => "The natural logarithm is log.".to_owned(),
                (_, Some(near)) => format!("Did you mean \"{near}\"?"),
                _ => format!("The functions are {}.", names.join(", ")),
            };
            return Err(Fault::new(at, format!("{} is not a function", quoted(name)), hint));
        };
        let open = self.take().0;
        let mut arguments = Vec::new();
        if self.peek().1 != Token::Sign(")") {
            loop {
                arguments.push(self.expression(0)?);
                if self.peek().1 != Token::Sign(",") {
                    break;
                }
                self.next += 1;
            }
        }
        self.close(open)?;
        if arguments.len() != function.arguments() {
            let expected = counted(function.arguments(), "argument");
            return Err(Fault::new(at, format!("{name} has {}, found {}", expected, arguments.len()), usage(function)));
        }
        Ok(Kind::Call(function, arguments))
    }
}

/// Returns the hint on the arguments of a function.
fn usage(function: Function) -> String {
    use motorfit_core::named::Named;
    format!("{}: {}.", function.name(), function.text())
}
