//! Tokens of an expression.

use super::fault::Fault;
use motorfit_core::text::quoted;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Number(f64),
    Name(String),
    /// An operator or a bracket.
    Sign(&'static str),
    End,
}

impl Token {
    /// Returns the token as it is named in messages.
    pub fn shown(&self) -> String {
        match self {
            Self::Number(value) => format!("\"{value}\""),
            Self::Name(name) => quoted(name),
            Self::Sign(sign) => format!("\"{sign}\""),
            Self::End => "the end".to_owned(),
        }
    }
}

/// Signs; longer ones precede their beginnings.
const SIGNS: [&str; 15] = ["<=", ">=", "&&", "||", "+", "-", "*", "/", "^", "(", ")", ",", "<", ">", "!"];
/// Signs of other languages, with what to write instead.
const FOREIGN: [(&str, &str); 6] = [
    ("**", "Write ^ for a power."),
    ("==", "Compare with < or <=; two computed numbers are hardly ever equal."),
    ("!=", "Compare with < or <=; two computed numbers are hardly ever equal."),
    ("%", "There is no remainder; sin and cos take angles of any size."),
    ("?", "Write select(condition, a, b)."),
    ("·", "Write * for a product."),
];

/// Splits an expression into tokens, each with the byte at which it begins; the last is [`Token::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<(usize, Token)>, Fault> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        }
        if let Some((sign, hint)) = FOREIGN.iter().find(|(sign, _)| rest.starts_with(sign)) {
            return Err(Fault::new(at, format!("\"{sign}\" is not an operator"), *hint));
        }
        let (token, length) = if c.is_ascii_digit() || (c == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit()))
        {
            number(rest).map_err(|fault| Fault { at: at + fault.at, ..fault })?
        } else if c.is_ascii_alphabetic() || c == '_' {
            let length = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
            (Token::Name(rest[..length].to_owned()), length)
        } else if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
            (Token::Sign(sign), sign.len())
        } else {
            let message = format!("{} has no meaning in an expression", quoted(&c.to_string()));
            return Err(Fault::new(at, message, "Use ASCII letters, digits, + - * / ^ ( ) , < > <= >= && || and !."));
        };
        tokens.push((at, token));
        at += length;
    }
    tokens.push((text.len(), Token::End));
    Ok(tokens)
}

/// Reads the number at the start of a text; returns it and its length.
fn number(text: &str) -> Result<(Token, usize), Fault> {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    if bytes.get(length) == Some(&b'.') {
        length += 1 + digits(length + 1);
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = if length + 1 + sign <= bytes.len() { digits(length + 1 + sign) } else { 0 };
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    let next = text[length..].chars().next();
    if next.is_some_and(|c| c.is_ascii_alphabetic() || c == '_') {
        return Err(Fault::new(length, "a number is followed by a name", "Write * between factors."));
    }
    if next == Some('.') {
        return Err(Fault::new(length, "a number has two points", "Write one decimal point."));
    }
    let value: f64 = text[..length].parse().map_err(|_| Fault::new(0, "this is not a number", "Write 1.5 or 2e-3."))?;
    if !value.is_finite() {
        return Err(Fault::new(0, "the number is too large", "Numbers up to 1e308 can be computed with."));
    }
    Ok((Token::Number(value), length))
}
