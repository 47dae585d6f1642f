//! The language of models: its tokens for the parser, and its messages.

use super::fault::Fault;
use super::functions::Function;
use super::lexer::{Token, tokens};
use super::tree::{Expression, Operator};
use motorfit_core::expression::{CHAIN_MAX, Language, Problem, Start, parse as parse_with};
use motorfit_core::named::Named as _;
use motorfit_core::text::{counted, nearest, quoted};

/// Largest depth of nested brackets and operators.
pub(crate) const DEPTH_MAX: usize = 100;

/// Parses an expression.
pub(crate) fn parse(text: &str) -> Result<Expression, Fault> {
    let mut reader = Reader { tokens: tokens(text)?, next: 0 };
    let expression = parse_with(&mut reader)?;
    match reader.peek() {
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

/// The tokens of an expression and the position among them.
struct Reader {
    tokens: Vec<(usize, Token)>,
    next: usize,
}

impl Reader {
    /// Returns the next token; the last one, the end, stays.
    fn peek(&self) -> &(usize, Token) {
        &self.tokens[self.next.min(self.tokens.len() - 1)]
    }
}

impl Language for Reader {
    type Name = String;
    type Function = Function;
    type Fault = Fault;

    const LEVELS_MAX: usize = DEPTH_MAX;
    const COUNTS_OPERANDS: bool = true;
    const HAS_LISTS: bool = true;

    fn start(&mut self) -> Result<(usize, Start<String, Function>), Fault> {
        let (at, token) = self.peek().clone();
        self.next += 1;
        let start = match token {
            Token::Number(value) => Start::Number(value),
            Token::Sign("-") => Start::Negative,
            Token::Sign("+") => Start::Positive,
            Token::Sign("!") => Start::Not,
            Token::Sign("(") => Start::Bracket,
            Token::Name(name) if self.is_next("(") => {
                let open = self.peek().0;
                self.next += 1;
                Start::Call(function(&name, at)?, open)
            }
            Token::Name(name) => Start::Name(name),
            Token::End => return Err(Fault::new(at, "a value is missing at the end", "Complete the expression.")),
            Token::Sign(sign) => {
                let message = format!("a value is missing before \"{sign}\"");
                return Err(Fault::new(at, message, "Complete the expression."));
            }
        };
        Ok((at, start))
    }

    fn operator(&self) -> Option<(usize, Operator)> {
        let (at, Token::Sign(sign)) = self.peek() else { return None };
        Operator::ALL.into_iter().find(|operator| operator.name() == *sign).map(|operator| (*at, operator))
    }

    fn is_next(&self, sign: &str) -> bool {
        matches!(self.peek().1, Token::Sign(next) if next == sign)
    }

    fn take(&mut self, _: &str) {
        self.next += 1;
    }

    fn arguments(function: &Function) -> usize {
        function.arguments()
    }

    fn fault(&self, problem: Problem<Function>) -> Fault {
        let (next, token) = self.peek();
        let (at, message, hint) = match problem {
            Problem::Levels => (
                *next,
                format!("nested deeper than {DEPTH_MAX} levels"),
                "Name parts of the expression in [let].".into(),
            ),
            Problem::Chain(at) => (
                at,
                format!("more than {CHAIN_MAX} operators in a row"),
                "Name parts of the expression in [let].".into(),
            ),
            Problem::Comparisons => {
                let hint = "Join two comparisons by &&: a < b && b < c.".to_owned();
                (*next, "comparisons cannot be chained".to_owned(), hint)
            }
            Problem::Open(open) => {
                let hint = format!("Close the bracket at character {} of the expression.", open + 1);
                (*next, format!("\")\" is missing before {}", token.shown()), hint)
            }
            Problem::Arguments(function, at, found) => {
                let expected = counted(function.arguments(), "argument");
                (at, format!("{} has {expected}, found {found}", function.name()), usage(function))
            }
        };
        Fault { at, message, hint }
    }
}

/// Returns the function with a name that is at a byte.
fn function(name: &str, at: usize) -> Result<Function, Fault> {
    Function::ALL.into_iter().find(|function| function.name() == name).ok_or_else(|| {
        let names = Function::names();
        let hint = match (name, nearest(name, &names)) {
            ("ln", _) => "The natural logarithm is log.".to_owned(),
            (_, Some(near)) => format!("Did you mean \"{near}\"?"),
            _ => format!("The functions are {}.", names.join(", ")),
        };
        Fault::new(at, format!("{} is not a function", quoted(name)), hint)
    })
}

/// Returns the hint on the arguments of a function.
fn usage(function: Function) -> String {
    format!("{}: {}.", function.name(), function.text())
}
