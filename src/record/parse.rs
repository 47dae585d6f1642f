//! Lines into cells, cells into numbers.

use crate::text::excerpt;

/// Splits a line at `separator`; a cell in double quotes may hold it. `""` inside quotes is a quote.
pub(super) fn cells<'a>(line: &'a str, separator: char, into: &mut Vec<&'a str>) {
    into.clear();
    let (mut start, mut quoted) = (0, false);
    for (at, c) in line.char_indices() {
        if c == '"' {
            quoted = !quoted;
        } else if c == separator && !quoted {
            into.push(unquoted(&line[start..at]));
            start = at + c.len_utf8();
        }
    }
    into.push(unquoted(&line[start..]));
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    cell.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).map_or(cell, str::trim)
}

/// A finite number from a cell; with `decimal_comma` both `1,5` and `1.5` are one and a half.
///
/// # Errors
/// What was found and what was expected, in words.
pub fn parse_number(cell: &str, decimal_comma: bool) -> Result<f64, String> {
    let cell = cell.trim();
    if cell.is_empty() {
        return Err("found an empty cell, expected a number".to_owned());
    }
    let swapped;
    let text = if decimal_comma && cell.contains(',') {
        if cell.contains('.') {
            return Err(format!("found \"{}\" with both comma and point, expected a number", excerpt(cell)));
        }
        swapped = cell.replacen(',', ".", 1);
        swapped.as_str()
    } else {
        cell
    };
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) if value.is_nan() => Err(format!("found \"{}\", not a number", excerpt(cell))),
        Ok(_) => Err(format!("found \"{}\", infinite or too large, expected a finite number", excerpt(cell))),
        Err(_) => Err(format!("found \"{}\", expected a number", excerpt(cell))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_hold_separators() {
        let mut row = Vec::new();
        cells("\"0,5\", 2 ,\"\",x", ',', &mut row);
        assert_eq!(row, ["0,5", "2", "", "x"]);
        cells("a;b;", ';', &mut row);
        assert_eq!(row, ["a", "b", ""]);
    }

    #[test]
    fn numbers_and_what_is_none() {
        assert_eq!(parse_number(" 1,5e-3 ", true), Ok(0.0015));
        assert_eq!(parse_number("-2.5", true), Ok(-2.5));
        for (cell, comma) in
            [("", true), ("abc", true), ("1,5", false), ("1.000,5", true), ("NaN", true), ("inf", true)]
        {
            assert!(parse_number(cell, comma).is_err(), "{cell}");
        }
        assert!(parse_number("1e400", false).is_err_and(|e| e.contains("too large")));
    }
}
