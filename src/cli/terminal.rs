//! Width of the terminal, and text wrapped to it. Output that no terminal shows keeps its usual width, so that files and pipes do
//! not depend on a window; `COLUMNS` in the environment sets the width there too.

use std::io::IsTerminal as _;

/// Narrowest width to which output is wrapped \[characters\].
const NARROWEST: usize = 50;

/// An output stream.
#[derive(Clone, Copy)]
pub(crate) enum Stream {
    Stdout,
    Stderr,
}

/// Returns the width to which a stream is wrapped \[characters\]; `None` without a terminal and without `COLUMNS`.
pub(crate) fn width(stream: Stream) -> Option<usize> {
    let columns = std::env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok());
    let size = || match stream {
        Stream::Stdout => {
            std::io::stdout().is_terminal().then(|| terminal_size::terminal_size_of(std::io::stdout()))?
        }
        Stream::Stderr => {
            std::io::stderr().is_terminal().then(|| terminal_size::terminal_size_of(std::io::stderr()))?
        }
    };
    let measured = || size().map(|(columns, _)| usize::from(columns.0));
    columns.or_else(measured).filter(|columns| *columns > 0).map(|columns: usize| columns.max(NARROWEST))
}

/// Returns the width of tables on stdout: `usual`, or that of the terminal if it is narrower.
pub(crate) fn table_width(usual: usize) -> usize {
    width(Stream::Stdout).map_or(usual, |columns| columns.min(usual))
}

/// Wraps the lines of a text at spaces to the width of a stream; see [`wrapped`].
pub(crate) fn fitted(text: &str, stream: Stream) -> String {
    width(stream).map_or_else(|| text.to_owned(), |width| wrapped(text, width))
}

/// Wraps the lines of a text that are longer than `width`, between words. The further lines of one begin below its second
/// column. Words are not broken, nor are quoted words of a command. Lines with a command to copy are not wrapped, because a line
/// break would be copied too; a terminal continues them itself.
pub(crate) fn wrapped(text: &str, width: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in text.split('\n') {
        if length(line) <= width || line.trim_start().starts_with("next ") {
            lines.push(line.to_owned());
        } else {
            lines.extend(broken(line, width));
        }
    }
    lines.join("\n")
}

/// Largest column below which further lines begin.
const HANG_MAX: usize = 16;

/// Breaks one line between words.
fn broken(line: &str, width: usize) -> Vec<String> {
    let indent = line.len() - line.trim_start_matches(' ').len();
    let label = line[indent..].find("  ").map(|at| indent + at);
    let second = label.map(|at| at + line[at..].len() - line[at..].trim_start_matches(' ').len());
    let hang = second.map(|at| length(&line[..at])).filter(|at| *at <= HANG_MAX).unwrap_or(indent + 2);
    // The spaces before the second column stay as they are.
    let head = second.filter(|_| hang <= HANG_MAX && hang != indent + 2).unwrap_or(indent);
    let (mut lines, mut current) = (Vec::new(), line[..head].to_owned());
    let mut is_first = true;
    for word in words(&line[head..]) {
        if !is_first && length(&current) + 1 + length(word) > width {
            lines.push(std::mem::replace(&mut current, " ".repeat(hang)));
            is_first = true;
        }
        if !is_first {
            current.push(' ');
        }
        current.push_str(word);
        is_first = false;
    }
    lines.push(current);
    lines
}

/// Returns the words of a text; spaces inside a word in single quotes, as of a command, do not separate.
fn words(text: &str) -> Vec<&str> {
    let (mut words, mut start, mut is_quoted, mut before) = (Vec::new(), 0, false, ' ');
    for (at, c) in text.char_indices() {
        match c {
            // An apostrophe inside a word is no quotation mark.
            '\'' if is_quoted => is_quoted = false,
            '\'' if matches!(before, ' ' | '=' | '(') => is_quoted = text[at + 1..].contains('\''),
            ' ' if !is_quoted => {
                words.extend(Some(&text[start..at]).filter(|word| !word.is_empty()));
                start = at + 1;
            }
            _ => {}
        }
        before = c;
    }
    words.extend(Some(&text[start..]).filter(|word| !word.is_empty()));
    words
}

/// Returns the number of characters that are shown, without escape sequences of styles.
fn length(text: &str) -> usize {
    let mut is_escape = false;
    let shown = text.chars().filter(|c| {
        let was_escape = is_escape;
        is_escape = *c == '\u{1b}' || (is_escape && *c != 'm');
        !was_escape && !is_escape
    });
    shown.count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_broken_between_words_below_their_second_column() {
        let line = "  fit       current 99.80 % and speed 99.98 %, which is long enough to need a second line";
        let text = wrapped(line, 50);
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.len() > 1 && lines.iter().all(|line| line.chars().count() <= 50), "{text}");
        assert!(lines[1].starts_with("            ") && !lines[1].starts_with("             "), "{text}");
        assert!(text.split_whitespace().eq(line.split_whitespace()), "{text}");
        assert_eq!(wrapped("short\n\n  lines", 50), "short\n\n  lines");
    }

    #[test]
    fn commands_and_styles_stay_whole() {
        let next = format!("  next      motorfit identify {}", "long-name.csv ".repeat(9));
        assert_eq!(wrapped(&next, 50), next);
        let help = "help: Name the columns by --columns 'time=\"my time\":ms,voltage=\"my voltage (V)\":V', or don't, as you like";
        assert!(
            wrapped(help, 50).lines().any(|line| line.contains("'time=\"my time\":ms,voltage=\"my voltage (V)\":V',"))
        );
        assert_eq!(length("\u{1b}[1mbold\u{1b}[0m text"), 9);
        let styled = format!("\u{1b}[33mwarning:\u{1b}[0m {}", "word ".repeat(30));
        assert!(wrapped(&styled, 60).lines().all(|line| length(line) <= 60));
    }
}
