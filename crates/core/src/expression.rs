//! The parser of expressions, shared by the languages of models and of columns: operator precedence (V. R. Pratt, Top Down
//! Operator Precedence, 1973).
//!
//! Precedence, from the loosest: `||`, `&&`, comparison, `+ -`, `* /`, unary `- !`, `^` (right-associative). A [`Language`]
//! reads the tokens, which decides what a name is and which operators there are, and has the messages of its errors.

use crate::named::named;

/// Largest number of operators in a row, together with the depth at which they are.
pub const CHAIN_MAX: usize = 300;
/// Precedence of a unary sign: tighter than a product, looser than a power.
const UNARY: u8 = 6;

named! {
    /// An operator with two operands, named by its sign; longer signs precede their beginnings.
    pub enum Operator: u8 {
        /// One of two conditions holds.
        Or = "||" => 1,
        /// Both conditions hold.
        And = "&&" => 2,
        /// The left side is at most the right side.
        LessEqual = "<=" => 3,
        /// The left side is at least the right side.
        GreaterEqual = ">=" => 3,
        /// The left side is below the right side.
        Less = "<" => 3,
        /// The left side is above the right side.
        Greater = ">" => 3,
        /// Sum.
        Add = "+" => 4,
        /// Difference.
        Subtract = "-" => 4,
        /// Product.
        Multiply = "*" => 5,
        /// Quotient.
        Divide = "/" => 5,
        /// Power.
        Power = "^" => 7,
    }
}

impl Operator {
    /// Returns the precedence, from 1 (loosest).
    #[must_use]
    pub const fn precedence(self) -> u8 {
        self.row()
    }

    /// Returns true for comparisons.
    const fn is_comparison(self) -> bool {
        self.precedence() == 3
    }
}

/// A node of a syntax tree, with the byte at which it begins (for an operator, the byte of the operator).
#[derive(Debug, Clone, PartialEq)]
pub struct Expression<N, F> {
    /// The byte in the text.
    pub at: usize,
    /// The outermost operation.
    pub kind: Kind<N, F>,
}

/// An operation with its operands.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind<N, F> {
    /// A number.
    Number(f64),
    /// A name, as the language resolves it.
    Name(N),
    /// The negative of a value.
    Negative(Box<Expression<N, F>>),
    /// The negation of a condition.
    Not(Box<Expression<N, F>>),
    /// An operator with two operands.
    Binary(Operator, Box<Expression<N, F>>, Box<Expression<N, F>>),
    /// A function with its arguments.
    Call(F, Vec<Expression<N, F>>),
}

impl<N, F> Expression<N, F> {
    /// Calls `see` with each node, parents first and operands from left to right.
    pub fn visit<'a>(&'a self, see: &mut dyn FnMut(&'a Self)) {
        see(self);
        match &self.kind {
            Kind::Number(_) | Kind::Name(_) => {}
            Kind::Negative(inner) | Kind::Not(inner) => inner.visit(see),
            Kind::Binary(_, left, right) => {
                left.visit(see);
                right.visit(see);
            }
            Kind::Call(_, arguments) => arguments.iter().for_each(|argument| argument.visit(see)),
        }
    }

    /// Calls `see` with each name and its position, from left to right.
    pub fn names<'a>(&'a self, see: &mut dyn FnMut(&'a N, usize)) {
        self.visit(&mut |node| {
            if let Kind::Name(name) = &node.kind {
                see(name, node.at);
            }
        });
    }
}

/// The first token of an operand.
pub enum Start<N, F> {
    /// A number.
    Number(f64),
    /// A name.
    Name(N),
    /// A function, and the byte of the bracket after it, which is taken too.
    Call(F, usize),
    /// An opening bracket.
    Bracket,
    /// `-`.
    Negative,
    /// `+`, which changes nothing.
    Positive,
    /// `!`.
    Not,
}

/// A syntax error, for which the language has the message.
pub enum Problem<F> {
    /// More than [`Language::LEVELS_MAX`] levels.
    Levels,
    /// More than [`CHAIN_MAX`] operators in a row, at the byte of the one too many.
    Chain(usize),
    /// A comparison of a comparison.
    Comparisons,
    /// The bracket at this byte is not closed.
    Open(usize),
    /// The function at this byte has another number of arguments than it takes.
    Arguments(F, usize, usize),
}

/// A language of expressions: its tokens and its errors, at a position in a text.
pub trait Language {
    /// The meaning of a name.
    type Name;
    /// A function.
    type Function;
    /// An error.
    type Fault;

    /// Largest number of levels of brackets, signs and powers; the expression itself is the first.
    const LEVELS_MAX: usize;
    /// True if the right operand of any operator is a further level, not only that of a power.
    const COUNTS_OPERANDS: bool;
    /// True if functions have lists of arguments, which may be empty; otherwise each has one argument.
    const HAS_LISTS: bool;

    /// Takes the first token of an operand; also returns its byte.
    ///
    /// # Errors
    /// Returns an error if no operand begins here.
    fn start(&mut self) -> Started<Self>;

    /// Returns the operator that is the next token, and its byte.
    fn operator(&self) -> Option<(usize, Operator)>;

    /// Returns true if a sign is the next token.
    fn is_next(&self, sign: &str) -> bool;

    /// Takes the next token, which is a sign.
    fn take(&mut self, sign: &str);

    /// Returns the number of arguments of a function.
    fn arguments(function: &Self::Function) -> usize;

    /// Returns the error for a problem at the next token.
    fn fault(&self, problem: Problem<Self::Function>) -> Self::Fault;
}

/// The first token of an operand in a language with its byte, or an error.
pub type Started<L> = Result<(usize, Start<<L as Language>::Name, <L as Language>::Function>), <L as Language>::Fault>;

/// The tree of an expression in a language, or its first error.
pub type Parsed<L> = Result<Tree<L>, <L as Language>::Fault>;

/// The tree of an expression in a language.
type Tree<L> = Expression<<L as Language>::Name, <L as Language>::Function>;

/// Parses the expression at the position of a language, up to the first token that does not continue it.
///
/// # Errors
/// Returns the first error.
pub fn parse<L: Language>(language: &mut L) -> Parsed<L> {
    operators(language, 0, 1)
}

/// Parses operators of at least a precedence.
fn operators<L: Language>(language: &mut L, least: u8, level: usize) -> Parsed<L> {
    if level > L::LEVELS_MAX {
        return Err(language.fault(Problem::Levels));
    }
    let mut left = operand(language, level)?;
    // A chain of operators makes the tree as deep as it is long; later stages walk the tree by recursion.
    let mut chain = level;
    while let Some((at, operator)) = language.operator()
        && operator.precedence() >= least
    {
        language.take(operator.name());
        chain += 1;
        if chain > CHAIN_MAX {
            return Err(language.fault(Problem::Chain(at)));
        }
        // A power is right-associative.
        let is_power = operator == Operator::Power;
        let least = operator.precedence() + u8::from(!is_power);
        let right = operators(language, least, level + usize::from(is_power || L::COUNTS_OPERANDS))?;
        if operator.is_comparison() && language.operator().is_some_and(|(_, next)| next.is_comparison()) {
            return Err(language.fault(Problem::Comparisons));
        }
        left = Expression { at, kind: Kind::Binary(operator, Box::new(left), Box::new(right)) };
    }
    Ok(left)
}

fn operand<L: Language>(language: &mut L, level: usize) -> Parsed<L> {
    let (at, start) = language.start()?;
    let kind = match start {
        Start::Number(value) => Kind::Number(value),
        Start::Name(name) => Kind::Name(name),
        Start::Negative => Kind::Negative(Box::new(operators(language, UNARY, level + 1)?)),
        Start::Positive => return operators(language, UNARY, level + 1),
        Start::Not => Kind::Not(Box::new(operators(language, UNARY, level + 1)?)),
        Start::Bracket => {
            let inner = operators(language, 0, level + 1)?;
            close(language, at)?;
            return Ok(inner);
        }
        Start::Call(function, open) => {
            let arguments = arguments(language, level + 1)?;
            close(language, open)?;
            if arguments.len() != L::arguments(&function) {
                return Err(language.fault(Problem::Arguments(function, at, arguments.len())));
            }
            Kind::Call(function, arguments)
        }
    };
    Ok(Expression { at, kind })
}

/// Parses the arguments of a function.
fn arguments<L: Language>(language: &mut L, level: usize) -> Result<Vec<Tree<L>>, L::Fault> {
    if L::HAS_LISTS && language.is_next(")") {
        return Ok(Vec::new());
    }
    let mut arguments = vec![operators(language, 0, level)?];
    while L::HAS_LISTS && language.is_next(",") {
        language.take(",");
        arguments.push(operators(language, 0, level)?);
    }
    Ok(arguments)
}

/// Takes the bracket that closes the one at `open`.
fn close<L: Language>(language: &mut L, open: usize) -> Result<(), L::Fault> {
    if !language.is_next(")") {
        return Err(language.fault(Problem::Open(open)));
    }
    language.take(")");
    Ok(())
}
